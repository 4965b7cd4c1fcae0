//! Camera paths: where the camera is at some times, and a smooth way between them.
//!
//! Positions follow a cubic Hermite curve whose velocity at a key is the slope there of the parabola
//! through the key and its neighbours (Catmull and Rom's curve with the times as knots), so speed
//! and direction never jump, however unevenly the keys lie in time. Orientations follow Shoemake's
//! cubic Bezier curve of quaternions (1985) with angular velocities found in the same way. The speed at
//! a key is limited by the slower of the steps it joins: where a key and its neighbour are the same,
//! the camera rests.

mod file;

use std::path::Path;

use glam::{DQuat, DVec3};

use super::fault::{At, Checked};
use super::{Camera, CameraBasis, limits, text_file};
use crate::error::Result;

/// Distance of the point that a camera of a path looks at, m. Any would do.
const TARGET_DISTANCE: f64 = 1000.0;

/// Most of the speed at a key over the slower of the mean speeds before and after it: with more, a
/// cubic runs past its keys and back (Fritsch and Carlson, 1980). It also keeps the turns between
/// the points of a Bezier curve below half a circle.
const STEEPEST: f64 = 3.0;

/// Where the camera is at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathKey {
    /// Seconds from the path's beginning.
    pub time: f64,
    /// The pinhole, m.
    pub position: DVec3,
    /// From the camera's axes to the world's: the camera looks along its -Z, +Y is up in the picture.
    pub orientation: DQuat,
    /// Horizontal field of view from edge to edge, degrees; that of the scene where it is none.
    pub fov_x: Option<f64>,
}

/// A camera path: at least one key, by growing time.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    /// A name for people; the file's stem where the file gives none.
    pub name: String,
    keys: Vec<PathKey>,
}

impl CameraPath {
    /// Reads a path file.
    pub fn load(path: &Path) -> Result<Self> {
        let text = text_file::read(path, text_file::PATH)?;
        let mut read = Self::from_toml(&text, &path.display().to_string())?;
        if read.name.is_empty() {
            read.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
        Ok(read)
    }

    /// Reads a path from text; `place` names it in errors.
    pub fn from_toml(text: &str, place: &str) -> Result<Self> {
        file::parse(text, place)
    }

    /// A path through keys that a program has made.
    pub fn new(name: impl Into<String>, keys: Vec<PathKey>) -> Result<Self> {
        let path = Self { name: name.into(), keys };
        path.check().map_err(|f| f.in_place("path"))?;
        Ok(path)
    }

    /// Writes the path as TOML; [`CameraPath::from_toml`] reads back an equal path.
    pub fn to_toml(&self) -> Result<String> {
        file::write(self)
    }

    /// The keys.
    pub fn keys(&self) -> &[PathKey] {
        &self.keys
    }

    /// Time of the last key, s.
    pub fn end(&self) -> f64 {
        self.keys.last().map_or(0.0, |key| key.time)
    }

    /// The camera at a time (s); before the first key it stands there, after the last one there.
    /// `default` is the scene's own camera, whose field of view stands for what keys do not tell, and
    /// whose lens and shutter this one has too.
    pub fn camera(&self, time: f64, default: &Camera) -> Camera {
        let &Camera { aperture, shutter, .. } = default;
        let focus_distance = Some(default.focus());
        Camera { aperture, focus_distance, shutter, ..self.pinhole(time, default) }
    }

    fn pinhole(&self, time: f64, default: &Camera) -> Camera {
        let after = self.keys.partition_point(|key| key.time <= time);
        let fov = |key: &PathKey| key.fov_x.unwrap_or(default.fov_x);
        let (Some(a), Some(b)) =
            (after.checked_sub(1).and_then(|i| self.keys.get(i)), self.keys.get(after))
        else {
            // Outside: the nearer end. There is always a key.
            let end = if after == 0 { self.keys.first() } else { self.keys.last() };
            return end.map_or(*default, |key| camera(key.position, key.orientation, fov(key)));
        };
        let step = b.time - a.time;
        let share = ((time - a.time) / step).clamp(0.0, 1.0);
        let [from, to] = [after - 1, after].map(|key| self.rates(key, &fov));
        let hermite = |p: f64, v: f64, q: f64, w: f64| hermite([p, q], [v * step, w * step], share);
        let axis =
            |i: usize| hermite(a.position[i], from.velocity[i], b.position[i], to.velocity[i]);
        let position = DVec3::from_array([0, 1, 2].map(axis));
        let orientation = bezier(
            [a.orientation, same_side(a.orientation, b.orientation)],
            [from.spin * step, to.spin * step],
            share,
        );
        let fov_x = hermite(fov(a), from.zoom, fov(b), to.zoom);
        let limits = limits::FIELD_OF_VIEW;
        camera(position, orientation, fov_x.clamp(limits.least, limits.most))
    }

    /// How quickly things change at a key.
    fn rates(&self, key: usize, fov: &dyn Fn(&PathKey) -> f64) -> Rates {
        let here = &self.keys[key];
        let before = key.checked_sub(1).map(|i| &self.keys[i]);
        let change = |from: &PathKey, to: &PathKey| {
            let step = to.time - from.time;
            let turn = from.orientation.inverse() * same_side(from.orientation, to.orientation);
            Rates {
                step,
                velocity: (to.position - from.position) / step,
                spin: turn.to_scaled_axis() / step,
                zoom: (fov(to) - fov(from)) / step,
            }
        };
        let into = before.map(|before| change(before, here));
        let out = self.keys.get(key + 1).map(|after| change(here, after));
        match (into, out) {
            (Some(into), Some(out)) => into.between(&out),
            (Some(only), None) | (None, Some(only)) => only,
            (None, None) => Rates::default(),
        }
    }

    fn check(&self) -> Checked {
        let root = At::Root;
        let list = root.key("keys");
        if self.keys.is_empty() || self.keys.len() > limits::MOST_PATH_KEYS {
            let most = limits::MOST_PATH_KEYS;
            let found = self.keys.len();
            return Err(list.fault(format!("expected 1 to {most} keys, found {found}")));
        }
        for (i, key) in self.keys.iter().enumerate() {
            let at = list.index(i);
            at.key("time").number(key.time, &limits::PATH_TIME)?;
            at.key("position").numbers(&key.position.to_array(), &limits::COORDINATE)?;
            let turn = key.orientation.to_array();
            at.key("orientation").numbers(&turn, &limits::DIRECTION)?;
            if let Some(fov_x) = key.fov_x {
                at.key("fov_x").number(fov_x, &limits::FIELD_OF_VIEW)?;
            }
        }
        for (i, pair) in self.keys.windows(2).enumerate() {
            if pair[1].time - pair[0].time < limits::LEAST_KEY_STEP {
                return Err(list.index(i + 1).key("time").fault(format!(
                    "expected at least {} s more than the key before ({}), found {}",
                    limits::LEAST_KEY_STEP,
                    pair[0].time,
                    pair[1].time
                )));
            }
        }
        Ok(())
    }
}

/// Rates of change at a key, and the time over which they were measured.
#[derive(Clone, Copy, Default)]
struct Rates {
    step: f64,
    velocity: DVec3,
    /// Radians a second about the key's own axes.
    spin: DVec3,
    zoom: f64,
}

impl Rates {
    /// At the key where two steps meet: the parabola's slope, no steeper than [`STEEPEST`] allows.
    fn between(&self, next: &Self) -> Self {
        let share = self.step / (self.step + next.step);
        let mix = |a: DVec3, b: DVec3| {
            a.lerp(b, share).clamp_length_max(STEEPEST * a.length().min(b.length()))
        };
        let zoom = |z: f64| DVec3::new(z, 0.0, 0.0);
        Self {
            step: self.step + next.step,
            velocity: mix(self.velocity, next.velocity),
            spin: mix(self.spin, next.spin),
            zoom: mix(zoom(self.zoom), zoom(next.zoom)).x,
        }
    }
}

/// The same turn, by the quaternion on the side of another: the short way round.
fn same_side(of: DQuat, turn: DQuat) -> DQuat {
    if of.dot(turn) < 0.0 { -turn } else { turn }
}

/// Cubic from one value to another with these changes per unit at the ends; `t` from 0 to 1.
fn hermite([p, q]: [f64; 2], [v, w]: [f64; 2], t: f64) -> f64 {
    let rest = 1.0 - t;
    // As p plus a share of the difference: exact where nothing changes.
    p + (q - p) * t * t * (3.0 - 2.0 * t) + v * t * rest * rest - w * t * t * rest
}

/// Bezier curve of quaternions with these turns (rotation vectors about the own axes) per unit at
/// the ends.
fn bezier([p, q]: [DQuat; 2], [v, w]: [DVec3; 2], t: f64) -> DQuat {
    let mut points =
        [p, p * DQuat::from_scaled_axis(v / 3.0), q * DQuat::from_scaled_axis(-w / 3.0), q];
    // de Casteljau
    for last in (1..points.len()).rev() {
        for i in 0..last {
            points[i] = points[i].slerp(points[i + 1], t);
        }
    }
    points[0].normalize()
}

/// A camera by its orientation.
fn camera(position: DVec3, orientation: DQuat, fov_x: f64) -> Camera {
    let target = position + orientation * (DVec3::NEG_Z * TARGET_DISTANCE);
    Camera { position, target, up: orientation * DVec3::Y, fov_x, ..Camera::default() }
}

/// The orientation of a camera with these axes.
pub fn orientation(basis: &CameraBasis) -> DQuat {
    let axes = glam::DMat3::from_cols(basis.right, basis.up, -basis.forward);
    DQuat::from_mat3(&axes).normalize()
}

#[cfg(test)]
mod tests;
