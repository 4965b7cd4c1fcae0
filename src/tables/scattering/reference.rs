//! Second opinion: radiance of a uniform sphere by tracing paths backwards from the eye, ray by
//! ray, with nothing in common with the solver but the phase function.

use glam::DVec3;
use rayon::prelude::*;

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

/// Radiance that leaves the sphere along one ray towards the eye, per unit of sun irradiance,
/// without directly transmitted sunlight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereRadiance {
    /// Order 1, phase function included, by quadrature.
    pub single: f64,
    /// Orders from 2 on.
    pub multiple: Estimate,
}

impl SphereRadiance {
    /// All orders; the standard error is that of the higher ones.
    pub fn total(&self) -> Estimate {
        Estimate { mean: self.single + self.multiple.mean, error: self.multiple.error }
    }
}

/// A ray to be traced: unit vectors, as for [`super::ScatteringTable::lookup`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it enters the unit sphere.
    pub entry: DVec3,
    /// Its direction, away from the eye.
    pub dir: DVec3,
    /// Towards the sun.
    pub sun: DVec3,
    /// Extinction times radius.
    pub optical_radius: f64,
}

/// The radiance of a ray by tracing `paths` paths (rounded up to a multiple of 64) backwards on all
/// cores. The same arguments give the same result whatever the number of threads. 60,000 paths
/// come to about 0.3 % at optical radius 1, 0.7 % at 6 and 1 to 3 % from 20 on.
pub fn sphere_radiance(
    phase: &Phase,
    albedo: f64,
    ray: &Ray,
    paths: u64,
    seed: u64,
) -> SphereRadiance {
    let geometry = Geometry::of(ray.entry, ray.dir, ray.sun);
    let source = trace(phase, albedo, &geometry, ray.optical_radius, paths, seed);
    let opaque = opacity(ray.optical_radius * 2.0 * geometry.incidence);
    SphereRadiance {
        single: phase.eval(geometry.view_sun.cos()) * source.single * opaque,
        multiple: Estimate {
            mean: source.multiple.mean * opaque,
            error: source.multiple.error * opaque,
        },
    }
}

/// Scatterings next to the sun whose directions are drawn from both ends.
const BRIDGE: usize = 6;
/// Roulette begins below this weight.
const ROULETTE: f64 = 0.1;
/// Bridges are tried everywhere up to this optical depth below the surface on the sun's side, and
/// less and less often over the next few; but nowhere less often than the last says.
const BRIDGE_DEPTHS: [f64; 2] = [12.0, 3.0];
const BRIDGE_LEAST: f64 = 0.02;
/// Blocks of paths, each with random numbers of its own: the result does not depend on threads.
const BLOCKS: u64 = 64;

/// Traces `paths` paths backwards along a ray. The same arguments give the same result.
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
    let per_block = paths.div_ceil(BLOCKS).max(1);
    let paths = per_block * BLOCKS;
    let blocks: Vec<[f64; 2]> = (0..BLOCKS)
        .into_par_iter()
        .map(|block| {
            let mut random = Random(seed);
            // Far apart: the state of a block is a hash of its number.
            random.0 ^= Random(block.wrapping_add(1)).next();
            let mut sums = [0.0; 2];
            for path in 0..per_block {
                // The first scattering is spread evenly over the light that comes from the chord.
                let u = ((path * BLOCKS + block) as f64 + random.unit()) / paths as f64;
                let t = -(-u * opacity(optical_radius * chord)).ln_1p() / optical_radius;
                let value = tracer.path(entry + t.min(chord) * dir, dir, &mut random);
                sums[0] += value;
                sums[1] += value * value;
            }
            sums
        })
        .collect();
    let n = paths as f64;
    let mean = blocks.iter().map(|s| s[0]).sum::<f64>() / n;
    let squares = blocks.iter().map(|s| s[1]).sum::<f64>() / n;
    ReferenceSource {
        single: albedo * single_source(geometry, optical_radius),
        multiple: Estimate { mean, error: ((squares - mean * mean).max(0.0) / n).sqrt() },
    }
}

struct Random(u64);

impl Random {
    /// SplitMix64.
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
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
        let mut weight = self.albedo;
        let mut sum = 0.0;
        for between in 1..BRIDGE {
            sum += weight * self.bridge(x, dir, between, random);
        }
        loop {
            let depth = self.optical_radius * exit_distance(x, self.sun);
            let share = (-(depth - BRIDGE_DEPTHS[0]) / BRIDGE_DEPTHS[1]).exp();
            let share = share.clamp(BRIDGE_LEAST, 1.0);
            if share >= 1.0 || random.unit() < share {
                sum += weight / share * self.bridge(x, dir, BRIDGE, random);
            }
            // The path itself goes on by the phase function alone.
            dir = self.turned(dir, random);
            let (flight, collides) = self.flight(x, dir, random);
            weight *= collides * self.albedo;
            x += flight * dir;
            if weight < ROULETTE {
                if random.unit() * ROULETTE >= weight {
                    return sum;
                }
                weight = ROULETTE;
            }
        }
    }

    /// Light scattered at `x` against `dir` that was scattered exactly `between` times before.
    ///
    /// The directions in between are a chain from `dir` to the sun: some of them follow each other
    /// from `dir` on, the others from the sun, and the link where the two parts meet is drawn
    /// evenly. By the balance heuristic over all links the value is the harmonic mean of the phase
    /// function over the chain, which is large only where every turn is small: no sample stands
    /// out, however narrow the lobe.
    fn bridge(&self, mut x: DVec3, dir: DVec3, between: usize, random: &mut Random) -> f64 {
        let mut chain = [self.sun; BRIDGE + 2];
        chain[0] = dir;
        let link = ((random.unit() * (between + 1) as f64) as usize).min(between);
        for i in 1..=link {
            chain[i] = self.turned(chain[i - 1], random);
        }
        for i in (link + 1..=between).rev() {
            chain[i] = self.turned(chain[i + 1], random);
        }
        let links = chain[..between + 2].windows(2);
        let inverse: f64 = links.map(|w| 1.0 / self.phase.eval(w[0].dot(w[1]))).sum();
        let mut value = (between + 1) as f64 / inverse;
        for &way in &chain[1..=between] {
            let (flight, collides) = self.flight(x, way, random);
            x += flight * way;
            value *= collides * self.albedo;
        }
        value * (-self.optical_radius * exit_distance(x, self.sun)).exp()
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
