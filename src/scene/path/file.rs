//! The TOML form of a camera path, and the way between it and [`CameraPath`].

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use toml::de::{DeTable, DeValue};

use super::{CameraPath, PathKey, orientation};
use crate::error::{Error, Result};
use crate::scene::fault::{self, At, Checked, Fault};
use crate::scene::file::{line_of, toml_error};
use crate::scene::{Camera, limits, vector};

/// The file as it is written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PathFile {
    #[serde(default, skip_serializing_if = "String::is_empty")]
    name: String,
    keys: Vec<KeyTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KeyTable {
    time: f64,
    #[serde(with = "vector::three")]
    position: DVec3,
    #[serde(default, with = "vector::some_three", skip_serializing_if = "Option::is_none")]
    target: Option<DVec3>,
    #[serde(default, with = "vector::some_three", skip_serializing_if = "Option::is_none")]
    up: Option<DVec3>,
    #[serde(default, with = "vector::some_quaternion", skip_serializing_if = "Option::is_none")]
    orientation: Option<DQuat>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fov_x: Option<f64>,
}

pub(super) fn parse(text: &str, place: &str) -> Result<CameraPath> {
    // An editor's byte order mark is no part of the text.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let in_text = |f: Fault| {
        let line = line_of(text, f.field());
        f.in_line(place, line)
    };
    let root = DeTable::parse(text).map_err(|e| toml_error(text, place, "", &e))?;
    tables(root.get_ref()).map_err(in_text)?;
    let reader = toml::Deserializer::from(root);
    let file: PathFile = serde_path_to_error::deserialize(reader).map_err(|e| {
        let path = fault::path_text(e.path());
        toml_error(text, place, &path, e.inner())
    })?;
    let keys = file.keys.iter().enumerate().map(|(i, key)| {
        let root = At::Root;
        let list = root.key("keys");
        key.read(list.index(i))
    });
    let keys = keys.collect::<std::result::Result<_, _>>().map_err(in_text)?;
    let path = CameraPath { name: file.name, keys };
    path.check().map_err(in_text)?;
    Ok(path)
}

pub(super) fn write(path: &CameraPath) -> Result<String> {
    let keys = path.keys.iter().map(|key| KeyTable {
        time: key.time,
        position: key.position,
        target: None,
        up: None,
        orientation: Some(key.orientation),
        fov_x: key.fov_x,
    });
    let file = PathFile { name: path.name.clone(), keys: keys.collect() };
    toml::to_string(&file).map_err(|e| Error::input("path", e.to_string()))
}

impl KeyTable {
    /// What the key means; `at` is where it stands.
    fn read(&self, at: At<'_>) -> std::result::Result<PathKey, Fault> {
        let turn = match (self.orientation, self.target) {
            (Some(turn), None) => {
                if self.up.is_some() {
                    let message = "goes with target; an orientation tells what is up itself";
                    return Err(at.key("up").fault(message));
                }
                let place = at.key("orientation");
                place.numbers(&turn.to_array(), &limits::DIRECTION)?;
                vector::unit_quaternion(turn).ok_or_else(|| {
                    place.fault("expected a quaternion [x, y, z, w] that is not zero")
                })?
            }
            (None, Some(target)) => {
                at.key("target").numbers(&target.to_array(), &limits::COORDINATE)?;
                at.key("position").numbers(&self.position.to_array(), &limits::COORDINATE)?;
                let up = self.up.unwrap_or(DVec3::Y);
                at.key("up").numbers(&up.to_array(), &limits::DIRECTION)?;
                if vector::unit(up).is_none() {
                    return Err(at.key("up").fault("expected a direction, found [0, 0, 0]"));
                }
                if vector::unit(target - self.position).is_none() {
                    let message = "expected a point other than the key's position";
                    return Err(at.key("target").fault(message));
                }
                let camera = Camera { position: self.position, target, up, ..Camera::default() };
                orientation(&camera.basis())
            }
            (Some(_), Some(_)) => {
                let message = "expected either target or orientation, found both";
                return Err(at.key("orientation").fault(message));
            }
            (None, None) => {
                return Err(at
                    .key("target")
                    .fault("is missing; a key has a target or an orientation"));
            }
        };
        let &Self { time, position, fov_x, .. } = self;
        Ok(PathKey { time, position, orientation: turn, fov_x })
    }
}

/// Refuses lists in place of tables: serde would take their elements for the fields in order.
fn tables(root: &DeTable<'_>) -> Checked {
    let Some(DeValue::Array(keys)) = root.get("keys").map(|v| v.get_ref()) else { return Ok(()) };
    match keys.iter().position(|k| matches!(k.get_ref(), DeValue::Array(_))) {
        Some(index) => {
            let root = At::Root;
            let list = root.key("keys");
            Err(list.index(index).fault("expected a table, found a list"))
        }
        None => Ok(()),
    }
}
