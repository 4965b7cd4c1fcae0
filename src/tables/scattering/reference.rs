//! Second opinion: radiance of a uniform sphere by tracing paths backwards from the eye, ray by
//! ray, with nothing in common with the solver but the phase function.

use glam::DVec3;

use super::mapping::Geometry;
use super::single::{opacity, single_source};
use crate::medium::{Phase, PreparedPhase};

/// A mean of random samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
}

/// Sources of one ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceSource {
    /// Order 1 without phase function, by quadrature.
    pub single: f64,
    /// Orders from 2 on.
    pub multiple: Estimate,
}

/// Roulette begins below this weight.
const ROULETTE: f64 = 0.1;

struct Random(u64);

impl Random {
    /// SplitMix64.
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Traces `paths` paths backwards along a ray.
pub fn trace(
    phase: &Phase,
    albedo: f64,
    geometry: &Geometry,
    optical_radius: f64,
    paths: u64,
    seed: u64,
) -> ReferenceSource {
    let tracer = Tracer { phase: phase.prepare(), albedo, optical_radius, sun: DVec3::Z };
    let (entry, dir, _) = geometry.ray();
    let chord = 2.0 * geometry.incidence;
    let mut random = Random(seed);
    let (mut sum, mut squares) = (0.0, 0.0);
    for path in 0..paths {
        // The first scattering is spread evenly over the light that comes from the chord.
        let u = (path as f64 + random.unit()) / paths as f64;
        let t = -(-u * opacity(optical_radius * chord)).ln_1p() / optical_radius;
        let value = tracer.path(entry + t.min(chord) * dir, dir, &mut random);
        sum += value;
        squares += value * value;
    }
    let n = paths as f64;
    let mean = sum / n;
    let variance = (squares / n - mean * mean).max(0.0);
    ReferenceSource {
        single: albedo * single_source(geometry, optical_radius),
        multiple: Estimate { mean, error: (variance / n).sqrt() },
    }
}

struct Tracer {
    phase: PreparedPhase,
    albedo: f64,
    optical_radius: f64,
    sun: DVec3,
}

impl Tracer {
    /// Orders from 2 on of the light scattered at `x` against `dir`.
    fn path(&self, mut x: DVec3, mut dir: DVec3, random: &mut Random) -> f64 {
        let mut weight = 1.0;
        let mut sum = 0.0;
        loop {
            weight *= self.albedo;
            sum += weight * self.twice(x, dir, random);
            // The path itself goes on by the phase function alone.
            dir = self.turned(dir, random);
            let (flight, collides) = self.flight(x, dir, random);
            weight *= collides;
            x += flight * dir;
            if weight < ROULETTE {
                if random.unit() * ROULETTE >= weight {
                    return sum;
                }
                weight = ROULETTE;
            }
        }
    }

    /// Light scattered at `x` against `dir` that was scattered exactly once before, from one
    /// direction drawn near `dir` or near the sun: with both lobes sampled no sample is large.
    fn twice(&self, x: DVec3, dir: DVec3, random: &mut Random) -> f64 {
        let axis = if random.unit() < 0.5 { dir } else { self.sun };
        let from = self.turned(axis, random);
        let first = self.phase.eval(dir.dot(from));
        let second = self.phase.eval(from.dot(self.sun));
        let (flight, collides) = self.flight(x, from, random);
        let place = x + flight * from;
        let sunlight = (-self.optical_radius * exit_distance(place, self.sun)).exp();
        self.albedo * collides * sunlight * first * second / (0.5 * (first + second))
    }

    fn flight(&self, x: DVec3, dir: DVec3, random: &mut Random) -> (f64, f64) {
        let exit = exit_distance(x, dir);
        let collides = opacity(self.optical_radius * exit);
        let flight = -(-random.unit() * collides).ln_1p() / self.optical_radius;
        (flight.min(exit), collides)
    }

    fn turned(&self, dir: DVec3, random: &mut Random) -> DVec3 {
        let cosine = self.phase.sample(random.unit(), random.unit());
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (s, c) = (std::f64::consts::TAU * random.unit()).sin_cos();
        let (u, v) = dir.any_orthonormal_pair();
        (dir * cosine + sine * (c * u + s * v)).normalize()
    }
}

fn exit_distance(x: DVec3, dir: DVec3) -> f64 {
    let along = x.dot(dir);
    let inside = (1.0 - x.length_squared()).max(0.0);
    let root = (along * along + inside).sqrt();
    if along > 0.0 { inside / (root + along) } else { root - along }
}
