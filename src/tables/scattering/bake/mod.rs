//! Solver: discrete directions on a grid over the sphere, successive orders, accelerated.
//!
//! 1. Light scattered once is a quadrature at every node of a grid over position and direction
//!    ([`grid`], [`super::single`]).
//! 2. A step scatters the light at every place ([`rescatter`]: the phase function integrated over
//!    the cells of the direction grid, so that no lobe is smeared or cut) and carries it along
//!    straight flights to every other ([`sweep`]). Orders 2 and 3 are divided by the known shape of
//!    their lobes first.
//! 3. The fixed point of these steps is all orders. Plain steps are the orders themselves; mixing
//!    the last few ([`fixed_point`]), steered by [`diffusion`], reaches the limit of thousands of
//!    orders in 3 to 21 steps.
//! 4. One more scattering, towards the table's view directions, and the last flight along the view
//!    ray by quadrature ([`gather`]).
//! 5. The logarithms at the nodes are moved so that linear reading is right in the mean
//!    ([`middle`]), and with albedo 1 each chord's multiple scattering is scaled so that the light
//!    that a ray sends backwards all comes out ([`furnace`]).
//!
//! Which part an error comes from, by the survey of `accuracy_tests`; rays with impact parameters to
//! 0.95:
//! - the solver itself is 0.1 to 0.3 % from its own limit (grids of half the steps), and raw energy
//!   is within 0.3 % up to optical radius 4, 1 % at 64 (HG 0.85);
//! - what dominated was the table's grid: 37 % of the rays were off by more than 1 % at optical
//!   radius 3 to 6 with even steps in the radius' logarithm, none with even steps in
//!   ln(1 + R); 10 % with 32 view-sun nodes (Mie), 0.1 % with 40; 16 % at 64 without the
//!   factor of [`super::terminator`], 5 % with it;
//! - moving nodes between the chords takes the root mean square to 60 % of what it was.
//!
//! Tried before, and worse: photons recorded on the same grid in place of the steps, with one
//! flight after (16 s per table, errors of 1.5 % at optical radius 1 and 10 to 30 % on the dark
//! side at 64; splitting photons towards the dark side only made its noise large-scaled); photons
//! as the start of four steps (0.1 % at 1, but 5 % at 64). Gauss's rule in the share of light along
//! flights (0.6 % too much light at optical radius 4 to 16). The grid's error in a place's escape put
//! on the directions near the horizon in place of all (raw energy of grazing chords off by 4 % in
//! place of 0.8 %).

pub mod critical;
mod diffusion;
mod fixed_point;
mod furnace;
mod gather;
mod grid;
mod middle;
mod quadrature;
mod rescatter;
mod sweep;

use std::f64::consts::PI;

use rayon::prelude::*;

pub use fixed_point::Convergence;
#[cfg(test)]
pub use furnace::{Furnace, Place};
pub use quadrature::GaussRule;

use self::diffusion::Diffusion;
use self::grid::{FieldGrid, FieldSize};
use self::rescatter::{Rescatter, Shape};
use self::sweep::{Emission, Flights};
use super::ScatteringOptions;
use super::mapping::{Geometry, ViewSunMap, azimuth_angle, incidence_cosine, node};
use super::march::ChordMarch;
use super::report::{RadiusReport, ScatteringReport};
use super::single::{opacity, source_from_within};
use super::terminator::Terminator;
use crate::medium::Phase;
use crate::tables::Progress;

/// Bound on the steps; they are told in the report.
const MOST_STEPS: usize = 150;
/// Places darker than this share of the brightest count as if they had it. In the thickest
/// spheres the dark side has about that share.
const DARKEST: f32 = 1e-3;
/// Source below which its logarithm is cut: far below anything f16 could show.
const LEAST_SOURCE: f64 = 1e-12;

/// Chords with a lesser cosine of incidence are not in the report: it is that of the impact
/// parameter 0.95.
const GRAZING: f64 = 0.3122;

/// The values of a table in its layout, as f64, and the report.
///
/// Optical radii follow each other, and each is computed by all threads: in thick spheres the grid
/// takes 300 MB.
pub fn bake(
    phase: &Phase,
    albedo: f64,
    options: &ScatteringOptions,
    progress: &dyn Progress,
) -> (Vec<f64>, ScatteringReport) {
    let radii = options.resolution[0];
    progress.start(radii as u64 + 1, &format!("scattering of {phase}"));
    let map = ViewSunMap::for_phase(phase);
    let views = options.resolution[3];
    let views = (0..views).map(|k| map.angle(node(k, views))).collect();
    let solver = Solver::new(phase, albedo, views, options.remainder);
    let furnace = furnace::Furnace::new(phase, &map, options.resolution);
    progress.advance(1);
    let mut values = Vec::with_capacity(options.entries());
    let mut report = ScatteringReport::default();
    for k in 0..radii {
        let (slice, of_radius) = solver.slice(options, &furnace, k);
        values.extend(slice);
        report.radii.push(of_radius);
        progress.advance(1);
    }
    // Along the optical radius all chords bend alike, so the balance of each radius is off as they are:
    // its greatest error counts.
    middle::between_chords(&mut values, options.resolution, &[0], middle::LEAST_GREATEST);
    middle::join_azimuths(&mut values, options.resolution);
    (values, report)
}

/// Sources of orders from 2 on for single rays, straight from the solver: what a table of infinite
/// resolution would hold, before it is balanced.
pub fn sources(
    phase: &Phase,
    albedo: f64,
    rays: &[Geometry],
    optical_radius: f64,
    remainder: f64,
) -> (Vec<f64>, Convergence) {
    let views = rays.iter().map(|ray| ray.view_sun).collect();
    let solver = Solver::new(phase, albedo, views, remainder);
    let size = FieldSize::for_radius(optical_radius, solver.terminator.transport);
    let grid = FieldGrid::new(size, solver.map, optical_radius);
    let (emission, convergence) = solver.emission(&grid, optical_radius);
    let gather = |(k, ray)| gather::gather(&emission, &grid, &solver.rays, ray, k, optical_radius);
    (rays.iter().enumerate().map(gather).collect(), convergence)
}

/// What all optical radii share.
struct Solver {
    albedo: f64,
    mean_cosine: f64,
    /// Angles from the sun of the directions that are asked for.
    views: Vec<f64>,
    remainder: f64,
    map: ViewSunMap,
    terminator: Terminator,
    directions: usize,
    /// Scattering of light scattered once, divided by the phase function.
    once: Stage,
    /// Scattering of light scattered twice, divided by the phase function convolved with itself.
    twice: Stage,
    /// Scattering of any light.
    further: Stage,
    /// The shape of light scattered twice at the grid's angles.
    twice_shape: Vec<f64>,
    solid_angles: Vec<f64>,
    rays: Vec<(f64, f64)>,
}

/// What light of one angular shape scatters.
struct Stage {
    /// Towards the grid's directions.
    within: Rescatter,
    /// Towards the table's view directions.
    out: Rescatter,
}

impl Solver {
    fn new(phase: &Phase, albedo: f64, views: Vec<f64>, remainder: f64) -> Self {
        let map = ViewSunMap::for_phase(phase);
        let prepared = phase.prepare();
        let once = |angle: f64| prepared.eval(angle.cos());
        let convolved = TwiceScattered::new(phase, &map);
        let twice = |angle: f64| convolved.eval(&map, angle);
        // All optical radii have the same directions.
        let field = FieldSize::for_radius(1.0, 1.0);
        let grid = FieldGrid::new(field, map, 1.0);
        let own: Vec<f64> = (0..field.view_sun).map(|k| grid.view_sun_at(k)).collect();
        let stage = |shape: Shape<'_>| {
            let matrix = |views: &[f64]| {
                Rescatter::new(phase, &map, views, [field.view_sun, field.azimuth], shape)
            };
            Stage { within: matrix(&own), out: matrix(&views) }
        };
        let (once_stage, twice_stage, mut further) = (stage(&once), stage(&twice), stage(&|_| 1.0));
        further.within.conserve(&grid.ring_measures());
        Self {
            albedo,
            mean_cosine: phase.mean_cosine(),
            views,
            remainder,
            map,
            terminator: Terminator::for_phase(phase),
            directions: field.directions(),
            once: once_stage,
            twice: twice_stage,
            further,
            twice_shape: (0..field.view_sun).map(|k| twice(grid.view_sun_at(k))).collect(),
            solid_angles: grid.solid_angles(),
            rays: gather::rule(),
        }
    }

    /// The table's values for one optical radius.
    fn slice(
        &self,
        options: &ScatteringOptions,
        furnace: &furnace::Furnace,
        index: usize,
    ) -> (Vec<f64>, RadiusReport) {
        let [_, incidences, azimuths, views] = options.resolution;
        let optical_radius = options.optical_radius_at(index);
        let size = FieldSize::for_radius(optical_radius, self.terminator.transport);
        let grid = FieldGrid::new(size, self.map, optical_radius);
        let (emission, convergence) = self.emission(&grid, optical_radius);
        let geometry = |i: usize, azimuth: f64, view_sun: f64| Geometry {
            incidence: incidence_cosine(node(i, incidences)),
            azimuth,
            view_sun,
        };
        let mut values: Vec<f64> = (0..incidences * azimuths)
            .into_par_iter()
            .flat_map_iter(|row| {
                let (i, azimuth) = (row / azimuths, azimuth_angle(node(row % azimuths, azimuths)));
                let (emission, grid) = (&emission, &grid);
                (0..views).map(move |k| {
                    let ray = geometry(i, azimuth, self.views[k]);
                    let source =
                        gather::gather(emission, grid, &self.rays, &ray, k, optical_radius);
                    let known = opacity(optical_radius)
                        * self.terminator.factor(ray.elevation(), optical_radius);
                    (source.max(LEAST_SOURCE) / known).ln()
                })
            })
            .collect();
        let slice = [1, incidences, azimuths, views];
        middle::between_chords(&mut values, slice, &[2, 3], middle::LEAST_SQUARES);
        let mut scales = Vec::new();
        if self.albedo == 1.0 {
            for (i, rows) in values.chunks_exact_mut(azimuths * views).enumerate() {
                let incidence = incidence_cosine(node(i, incidences));
                let chord = ChordMarch::new(incidence, optical_radius);
                let across = (1.0 - incidence * incidence).max(0.0).sqrt();
                let [once, multiple] = furnace.integrals(|a, v| {
                    let at = |j: usize, k: usize| rows[j * views + k];
                    let line =
                        |j: usize| at(j, v.index) + v.share * (at(j, v.index + 1) - at(j, v.index));
                    let (low, high) = (line(a.index), line(a.index + 1));
                    let elevation = across * v.sine * a.cosine - incidence * v.cosine;
                    let known =
                        opacity(optical_radius) * self.terminator.factor(elevation, optical_radius);
                    [
                        chord.source(elevation, v.cosine),
                        known * (low + a.share * (high - low)).exp(),
                    ]
                });
                let scale = (1.0 - once).max(0.0) / multiple;
                rows.iter_mut().for_each(|v| *v += scale.ln());
                if incidence >= GRAZING {
                    scales.push(scale);
                }
            }
        }
        middle::between_chords(&mut values, slice, &[1], middle::LEAST_SQUARES);
        (values, RadiusReport::new(optical_radius, &convergence, &scales))
    }

    /// Light of orders from 2 on that is scattered towards the table's view directions.
    fn emission(&self, grid: &FieldGrid, optical_radius: f64) -> (Emission, Convergence) {
        let flights = Flights::new(grid, optical_radius, &self.solid_angles);
        let arriving = |values: &[f32]| {
            flights.arriving(grid, &Emission::new(grid, values, grid.size.view_sun))
        };
        // Orders 2 and 3 by themselves: their lobes are the narrowest, and their shapes are known.
        let once = self.once_scattered(grid, &flights, optical_radius);
        let twice = self.by_shape(grid, arriving(&self.scatter(&self.once.within, &once)));
        let third = self.scatter(&self.twice.within, &twice);
        let diffusion =
            Diffusion::new(grid, optical_radius, self.albedo, self.mean_cosine, &self.solid_angles);
        let step = |values: &[f32]| {
            let mut next = self.scatter(&self.further.within, &arriving(values));
            sum(&mut next, &third);
            let excess: Vec<f32> = next.iter().zip(values).map(|(n, v)| n - v).collect();
            diffusion.add(&excess, &mut next);
            next
        };
        // Every place counts by its own brightness, the dark side as much as the bright one.
        let outputs = self.further.within.outputs();
        let weights = |values: &[f32]| {
            let means: Vec<f32> = values
                .par_chunks_exact(outputs)
                .map(|v| (v.iter().sum::<f32>() / outputs as f32).abs())
                .collect();
            let brightest = means.iter().copied().fold(0.0, f32::max);
            // Without any light, as at albedo 0, there is nothing to weigh; its inverse is finite.
            let least = (DARKEST * brightest).max(f32::MIN_POSITIVE);
            means.into_iter().map(|mean| 1.0 / mean.max(least)).collect()
        };
        let (values, convergence) =
            fixed_point::iterate(third.clone(), step, weights, self.remainder, MOST_STEPS);
        let mut out = self.scatter(&self.further.out, &arriving(&values));
        sum(&mut out, &self.scatter(&self.once.out, &once));
        sum(&mut out, &self.scatter(&self.twice.out, &twice));
        (Emission::new(grid, &out, self.views.len()), convergence)
    }

    /// What this light scatters, place by place.
    fn scatter(&self, rescatter: &Rescatter, light: &[f32]) -> Vec<f32> {
        let outputs = rescatter.outputs();
        let directions = self.directions;
        let mut values = vec![0.0; light.len() / directions * outputs];
        values
            .par_chunks_exact_mut(outputs)
            .zip(light.par_chunks_exact(directions))
            .for_each(|(out, light)| rescatter.add(light, out, self.albedo));
        values
    }

    /// Light scattered once that arrives at each place from each direction, divided by the phase
    /// function.
    fn once_scattered(&self, grid: &FieldGrid, flights: &Flights, optical_radius: f64) -> Vec<f32> {
        let size = grid.size;
        let step = PI / (size.azimuth - 1) as f64;
        let azimuths: Vec<f64> = (0..size.azimuth).map(|k| (step * k as f64).cos()).collect();
        let angles = (0..size.view_sun).map(|k| grid.view_sun_at(k));
        let angles: Vec<_> = angles.map(|a| (a.sin(), a.cos())).collect();
        let (azimuths, angles) = (&azimuths, &angles);
        (0..size.radius * size.zenith)
            .into_par_iter()
            .flat_map_iter(|place| {
                let radius = grid.radius_at((place / size.zenith) as f64);
                let zenith = grid.zenith_at((place % size.zenith) as f64);
                let zenith = (zenith.sin(), zenith.cos());
                (0..size.directions()).map(move |direction| {
                    let view_sun = angles[direction / size.azimuth];
                    let azimuth = azimuths[direction % size.azimuth];
                    let source =
                        source_from_within(radius, zenith, view_sun, azimuth, optical_radius);
                    (self.albedo * source * flights.opacity(grid, place, direction)) as f32
                })
            })
            .collect()
    }

    /// Light divided by the shape that light scattered twice has.
    fn by_shape(&self, grid: &FieldGrid, mut light: Vec<f32>) -> Vec<f32> {
        let factors: Vec<f32> = self.twice_shape.iter().map(|s| (1.0 / s) as f32).collect();
        for place in light.chunks_exact_mut(self.directions) {
            for (ring, factor) in place.chunks_exact_mut(grid.size.azimuth).zip(&factors) {
                ring.iter_mut().for_each(|l| *l *= factor);
            }
        }
        light
    }
}

fn sum(to: &mut [f32], from: &[f32]) {
    to.par_iter_mut().zip(from).for_each(|(t, f)| *t += f);
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
                (sum / (4.0 * PI)).max(f64::MIN_POSITIVE)
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

#[cfg(test)]
mod sphere_tests;
