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
mod sweep;

use rayon::prelude::*;

#[cfg(test)]
pub use furnace::Furnace;
pub use quadrature::GaussRule;

use self::angles::AngleSampler;
pub use self::grid::FieldSize;
use self::grid::{FieldGrid, solve_tridiagonal};
use self::photons::{COUNTED_ORDERS, Tally, Tracer};
use self::rescatter::{Rescatter, Shape};
use self::sweep::{Emission, Flights};
use super::mapping::{Geometry, ViewSunMap, azimuth_angle, node};
use super::report::{RadiusReport, ScatteringReport};
use super::single::{effective_sun_path, opacity, source_from_within};
use super::{CHANNELS, ScatteringOptions};
use crate::medium::Phase;
use crate::tables::Progress;

/// Photon batches of one optical radius: their sums are added in a fixed order, so the result does
/// not depend on the number of threads.
const BATCHES: u64 = 4;
/// The grid of scattered light. Finer does not change the table by more than its noise.
pub const FIELD: FieldSize = FieldSize { radius: 20, zenith: 33, view_sun: 44, azimuth: 11 };
/// Deterministic flights and scatterings after the photons.
pub const SWEEPS: usize = 4;
const SPLIT: f64 = 1.0;
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
    bake_with(phase, albedo, options, FIELD, 0, SWEEPS, progress)
}

/// [`bake`] with another grid inside, and other random numbers for each `series`.
pub fn bake_with(
    phase: &Phase,
    albedo: f64,
    options: &ScatteringOptions,
    field: FieldSize,
    series: u64,
    sweeps: usize,
    progress: &dyn Progress,
) -> (Vec<f64>, ScatteringReport) {
    let [radii, _, _, views] = options.resolution;
    let map = ViewSunMap::for_phase(phase);
    progress.start(radii as u64 * BATCHES + 1, &format!("scattering of {phase}"));
    let prepared = phase.prepare();
    let once = |angle: f64| prepared.eval(angle.cos());
    let twice = TwiceScattered::new(phase, &map);
    let spread = |angle: f64| twice.eval(&map, angle) + FLAT_SHARE / (4.0 * std::f64::consts::PI);
    let grid = FieldGrid::new(field, map, 1.0);
    let lobe = |shape: &(dyn Fn(f64) -> f64 + Sync)| Lobe {
        nodes: (0..field.view_sun).map(|k| shape(grid.view_sun_at(k))).collect(),
        measures: grid.direction_measures(shape),
        within: Rescatter::new(
            phase,
            &map,
            field.view_sun,
            field.view_sun,
            field.azimuth,
            &Shape(shape),
        ),
        out: Rescatter::new(phase, &map, views, field.view_sun, field.azimuth, &Shape(shape)),
    };
    let solver = Solver {
        albedo,
        options,
        map,
        angles: AngleSampler::new(phase),
        single: lobe(&once),
        multiple: lobe(&spread),
        solid_angles: grid.direction_measures(|_| 1.0),
        mean_cosine: phase.mean_cosine(),
        rays: gather::rule(),
        field,
        series,
        sweeps,
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
    single: Lobe,
    multiple: Lobe,
    solid_angles: Vec<f64>,
    mean_cosine: f64,
    sweeps: usize,
    rays: GaussRule,
    field: FieldSize,
    series: u64,
    furnace: furnace::Furnace,
    progress: &'a dyn Progress,
}

impl Solver<'_> {
    /// The table's values for one optical radius.
    fn slice(&self, index: usize) -> (Vec<f64>, RadiusReport) {
        let [_, incidences, azimuths, views] = self.options.resolution;
        let optical_radius = self.options.optical_radius_at(index);
        let grid = FieldGrid::new(self.field, self.map, optical_radius);
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
            levels: dark_levels(optical_radius * (1.0 - self.mean_cosine)),
        };
        let events = self.options.events.div_ceil(BATCHES);
        let batches: Vec<Tally> = (0..BATCHES)
            .into_par_iter()
            .map(|batch| {
                let tally =
                    tracer.trace(events, (self.series << 32) + index as u64 * BATCHES + batch);
                self.progress.advance(1);
                tally
            })
            .collect();
        let mut sum = Tally {
            photons: 0,
            fields: [vec![0.0; self.field.len()], vec![0.0; self.field.len()]],
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

    /// Light of orders from 2 on that is scattered towards the table's view directions.
    fn emission(&self, grid: &FieldGrid, tally: &Tally, optical_radius: f64) -> Emission {
        let flights = Flights::new(grid, optical_radius, &self.solid_angles);
        let sunlit = self.sunlit(grid, &flights, optical_radius);
        let twice = self.scatter(&self.single.within, &sunlit);
        let mut values = self.photon_emission(grid, tally, optical_radius);
        for _ in 0..self.sweeps {
            let emission = Emission::new(grid, &values, self.field.view_sun);
            let arriving = self.weights(flights.arriving(grid, &emission));
            values = self.scatter(&self.multiple.within, &arriving);
            values.iter_mut().zip(&twice).for_each(|(v, t)| *v += t);
        }
        let emission = Emission::new(grid, &values, self.field.view_sun);
        let arriving = self.weights(flights.arriving(grid, &emission));
        let mut values = self.scatter(&self.multiple.out, &arriving);
        let twice = self.scatter(&self.single.out, &sunlit);
        values.iter_mut().zip(&twice).for_each(|(v, t)| *v += t);
        Emission::new(grid, &values, self.options.resolution[3])
    }

    /// What the light of these weights scatters.
    fn scatter(&self, rescatter: &Rescatter, weights: &[f32]) -> Vec<f32> {
        let outputs = rescatter.outputs();
        let mut values = vec![0.0; weights.len() / self.field.directions() * outputs];
        values
            .par_chunks_exact_mut(outputs)
            .zip(weights.par_chunks_exact(self.field.directions()))
            .for_each(|(out, weights)| {
                let weights: Vec<f64> = weights.iter().map(|&w| f64::from(w)).collect();
                let mut sums = vec![0.0; outputs];
                rescatter.add(&weights, &mut sums);
                for (o, s) in out.iter_mut().zip(sums) {
                    *o = (self.albedo * s) as f32;
                }
            });
        values
    }

    /// Light scattered once, at each place from each direction, as weights of the cells.
    fn sunlit(&self, grid: &FieldGrid, flights: &Flights, optical_radius: f64) -> Vec<f32> {
        let size = self.field;
        let step = std::f64::consts::PI / (size.azimuth - 1) as f64;
        (0..size.radius * size.zenith)
            .into_par_iter()
            .flat_map_iter(|place| {
                let radius = grid.radius_at((place / size.zenith) as f64);
                let zenith = grid.zenith_at((place % size.zenith) as f64);
                (0..size.directions()).map(move |direction| {
                    let view_sun = grid.view_sun_at(direction / size.azimuth);
                    let azimuth = step * (direction % size.azimuth) as f64;
                    let source =
                        source_from_within(radius, zenith, view_sun, azimuth, optical_radius);
                    let opaque = flights.opacity(grid, place, direction);
                    (self.albedo * source * opaque * self.single.measures[direction]) as f32
                })
            })
            .collect()
    }

    /// Light that arrives, as weights of the cells.
    fn weights(&self, mut light: Vec<f32>) -> Vec<f32> {
        let factors: Vec<f32> = (0..self.field.directions())
            .map(|d| {
                (self.multiple.measures[d] / self.multiple.nodes[d / self.field.azimuth]) as f32
            })
            .collect();
        for place in light.chunks_exact_mut(factors.len()) {
            place.iter_mut().zip(&factors).for_each(|(l, f)| *l *= f);
        }
        light
    }

    /// Light of orders from 2 on as the photons have it: unbiased, but noisy.
    fn photon_emission(&self, grid: &FieldGrid, tally: &Tally, optical_radius: f64) -> Vec<f32> {
        let size = self.field;
        let zeniths = grid.zenith_measures();
        // Each photon carries its share of the sunlight on the unit disc.
        let scale = std::f64::consts::PI / (tally.photons as f64 * optical_radius);
        let mut values: Vec<f64> = [&self.single, &self.multiple]
            .into_iter()
            .zip(&tally.fields)
            .map(|(lobe, field)| self.scatter(&lobe.within, field))
            .reduce(|mut sum, more| {
                sum.iter_mut().zip(more).for_each(|(s, m)| *s += m);
                sum
            })
            .unwrap_or_default()
            .into_iter()
            .map(f64::from)
            .collect();
        let outputs = self.single.within.outputs();
        for (place, values) in values.chunks_exact_mut(outputs).enumerate() {
            let factor = scale / zeniths[place % size.zenith];
            values.iter_mut().for_each(|v| *v *= factor);
        }
        let (diagonal, beside) = grid.radius_mass();
        solve_tridiagonal(&diagonal, &beside, &mut values, size.zenith * outputs);
        values.into_iter().map(|v| v as f32).collect()
    }
}

/// Doublings of the photons towards the dark side. The light that diffuses through falls as the
/// inverse of the optical radius scaled by 1 - g.
fn dark_levels(scaled_radius: f64) -> u32 {
    let fall = 1.0 + SPLIT * scaled_radius;
    fall.log2().round().clamp(0.0, 7.0) as u32
}

/// An angular shape of light within the cells of the direction grid, and what it scatters.
struct Lobe {
    /// The shape at the view-sun nodes.
    nodes: Vec<f64>,
    /// Integrals of the shape over the cells, by direction.
    measures: Vec<f64>,
    /// Scattering towards the grid's directions.
    within: Rescatter,
    /// Scattering towards the table's view directions.
    out: Rescatter,
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
