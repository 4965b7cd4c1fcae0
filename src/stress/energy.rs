//! What energy allows: an upper bound of the radiance of a pixel.
//!
//! Radiance is linear in its sources, so the bound is a sum.
//!
//! - Light that comes in diffusely, with radiance up to `L` (a uniform sky): nowhere more than `L`,
//!   since no surface and no medium here sends out more than it receives (maximum principle of the
//!   transport equation for albedos up to 1).
//! - The sun, irradiance `E`, unscattered: the radiance of its disc, within its rim.
//! - Sunlight scattered once, at an angle `a`: the integral of `w E p(a) exp(-...) d tau` over
//!   a ray is at most `w E p(a)`. Light that is scattered within the forward peak goes on
//!   as not scattered, in a medium thinner by `s = 1 - w f` (delta-M scaling): `w E p(a) / s`,
//!   times the largest factor of the halo at that angle. Air: its own phase function.
//! - Sunlight scattered more than once: in a plane-parallel medium with albedo 1 at most
//!   `sqrt(3) H(1) / (4 pi) E = 0.40 E`, the radiance deep in a half-space under a sun in the zenith
//!   (Chandrasekhar, Radiative Transfer, chapter 3, with H(1) = 2.908); over a white ground it is not
//!   more, since no light goes down into a half-space either. Hollow shapes may gather
//!   light from more than one side: twice as much is allowed.
//! - A sea: glitter as its facets have it, and of clouds and air that it may mirror what they scatter once at any angle. That
//!   is thousands per steradian in the peak of droplets, far more than waves leave of it: only what is beyond all measure
//!   passes this bound. What a sea reflects is compared with numbers in `tests/frame/sea.rs`.

use std::sync::Arc;

use glam::DVec3;

use super::Made;
use crate::frame::Picture;
use crate::frame::cpu::atmosphere::{aerosol_phase, distance_to_ground, rayleigh_phase};
use crate::frame::cpu::sea::surface_normal;
use crate::frame::renderer::sky_inputs;
use crate::frame::sky::gpu_data::{DISC_RIM, disc_peak, seen_from};
use crate::medium::halo::{HALO_COLUMNS, HALO_DEEPEST, HALO_DEPTH};
use crate::medium::phase::PreparedPhase;
use crate::medium::{Halo, Sea};
use crate::reference::{Filter, View};
use crate::scene::{Scene, Sky};

/// Radiance of sunlight after many scatterings over the sun's irradiance, 1/sr.
const DIFFUSE: f64 = 0.40;
/// For shapes other than plane layers.
const GATHERED: f64 = 2.0;
/// Colours of sunlight pass the white of its irradiance by some per cent (the conversion of four
/// wavelengths to linear sRGB), tables and the light grid add their errors: the targets of those are
/// 3 % in the furnace of many particles.
const TOLERANCE: f64 = 1.05;
/// Pixels near the disc's rim are as bright as the table of the disc has it: one step of f32 in the
/// chord of the angle.
const RIM: f64 = 1e-6;

/// Bounds of a scene's radiances.
pub struct Energy<'a> {
    sun: DVec3,
    irradiance: f64,
    uniform: f64,
    disc: [f64; 2],
    has_air: bool,
    scattered: f64,
    phase: PreparedPhase,
    halo: &'a Halo,
    sea: Option<(Arc<Sea>, f64)>,
}

impl<'a> Energy<'a> {
    /// Of a scene.
    pub fn new(scene: &Scene, made: &'a Made) -> Self {
        let (phase, albedo) = (&scene.medium.phase, scene.medium.albedo);
        let radius = 0.5 * scene.sun.angular_diameter.to_radians();
        let has_matter = scene.clouds.is_some() || !scene.particles.is_empty();
        Self {
            sun: scene.sun.direction,
            irradiance: scene.sun.irradiance,
            uniform: match scene.sky {
                Sky::Uniform { radiance } => radiance,
                Sky::Atmosphere => 0.0,
            },
            disc: [radius * (1.0 + DISC_RIM) + RIM, disc_peak(radius)],
            has_air: scene.sky == Sky::Atmosphere,
            scattered: if has_matter { albedo / made.truncation.scale(albedo) } else { 0.0 },
            phase: phase.prepare(),
            halo: &made.halo,
            sea: sky_inputs(scene).sea().map(|sea| (sea, seen_from(scene.camera.position.y))),
        }
    }

    /// Sunlight that a sea may send in a direction, over the sun's irradiance, 1/sr: glitter, and of clouds whatever
    /// is scattered at any angle.
    fn of_sea(&self, dir: DVec3) -> f64 {
        let Some((sea, altitude)) = &self.sea else { return 0.0 };
        let distance = distance_to_ground(*altitude, dir.y);
        if distance < 0.0 {
            return 0.0;
        }
        let normal = surface_normal(dir * distance, *altitude);
        let level = normal.dot(self.sun).max(0.0);
        let clouds = self.scattered * self.phase.eval(1.0).max(self.phase.eval(-1.0));
        let halo = self.halo.factors.iter().fold(1.0f64, |most, f| most.max(f64::from(*f)));
        let air = if self.has_air { aerosol_phase(1.0) } else { 0.0 };
        level * sea.glitter(normal, -dir, self.sun) + clouds * halo + air
    }

    /// Most radiance that can come from a direction.
    pub fn bound(&self, dir: DVec3) -> f64 {
        let cosine = dir.dot(self.sun).clamp(-1.0, 1.0);
        let chord = (dir - self.sun).length();
        let halo = (0..HALO_COLUMNS)
            .map(|c| {
                let share = c as f64 / (HALO_COLUMNS - 1) as f64;
                let depth = HALO_DEPTH * ((1.0 + HALO_DEEPEST / HALO_DEPTH).powf(share) - 1.0);
                self.halo.factor(0.5 * chord, depth)
            })
            .fold(1.0, f64::max);
        let mut of_sun = self.scattered * self.phase.eval(cosine) * halo + GATHERED * DIFFUSE;
        if self.has_air {
            of_sun += rayleigh_phase(cosine).max(aerosol_phase(cosine));
        }
        of_sun += self.of_sea(dir);
        if self.meets_disc(dir) {
            of_sun += self.disc[1];
        }
        TOLERANCE * (self.uniform + self.irradiance * of_sun)
    }

    /// Whether the sun's disc is seen in a direction, or would be without clouds.
    pub fn meets_disc(&self, dir: DVec3) -> bool {
        (dir - self.sun).length() <= self.disc[0]
    }

    /// The largest radiance of a picture's pixels over its bound; NaN where a pixel is.
    pub fn largest(&self, scene: &Scene, picture: &Picture) -> f64 {
        let view = View::new(&scene.camera, picture.size, None, Filter::Centre);
        let width = picture.size[0] as usize;
        picture.radiance.iter().enumerate().fold(0.0, |most, (i, pixel)| {
            let place = [(i % width) as f64 + 0.5, (i / width) as f64 + 0.5];
            let bound = self.bound(view.ray(place, [0.0; 2]).dir);
            pixel[..3].iter().fold(most, |most: f64, value| {
                let value = f64::from(*value);
                // Nothing over nothing is allowed; NaN stays.
                let ratio = if value == 0.0 { 0.0 } else { value / bound };
                if ratio > most || ratio.is_nan() { ratio } else { most }
            })
        })
    }
}
