//! Random scenes: every parameter drawn from the whole of its range, mostly by its magnitude.

use glam::{DQuat, DVec3};

use super::{Case, MEDIA, Way};
use crate::frame::Preset;
use crate::reference::Random;
use crate::scene::limits::{self, Range};
use crate::scene::{CloudField, Ground, Medium, ParticleSpec, Scene, Sky};
use crate::tables::TableSet;

/// Least magnitude of what may be 0 too.
const LEAST: f64 = 1e-12;
/// Scenes in a row of the same medium: each needs a renderer of its own.
const SAME_MEDIUM: u64 = 64;
/// Scenes in a row that come about the same way: it needs a renderer of its own too.
const SAME_WAY: u64 = 16;
/// One in so many of these is made as in a window, which takes up to a hundred frames.
const LIVE: f64 = 4.0;
/// Of the scenes with a ground, one in so many has a sea in its place. They are drawn by numbers of their own, so that all else of a
/// scene is as it was before there were seas; of the scenes that the README names, none has one.
const SEA: f64 = 4.0;
/// Which numbers these are.
const SEAS: u64 = 20;
/// Most particles of a scene.
const MOST_PARTICLES: f64 = 200.0;

struct Draw<'a> {
    random: Random,
    tables: &'a TableSet,
}

/// Name of a random scene.
pub fn name(seed: u64, number: u64) -> String {
    format!("random {seed}:{number}")
}

/// The random scene of this seed and number; of a random quality where none is given.
pub fn case(
    seed: u64,
    number: u64,
    size: [u32; 2],
    preset: Option<Preset>,
    tables: &TableSet,
) -> Case {
    let mut media = Random::new(seed, 1, number / SAME_MEDIUM);
    let known: Vec<_> =
        MEDIA.into_iter().filter(|(p, a)| tables.scattering_for(p, *a).is_some()).collect();
    let (phase, albedo) = known[(media.unit() * known.len() as f64) as usize % known.len()];
    let drawn = Preset::ALL[(media.unit() * 4.0) as usize % 4];
    let preset = preset.unwrap_or(drawn);
    let mut draw = Draw { random: Random::new(seed, 2, number), tables };
    let mut scene = draw.scene(Medium { phase, albedo });
    let time = if draw.one_in(4.0) { 0.0 } else { draw.signed(1e-3, limits::TIME.most) };
    flood(&mut scene, Draw { random: Random::new(seed, SEAS, number), tables });
    let mut ways = Random::new(seed, 3, number / SAME_WAY);
    let way = if ways.unit() * LIVE < 1.0 { Way::Live } else { Way::Alone };
    let like = None;
    Case { name: name(seed, number), scene, time, size, preset, way, like }
}

/// Makes a sea of some grounds.
fn flood(scene: &mut Scene, mut draw: Draw<'_>) {
    if let Some(ground) = scene.effective_ground()
        && draw.one_in(SEA)
    {
        scene.ground = Some(Ground::sea(draw.of(&limits::WIND_SPEED), ground.albedo));
    }
}

impl Draw<'_> {
    fn unit(&mut self) -> f64 {
        self.random.unit()
    }

    fn one_in(&mut self, n: f64) -> bool {
        self.unit() * n < 1.0
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// By magnitude.
    fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        (low.ln() + (high / low).ln() * self.unit()).exp().clamp(low, high)
    }

    fn signed(&mut self, low: f64, high: f64) -> f64 {
        let sign = if self.one_in(2.0) { 1.0 } else { -1.0 };
        sign * self.magnitude(low, high)
    }

    /// In a range, by magnitude where it spans some; now and then its ends.
    fn of(&mut self, range: &Range) -> f64 {
        match (self.unit() * 16.0) as u32 {
            0 => range.least,
            1 => range.most,
            _ if range.least <= 0.0 => self.magnitude(LEAST, range.most),
            _ => self.magnitude(range.least, range.most),
        }
    }

    fn direction(&mut self) -> DVec3 {
        // Axes are where cross products vanish.
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        if self.one_in(5.0) {
            let axis = axes[(self.unit() * 3.0) as usize % 3];
            return if self.one_in(2.0) { axis } else { -axis };
        }
        let (z, turn) = (self.between(-1.0, 1.0), self.between(0.0, std::f64::consts::TAU));
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * turn.cos(), z, across * turn.sin())
    }

    fn shape(&mut self) -> String {
        let names: Vec<_> = self.tables.shape_names().collect();
        let index = (self.random.unit() * names.len() as f64) as usize % names.len();
        names[index].to_owned()
    }

    fn scene(&mut self, medium: Medium) -> Scene {
        let mut scene = Scene { medium, ..Scene::default() };
        // A light without the other is what the bounds of energy are sharpest for.
        if self.one_in(2.0) {
            scene.sky = Sky::Uniform { radiance: self.of(&limits::IRRADIANCE) };
        }
        scene.sun.irradiance = if self.one_in(3.0) { 0.0 } else { self.of(&limits::IRRADIANCE) };
        scene.sun.direction = self.direction();
        scene.sun.angular_diameter = self.of(&limits::ANGULAR_DIAMETER);
        if self.one_in(2.0) {
            let albedo = DVec3::new(self.unit(), self.unit(), self.unit());
            scene.ground = Some(Ground::plain(albedo));
        }
        scene.exposure = self.between(limits::EXPOSURE.least, limits::EXPOSURE.most);
        // Everything lies within this distance of a place that may be far away.
        let scale = self.magnitude(1e-2, 1e7);
        let place = if self.one_in(2.0) {
            DVec3::Y * self.magnitude(1.0, 1e4)
        } else {
            self.direction() * self.magnitude(1.0, 1e10)
        };
        let count = if self.one_in(8.0) { 0.0 } else { self.magnitude(1.0, MOST_PARTICLES) };
        scene.particles = (0..count as u32).map(|_| self.particle(place, scale)).collect();
        let reach = self.magnitude(1e-3, 1e2) * scale;
        scene.camera.position = place + self.direction() * reach;
        scene.camera.target = match scene.particles.first() {
            Some(first) if first.centre != scene.camera.position => first.centre,
            _ => scene.camera.position + self.direction() * scale,
        };
        // From below the ground nothing is defined that could be compared.
        if scene.effective_ground().is_some() {
            scene.camera.position.y = scene.camera.position.y.abs();
        }
        // At 1e10 m from the origin two places may be one.
        if scene.camera.target == scene.camera.position {
            scene.camera.target.x += 1.0;
        }
        scene.camera.up = self.direction();
        scene.camera.fov_x = self.between(limits::FIELD_OF_VIEW.least, limits::FIELD_OF_VIEW.most);
        if self.one_in(6.0) {
            scene.clouds = Some(self.field());
        }
        scene
    }

    fn particle(&mut self, place: DVec3, scale: f64) -> ParticleSpec {
        let away = self.magnitude(1e-3, 1.0) * scale;
        let turn = DQuat::from_axis_angle(self.direction(), self.between(0.0, 3.0)).normalize();
        let least = limits::RADIUS.least;
        ParticleSpec {
            centre: place + self.direction() * away,
            radius: self.magnitude(1e-2, 1.0).mul_add(scale, least).min(limits::RADIUS.most),
            extinction: self.of(&limits::EXTINCTION),
            shape: self.shape(),
            orientation: turn,
        }
    }

    /// Small enough to be made in a fraction of a second.
    fn field(&mut self) -> CloudField {
        CloudField {
            seed: (self.unit() * 4e9) as u32,
            base: self.of(&limits::CLOUD_BASE),
            thickness: self.of(&limits::CLOUD_THICKNESS),
            coverage: self.unit(),
            extinction: self.of(&limits::EXTINCTION),
            feature_size: self.of(&limits::FEATURE_SIZE),
            cell_size: self.of(&limits::CELL_SIZE),
            cells: 2 * (1 + (self.unit() * 8.0) as u32),
            rings: 1 + (self.unit() * 3.0) as u32,
            layers: 1 + (self.unit() * 6.0) as u32,
            particle_size: self.of(&limits::PARTICLE_SIZE),
            wind: DVec3::new(self.between(-200.0, 200.0), 0.0, self.between(-200.0, 200.0)),
            evolution_time: self.of(&limits::EVOLUTION_TIME),
            shapes: Vec::new(),
            // Corners have them.
            weather: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_grounds_are_seas_and_none_of_the_named_scenes() {
        let tables = TableSet::embedded().expect("tables");
        let scene = |seed, number| case(seed, number, [16, 9], None, &tables).scene;
        let scenes: Vec<_> = (0..400).map(|number| scene(7, number)).collect();
        let grounds = scenes.iter().filter(|s| s.effective_ground().is_some()).count() as f64;
        let seas: Vec<_> = scenes.iter().filter(|s| s.is_sea()).collect();
        let share = seas.len() as f64 / grounds;
        // About 300 grounds: a standard error of 0.025.
        assert!((share - 1.0 / SEA).abs() < 0.1, "{share} of {grounds}");
        let winds = seas.iter().filter_map(|s| s.ground?.wind_speed());
        let Range { least, most, .. } = limits::WIND_SPEED;
        assert!(winds.clone().all(|wind| (least..=most).contains(&wind)));
        assert!(winds.clone().any(|wind| wind > 1.0) && winds.clone().any(|wind| wind < 0.01));
        let named = [
            (601, 111),
            (600, 81),
            (603, 78),
            (505, 57),
            (903, 46),
            (903, 25),
            (1000, 6),
            (3000, 901),
            (3000, 702),
            (3000, 858),
            (3000, 925),
            (4000, 3),
        ];
        let flooded: Vec<_> = named.into_iter().filter(|(s, n)| scene(*s, *n).is_sea()).collect();
        assert!(flooded.is_empty(), "{flooded:?}");
    }
}
