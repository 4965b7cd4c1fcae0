//! Camera paths in the window: recorded, put together from single views, and flown along.

use crate::scene::path::{PathKey, orientation};
use crate::scene::{Camera, CameraPath, limits};

/// Between two keys of a recording, s: less than the flight's inertia, so no turn is cut short.
const RECORD_STEP: f64 = 0.1;
/// Between two views that are added one by one, s, at first.
const FIRST_STEP: f64 = 4.0;

/// What is done with the path now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Doing {
    /// Nothing.
    #[default]
    Rest,
    /// Recording, so many seconds already.
    Record(f64),
    /// Flying along it.
    Replay,
}

/// A camera path on the desk.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FlightPath {
    keys: Vec<PathKey>,
    doing: Doing,
    /// The place on the path, s from its beginning.
    pub time: f64,
    /// Between two views that are added one by one, s.
    pub step: f64,
    /// The scene's time when the first key was taken, s.
    pub begun: f64,
    /// The keys as a path, where there are any.
    made: Option<CameraPath>,
}

impl Default for FlightPath {
    fn default() -> Self {
        Self {
            keys: Vec::new(),
            doing: Doing::Rest,
            time: 0.0,
            step: FIRST_STEP,
            begun: 0.0,
            made: None,
        }
    }
}

impl FlightPath {
    /// Takes a path from a file.
    pub fn set(&mut self, path: &CameraPath, now: f64) {
        *self = Self { step: self.step, keys: path.keys().to_vec(), begun: now, ..Self::default() };
        self.made = Some(path.clone());
    }

    /// Number of keys.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// Time of the last key, s.
    pub fn end(&self) -> f64 {
        self.keys.last().map_or(0.0, |key| key.time)
    }

    /// The path, if it has keys.
    pub fn path(&self) -> Option<&CameraPath> {
        self.made.as_ref()
    }

    /// Whether it is being recorded.
    pub fn is_recording(&self) -> bool {
        matches!(self.doing, Doing::Record(_))
    }

    /// Whether it is being flown along.
    pub fn is_replaying(&self) -> bool {
        self.doing == Doing::Replay
    }

    /// Begins a new recording at this view and this time of the scene (s), or ends the one there is.
    pub fn record(&mut self, camera: &Camera, now: f64) {
        if self.is_recording() {
            self.doing = Doing::Rest;
            return;
        }
        *self = Self { step: self.step, begun: now, doing: Doing::Record(0.0), ..Self::default() };
        self.push(0.0, camera);
    }

    /// Begins to fly along it, or stops. At its end it begins anew.
    pub fn replay(&mut self) {
        self.doing = match self.doing {
            Doing::Replay => Doing::Rest,
            _ if self.keys.is_empty() => Doing::Rest,
            _ => Doing::Replay,
        };
        if self.time >= self.end() {
            self.time = 0.0;
        }
    }

    /// Adds one view, [`Self::step`] after the last; `now` is the scene's time, s.
    pub fn add(&mut self, camera: &Camera, now: f64) {
        self.doing = Doing::Rest;
        let time = if self.keys.is_empty() { 0.0 } else { self.end() + self.step };
        if self.keys.is_empty() {
            self.begun = now;
        }
        self.push(time, camera);
        self.time = time;
    }

    /// Takes the last view away.
    pub fn remove_last(&mut self) {
        self.doing = Doing::Rest;
        self.keys.pop();
        self.time = self.time.min(self.end());
        self.make();
    }

    /// Takes all views away.
    pub fn clear(&mut self) {
        *self = Self { step: self.step, ..Self::default() };
    }

    /// `seconds` go by with this view; returns the view that the path asks for instead, if it does.
    pub fn advance(&mut self, seconds: f64, camera: &Camera) -> Option<Camera> {
        match self.doing {
            Doing::Rest => None,
            Doing::Record(time) => {
                let time = time + seconds;
                self.doing = Doing::Record(time);
                self.time = time;
                if time - self.end() >= RECORD_STEP {
                    self.push(time, camera);
                }
                None
            }
            Doing::Replay => {
                self.time += seconds;
                if self.time >= self.end() {
                    self.time = self.end();
                    self.doing = Doing::Rest;
                }
                self.view(camera)
            }
        }
    }

    /// The view at the place on the path; `camera` tells what keys don't.
    pub fn view(&self, camera: &Camera) -> Option<Camera> {
        self.made.as_ref().map(|path| path.camera(self.time, camera))
    }

    fn push(&mut self, time: f64, camera: &Camera) {
        let full = self.keys.len() >= limits::MOST_PATH_KEYS || time > limits::PATH_TIME.most;
        if full {
            self.doing = Doing::Rest;
            return;
        }
        let (position, fov_x) = (camera.position, Some(camera.fov_x));
        let orientation = orientation(&camera.basis());
        self.keys.push(PathKey { time, position, orientation, fov_x });
        self.make();
    }

    fn make(&mut self) {
        // None where there are no keys; those of a camera within a scene's limits are good.
        self.made = CameraPath::new("flight", self.keys.clone()).ok();
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn camera(x: f64) -> Camera {
        let position = DVec3::new(x, 10.0, 0.0);
        Camera { position, target: position + DVec3::new(1.0, 0.5, -2.0), ..Camera::default() }
    }

    #[test]
    fn a_recorded_flight_is_flown_again() {
        let mut path = FlightPath::default();
        path.record(&camera(0.0), 7.0);
        assert!(path.is_recording());
        let mut time = 0.0;
        for _ in 0..400 {
            time += 0.03;
            assert_eq!(path.advance(0.03, &camera(5.0 * time)), None, "one flies oneself");
        }
        path.record(&camera(0.0), 0.0);
        assert!(!path.is_recording() && path.begun == 7.0);
        // A step of 0.03 s passes 0.1 s after 4.
        assert_eq!(path.len(), 101);
        let text = path.path().expect("a path").to_toml().expect("TOML");
        let read = CameraPath::from_toml(&text, "the path").expect("a path");
        assert_eq!(read.keys(), path.path().expect("a path").keys());

        path.replay();
        assert!(path.is_replaying());
        let mut views = Vec::new();
        while path.is_replaying() {
            views.push((path.time, path.advance(0.05, &camera(0.0)).expect("a view")));
        }
        for (before, view) in &views {
            let expected = camera(5.0 * (before + 0.05).min(path.end()));
            // An even flight is a straight line of even speed through its keys.
            assert!(view.position.distance(expected.position) < 1e-6, "{before} {view:?}");
            assert!(view.basis().forward.distance(expected.basis().forward) < 1e-9);
        }
        assert_eq!(path.time, path.end());
        path.replay();
        assert_eq!((path.time, path.is_replaying()), (0.0, true), "from the beginning");
    }

    #[test]
    fn views_are_added_and_taken_away() {
        let mut path = FlightPath::default();
        path.replay();
        assert!(!path.is_replaying() && path.path().is_none(), "nothing to fly along");
        path.step = 2.0;
        (0..3).for_each(|i| path.add(&camera(f64::from(i)), 1.0));
        assert_eq!((path.len(), path.end(), path.time), (3, 4.0, 4.0));
        path.time = 2.0;
        let view = path.view(&camera(9.0)).expect("a view");
        assert!(view.position.distance(camera(1.0).position) < 1e-9);
        path.time = 4.0;
        path.remove_last();
        assert_eq!((path.len(), path.end(), path.time), (2, 2.0, 2.0));
        path.clear();
        assert_eq!((path.len(), path.step), (0, 2.0));
        path.remove_last();
        assert!(path.path().is_none());
    }

    #[test]
    fn a_file_takes_the_place_of_what_was_there() {
        let mut path = FlightPath::default();
        path.record(&camera(0.0), 0.0);
        let keys = [(0.0, 0.0), (3.0, 30.0)].map(|(time, x)| PathKey {
            time,
            position: DVec3::new(x, 0.0, 0.0),
            orientation: glam::DQuat::IDENTITY,
            fov_x: None,
        });
        path.set(&CameraPath::new("file", keys.to_vec()).expect("a path"), 5.0);
        assert_eq!((path.len(), path.end(), path.is_recording()), (2, 3.0, false));
        path.time = 1.5;
        let lens = Camera { fov_x: 33.0, ..camera(0.0) };
        let view = path.view(&lens).expect("a view");
        assert!((view.position.x - 15.0).abs() < 1e-9 && view.fov_x == 33.0);
    }
}
