//! Solver: photons fill a grid of scattered light, quadratures turn it into the table.
//!
//! 1. Photons from the sun scatter through the sphere until they are out, however often that is;
//!    every scattering is recorded on a grid over position and direction ([`photons`]). One field
//!    serves all rays through the sphere, so each of them averages over millions of scatterings.
//! 2. One more scattering, towards the table's view directions, is a matrix ([`rescatter`]).
//! 3. The last flight along the view ray is a quadrature ([`gather`]).
//! 4. With albedo 1 the light that a ray sends backwards all comes out: the multiple scattering of
//!    each chord is scaled so that this holds exactly ([`furnace`]); the report says how little
//!    that changes.

mod angles;
mod furnace;
mod gather;
mod grid;
mod photons;
mod quadrature;
mod random;
mod rescatter;

use rayon::prelude::*;

#[cfg(test)]
pub use furnace::Furnace;
pub use quadrature::GaussRule;

use self::angles::AngleSampler;
use self::gather::Emission;
use self::grid::{FieldGrid, FieldSize, solve_tridiagonal};
use self::photons::{COUNTED_ORDERS, Tally, Tracer};
use self::rescatter::{Rescatter, Shape};
use super::mapping::{Geometry, ViewSunMap, azimuth_angle, node};
use super::report::{RadiusReport, ScatteringReport};
use super::single::{effective_sun_path, opacity};
use super::{CHANNELS, ScatteringOptions};
use crate::medium::Phase;
use crate::tables::Progress;

/// Photon batches of one optical radius: their sums are added in a fixed order, so the result does
/// not depend on the number of threads.
const BATCHES: u64 = 4;
/// The grid of scattered light. Finer does not change the table by more than its noise.
const FIELD: FieldSize = FieldSize { radius: 24, zenith: 37, view_sun: 48, azimuth: 13 };
/// Least share of isotropic light in the shape that multiply scattered light has within a cell.
const FLAT_SHARE: f64 = 0.05;
/// Source below which its logarithm is cut: far below anything f16 could show.
const LEAST_SOURCE: f64 = 1e-12;

/// The values of a table in its layout, as f64, and the report.
pub fn bake(
    phase: &Phase,
    albedo: f64,
    options: &ScatteringOptions,
    progress: &dyn Progress,
) -> (Vec<f64>, ScatteringReport) {
    let [radii, _, _, views] = options.resolution;
    let map = ViewSunMap::for_phase(phase);
    progress.start(radii as u64 * BATCHES + 1, &format!("scattering of {phase}"));
    let prepared = phase.prepare();
    let once = |angle: f64| prepared.eval(angle.cos());
    let twice = TwiceScattered::new(phase, &map);
    let spread = |angle: f64| twice.eval(&map, angle) + FLAT_SHARE / (4.0 * std::f64::consts::PI);
    let rescatter = |shape: &(dyn Fn(f64) -> f64 + Sync)| {
        Rescatter::new(phase, &map, views, FIELD.view_sun, FIELD.azimuth, &Shape(shape))
    };
    let solver = Solver {
        albedo,
        options,
        map,
        angles: AngleSampler::new(phase),
        rescatter: [rescatter(&once), rescatter(&spread)],
        rays: gather::rule(),
        furnace: furnace::Furnace::new(phase, &map, options.resolution),
        progress,
    };
    progress.advance(1);
    let slices: Vec<(Vec<f64>, RadiusReport)> =
        (0..radii).into_par_iter().map(|k| solver.slice(k)).collect();
    let mut values = Vec::with_capacity(options.entries() * CHANNELS);
    let mut report = ScatteringReport::default();
    for (slice, of_radius) in slices {
        values.extend(slice);
        report.radii.push(of_radius);
    }
    (values, report)
}

struct Solver<'a> {
    albedo: f64,
    options: &'a ScatteringOptions,
    map: ViewSunMap,
    angles: AngleSampler,
    rescatter: [Rescatter; 2],
    rays: GaussRule,
    furnace: furnace::Furnace,
    progress: &'a dyn Progress,
}

impl Solver<'_> {
    /// The table's values for one optical radius.
    fn slice(&self, index: usize) -> (Vec<f64>, RadiusReport) {
        let [_, incidences, azimuths, views] = self.options.resolution;
        let optical_radius = self.options.optical_radius_at(index);
        let grid = FieldGrid::new(FIELD, self.map, optical_radius);
        let tally = self.photons(&grid, index, optical_radius);
        let emission = self.emission(&grid, &tally, optical_radius);
        let mut values = Vec::with_capacity(incidences * azimuths * views * CHANNELS);
        let mut scales = Vec::new();
        for i in 0..incidences {
            let mut rows = Vec::with_capacity(azimuths * views * CHANNELS);
            for j in 0..azimuths {
                for k in 0..views {
                    let geometry = Geometry {
                        incidence: node(i, incidences),
                        azimuth: azimuth_angle(node(j, azimuths)),
                        view_sun: self.map.angle(node(k, views)),
                    };
                    let path = effective_sun_path(&geometry, optical_radius);
                    let multiple =
                        gather::gather(&emission, &grid, &self.rays, &geometry, k, optical_radius);
                    rows.push(path);
                    rows.push((multiple.max(LEAST_SOURCE) / opacity(optical_radius)).ln());
                }
            }
            if self.albedo == 1.0 {
                let scale = self.furnace.scale(&rows, optical_radius);
                rows.iter_mut().skip(1).step_by(CHANNELS).for_each(|v| *v += scale.ln());
                scales.push(scale);
            }
            values.extend(rows);
        }
        (values, RadiusReport::new(optical_radius, &tally.by_order, tally.photons, &scales))
    }

    fn photons(&self, grid: &FieldGrid, index: usize, optical_radius: f64) -> Tally {
        let tracer = Tracer {
            grid,
            angles: &self.angles,
            optical_radius: optical_radius as f32,
            albedo: self.albedo as f32,
        };
        let events = self.options.events.div_ceil(BATCHES);
        let batches: Vec<Tally> = (0..BATCHES)
            .into_par_iter()
            .map(|batch| {
                let tally = tracer.trace(events, index as u64 * BATCHES + batch);
                self.progress.advance(1);
                tally
            })
            .collect();
        let mut sum = Tally {
            photons: 0,
            fields: [vec![0.0; FIELD.len()], vec![0.0; FIELD.len()]],
            by_order: vec![0.0; COUNTED_ORDERS + 1],
        };
        for batch in batches {
            sum.photons += batch.photons;
            for (to, from) in sum.by_order.iter_mut().zip(&batch.by_order) {
                *to += from;
            }
            for (to, from) in sum.fields.iter_mut().zip(&batch.fields) {
                to.iter_mut().zip(from).for_each(|(t, f)| *t += f);
            }
        }
        sum
    }

    /// Scatters the recorded light towards the view directions.
    fn emission(&self, grid: &FieldGrid, tally: &Tally, optical_radius: f64) -> Emission {
        let views = self.options.resolution[3];
        let stride = views * FIELD.azimuth;
        let zeniths = grid.zenith_measures();
        // Each photon carries its share of the sunlight on the unit disc.
        let scale = self.albedo * std::f64::consts::PI / (tally.photons as f64 * optical_radius);
        let mut values: Vec<f64> = (0..FIELD.radius * FIELD.zenith)
            .into_par_iter()
            .flat_map_iter(|place| {
                let mut out = vec![0.0; stride];
                for (field, rescatter) in tally.fields.iter().zip(&self.rescatter) {
                    let cells = &field[place * FIELD.directions()..][..FIELD.directions()];
                    let weights: Vec<f64> = cells.iter().map(|&w| f64::from(w)).collect();
                    rescatter.add(&weights, &mut out);
                }
                let factor = scale / zeniths[place % FIELD.zenith];
                out.into_iter().map(move |v| v * factor)
            })
            .collect();
        let (diagonal, beside) = grid.radius_mass();
        solve_tridiagonal(&diagonal, &beside, &mut values, FIELD.zenith * stride);
        Emission { values, views }
    }
}

/// The phase function convolved with itself: the angular shape of light scattered twice.
struct TwiceScattered {
    values: Vec<f64>,
}

impl TwiceScattered {
    /// Nodes of the tabulation and terms of the Legendre series; beyond the last term the square
    /// of a moment is below 1e-6 for the narrowest Mie lobe.
    const NODES: usize = 512;
    const TERMS: usize = 2000;

    fn new(phase: &Phase, map: &ViewSunMap) -> Self {
        let moments = phase.legendre_moments(Self::TERMS);
        let values = (0..Self::NODES)
            .into_par_iter()
            .map(|i| {
                let c = map.angle(node(i, Self::NODES)).cos();
                let (mut before, mut p) = (0.0, 1.0);
                let mut sum = 0.0;
                for (l, moment) in moments.iter().enumerate() {
                    let order = l as f64;
                    sum += (2.0 * order + 1.0) * moment * moment * p;
                    (before, p) =
                        (p, ((2.0 * order + 1.0) * c * p - order * before) / (order + 1.0));
                }
                (sum / (4.0 * std::f64::consts::PI)).max(0.0)
            })
            .collect();
        Self { values }
    }

    fn eval(&self, map: &ViewSunMap, angle: f64) -> f64 {
        let at = map.coordinate((0.5 * angle).sin()) * (Self::NODES - 1) as f64;
        let i = (at as usize).min(Self::NODES - 2);
        let u = at - i as f64;
        (1.0 - u) * self.values[i] + u * self.values[i + 1]
    }
}
