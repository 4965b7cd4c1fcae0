//! What the number of steps explains. A frame marches in a few steps a radius, and where many optical depths lie in one
//! it may be far from the exact picture. Then it has to be the same as its march in f64, with the true depth to
//! the sun and particles in place of lists, and that march has to come to the exact picture with more steps.

use glam::DVec3;

use super::composed::meets;
use crate::frame::cpu::blend::{Pixel, compose};
use crate::frame::cpu::lighting::SunDepth;
use crate::frame::cpu::segments::ChordInputs;
use crate::frame::gpu_data::{Particle, ParticleLight};
use crate::frame::{Lighting, Quality};
use crate::reference::{Exact, ExactPixel};

/// Times the steps of the frame in the march that is to be the exact picture.
const FINER: u32 = 16;
/// Transmittance at which that ends.
const OPAQUE: f64 = 1e-9;

/// Radii over those of particles: where a ray only just meets one or misses it, as from an eye on its surface, f32 may
/// do the other, and the smallest that is met sets the steps. Some last digits of f32.
pub(super) const ROUNDED: [f32; 2] = [1.0 - 1e-6, 1.0 + 1e-6];

/// The march of a frame, in f64.
#[derive(Clone, Copy)]
pub(super) struct Steps<'a> {
    pub exact: &'a Exact<'a>,
    /// With the true depth to the sun, or with that between texels of the shadow maps.
    pub inputs: &'a ChordInputs<'a>,
    /// The same for the ground: optical depth to the sun from a point.
    pub ground_depth: SunDepth<'a>,
    pub particles: &'a [Particle],
    pub lights: &'a [ParticleLight],
    pub quality: &'a Quality,
    /// Radius of a particle over its own: 1, or one of [`ROUNDED`].
    pub size: f32,
}

/// Whether a particle is in the lists of the frame at all: without matter it sets no steps.
pub(super) fn is_listed(particle: &Particle) -> bool {
    particle.extinction > 0.0
}

impl Steps<'_> {
    /// With the frame's steps, and with many.
    pub fn few_and_many(&self, dir: DVec3) -> [ExactPixel; 2] {
        let nearest =
            |p: &Particle| DVec3::from(p.centre.map(f64::from)).length() - f64::from(p.radius);
        let sized = |p: &Particle| Particle { radius: self.size * p.radius, ..*p };
        let both = self.particles.iter().map(sized).zip(self.lights);
        let mut met: Vec<_> = both.filter(|(p, _)| is_listed(p) && meets(p, dir)).collect();
        met.sort_by(|a, b| nearest(&a.0).total_cmp(&nearest(&b.0)));
        let particles: Vec<_> = met.iter().map(|(p, _)| *p).collect();
        let lights: Vec<_> = met.iter().map(|(_, l)| **l).collect();
        let far = self.exact.far(dir);
        let lighting = Lighting::Grid;
        let pixel = Pixel {
            inputs: self.inputs,
            particles: &particles,
            lights: &lights,
            dir,
            far,
            lighting,
        };
        let Quality { steps, transmittance_stop, .. } = *self.quality;
        let few = compose(&pixel, steps, transmittance_stop.into());
        let many = compose(&pixel, FINER * steps, OPAQUE);
        [few, many].map(|clouds| self.exact.pixel_of(dir, clouds, self.ground_depth))
    }
}
