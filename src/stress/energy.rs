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
//! - A sea: glitter as its facets have it, and of clouds and air that it mirrors what they scatter once, times the share of the
//!   light that its facets reflect towards the eye. They are no steeper than four times their root mean square, so that the
//!   mirrored ray of each lies within an angle of that of a level sea, and no nearer to the sun than that angle leaves. Where it leaves
//!   none, near glitter, that is the forward peak of droplets, thousands per steradian, of which waves leave far
//!   less: there the bound is a wide one. What a sea reflects is compared with numbers in `tests/frame/sea.rs`.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;

use super::Made;
use crate::frame::Picture;
use crate::frame::air_shadow::ray_block;
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
/// Slopes of a sea over their root mean square, beyond which there are none: of Gaussian ones 1e-7, and of the frame's facets,
/// which are among the shallower ones, none.
const STEEPEST: f64 = 4.0;
/// Rays of the sea to both sides of a pixel, half of the square whose mean is taken and the next one, from which it has its light.
const RAYS_BESIDE: f64 = 3.0;
/// Angles, and heights of the view, of which the one with most light is taken.
const ANGLES: u32 = 64;
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

    /// Sunlight that a sea may send in a direction, over the sun's irradiance, 1/sr: glitter, and what clouds and air scatter
    /// towards its facets. `beside`: angle to other rays whose light it takes, rad.
    fn of_sea(&self, dir: DVec3, beside: f64) -> f64 {
        let Some((sea, altitude)) = &self.sea else { return 0.0 };
        let distance = distance_to_ground(*altitude, dir.y);
        if distance < 0.0 {
            return 0.0;
        }
        let normal = surface_normal(dir * distance, *altitude);
        let level = normal.dot(self.sun).max(0.0);
        let height = -dir.dot(normal).clamp(-1.0, 0.0);
        let mirrored = dir + 2.0 * height * normal;
        let turned = 2.0 * (STEEPEST * sea.slope()).atan() + beside;
        let nearest = (mirrored.dot(self.sun).clamp(-1.0, 1.0).acos() - turned).max(0.0);
        let most = |first: f64, last: f64, of: &dyn Fn(f64) -> f64| {
            let at = |i: u32| first + (last - first) * f64::from(i) / f64::from(ANGLES);
            (0..=ANGLES).map(|i| of(at(i))).fold(0.0, f64::max)
        };
        let clouds = self.scattered * most(nearest, PI, &|angle| self.phase.eval(angle.cos()));
        let halo = self.halo.factors.iter().fold(1.0f64, |most, f| most.max(f64::from(*f)));
        let of_air = |angle: f64| aerosol_phase(angle.cos()).max(rayleigh_phase(angle.cos()));
        let air = if self.has_air { most(nearest, PI, &of_air) } else { 0.0 };
        let lowest = (height.asin() - beside).max(0.0);
        let reflected = most(lowest, height.asin(), &|angle| sea.reflectance(angle.sin()));
        level * sea.glitter(normal, -dir, self.sun) + reflected * (clouds * halo + air)
    }

    /// Most radiance that can come from a direction.
    pub fn bound(&self, dir: DVec3) -> f64 {
        self.bound_beside(dir, 0.0)
    }

    /// The same of a pixel that takes what a sea reflects from rays at an angle, rad.
    fn bound_beside(&self, dir: DVec3, beside: f64) -> f64 {
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
        of_sun += self.of_sea(dir, beside);
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
        let half_width = scene.camera.half_width();
        let pixel = 2.0 * half_width / f64::from(picture.size[0]);
        let beside = RAYS_BESIDE * f64::from(ray_block(picture.size, half_width)) * pixel;
        picture.radiance.iter().enumerate().fold(0.0, |most, (i, pixel)| {
            let place = [(i % width) as f64 + 0.5, (i / width) as f64 + 0.5];
            let bound = self.bound_beside(view.ray(place, [0.0; 2]).dir, beside);
            pixel[..3].iter().fold(most, |most: f64, value| {
                let value = f64::from(*value);
                // Nothing over nothing is allowed; NaN stays.
                let ratio = if value == 0.0 { 0.0 } else { value / bound };
                if ratio > most || ratio.is_nan() { ratio } else { most }
            })
        })
    }
}
