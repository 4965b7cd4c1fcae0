//! The blend in f64: twin of `shaders/frame/blend.wgsl`, where the method is told.

use glam::{DQuat, DVec3};

use super::lighting::{RayLight, mean_sunlight, own_share};
use super::octaves::{octave_sources, octave_sunlight, octave_transmittance};
use super::segments::{ChordInputs, Composed, mean_scatter_fraction};
use crate::frame::gpu_data::{Particle, ParticleLight};
use crate::frame::settings::Lighting;

/// Bins of a block.
pub const BINS: usize = 8;
/// Least step over the distance.
const LEAST_STEP: f64 = 1e-6;
/// Least length of a part of a chord, in bins.
const LEAST_PART: f64 = 1e-6;
/// Transmittance below this is dark.
const DARK: f64 = 1e-30;

/// What a pixel's ray meets: particles in the order of their nearest points, with their light.
pub struct Pixel<'a> {
    /// Frame, tables and light.
    pub inputs: &'a ChordInputs<'a>,
    /// In the order of the list.
    pub particles: &'a [Particle],
    /// Of each particle.
    pub lights: &'a [ParticleLight],
    /// Of the ray.
    pub dir: DVec3,
    /// m, to the ground.
    pub far: f64,
    /// What the light of its surroundings is.
    pub lighting: Lighting,
}

/// Of one bin: optical depth, that among others, and source of what is alone.
#[derive(Clone, Copy, Default)]
struct Bin {
    tau: f64,
    crowded: f64,
    own: f64,
}

/// A block of bins, and the colours of its light times its optical depth.
#[derive(Default)]
struct Block {
    bins: [Bin; BINS],
    matter: f64,
    sun: DVec3,
    above: DVec3,
    below: DVec3,
}

/// Visible part of a ray in a particle, m.
struct Span {
    near: f64,
    begin: f64,
    end: f64,
}

fn vector(v: &[f32]) -> DVec3 {
    DVec3::new(v[0].into(), v[1].into(), v[2].into())
}

impl Pixel<'_> {
    fn span(&self, particle: &Particle) -> Option<Span> {
        let (centre, radius) = (vector(&particle.centre), f64::from(particle.radius));
        let middle = centre.dot(self.dir);
        let half = radius * radius - (centre - middle * self.dir).length_squared();
        let half = (half > 0.0).then(|| half.sqrt())?;
        let span = Span {
            near: middle - half,
            begin: (middle - half).max(0.0),
            end: (middle + half).min(self.far),
        };
        (span.end > span.begin).then_some(span)
    }

    fn nearest(particle: &Particle) -> f64 {
        vector(&particle.centre).length() - f64::from(particle.radius)
    }

    /// Where matter begins after the cursor, and the radius that sets the steps there (m): that of the smallest
    /// particle, but a block ends before a smaller one with no finer steps than that takes.
    fn next(&self, cursor: f64, steps: u32) -> Option<(f64, f64)> {
        let (mut begin, mut smallest) = (f64::INFINITY, f64::INFINITY);
        for particle in self.particles {
            if Self::nearest(particle) >= begin + smallest {
                break;
            }
            if let Some(span) = self.span(particle).filter(|span| span.end > cursor) {
                let from_here = span.begin.max(cursor);
                begin = begin.min(from_here);
                let up_to = (from_here - begin) * f64::from(steps) / BINS as f64;
                smallest = smallest.min(f64::from(particle.radius).max(up_to));
            }
        }
        begin.is_finite().then_some((begin, smallest))
    }

    /// Adds a block lit by octaves, or each particle by itself.
    fn compose_without_grid(
        &self,
        ray: &RayLight<'_>,
        block: &Block,
        [begin, end]: [f64; 2],
        sum: &mut Composed,
    ) {
        let frame = self.inputs.frame;
        let (albedo, cosine) = (f64::from(frame.albedo), self.dir.dot(vector(&frame.sun)));
        let sources = octave_sources(ray.first, cosine, frame.mean_cosine.into(), albedo);
        let step = (end - begin) / BINS as f64;
        for (i, bin) in block.bins.iter().enumerate().filter(|(_, bin)| bin.tau > 0.0) {
            let weight = sum.transmittance * -(-bin.tau).exp_m1();
            let within = mean_scatter_fraction(bin.tau);
            let (sun, around) = match self.lighting {
                Lighting::Octaves => {
                    let depths = ray.depths(begin, step, i);
                    let at = depths[0] + (depths[1] - depths[0]) * within;
                    let to_eye = within * bin.tau - sum.transmittance.max(DARK).ln();
                    let around = 0.5 * (octave_transmittance(at) + octave_transmittance(to_eye));
                    (octave_sunlight(&sources, depths[0], depths[1], bin.tau), around)
                }
                Lighting::Grid | Lighting::Alone => (bin.own / bin.tau, 1.0),
            };
            let colours = sun * block.sun + 0.5 * albedo * around * (block.above + block.below);
            sum.radiance += weight * colours / block.matter;
            sum.distance += weight * (begin + step * (i as f64 + within));
            sum.transmittance *= (-bin.tau).exp();
        }
    }

    /// Adds what a particle has between `begin` and the end of a block with these steps (m).
    fn add(&self, block: &mut Block, index: usize, begin: f64, step: f64) {
        let (particle, light) = (&self.particles[index], &self.lights[index]);
        let Some(span) = self.span(particle) else { return };
        let (a, b) = (span.begin.max(begin), span.end.min(begin + BINS as f64 * step));
        if b <= a {
            return;
        }
        let frame = self.inputs.frame;
        let (centre, radius) = (vector(&particle.centre), f64::from(particle.radius));
        let sun = vector(&frame.sun);
        let scale = f64::from(frame.delta_scale);
        let place = |t: f64| (t * self.dir - centre) / radius;
        let optical_radius = f64::from(particle.optical_radius);
        let first = (a - begin) / step;
        let last = ((b - begin) / step).max(first + LEAST_PART);
        let alone = match self.lighting {
            Lighting::Grid | Lighting::Alone => f64::from(light.ambient_below[3]),
            Lighting::Octaves => 0.0,
        };
        let mut own = 0.0;
        if alone > 0.0 {
            let entry = place(span.near);
            let scattered =
                self.inputs.scattering.lookup(entry, self.dir, sun, optical_radius / scale);
            let phase = self.inputs.phase.eval(sun.dot(self.dir));
            own = alone
                * (scattered[0] * phase + scattered[1])
                * (-f64::from(light.ambient_above[3])).exp();
        }
        let turn = DQuat::from_array(particle.orientation.map(f64::from));
        let copy = self.inputs.copy(particle, self.dir);
        for (i, bin) in block.bins.iter_mut().enumerate() {
            let [from, to] = [first, last].map(|t| t.clamp(i as f64, i as f64 + 1.0));
            if to <= from {
                continue;
            }
            let at = turn * place(begin + step * 0.5 * (from + to));
            let density = self.inputs.tables.density(particle.shape, at, copy);
            let tau = f64::from(particle.extinction) * step * (to - from) * density;
            bin.tau += tau;
            bin.crowded += tau * (1.0 - alone);
            bin.own += own * tau;
            block.matter += tau;
            block.sun += tau * vector(&light.sun_irradiance);
            block.above += tau * vector(&light.ambient_above);
            block.below += tau * vector(&light.ambient_below);
        }
    }
}

/// Composes a pixel with `steps` bins in a radius of the smallest particle at hand; it is finished below the
/// transmittance `stop`.
pub fn compose(pixel: &Pixel<'_>, steps: u32, stop: f64) -> Composed {
    let ray = pixel.inputs.ray(pixel.dir);
    let mut sum = Composed { radiance: DVec3::ZERO, transmittance: 1.0, distance: 0.0 };
    let (mut cursor, mut since_gap) = (0.0, 0.0);
    while let Some((begin, smallest)) = pixel.next(cursor, steps) {
        let step = (smallest / f64::from(steps)).max(LEAST_STEP * begin);
        let end = begin + BINS as f64 * step;
        if begin > cursor {
            since_gap = 0.0;
        }
        let mut block = Block::default();
        for (index, particle) in pixel.particles.iter().enumerate() {
            if Pixel::nearest(particle) >= end {
                break;
            }
            pixel.add(&mut block, index, begin, step);
        }
        if block.matter > 0.0 {
            match pixel.lighting {
                Lighting::Grid => {
                    compose_block(&ray, &block, [begin, end], &mut since_gap, &mut sum);
                }
                Lighting::Octaves | Lighting::Alone => {
                    pixel.compose_without_grid(&ray, &block, [begin, end], &mut sum);
                }
            }
        }
        if sum.transmittance <= stop {
            break;
        }
        cursor = end;
    }
    let opacity = 1.0 - sum.transmittance;
    sum.distance = if opacity > 0.0 { sum.distance / opacity } else { 0.0 };
    sum
}

impl Block {
    /// Place in bins where the light of the pair of bins from this one on comes from.
    fn light_comes_from(&self, bin: usize) -> f64 {
        let [near, far] = [bin, bin + 1].map(|i| self.bins[i].tau);
        let [first, second] = [-(-near).exp_m1(), -(-far).exp_m1() * (-near).exp()];
        let within =
            first * mean_scatter_fraction(near) + second * (1.0 + mean_scatter_fraction(far));
        bin as f64 + within / (first + second)
    }
}

impl RayLight<'_> {
    /// Depths to the sun at the ends of a bin of a block: exact at the ends of every second bin, linear between them.
    fn depths(&self, begin: f64, step: f64, bin: usize) -> [f64; 2] {
        let first = bin / 2 * 2;
        let pair =
            [first, first + 2].map(|b| (self.sun_depth)((begin + step * b as f64) * self.dir));
        let middle = 0.5 * (pair[0] + pair[1]);
        if bin.is_multiple_of(2) { [pair[0], middle] } else { [middle, pair[1]] }
    }
}

fn compose_block(
    ray: &RayLight<'_>,
    block: &Block,
    [begin, end]: [f64; 2],
    since_gap: &mut f64,
    sum: &mut Composed,
) {
    let step = (end - begin) / BINS as f64;
    let place = |bins: usize| (begin + step * bins as f64) * ray.dir;
    let depth = |bins: usize| (ray.sun_depth)(place(bins));
    let depths = [depth(0), depth(BINS)];
    // Where the block's light comes from, on the way to the sun and to the eye.
    let matter = block.bins.iter().map(|bin| bin.tau).sum();
    let deep = mean_scatter_fraction(matter);
    let to_sun = depths[0] + (depths[1] - depths[0]) * deep;
    let path = ray.halo_share * (to_sun + deep * matter - sum.transmittance.max(DARK).ln());
    let once = ray.first * ray.halo.factor(ray.half_sine, path);
    let (mut sunlight, mut above, mut below) = (0.0, 0.0, 0.0);
    for (i, bin) in block.bins.iter().enumerate().filter(|(_, bin)| bin.tau > 0.0) {
        let opacity = -(-bin.tau).exp_m1();
        let [front, back] = ray.depths(begin, step, i);
        let lit = once * bin.crowded * mean_sunlight(front, back, bin.tau);
        let within = mean_scatter_fraction(bin.tau);
        let seen = ray.field.at((begin + step * block.light_comes_from(i / 2 * 2)) * ray.dir);
        let weight = sum.transmittance * opacity / bin.tau;
        let own = bin.own * own_share(*since_gap, bin.tau, ray.delta_scale);
        *since_gap += bin.tau;
        sunlight += weight * (lit + seen.x * bin.crowded + own);
        above += weight * bin.tau * seen.y;
        below += weight * bin.tau * (seen.z - seen.y).max(0.0);
        sum.distance += weight * bin.tau * (begin + step * (i as f64 + within));
        sum.transmittance *= (-bin.tau).exp();
    }
    sum.radiance +=
        (sunlight * block.sun + above * block.above + below * block.below) / block.matter;
}
