//! All that keys and sliders change: scene, camera, time, quality.

use super::angles::Angles;
use super::camera::FlyCamera;
use super::clock::Clock;
use super::compared::Comparison;
use super::day::Day;
use super::flight_path::FlightPath;
use super::input::Key;
use super::scale::{Resolution, SCALES};
use super::studio::Inside;
use super::wishes::Wish;
use crate::frame::{Preset, RenderSettings};
use crate::output::Format;
use crate::scene::{Medium, Scene};

/// Longest time between two frames that counts for the flight, s: on a slow machine one flies more
/// slowly instead of in leaps.
const LONGEST_FLIGHT: f64 = 0.25;
/// The same for the scene's clock, s: slow frames show the right time, and a stall is no jump.
const LONGEST_TICK: f64 = 2.0;
/// Pictures a second that are held at first, and the part of the window's sides that they begin
/// with: on a graphics card, and on a software driver.
const FIRST_RATE: [f64; 2] = [60.0, 8.0];
const FIRST_SCALE: [f32; 2] = [0.5, 0.25];

/// What is shown and how.
#[derive(Clone, Debug)]
pub(super) struct Session {
    /// The scene with everything that was changed in it, except for the camera's flight.
    pub scene: Scene,
    /// The scene as it was loaded.
    pub start: Scene,
    /// The medium that is being chosen: its tables may take a minute, so it is taken over at once.
    pub medium: Medium,
    /// The flight.
    pub fly: FlyCamera,
    /// The camera path: recorded, or flown along.
    pub path: FlightPath,
    /// Time.
    pub clock: Clock,
    /// Where the sun is put with sliders.
    sun: Angles,
    /// The time of day that it was put to last, or one that has it where it is.
    day: Day,
    /// What the renderer is made for.
    pub settings: RenderSettings,
    /// The picture's size.
    pub resolution: Resolution,
    /// Whether a view at rest is shown at the window's full size.
    pub sharp: bool,
    /// Whether the panel is shown.
    pub panel: bool,
    /// Whether all sections of the panel are open.
    pub unfold: bool,
    /// Whether the keys are shown.
    pub help: bool,
    /// What of the insides is shown in place of the picture.
    pub inside: Option<Inside>,
    /// The reference beside the frame.
    pub compare: Comparison,
    /// Which of the listed particles the panel shows.
    pub chosen_particle: usize,
    /// The file that the panel saves the scene into.
    pub save_as: String,
    /// What else was asked for.
    pub wishes: Vec<Wish>,
}

impl Session {
    /// Shows a scene from a time in seconds on.
    pub fn new(scene: Scene, time: f64) -> Self {
        Self {
            fly: FlyCamera::new(&scene.camera),
            path: FlightPath::default(),
            clock: Clock::new(time),
            sun: Angles::of(scene.sun.direction),
            day: Day::of(Angles::of(scene.sun.direction)),
            start: scene.clone(),
            medium: scene.medium,
            scene,
            settings: RenderSettings {
                preset: Preset::High,
                time_passes: true,
                live: true,
                ..Default::default()
            },
            resolution: Resolution::new(FIRST_RATE[0], FIRST_SCALE[0]),
            sharp: true,
            panel: true,
            unfold: false,
            help: false,
            inside: None,
            compare: Comparison::default(),
            chosen_particle: 0,
            save_as: "my-scene.toml".to_owned(),
            wishes: Vec::new(),
        }
    }

    /// Where to start without a graphics card: a few pictures a second.
    pub fn for_software(&mut self) {
        self.settings.preset = Preset::Low;
        self.resolution = Resolution::new(FIRST_RATE[1], FIRST_SCALE[1]);
    }

    /// A key goes down or up; `again` where it is held and repeats itself.
    pub fn key(&mut self, key: Key, down: bool, again: bool) {
        match key {
            Key::Push(push) if !again => self.fly.push(push, down),
            Key::Faster => self.fly.fast = down,
            Key::Slower if down => self.clock.change_pace(0.5),
            Key::Quicker if down => self.clock.change_pace(2.0),
            _ if !down || again => {}
            Key::Push(_) | Key::Slower | Key::Quicker => {}
            Key::Pause => self.clock.running ^= true,
            Key::Panel => self.panel ^= true,
            Key::Help => self.help ^= true,
            Key::Home => self.fly.reset(),
            Key::Record => self.path.record(&self.fly.camera(), self.clock.time),
            Key::AddView => self.path.add(&self.fly.camera(), self.clock.time),
            Key::Replay => self.path.replay(),
            Key::SaveScene => self.wishes.push(Wish::SaveScene(None)),
            Key::Compare => {
                self.compare.wanted ^= true;
                // Only a view at rest has one.
                self.clock.running &= !self.compare.wanted;
            }
            Key::Inside => self.inside = next_inside(self.inside),
            Key::SavePath => self.wishes.push(Wish::SavePath),
            Key::LoseSurface => self.wishes.push(Wish::LoseSurface),
            Key::LoseDevice => self.wishes.push(Wish::LoseDevice),
            Key::Screenshot => {
                self.wishes.push(Wish::Screenshot(vec![Format::Png, Format::Exr]));
            }
            Key::Quit => self.wishes.push(Wish::Quit),
        }
    }

    /// `seconds` of ours go by.
    pub fn step(&mut self, seconds: f64) {
        self.fly.step(seconds.clamp(0.0, LONGEST_FLIGHT));
        let seconds = seconds.clamp(0.0, LONGEST_TICK);
        self.clock.step(seconds);
        // In the scene's time, as `cumuli render` counts it, while that goes by.
        let seconds = if self.clock.running { seconds * self.clock.pace } else { seconds };
        if let Some(camera) = self.path.advance(seconds, &self.fly.camera()) {
            self.fly.set(&camera);
        }
    }

    /// Whether the picture changes by itself.
    pub fn is_lively(&self) -> bool {
        // Only generated clouds change with time.
        (self.clock.running && self.scene.clouds.is_some())
            || self.fly.is_moving()
            || self.path.is_recording()
            || self.path.is_replaying()
    }

    /// The scene as it is seen now.
    pub fn seen(&self) -> Scene {
        Scene { camera: self.fly.camera(), ..self.scene.clone() }
    }

    /// The picture's size for a window's, both in pixels; `rests` where there is time for all of them.
    pub fn picture_size(&self, window: [u32; 2], most: u32, rests: bool) -> [u32; 2] {
        let full = rests && self.sharp;
        let scale = if full { *SCALES.end() } else { self.resolution.scale };
        window.map(|side| ((side as f32 * scale).round() as u32).clamp(1, most))
    }

    /// Height and compass direction of the sun.
    pub fn sun(&self) -> Angles {
        self.sun
    }

    /// Moves the sun.
    pub fn set_sun(&mut self, sun: Angles) {
        if sun != self.sun {
            self.sun = sun;
            self.day = Day::of(sun);
            self.scene.sun.direction = sun.direction();
        }
    }

    /// Puts the sun back where the scene has it.
    pub fn restore_sun(&mut self) {
        self.scene.sun.direction = self.start.sun.direction;
        self.sun = Angles::of(self.start.sun.direction);
        self.day = Day::of(self.sun);
    }

    /// The time of day that the sun was put to last, or one that has it where it is.
    pub fn day(&self) -> Day {
        self.day
    }

    /// Puts the sun where it is at a time of day.
    pub fn set_day(&mut self, day: Day) {
        if day != self.day {
            self.set_sun(day.sun());
            self.day = day;
        }
    }

    /// The scene as it was loaded, seen from where it starts; time and quality stay.
    pub fn reset(&mut self) {
        let start = self.start.clone();
        self.show(start);
        self.fly.reset();
    }

    /// Another scene, seen from its own camera.
    pub fn load(&mut self, scene: Scene) {
        self.start = scene.clone();
        self.fly.begin(&scene.camera);
        self.show(scene);
    }

    /// The same scene after its file was changed: the flight goes on, unless the file's camera is
    /// what was changed.
    pub fn reload(&mut self, scene: Scene) {
        if scene.camera == self.start.camera {
            self.start = scene.clone();
            self.show(scene);
        } else {
            self.load(scene);
        }
    }

    fn show(&mut self, scene: Scene) {
        self.sun = Angles::of(scene.sun.direction);
        self.day = Day::of(self.sun);
        self.medium = scene.medium;
        self.scene = scene;
    }
}

/// The views of the insides one after the other, then the picture again.
fn next_inside(now: Option<Inside>) -> Option<Inside> {
    let all = Inside::ALL.map(|(inside, _)| inside);
    let next = now.and_then(|now| all.iter().position(|i| *i == now)).map_or(0, |i| i + 1);
    all.get(next).copied()
}

#[cfg(test)]
mod tests;
