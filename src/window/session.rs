//! All that keys and sliders change: scene, camera, time, quality.

use super::angles::Angles;
use super::camera::FlyCamera;
use super::clock::Clock;
use crate::frame::{Preset, RenderSettings};
use crate::scene::Scene;

/// Longest time between two frames that counts for the flight, s: on a slow machine one flies more
/// slowly instead of in leaps.
const LONGEST_FLIGHT: f64 = 0.25;
/// The same for the scene's clock, s: slow frames show the right time, and a stall is no jump.
const LONGEST_TICK: f64 = 2.0;
/// Smallest and largest side of the picture as a part of the window's.
pub(super) const SCALES: std::ops::RangeInclusive<f32> = 0.1..=1.0;

/// What is shown and how.
#[derive(Clone, Debug)]
pub(super) struct Session {
    /// The scene with everything that was changed in it, except for the camera's flight.
    pub scene: Scene,
    start: Scene,
    /// The flight.
    pub fly: FlyCamera,
    /// Time.
    pub clock: Clock,
    /// Where the sun is put with sliders.
    sun: Angles,
    /// What the renderer is made for.
    pub settings: RenderSettings,
    /// The picture's sides as a part of the window's, in [`SCALES`].
    pub scale: f32,
    /// Whether the panel is shown.
    pub panel: bool,
}

impl Session {
    /// Shows a scene from a time in seconds on.
    pub fn new(scene: Scene, time: f64) -> Self {
        Self {
            fly: FlyCamera::new(&scene.camera),
            clock: Clock::new(time),
            sun: Angles::of(scene.sun.direction),
            start: scene.clone(),
            scene,
            settings: RenderSettings {
                preset: Preset::High,
                time_passes: true,
                live: true,
                ..Default::default()
            },
            scale: *SCALES.end(),
            panel: true,
        }
    }

    /// Where to start without a graphics card: a few pictures a second.
    pub fn for_software(&mut self) {
        self.settings.preset = Preset::Low;
        self.scale = 0.5;
    }

    /// `seconds` of ours go by.
    pub fn step(&mut self, seconds: f64) {
        self.fly.step(seconds.clamp(0.0, LONGEST_FLIGHT));
        self.clock.step(seconds.clamp(0.0, LONGEST_TICK));
    }

    /// Whether the picture changes by itself.
    pub fn is_lively(&self) -> bool {
        // Only generated clouds change with time.
        (self.clock.running && self.scene.clouds.is_some()) || self.fly.is_moving()
    }

    /// The scene as it is seen now.
    pub fn seen(&self) -> Scene {
        Scene { camera: self.fly.camera(), ..self.scene.clone() }
    }

    /// The picture's size for a window's, both in pixels.
    pub fn picture_size(&self, window: [u32; 2], most: u32) -> [u32; 2] {
        window.map(|side| ((side as f32 * self.scale).round() as u32).clamp(1, most))
    }

    /// Height and compass direction of the sun.
    pub fn sun(&self) -> Angles {
        self.sun
    }

    /// Moves the sun.
    pub fn set_sun(&mut self, sun: Angles) {
        if sun != self.sun {
            self.sun = sun;
            self.scene.sun.direction = sun.direction();
        }
    }

    /// The scene as it was loaded, seen from where it starts; time and quality stay.
    pub fn reset(&mut self) {
        self.scene = self.start.clone();
        self.sun = Angles::of(self.scene.sun.direction);
        self.fly.reset();
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::camera::Push;
    use super::*;

    fn session() -> Session {
        Session::new(Scene { clouds: Some(Default::default()), ..Scene::default() }, 5.0)
    }

    #[test]
    fn untouched_it_shows_the_scene_as_it_was_loaded() {
        let mut session = session();
        session.clock.running = false;
        session.set_sun(session.sun());
        session.step(1.0);
        assert_eq!(session.seen(), session.start, "to the bit");
        assert!(!session.is_lively());
    }

    #[test]
    fn only_what_changes_is_lively() {
        let mut session = session();
        assert!(session.is_lively(), "clouds drift");
        session.scene.clouds = None;
        assert!(!session.is_lively(), "listed particles don't");
        session.fly.push(Push::Left, true);
        assert!(session.is_lively());
        session.fly.push(Push::Left, false);
        (0..100).for_each(|_| session.step(0.1));
        assert!(!session.is_lively(), "it has come to rest");
    }

    #[test]
    fn a_stall_is_no_jump() {
        let mut session = session();
        session.fly.push(Push::Up, true);
        session.step(3600.0);
        assert_eq!(session.clock.time, 5.0 + LONGEST_TICK);
        let (before, after) = (session.start.camera, session.seen().camera);
        let way = after.position.distance(before.position);
        assert!(way > 0.0 && way < session.fly.speed * LONGEST_FLIGHT, "{way} m");
        session.step(-1.0);
        assert_eq!(session.clock.time, 5.0 + LONGEST_TICK, "a clock set back changes nothing");
        assert_eq!(session.seen().camera, after);
    }

    #[test]
    fn the_sun_goes_where_it_is_put_and_comes_back() {
        let mut session = session();
        session.set_sun(Angles { azimuth: 90.0, elevation: 30.0 });
        let direction = session.seen().sun.direction;
        assert!((direction - DVec3::new(0.75_f64.sqrt(), 0.5, 0.0)).length() < 1e-12);
        session.fly.push(Push::Up, true);
        session.step(0.1);
        session.fly.push(Push::Up, false);
        assert_ne!(session.seen().camera, session.start.camera);
        session.reset();
        assert_eq!(session.seen(), session.start);
    }

    #[test]
    fn every_window_has_a_picture_of_at_least_a_pixel() {
        let mut session = session();
        for (scale, window, picture) in [
            (1.0, [1280, 720], [1280, 720]),
            (0.5, [1281, 3], [641, 2]),
            (0.1, [1, 4], [1, 1]),
            (1.0, [9000, 10], [8192, 10]),
        ] {
            session.scale = scale;
            assert_eq!(session.picture_size(window, 8192), picture);
        }
    }
}
