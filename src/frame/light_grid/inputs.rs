//! What the light grid depends on: particles, sun, medium. It is made from its own particles,
//! around a point that moves in steps and at a time that goes in steps, so that the same scene, time
//! and camera always give the same light, and most frames find it made.

use glam::DVec3;

use super::directions::Directions;
use super::levels::{GridRoom, Levels, fitting, of_list};
use super::pass::light_words;
use super::sky_light::unevenness;
use crate::Result;
use crate::frame::gpu_data::{GRID_LEVELS, LightGridUniforms, Particle};
use crate::frame::population::Shapes;
use crate::frame::renderer::sky_inputs;
use crate::frame::rings::PlacedField;
use crate::medium::{Shape, Truncation};
use crate::scene::{CloudField, Scene};

/// Steps of the grid's time in one turnover of a field's largest features. The smallest turn over
/// ten times faster: light is then at most a 25th of their turnover old.
const STEPS_PER_TURNOVER: f64 = 256.0;
/// Steps of the anchor, in innermost cells of the field.
const ANCHOR_CELLS: f64 = 8.0;
/// Overlapping particles that the fixed-point sums have room for, at least.
const MOST_OVERLAPS: f64 = 65_536.0;

/// How finely the grid is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridSettings {
    /// Factor on the default number of cells along an axis.
    pub fineness: f64,
    /// Directions that light travels in.
    pub directions: Directions,
    /// Turns of scattering and sweeping, at least 1: coarsest level, each finer level.
    pub turns: [u32; 2],
    /// In slices: where there is nothing yet to show meanwhile, a rough solution comes first.
    pub draft: bool,
    /// Steps of a solution that a frame makes, 0 for all: the matter is one, then every turn of the largest level;
    /// of much smaller ones as many as have as many cells.
    pub slice: u32,
}

/// Turns of a solution for one of a draft, after the first.
const DRAFT_TURNS: u32 = 4;

/// Radius of the even ball with the same second moment as each shape's density, in its radii: where it is small over
/// the cells, a shape counts as that.
#[derive(Clone, Debug, PartialEq)]
pub struct Spreads(pub Vec<f32>);

/// Points of a shape that its second moment is taken from.
const SPREAD_POINTS: u32 = 4096;

impl Spreads {
    /// Of the shapes of the tables.
    pub fn new(shapes: &Shapes) -> Result<Self> {
        let mut spreads = Vec::new();
        while let Some(name) = shapes.name(spreads.len() as u32) {
            let shape = Shape::new(name.parse()?);
            let (mut mass, mut moment) = (0.0, 0.0);
            for i in 0..SPREAD_POINTS {
                let point = ball_point(i);
                let density = shape.density(point);
                mass += density;
                moment += density * point.length_squared();
            }
            // An even ball of radius r has the moment 3/5 r^2.
            let spread = if mass > 0.0 { (5.0 / 3.0 * moment / mass).sqrt() } else { 1.0 };
            spreads.push(spread.min(1.0) as f32);
        }
        Ok(Self(spreads))
    }
}

/// Point of an even sequence in the unit ball (Roberts 2018, in three dimensions).
fn ball_point(index: u32) -> DVec3 {
    const STEPS: [f64; 3] =
        [0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3];
    let [u, v, w] = STEPS.map(|s| (0.5 + f64::from(index) * s).fract());
    let z = 2.0 * u - 1.0;
    let across = (1.0 - z * z).sqrt();
    let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
    w.cbrt() * DVec3::new(across * cos, z, across * sin)
}

/// Everything the grid's light depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct GridInputs {
    /// Where it lies.
    pub levels: Levels,
    /// Uniforms of the passes.
    pub uniforms: LightGridUniforms,
    /// The cloud field around the anchor.
    pub clouds: Option<PlacedField>,
    /// The field wherever the anchor is.
    field: Option<CloudField>,
    /// Listed particles, relative to the anchor.
    pub listed: Vec<Particle>,
    /// Turns of scattering and sweeping.
    pub turns: [u32; 2],
    /// Room for cells that keep light.
    pub room: GridRoom,
    /// m, the anchor at time 0; it drifts with the field.
    start: DVec3,
    /// m/s.
    wind: DVec3,
    /// s, the time of the particles.
    epoch: f64,
    /// s, from one epoch to the next.
    epoch_length: f64,
}

/// Epochs after which a solution is too old to be shown until the next is whole: a third of the
/// turnover of a field's smallest features.
const OLDEST_EPOCHS: f64 = 8.0;
/// Steps of the anchor by which such a solution may lie beside: it then reaches a third of the
/// innermost ring beyond the eye.
const FARTHEST_STEPS: f64 = 2.0;
/// Turns of the coarsest level over listed particles, at least: with its few cells they cost nothing. The dark side
/// of eight coincident isotropic spheres of thickness 40, seen over its traced light: with 9 turns 0.44, with 33 1.04.
const LIST_TURNS: u32 = 33;
/// Turns of each finer level over listed particles, at least. The lit side of eight coincident isotropic spheres of
/// thickness 40, seen over its traced light: with 3 turns 0.86; the bound of the test is a tenth.
const LIST_FINER_TURNS: u32 = 5;
/// Turns of a coarsest level with about as many cells as the others, at most: each costs as much as theirs.
const LARGE_TURNS: u32 = 9;
/// Cells over those of the largest level up to which a step of a level is less than a step: a list's next coarser level
/// has an eighth, and those over a field's last ring; those of its rings have about as many each.
pub(super) const SMALL_LEVEL: f64 = 0.25;
/// Steps of a field's coverage, and factor on its extinction, up to which its light may stand for that of the
/// other for some frames: a slider that is drawn does not begin anew with each of them.
const COVERAGE_STEP: f64 = 0.05;
const EXTINCTION_FACTOR: f64 = 1.25;
/// Cosine of the angle by which the sun may turn while a solution is made for it: 5 degrees.
const SUN_JUMP: f32 = 0.996_194_7;

impl GridInputs {
    /// Of a scene at a time (s); none where there is no particle. Extinctions are scaled by `truncation`. There is
    /// room for `capacity` particles, and for as many slots as `room` says or more.
    pub fn new(
        scene: &Scene,
        shapes: &Shapes,
        truncation: &Truncation,
        settings: &GridSettings,
        time: f64,
        (capacity, room): (u32, GridRoom),
    ) -> Result<Option<Self>> {
        let camera = scene.camera.position;
        let epoch_length =
            scene.clouds.as_ref().map_or(0.0, |f| f.evolution_time / STEPS_PER_TURNOVER);
        let scale = truncation.scale(scene.medium.albedo);
        let words = light_words(scene.medium.albedo);
        let fine = (settings.fineness, settings.directions.count());
        let (levels, epoch, start, wind) = match &scene.clouds {
            Some(field) => {
                let epoch = (time / epoch_length).floor() * epoch_length;
                let step = ANCHOR_CELLS * field.cell_size;
                let drifted = ((camera - field.wind * time) / step).round() * step;
                // Altitudes are those of the ground: the field may only drift sideways here.
                let start = DVec3::new(drifted.x, 0.0, drifted.z);
                let anchor = start + field.wind * epoch;
                let usual = fitting(field, anchor, fine, words, false);
                let levels = if usual.cells() == room.too_many_cells {
                    fitting(field, anchor, fine, words, true)
                } else {
                    usual
                };
                (levels, epoch, start, field.wind)
            }
            None => match of_list(&scene.particles, fine, words) {
                Some(levels) => {
                    let anchor = levels.anchor;
                    (levels, 0.0, anchor, DVec3::ZERO)
                }
                None => return Ok(None),
            },
        };
        let mut listed = shapes.listed(&scene.particles, levels.anchor)?;
        scale_particles(&mut listed, scale);
        let around = Scene {
            camera: crate::scene::Camera { position: levels.anchor, ..scene.camera },
            clouds: scene.clouds.clone(),
            particles: Vec::new(),
            ..scene.clone()
        };
        let mut clouds = shapes.field(&around, epoch, listed.len() as u32, capacity)?;
        if let Some(clouds) = &mut clouds {
            scale_field(clouds, scale);
        }
        let densest = listed.iter().map(|p| p.extinction).fold(0.0f32, f32::max);
        let densest = clouds.as_ref().map_or(densest, |c| densest.max(c.uniforms.extinction));
        let overlaps = if clouds.is_some() { MOST_OVERLAPS } else { listed.len() as f64 + 1.0 };
        let mut uniforms = <LightGridUniforms as bytemuck::Zeroable>::zeroed();
        let [x, y, z] = scene.sun.direction.as_vec3().to_array();
        uniforms.sun = [x, y, z, -levels.anchor.y as f32];
        let altitude =
            scene.clouds.as_ref().map_or(levels.anchor.y, |f| f.base + 0.5 * f.thickness);
        let axes = Directions::with_axes(levels.directions / 2).unwrap_or_default().axes();
        let sky = unevenness(&sky_inputs(scene), altitude, axes);
        uniforms.sky.as_flattened_mut()[..sky.len()].copy_from_slice(&sky);
        uniforms.axes = axes.len() as u32;
        uniforms.widest = levels.widest as u32;
        uniforms.of_list = u32::from(clouds.is_none());
        let has_above = clouds.is_some() && levels.has_beyond_first(&scene.particles);
        uniforms.has_above = u32::from(has_above);
        for (slot, axis) in uniforms.axis.iter_mut().zip(axes) {
            *slot = axis.as_vec4().to_array();
        }
        uniforms.levels = levels.levels.len() as u32;
        uniforms.cells = levels.cells();
        uniforms.longest = levels.longest();
        uniforms.words = levels.words();
        let coverage = scene.clouds.as_ref().map_or(1.0, |field| field.coverage);
        let room = room.at_least(&levels, coverage, words);
        uniforms.matter_room = room.matter;
        uniforms.kept_room = room.kept;
        uniforms.moment_first = truncation.moments[0] as f32;
        uniforms.moment_second = truncation.moments[1] as f32;
        uniforms.albedo = truncation.albedo(scene.medium.albedo) as f32;
        // Half of the range is left for balls that are denser in a cell than their mean.
        uniforms.quantum =
            (f64::from(densest).max(1e-30) * overlaps.min(MOST_OVERLAPS) / 2.0_f64.powi(31)) as f32;
        uniforms.spreads = shapes.count();
        for (slot, level) in uniforms.level.iter_mut().zip(&levels.levels).take(GRID_LEVELS) {
            *slot = *level;
        }
        let [coarsest, finer] = settings.turns;
        let turns = match clouds {
            // Fields of as many rings as there may be levels have none that is coarse.
            Some(_) if !levels.has_small_coarsest() => [coarsest.min(LARGE_TURNS), finer],
            Some(_) => [coarsest, finer],
            None => [coarsest.max(LIST_TURNS), finer.max(LIST_FINER_TURNS)],
        };
        let field = scene.clouds.clone();
        let inputs = Self {
            levels,
            uniforms,
            clouds,
            field,
            listed,
            turns,
            room,
            start,
            wind,
            epoch,
            epoch_length,
        };
        Ok(Some(inputs))
    }

    /// Where the anchor is at a time (s), m.
    pub fn anchor_at(&self, time: f64) -> DVec3 {
        self.start + self.wind * time
    }

    /// Steps of a solution: the matter, and the turns of all levels.
    pub fn steps(&self) -> u32 {
        1 + (0..self.levels.levels.len()).map(|level| self.turns_of(level)).sum::<u32>()
    }

    /// The same with a few turns: light that is about right, in less than half of the time.
    pub fn draft(&self) -> Self {
        Self {
            turns: self.turns.map(|turns| 1 + turns.saturating_sub(1) / DRAFT_TURNS),
            ..self.clone()
        }
    }

    /// Whether a solution of these inputs may stand for that of others for a while: the same cells
    /// over nearly the same matter.
    pub fn is_near(&self, other: &Self) -> bool {
        let length =
            |i: &Self| i.clouds.as_ref().map_or(0.0, |c| f64::from(c.uniforms.ring[0].cell_size));
        let beside = (self.start - other.start).abs().max_element();
        self.levels.levels == other.levels.levels
            && self.listed == other.listed
            && match (&self.field, &other.field) {
                (Some(field), Some(other)) => are_near(field, other),
                (field, other) => field.is_none() && other.is_none(),
            }
            && beside <= FARTHEST_STEPS * ANCHOR_CELLS * length(self)
            && (self.epoch - other.epoch).abs()
                <= OLDEST_EPOCHS * self.epoch_length.max(other.epoch_length)
    }

    /// Whether their suns are nearly the same.
    pub fn has_sun_near(&self, other: &Self) -> bool {
        let [a, b] = [self, other].map(|i| glam::Vec4::from(i.uniforms.sun).truncate());
        a.dot(b) >= SUN_JUMP
    }

    /// Step after the next `slice` ones from `done` on, where those of a level that is small over the largest one
    /// count by its cells; at least one.
    pub fn steps_within(&self, done: u32, slice: u32) -> u32 {
        let levels = &self.levels.levels;
        let of_level = |l: usize| {
            let share = self.levels.over_largest(l);
            let work = if share <= SMALL_LEVEL { share } else { 1.0 };
            std::iter::repeat_n(work, self.turns_of(l) as usize)
        };
        let steps = std::iter::once(1.0).chain((0..levels.len()).rev().flat_map(of_level));
        end_of_slice(steps, done, slice)
    }

    /// Turns of a level.
    pub fn turns_of(&self, level: usize) -> u32 {
        self.turns[usize::from(level + 1 != self.levels.levels.len())]
    }
}

/// Where the slice of these steps' work ends that begins with step `done`: at least one step is in it.
fn end_of_slice(steps: impl Iterator<Item = f64>, done: u32, slice: u32) -> u32 {
    let (mut end, mut work) = (done, 0.0);
    for step in steps.skip(done as usize) {
        if work >= f64::from(slice.max(1)) {
            break;
        }
        (end, work) = (end + 1, work + step);
    }
    end
}

/// Whether two fields have about the same clouds in the same places.
fn are_near(field: &CloudField, other: &CloudField) -> bool {
    let within = |a: &CloudField, b: &CloudField| a.extinction <= EXTINCTION_FACTOR * b.extinction;
    let (coverage, extinction) = (other.coverage, other.extinction);
    (field.coverage - coverage).abs() <= COVERAGE_STEP
        && within(field, other)
        && within(other, field)
        && CloudField { coverage, extinction, ..field.clone() } == *other
}

/// Scales the extinction of listed particles.
pub fn scale_particles(particles: &mut [Particle], scale: f64) {
    for p in particles {
        p.extinction *= scale as f32;
        p.optical_radius *= scale as f32;
    }
}

/// Scales the extinction of a cloud field.
pub fn scale_field(clouds: &mut PlacedField, scale: f64) {
    clouds.uniforms.extinction *= scale as f32;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The matter, many turns of a few cells, five of an eighth, five of the whole.
    fn steps() -> impl Iterator<Item = f64> {
        std::iter::once(1.0).chain([0.015_625; 33]).chain([0.125; 5]).chain([1.0; 5])
    }

    #[test]
    fn slices_make_every_step_once() {
        for slice in [0, 1, 2, 3, 100, u32::MAX] {
            let (mut done, mut frames) = (0, 0);
            while done < 44 {
                let end = end_of_slice(steps(), done, slice);
                assert!(end > done && end <= 44, "{slice}: from {done} to {end}");
                (done, frames) = (end, frames + 1);
            }
            let work: f64 = steps().sum();
            let least = (work / f64::from(slice.max(1))).ceil() as u32;
            // A slice may end a step late, none does nothing.
            assert!(frames <= least.max(1), "{slice}: {frames} frames for the work of {least}");
        }
        // All turns of the coarsest level in a frame with the matter, where two steps are wanted.
        assert_eq!(end_of_slice(steps(), 0, 2), 1 + 33 + 4);
    }
}
