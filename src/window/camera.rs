//! A camera that flies: the mouse turns it, keys push it.

use glam::DVec3;

use super::angles::Angles;
use crate::scene::{Camera, limits};

/// Speed at the start, m/s: through a cloud in a few seconds.
const FIRST_SPEED: f64 = 100.0;
/// Slowest and fastest, m/s: a walk, and to the horizon in half a minute.
const SPEEDS: std::ops::RangeInclusive<f64> = 1.0..=5000.0;
/// A notch of the wheel: four of them double the speed.
const NOTCH: f64 = 1.189;
/// With shift.
const FASTER: f64 = 5.0;
/// Time in which the velocity comes to 1 / e of where the keys want it, s: smooth, not sluggish.
const INERTIA: f64 = 0.12;
/// How fast a stick at its end turns the view, degrees/s: half around in two seconds.
const TURN: f64 = 90.0;
/// Below this speed the camera stands, m/s: a pixel of the nearest particle in a minute.
const STANDING: f64 = 1e-3;
/// Steepest look up or down, degrees: straight up, a turn of the head would be a jump.
const STEEPEST: f64 = 89.5;
/// From the camera to its target, m: far enough that single digits of both don't turn the view.
const TARGET_DISTANCE: f64 = 1000.0;

/// A direction of a push, in the camera's axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Push {
    Forward,
    Back,
    Left,
    Right,
    Up,
    Down,
}

impl Push {
    const COUNT: usize = 6;

    /// Right, up along the world's axis, and forward.
    fn axes(self) -> DVec3 {
        match self {
            Self::Forward => DVec3::Z,
            Self::Back => DVec3::NEG_Z,
            Self::Left => DVec3::NEG_X,
            Self::Right => DVec3::X,
            Self::Up => DVec3::Y,
            Self::Down => DVec3::NEG_Y,
        }
    }
}

const PUSHES: [Push; Push::COUNT] =
    [Push::Forward, Push::Back, Push::Left, Push::Right, Push::Up, Push::Down];

/// What sticks ask for: parts of the whole speed, and of the quickest turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Lean {
    /// Right, up along the world's axis, forward: each from -1 to 1.
    pub way: DVec3,
    /// To the right, and up: from -1 to 1.
    pub turn: [f64; 2],
}

/// The camera and what moves it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FlyCamera {
    /// Where the flight began.
    start: Camera,
    /// Where it was put last; lens and field of view are its.
    base: Camera,
    position: DVec3,
    view: Angles,
    velocity: DVec3,
    /// Whether it has left `base`.
    moved: bool,
    held: [bool; Push::COUNT],
    /// Pressed since the last step, even if released again: no tap is lost in a slow frame.
    tapped: [bool; Push::COUNT],
    /// What sticks ask for besides.
    leant: Lean,
    /// Whether shift is held.
    pub fast: bool,
    /// m/s, without shift.
    pub speed: f64,
}

impl FlyCamera {
    /// Starts at a scene's camera, and shows exactly its view until it is moved.
    pub fn new(camera: &Camera) -> Self {
        Self {
            start: *camera,
            base: *camera,
            position: camera.position,
            view: Angles::of(camera.basis().forward),
            velocity: DVec3::ZERO,
            moved: false,
            held: [false; Push::COUNT],
            tapped: [false; Push::COUNT],
            leant: Lean::default(),
            fast: false,
            speed: FIRST_SPEED,
        }
    }

    /// The camera for the picture.
    pub fn camera(&self) -> Camera {
        if !self.moved {
            return self.base;
        }
        Camera {
            position: self.position,
            target: self.position + TARGET_DISTANCE * self.view.direction(),
            up: DVec3::Y,
            ..self.base
        }
    }

    /// Puts it here, at rest; it shows exactly this camera's view until it is moved.
    pub fn set(&mut self, camera: &Camera) {
        let start = self.start;
        let (fast, speed, held, leant) = (self.fast, self.speed, self.held, self.leant);
        *self = Self { fast, speed, held, leant, ..Self::new(camera) };
        self.start = start;
    }

    /// Where the flight began, and where [`Self::reset`] leads.
    pub fn start(&self) -> &Camera {
        &self.start
    }

    /// Back to where it started, at rest.
    pub fn reset(&mut self) {
        let start = self.start;
        self.set(&start);
    }

    /// Begins anew at the camera of another scene.
    pub fn begin(&mut self, camera: &Camera) {
        self.start = *camera;
        self.reset();
    }

    /// A key goes down or up.
    pub fn push(&mut self, push: Push, down: bool) {
        self.held[push as usize] = down;
        self.tapped[push as usize] |= down;
    }

    /// Sticks are leant so from now on.
    #[cfg(any(feature = "gamepad", test))]
    pub fn lean(&mut self, lean: Lean) {
        if lean.way.is_finite() && lean.turn.iter().all(|turn| turn.is_finite()) {
            self.leant = lean;
        }
    }

    /// All keys go up, as when another window gets them.
    pub fn release(&mut self) {
        self.leant = Lean::default();
        self.held = [false; Push::COUNT];
        self.tapped = [false; Push::COUNT];
        self.fast = false;
    }

    /// The wheel turns by so many notches.
    pub fn wheel(&mut self, notches: f64) {
        let speed = self.speed * NOTCH.powf(notches);
        // A broken driver's NaN changes nothing.
        if speed.is_finite() {
            self.speed = speed.clamp(*SPEEDS.start(), *SPEEDS.end());
        }
    }

    /// The mouse moves by so many pixels, each `degrees` wide, to the right and down.
    pub fn look(&mut self, pixels: [f64; 2], degrees: f64) {
        let azimuth = self.view.azimuth + pixels[0] * degrees;
        let elevation = self.view.elevation - pixels[1] * degrees;
        if azimuth.is_finite() && elevation.is_finite() {
            self.view.azimuth = azimuth.rem_euclid(360.0);
            self.view.elevation = elevation.clamp(-STEEPEST, STEEPEST);
            self.moved = true;
        }
    }

    /// Whether it moves, or will with the next step.
    pub fn is_moving(&self) -> bool {
        self.velocity != DVec3::ZERO
            || self.leant != Lean::default()
            || self.held.contains(&true)
            || self.tapped.contains(&true)
    }

    /// Moves for `seconds`. How the time is cut into steps makes no difference, unless sticks turn the
    /// view meanwhile.
    pub fn step(&mut self, seconds: f64) {
        let [right, up] = self.leant.turn;
        if [right, up] != [0.0; 2] {
            self.look([right, -up], TURN * seconds);
        }
        let wanted = self.wanted();
        self.tapped = [false; Push::COUNT];
        // The velocity decays towards the wanted one; the way is its integral.
        let left = (-seconds / INERTIA).exp();
        let difference = self.velocity - wanted;
        let way = wanted * seconds + difference * (INERTIA * (1.0 - left));
        self.velocity = wanted + difference * left;
        if wanted == DVec3::ZERO && self.velocity.length() < STANDING {
            self.velocity = DVec3::ZERO;
        }
        if way != DVec3::ZERO {
            // Nowhere a scene's camera may not be, its target included.
            let most = DVec3::splat(limits::COORDINATE.most - TARGET_DISTANCE);
            self.position = (self.position + way).clamp(-most, most);
            self.moved = true;
        }
    }

    /// The velocity that the keys ask for, m/s.
    fn wanted(&self) -> DVec3 {
        let pushed =
            PUSHES.into_iter().filter(|p| self.held[*p as usize] || self.tapped[*p as usize]);
        let axes: DVec3 = pushed.map(Push::axes).sum();
        let forward = self.view.direction();
        let right = Angles { azimuth: self.view.azimuth + 90.0, elevation: 0.0 }.direction();
        let along = |axes: DVec3| right * axes.x + DVec3::Y * axes.y + forward * axes.z;
        let direction = along(axes).normalize_or_zero() + along(self.leant.way);
        let speed = if self.fast { FASTER * self.speed } else { self.speed };
        // Sticks ask for parts of the speed; nothing asks for more than all of it.
        direction.clamp_length_max(1.0) * speed
    }
}

#[cfg(test)]
mod tests;
