//! How far a frame is from the exact compositor: the same light of each particle, everything else
//! worked out in f64.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use glam::{DVec3, Vec3};

use super::difference::{Difference, MOST_RADIANCE, Unexplained, is_beyond, worse};
use super::explained::{ROUNDED, Steps, is_listed};
use super::{Case, Energy, Made};
use crate::Result;
use crate::error::Error;
use crate::frame::Picture;
use crate::frame::cpu::light_grid::FieldSeen;
use crate::frame::cpu::lighting::SunDepth;
use crate::frame::cpu::segments::ChordInputs;
use crate::frame::cpu::shadow::{Column, Nodes, between_texels, texel_side, through_nodes};
use crate::frame::cpu::sky::Sky;
use crate::frame::cpu::sky_march::Air;
use crate::frame::gpu_data::{Particle, ShadowUniforms};
use crate::frame::renderer::sky_inputs;
use crate::frame::view::frame_uniforms;
use crate::reference::{AIR_STEPS, Exact, ExactPixel, Filter, SunTruth, View};
use crate::scene::{Scene, Sky as SkyOf};
use crate::tables::TableSet;

/// Pixels that are compared, evenly spread over the picture.
const PIXELS: usize = 48;
/// Index of the shape without noise.
const UNIFORM: u32 = 0;
/// Particles up to which that takes seconds.
const MOST_PARTICLES: u64 = 20_000;
/// Optical radius, extinction times radius at density 1, of a noise shape up to which pictures are
/// compared: beyond, the thinnest wisp at an outline is opaque, and 8-bit densities and steps decide where it
/// ends. Clouds have less than 100.
const DEEPEST_COMPARED: f64 = 1e4;

/// The same of all noise shapes that a ray meets together up to which many steps have to come to the exact picture:
/// more than in any cloud. Beyond, their outline is what a pixel shows, and takes still more.
const CLOUD: f64 = 100.0;

/// Of transmittance and radiance in a pixel: up to this nothing is asked of its steps.
const PLAIN: f64 = 0.01;
/// Share of what energy allows that counts with the radiance of a pixel that it is judged by: deep inside of dark
/// media two pictures may differ by any factor of next to nothing.
const SEEN: f64 = 0.02;
/// Radiance that counts as dark, over what energy allows: tables of the air and the light grid are in
/// 16-bit floats, which end there.
const DARK: f64 = 1e-4;

/// Tables of the air over a ground of some albedo: they take longer than a picture's pixels.
#[derive(Clone, Debug)]
pub struct KeptAir {
    ground: (Vec3, Option<f64>),
    air: Air,
}

/// The sky of a scene, with the last one's air where it fits. Without air any does.
fn sky(scene: &Scene, kept: &mut Option<KeptAir>) -> Sky {
    let inputs = sky_inputs(scene);
    let ground = (inputs.ground_albedo, inputs.sea_wind);
    let fits = |k: &KeptAir| scene.sky != SkyOf::Atmosphere || k.ground == ground;
    if let Some(kept) = kept.as_ref().filter(|k| fits(k)) {
        return Sky::with_air(&inputs, AIR_STEPS, kept.air.clone());
    }
    let sky = Sky::new(&inputs, AIR_STEPS);
    *kept = Some(KeptAir { ground, air: sky.air().clone() });
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
        // The light of another frame is met by no ray.
        let nothing = particles.is_empty() && scene.clouds.is_none();
        let field = if nothing { FieldSeen::dark() } else { renderer.field()? };
        let quality = case.preset.quality();
        let shift = DVec3::ZERO; // the field brings its own
        let frame =
            frame_uniforms(scene, &scene.camera, size, truncation, shift, &quality, 0, [true; 3]);
        let truth = SunTruth::new(tables, &particles, scene.sun.direction)?;
        let sun_depth = |point: DVec3| truth.depth(point);
        let maps = renderer.shadow_places()?;
        let between = |point: DVec3| between_texels(&maps, point, |at| truth.depth(at));
        let listed: Vec<Particle> = particles.iter().filter(|p| is_listed(p)).copied().collect();
        let made = MadeTexels::new(Column {
            tables,
            particles: &listed,
            maps: &maps,
            steps: quality.shadow_steps,
        });
        let in_steps = |point: DVec3| made.depth(point);
        let inputs = |sun_depth| ChordInputs {
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
            Exact::with_sky(scene, inputs(&sun_depth), particles.clone(), lights.clone(), sky)?
                .filtered();
        let in_truth = inputs(&sun_depth);
        let by_texels =
            [(inputs(&between), &between as SunDepth<'_>), (inputs(&in_steps), &in_steps)];
        let steps = Steps {
            exact: &exact,
            inputs: &in_truth,
            ground_depth: &sun_depth,
            particles: &particles,
            lights: &lights,
            quality: &quality,
            size: 1.0,
        };
        let view = View::new(&scene.camera, size, None, Filter::Centre);
        let count = picture.radiance.len();
        let looked_at = count.min(PIXELS);
        let mut found = Difference { steps: quality.steps, ..Difference::default() };
        let (mut transmittance, mut radiance, mut total) = (0.0, 0.0, 0.0);
        let mut most = Unexplained::default();
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
            // What a sea reflects is not composed exactly.
            if scene.is_sea() && exact.far(dir).is_finite() {
                continue;
            }
            found.pixels += 1;
            let expected = exact.pixel(dir);
            let [r, g, b, opacity] = picture.radiance[index].map(f64::from);
            let frame = ExactPixel {
                radiance: DVec3::new(r, g, b),
                transmittance: 1.0 - opacity,
                distance: expected.distance,
            };
            let (has_disc, bound) = (energy.meets_disc(dir), energy.bound(dir));
            let there = expected.radiance.length() + SEEN * 3f64.sqrt() * bound;
            let apart = |a: ExactPixel, b: ExactPixel| {
                let light = (a.radiance - b.radiance).length();
                let is_same = has_disc || light == 0.0;
                let light = if is_same { 0.0 } else { light / there };
                [(a.transmittance - b.transmittance).abs(), light]
            };
            let off = apart(frame, expected);
            found.worst = worse(found.worst, off);
            transmittance += off[0] * off[0];
            if !has_disc {
                radiance += (frame.radiance - expected.radiance).length_squared();
                total += expected.radiance.length_squared() + (DARK * bound).powi(2);
            }
            if !off.iter().any(|off| is_beyond(*off, PLAIN)) {
                continue;
            }
            let [few, many] = steps.few_and_many(dir);
            let is_cloud = all <= CLOUD;
            let left = if is_cloud { apart(many, expected) } else { [0.0; 2] };
            let mut march = apart(frame, few);
            // Where outlines are all or nothing, they are so towards the sun as well: there a texel is told from its
            // neighbours, as long as it is no wider than what the ray meets. So is the edge of a shadow on the ground, by the
            // deepest of what throws it.
            let is_shown = |p: &Particle| texel_side(&maps, centre(p)) <= f64::from(p.radius);
            let mut met = particles.iter().filter(|p| is_listed(p) && meets(p, dir));
            let in_texels_met = !is_cloud && met.all(is_shown);
            let on_ground = exact.far(dir) * dir;
            let shading = particles
                .iter()
                .filter(|p| is_listed(p) && shades(p, on_ground, scene.sun.direction, &maps));
            let thrown_by = shading.max_by(|a, b| depth(a, scale).total_cmp(&depth(b, scale)));
            let in_texels_on_ground = on_ground.is_finite() && thrown_by.is_some_and(is_shown);
            // Their rays are exact at first, and marched in the frame's few steps then.
            let mut steps = steps;
            for (inputs, depth) in &by_texels {
                if !((in_texels_met || in_texels_on_ground) && is_beyond(march[1], MOST_RADIANCE)) {
                    break;
                }
                if in_texels_met {
                    steps.inputs = inputs;
                }
                if in_texels_on_ground {
                    steps.ground_depth = *depth;
                }
                march = apart(frame, steps.few_and_many(dir)[0]);
            }
            for size in ROUNDED {
                let fails = |march| Unexplained { march, left: [0.0; 2] }.failure().is_some();
                let rounded = || apart(frame, Steps { size, ..steps }.few_and_many(dir)[0]);
                if fails(march) {
                    march = Some(rounded()).filter(|r| !fails(*r)).unwrap_or(march);
                }
            }
            most = most.or_worse(Unexplained { march, left });
        }
        if found.pixels == 0 {
            return Ok(None);
        }
        found.transmittance = (transmittance / found.pixels as f64).sqrt();
        found.radiance = if radiance == 0.0 { 0.0 } else { (radiance / total).sqrt() };
        (found.march, found.left) = (most.march, most.left);
        Ok(Some(found))
    }
}

/// Texels of the shadow maps in f64, made when they are asked for, in the frame's own steps.
struct MadeTexels<'a> {
    column: Column<'a>,
    known: Mutex<HashMap<(usize, [i64; 2]), Nodes>>,
}

impl<'a> MadeTexels<'a> {
    fn new(column: Column<'a>) -> Self {
        Self { column, known: Mutex::default() }
    }

    fn depth(&self, point: DVec3) -> f64 {
        through_nodes(self.column.maps, point, |map, texel| {
            let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
            // Look-ups lie within the maps.
            *known
                .entry((map, texel))
                .or_insert_with(|| self.column.nodes(map, texel.map(|t| t.max(0) as u32)).rounded())
        })
    }
}

/// Optical radius of a particle whose extinction is scaled by `scale`.
fn depth(particle: &Particle, scale: f64) -> f64 {
    f64::from(particle.extinction) * f64::from(particle.radius) / scale
}

fn centre(particle: &Particle) -> DVec3 {
    DVec3::from(particle.centre.map(f64::from))
}

/// Whether texels of the shadow maps that tell of a point may see a particle between it and the sun.
fn shades(particle: &Particle, point: DVec3, sun: DVec3, maps: &ShadowUniforms) -> bool {
    // Four texels tell of a point: the farthest is less than the diagonal of one away.
    let beside = texel_side(maps, point) * std::f64::consts::SQRT_2;
    let to_centre = centre(particle) - point;
    let radius = f64::from(particle.radius);
    let along = to_centre.dot(sun);
    along > -radius && (to_centre - along * sun).length() < radius + beside
}

/// Whether a ray from the eye meets a particle.
pub(super) fn meets(particle: &Particle, dir: DVec3) -> bool {
    let (centre, radius) = (centre(particle), f64::from(particle.radius));
    let nearest = centre.dot(dir).max(0.0) * dir;
    centre.distance_squared(nearest) < radius * radius
}
