//! How far a frame is from the exact compositor: the same light of each particle, everything else
//! worked out in f64.

use bytemuck::Zeroable;
use glam::{DVec3, Vec3};
use serde::Serialize;

use super::explained::Steps;
use super::{Case, Energy, Made};
use crate::Result;
use crate::error::Error;
use crate::frame::Picture;
use crate::frame::cpu::light_grid::FieldSeen;
use crate::frame::cpu::segments::ChordInputs;
use crate::frame::cpu::sky::Sky;
use crate::frame::cpu::sky_march::Air;
use crate::frame::gpu_data::{LightGridUniforms, Particle};
use crate::frame::renderer::sky_inputs;
use crate::frame::view::frame_uniforms;
use crate::reference::{AIR_STEPS, Exact, Filter, SunTruth, View};
use crate::scene::{Scene, Sky as SkyOf};
use crate::tables::TableSet;

/// Pixels that are compared, evenly spread over the picture.
const PIXELS: usize = 48;
/// Index of the shape without noise.
const UNIFORM: u32 = 0;
/// Particles up to which that takes seconds.
const MOST_PARTICLES: u64 = 20_000;
/// Differences that fail a case: they tell blunders. The errors of tables and marches have their own tests. Root
/// mean squares over the pixels. What is measured is told in the README, with its distribution.
///
/// Transmittance: a noise shape of a few pixels' radius is marched through a copy that is filtered over a pixel, where
/// the exact one is that of the pixel's middle; and wisps are narrower than a step of preset low. The most at the
/// corners is 0.13 (nine coincident noise shapes in 3 steps a radius), in random scenes that pass 0.16 (`random 603:78`,
/// a field of balls of a metre and 20,000 per metre).
const MOST_TRANSMITTANCE: f64 = 0.2;
/// Transmittance of noise shapes deeper than any cloud, [`CLOUD`]: the outline of the last wisp is all or nothing in
/// every pixel that it crosses, and the march draws it elsewhere. Three of 48 pixels may be so; two were, in one
/// random scene.
const MOST_OUTLINES: f64 = 0.25;
/// Radiance, over the root mean square of the exact one, times the steps in a radius, where it is also more than
/// `MOST_OF_ALLOWED` of what energy allows: deep inside of dark media the two may differ by any factor of next to
/// nothing. A step takes light as linear in it, and so errs by a share of it that goes with its length: the most in
/// what is bright enough is 0.45 in the random scenes that pass. What sets the bound is not explained: opaque balls,
/// alone (corners), are off by 0.11 with any number of steps in an even medium, 0.021 of what is allowed, and by 0.24
/// in a backward scattering one, 0.014 of it.
const MOST_RADIANCE: f64 = 1.2;
const MOST_OF_ALLOWED: f64 = 0.02;
/// Of transmittance and radiance of pictures that are to be the same: 7e-6 and 2e-6 are measured
/// (`cargo nextest run --test stress long_lists`).
const MOST_UNLIKE: f64 = 1e-3;

/// Optical radius, extinction times radius at density 1, of a noise shape up to which pictures are
/// compared: beyond, the thinnest wisp at an outline is opaque, and 8-bit densities and steps decide where it
/// ends. Clouds have less than 100.
pub const DEEPEST_COMPARED: f64 = 1e4;

/// The same of all noise shapes that a ray meets together beyond which their outline is what a pixel shows: more
/// than in any cloud.
const CLOUD: f64 = 100.0;

/// Of transmittance and radiance in a pixel: up to this nothing is asked of its steps.
const PLAIN: f64 = 0.01;
/// Share of what energy allows that counts with the radiance of a pixel that it is judged by.
const SEEN: f64 = 0.02;
/// Radiance that counts as dark, over what energy allows: tables of the air and the light grid are in
/// 16-bit floats, which end there.
const DARK: f64 = 1e-4;

/// Root mean square differences.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Difference {
    /// Pixels compared.
    pub pixels: usize,
    /// Of transmittance, in pixels that meet no noise shape deeper than clouds.
    pub transmittance: f64,
    /// Of transmittance, in the other pixels, over the number of all.
    pub outlines: f64,
    /// Of radiance, over the root mean square of the exact one, darkness apart; without pixels of the sun's disc, which
    /// is so bright that it shows the last digit of the transmittance.
    pub radiance: f64,
    /// Of transmittance and radiance in the worst pixel.
    pub worst: [f64; 2],
    /// Of what steps don't explain.
    pub unexplained: [f64; 2],
    /// Of radiance, over the root mean square of what energy allows.
    pub of_allowed: f64,
    /// Steps in a radius that the frame was marched with.
    pub steps: u32,
    /// Whether the two are to be the same, steps and all.
    pub alike: bool,
}

impl Difference {
    /// Why it is too much.
    pub fn failure(&self) -> Option<String> {
        let bad = |value: f64, most: f64| value.is_nan() || value > most;
        let most_transmittance = if self.alike { MOST_UNLIKE } else { MOST_TRANSMITTANCE };
        if bad(self.outlines, MOST_OUTLINES) {
            return Some(format!("transmittance of outlines is off by {:.4} RMS", self.outlines));
        }
        if bad(self.transmittance, most_transmittance) {
            return Some(format!("transmittance is off by {:.4} RMS", self.transmittance));
        }
        let most_radiance = MOST_RADIANCE / f64::from(self.steps.max(1));
        let is_off = if self.alike {
            bad(self.radiance, MOST_UNLIKE)
        } else {
            bad(self.radiance, most_radiance) && bad(self.of_allowed, MOST_OF_ALLOWED)
        };
        is_off.then(|| format!("radiance is off by {:.1} % RMS", 100.0 * self.radiance))
    }
}

/// Tables of the air over a ground of some albedo: they take longer than a picture's pixels.
#[derive(Clone, Debug)]
pub struct KeptAir {
    ground_albedo: Vec3,
    air: Air,
}

/// The sky of a scene, with the last one's air where it fits. Without air any does.
fn sky(scene: &Scene, kept: &mut Option<KeptAir>) -> Sky {
    let inputs = sky_inputs(scene);
    let fits =
        |k: &KeptAir| scene.sky != SkyOf::Atmosphere || k.ground_albedo == inputs.ground_albedo;
    if let Some(kept) = kept.as_ref().filter(|k| fits(k)) {
        return Sky::with_air(&inputs, AIR_STEPS, kept.air.clone());
    }
    let sky = Sky::new(&inputs, AIR_STEPS);
    *kept = Some(KeptAir { ground_albedo: inputs.ground_albedo, air: sky.air().clone() });
    sky
}

/// What the exact picture is made with.
pub struct Composed<'a> {
    /// The renderer with its last frame.
    pub made: &'a Made,
    /// The tables.
    pub tables: &'a TableSet,
    /// What is too bright.
    pub energy: &'a Energy<'a>,
}

impl Composed<'_> {
    /// Composes some pixels of the last frame exactly; none where there are too many particles.
    pub fn difference(
        &self,
        case: &Case,
        picture: &Picture,
        air: &mut Option<KeptAir>,
    ) -> Result<Option<Difference>> {
        let Self { made, tables, energy } = *self;
        if picture.stats.counters.particles_generated > MOST_PARTICLES {
            return Ok(None);
        }
        let (scene, size) = (&case.scene, case.size);
        let medium = &scene.medium;
        let scattering = tables.scattering_for(&medium.phase, medium.albedo).ok_or_else(|| {
            Error::Failed(format!("the tables hold no scattering of {}", medium.phase))
        })?;
        let Made { renderer, truncation, halo, .. } = made;
        let (particles, lights) = renderer.particles()?;
        // Without a grid nothing could be seen yet, in any frame. That of another frame is met by no ray.
        let nothing = particles.is_empty() && scene.clouds.is_none();
        let field = if nothing || renderer.solved_light().is_none() {
            FieldSeen::new(LightGridUniforms::zeroed(), Vec::new(), DVec3::ZERO)
        } else {
            renderer.field()?
        };
        let quality = case.preset.quality();
        let shift = DVec3::ZERO; // the field brings its own
        let frame =
            frame_uniforms(scene, &scene.camera, size, truncation, shift, &quality, 0, [true; 2]);
        let truth = SunTruth::new(tables, &particles, scene.sun.direction)?;
        let sun_depth = &|point: DVec3| truth.depth(point);
        let inputs = || ChordInputs {
            frame: &frame,
            tables,
            scattering,
            phase: medium.phase.prepare(),
            halo,
            field: &field,
            sun_depth,
        };
        let scale = f64::from(frame.delta_scale);
        let noise: Vec<Particle> =
            particles.iter().filter(|p| p.shape != UNIFORM).copied().collect();
        let sky = sky(scene, air);
        let exact =
            Exact::with_sky(scene, inputs(), particles.clone(), lights.clone(), sky)?.filtered();
        let steps = Steps {
            exact: &exact,
            inputs: &inputs(),
            particles: &particles,
            lights: &lights,
            quality: &quality,
        };
        let view = View::new(&scene.camera, size, None, Filter::Centre);
        let count = picture.radiance.len();
        let looked_at = count.min(PIXELS);
        let mut compared = 0;
        let (mut transmittance, mut outlines) = (0.0, 0.0);
        let (mut radiance, mut total, mut allowed) = (0.0, 0.0, 0.0);
        let (mut worst, mut unexplained) = ([0.0f64; 2], [0.0f64; 2]);
        for i in 0..looked_at {
            // A step that shares no factor with the width: not the same column every time.
            let index = (i * count / looked_at + i % 7).min(count - 1);
            let [x, y] = [index % size[0] as usize, index / size[0] as usize];
            let dir = view.ray([x as f64 + 0.5, y as f64 + 0.5], [0.0; 2]).dir;
            let depths = noise.iter().filter(|p| meets(p, dir)).map(|p| depth(p, scale));
            let (deepest, all) =
                depths.fold((0.0f64, 0.0), |(most, sum), d| (most.max(d), sum + d));
            if deepest > DEEPEST_COMPARED {
                continue;
            }
            compared += 1;
            let expected = exact.pixel(dir);
            let [r, g, b, opacity] = picture.radiance[index].map(f64::from);
            let off = (1.0 - opacity - expected.transmittance).powi(2);
            *(if all > CLOUD { &mut outlines } else { &mut transmittance }) += off;
            let has_disc = energy.meets_disc(dir);
            let scale = expected.radiance.length() + SEEN * 3.0f64.sqrt() * energy.bound(dir);
            let apart = |a: DVec3, b: DVec3| {
                if has_disc || a == b { 0.0 } else { (a - b).length() / scale }
            };
            let lit = DVec3::new(r, g, b);
            let mut here = [off.sqrt(), apart(lit, expected.radiance)];
            worst = [0, 1].map(|i| worst[i].max(here[i]));
            if here[0] > PLAIN || here[1] > PLAIN {
                let [few, many] = steps.few_and_many(dir);
                let t = [
                    1.0 - opacity - few.transmittance,
                    many.transmittance - expected.transmittance,
                ];
                let l = [apart(lit, few.radiance), apart(many.radiance, expected.radiance)];
                if std::env::var("ZZ").is_ok() {
                    println!("ZZ {} all {all:.3e} off {here:?} T {t:?} L {l:?}", case.name);
                }
                here = [here[0].min(t[0].abs().max(t[1].abs())), here[1].min(l[0].max(l[1]))];
            }
            if all <= CLOUD {
                unexplained = [0, 1].map(|i| unexplained[i].max(here[i]));
            }
            if !has_disc {
                radiance += (DVec3::new(r, g, b) - expected.radiance).length_squared();
                let bound = energy.bound(dir);
                total += expected.radiance.length_squared() + (DARK * bound).powi(2);
                allowed += 3.0 * bound * bound;
            }
        }
        if compared == 0 {
            return Ok(None);
        }
        let over = |of: f64| if radiance == 0.0 { 0.0 } else { (radiance / of).sqrt() };
        Ok(Some(Difference {
            pixels: compared,
            transmittance: (transmittance / compared as f64).sqrt(),
            outlines: (outlines / compared as f64).sqrt(),
            radiance: over(total),
            worst,
            unexplained,
            of_allowed: over(allowed),
            steps: quality.steps,
            alike: false,
        }))
    }
}

/// Difference of two pictures that are to be the same.
pub fn like(picture: &Picture, other: &Picture, steps: u32) -> Difference {
    let pixels = picture.radiance.len();
    let (mut transmittance, mut radiance, mut total) = (0.0, 0.0, 0.0);
    for (a, b) in picture.radiance.iter().zip(&other.radiance) {
        let ([r, g, b, opacity], [x, y, z, other]) = (a.map(f64::from), b.map(f64::from));
        transmittance += (opacity - other).powi(2);
        radiance += (DVec3::new(r, g, b) - DVec3::new(x, y, z)).length_squared();
        total += DVec3::new(x, y, z).length_squared();
    }
    let radiance = if radiance == 0.0 { 0.0 } else { (radiance / total).sqrt() };
    let transmittance = (transmittance / pixels.max(1) as f64).sqrt();
    // Nothing makes up for it, unlike in the dark of a picture that is composed.
    let outlines = 0.0;
    Difference {
        pixels,
        transmittance,
        outlines,
        radiance,
        worst: [transmittance, radiance],
        unexplained: [transmittance, radiance],
        of_allowed: radiance,
        steps,
        alike: true,
    }
}

/// Optical radius of a particle whose extinction is scaled by `scale`.
fn depth(particle: &Particle, scale: f64) -> f64 {
    f64::from(particle.extinction) * f64::from(particle.radius) / scale
}

/// Whether a ray from the eye meets a particle.
pub(super) fn meets(particle: &Particle, dir: DVec3) -> bool {
    let [x, y, z] = particle.centre.map(f64::from);
    let (centre, radius) = (DVec3::new(x, y, z), f64::from(particle.radius));
    let nearest = centre.dot(dir).max(0.0) * dir;
    centre.distance_squared(nearest) < radius * radius
}
