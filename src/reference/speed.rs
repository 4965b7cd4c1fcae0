//! How many paths a second: a clump of overlapping uniform spheres, as dense as a small cloud.

use std::sync::Arc;
use std::time::Instant;

use glam::{DQuat, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::geometry::Ray;
use super::grid::ParticleGrid;
use super::particles::WorldParticle;
use super::random::Random;
use super::statistics::Moments;
use super::transport::{Matter, look, turned};
use super::uniform_sky::{SunDisc, UniformSky};
use crate::medium::{Phase, Shape, ShapeSpec};

/// Radius of the ball that holds the spheres' centres, m.
const CLUMP: f64 = 500.0;
/// Number of spheres.
const SPHERES: usize = 200;
/// Optical thickness along the clump's axes, in the mean of three.
const THICKNESS: f64 = 30.0;
/// Paths of one stream of random numbers.
const BATCH: u64 = 1 << 10;

/// What was measured.
#[derive(Clone, Debug, Serialize)]
pub struct Speed {
    /// Followed to their ends.
    pub paths: u64,
    /// Elapsed, s.
    pub seconds: f64,
    /// Of all threads together.
    pub paths_per_second: f64,
    /// Processor time of all threads, s, where the system tells it: on a busy machine it says more
    /// than what elapsed.
    pub processor_seconds: Option<f64>,
    /// Threads.
    pub threads: usize,
    /// Share of paths that met the clump.
    pub met: f64,
    /// Mean radiance, so that the work cannot be left out.
    pub radiance: f64,
}

/// The spheres with an optical thickness of 30.
pub fn clump() -> ParticleGrid {
    let shape = Arc::new(Shape::new(ShapeSpec::UNIFORM));
    let mut random = Random::new(7, 0, 0);
    let mut spheres = Vec::new();
    while spheres.len() < SPHERES {
        let place = DVec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0;
        if place.length() < 1.0 {
            spheres.push(WorldParticle {
                centre: place * CLUMP,
                radius: 80.0 + 80.0 * random.unit(),
                extinction: 1.0,
                to_own: DQuat::IDENTITY,
                shape: shape.clone(),
            });
        }
    }
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let thickness = axes.iter().map(|&dir| {
        let ray = Ray { origin: dir * (-3.0 * CLUMP), dir };
        spheres.iter().filter_map(|s| s.span(&ray)).map(|(a, b)| b - a).sum::<f64>()
    });
    let extinction = THICKNESS * axes.len() as f64 / thickness.sum::<f64>();
    spheres.iter_mut().for_each(|s| s.extinction = extinction);
    ParticleGrid::new(spheres)
}

/// Follows paths from the eye: rays towards random places of the clump's disc, sun from the side,
/// albedo 1, Henyey-Greenstein with a mean cosine of 0.85.
pub fn speed(paths: u64) -> Speed {
    let medium = clump();
    let matter = Matter { phase: Phase::Hg { g: 0.85 }.prepare(), albedo: 1.0 };
    let sun = SunDisc::new(DVec3::new(0.6, 0.8, 0.0), DVec3::ONE, 0.0093);
    let sky = UniformSky { radiance: DVec3::splat(0.03), sun: Some(sun), ground: None, sea: None };
    let (start, processor) = (Instant::now(), processor_time());
    let batches = paths.div_ceil(BATCH);
    let (light, met) = (0..batches)
        .into_par_iter()
        .map(|batch| {
            let mut random = Random::new(0, 1, batch);
            let (mut light, mut met) = (Moments::default(), 0u64);
            for _ in 0..BATCH.min(paths - batch * BATCH) {
                let across = turned(DVec3::Z, 0.0, random.unit() * std::f64::consts::TAU);
                let origin = across * (CLUMP * random.unit().sqrt()) + DVec3::Z * (4.0 * CLUMP);
                let ray = Ray { origin, dir: DVec3::NEG_Z };
                let seen = look(&medium, &sky, &matter, ray, &mut random);
                light.add(seen.radiance.x);
                met += u64::from(seen.transmittance < 1.0);
            }
            (light, met)
        })
        .reduce(Default::default, |a, b| (a.0.merged(b.0), a.1 + b.1));
    let seconds = start.elapsed().as_secs_f64();
    Speed {
        paths,
        seconds,
        paths_per_second: paths as f64 / seconds,
        processor_seconds: processor_time().zip(processor).map(|(end, start)| end - start),
        threads: rayon::current_num_threads(),
        met: met as f64 / paths as f64,
        radiance: light.estimate().value,
    }
}

/// Processor time of this process so far, s, from Linux's `/proc`.
fn processor_time() -> Option<f64> {
    // Linux tells times in hundredths of a second, whatever its own clock.
    const TICK: f64 = 0.01;
    // proc(5): of the fields after the name in parentheses, 12 and 13 are user and system time.
    const TIMES: std::ops::Range<usize> = 11..13;
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = fields.get(TIMES)?.iter().map(|t| t.parse::<f64>().ok()).sum::<Option<f64>>()?;
    Some(TICK * ticks)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::super::geometry::Medium;
    use super::*;

    /// Summed over the grid's pieces in small steps, the clump is as thick as it is said to be.
    #[test]
    fn the_clump_is_as_thick_as_stated() {
        let medium = clump();
        const STEPS: u32 = 400;
        let thickness: f64 = [DVec3::X, DVec3::Y, DVec3::Z]
            .into_iter()
            .map(|dir| {
                let ray = Ray { origin: dir * (-3.0 * CLUMP), dir };
                let mut sum = 0.0;
                medium.pieces(&ray, f64::INFINITY, &mut |piece| {
                    let step = (piece.end - piece.begin) / f64::from(STEPS);
                    for i in 0..STEPS {
                        let t = piece.begin + (f64::from(i) + 0.5) * step;
                        sum += step * medium.extinction(piece.cell, ray.at(t));
                    }
                    ControlFlow::Continue(())
                });
                sum
            })
            .sum();
        assert!((thickness / 3.0 / THICKNESS - 1.0).abs() < 1e-3, "{}", thickness / 3.0);
    }
}
