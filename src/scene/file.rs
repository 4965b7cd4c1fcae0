//! The TOML form of a scene, and the way between it and [`Scene`].

use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::{Deserialize, Serialize};
use toml::de::{DeTable, DeValue};

use super::fault::{self, At, Fault};
use super::{Camera, CloudField, Ground, GroundKind, Medium, ParticleSpec, Scene, Sky, Sun};
use super::{check, particles, vector};
use crate::error::{Error, Result};

/// The file as it is written; [`Scene`] is what it means.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    #[serde(default, skip_serializing_if = "String::is_empty")]
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    particles_file: Option<PathBuf>,
    camera: Camera,
    sun: Sun,
    #[serde(default)]
    sky: SkyTable,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ground: Option<GroundTable>,
    #[serde(default)]
    medium: Medium,
    #[serde(default)]
    output: Output,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    clouds: Option<CloudField>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    particles: Vec<ParticleSpec>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SkyTable {
    kind: SkyKind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    radiance: Option<f64>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum SkyKind {
    Uniform,
    Atmosphere,
}

impl Default for SkyTable {
    fn default() -> Self {
        Self { kind: SkyKind::Atmosphere, radiance: None }
    }
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GroundTable {
    #[serde(default, skip_serializing_if = "GroundName::is_plain")]
    kind: GroundName,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    wind_speed: Option<f64>,
    #[serde(with = "vector::three")]
    albedo: DVec3,
}

#[derive(Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum GroundName {
    #[default]
    Plain,
    Sea,
}

impl GroundName {
    fn is_plain(&self) -> bool {
        *self == Self::Plain
    }
}

impl GroundTable {
    fn ground(&self, at: At<'_>) -> std::result::Result<Ground, Fault> {
        match (self.kind, self.wind_speed) {
            (GroundName::Plain, None) => Ok(Ground::plain(self.albedo)),
            (GroundName::Sea, Some(wind_speed)) => Ok(Ground::sea(wind_speed, self.albedo)),
            (GroundName::Plain, Some(_)) => Err(at
                .key("wind_speed")
                .fault("only a sea has a wind_speed, expected kind = \"sea\" with it")),
            (GroundName::Sea, None) => Err(at
                .key("wind_speed")
                .fault("is missing, a sea needs it: expected a speed in m/s")),
        }
    }
}

impl From<Ground> for GroundTable {
    fn from(Ground { kind, albedo }: Ground) -> Self {
        let (kind, wind_speed) = match kind {
            GroundKind::Plain => (GroundName::Plain, None),
            GroundKind::Sea { wind_speed } => (GroundName::Sea, Some(wind_speed)),
        };
        Self { kind, wind_speed, albedo }
    }
}

#[derive(Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Output {
    exposure: f64,
}

pub(super) fn parse(text: &str, place: &str, base_dir: &Path) -> Result<Scene> {
    // An editor's byte order mark is no part of the text.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let not_toml = |e: toml::de::Error| toml_error(text, place, "", &e);
    let root = DeTable::parse(text).map_err(not_toml)?;
    tables(root.get_ref()).map_err(|f| {
        let line = line_of(text, f.field());
        f.in_line(place, line)
    })?;
    let reader = toml::Deserializer::from(root);
    let file: SceneFile = serde_path_to_error::deserialize(reader).map_err(|e| {
        let path = fault::path_text(e.path());
        toml_error(text, place, &path, e.inner())
    })?;
    let particles_file = file.particles_file.clone();
    let mut scene = checked(file).map_err(|f| {
        let line = line_of(text, f.field());
        f.in_line(place, line)
    })?;
    if let Some(map) = scene.clouds.as_mut().and_then(|clouds| clouds.weather.as_mut()) {
        map.file = base_dir.join(&map.file);
        *map = map.read_again().map_err(|error| {
            let clouds = At::Root.key("clouds");
            let fault =
                clouds.key("weather").key("file").fault(fault::tidy(&error.to_string(), 300));
            fault.in_line(place, line_of(text, "clouds.weather.file"))
        })?;
    }
    if let Some(named) = particles_file {
        let path = base_dir.join(&named);
        if named.as_os_str().is_empty() || !path.exists() {
            let named = named.display();
            let message = format!("expected a JSON file of particles, found none at `{named}`");
            let fault = At::Root.key("particles_file").fault(message);
            return Err(fault.in_line(place, line_of(text, "particles_file")));
        }
        scene.particles.extend(particles::load(&path)?);
        // Each list is within the limits; their sum may not be.
        check::scene(&scene).map_err(|f| f.in_place(place))?;
    }
    Ok(scene)
}

/// Refuses lists in place of tables: serde would take their elements for the fields in order.
fn tables(root: &DeTable<'_>) -> std::result::Result<(), Fault> {
    const TABLES: [&str; 7] = ["camera", "sun", "sky", "ground", "medium", "output", "clouds"];
    let at = At::Root;
    for name in TABLES {
        if matches!(root.get(name).map(|v| v.get_ref()), Some(DeValue::Array(_))) {
            let message = format!("expected one table, [{name}] or {{...}}, found a list");
            return Err(at.key(name).fault(message));
        }
    }
    if let Some(DeValue::Table(clouds)) = root.get("clouds").map(|v| v.get_ref())
        && matches!(clouds.get("weather").map(|v| v.get_ref()), Some(DeValue::Array(_)))
    {
        let message = "expected one table, [clouds.weather] or {...}, found a list";
        return Err(at.key("clouds").key("weather").fault(message));
    }
    let Some(DeValue::Array(particles)) = root.get("particles").map(|v| v.get_ref()) else {
        return Ok(());
    };
    match particles.iter().position(|p| matches!(p.get_ref(), DeValue::Array(_))) {
        Some(index) => {
            Err(at.key("particles").index(index).fault("expected a table, found a list"))
        }
        None => Ok(()),
    }
}

fn checked(file: SceneFile) -> std::result::Result<Scene, Fault> {
    let at = At::Root;
    let sky = match (file.sky.kind, file.sky.radiance) {
        (SkyKind::Uniform, Some(radiance)) => Sky::Uniform { radiance },
        (SkyKind::Atmosphere, None) => Sky::Atmosphere,
        (SkyKind::Uniform, None) => {
            return Err(at.key("sky").key("radiance").fault("is missing, a uniform sky needs it"));
        }
        (SkyKind::Atmosphere, Some(_)) => {
            return Err(at.key("sky").key("radiance").fault(
                "only a uniform sky has a radiance, that of an atmosphere follows from the sun",
            ));
        }
    };
    let ground = file.ground.map(|table| table.ground(at.key("ground"))).transpose()?;
    let mut scene = Scene {
        name: file.name,
        camera: file.camera,
        sun: file.sun,
        sky,
        ground,
        medium: file.medium,
        particles: file.particles,
        clouds: file.clouds,
        exposure: file.output.exposure,
    };
    check::scene(&scene)?;
    // After the checks, so a zero or infinite direction has been refused.
    scene.sun.direction = vector::unit(scene.sun.direction).unwrap_or(scene.sun.direction);
    particles::normalise(&mut scene.particles);
    Ok(scene)
}

pub(super) fn write(scene: &Scene) -> Result<String> {
    let (kind, radiance) = match scene.sky {
        Sky::Uniform { radiance } => (SkyKind::Uniform, Some(radiance)),
        Sky::Atmosphere => (SkyKind::Atmosphere, None),
    };
    let file = SceneFile {
        name: scene.name.clone(),
        particles_file: None,
        camera: scene.camera,
        sun: scene.sun,
        sky: SkyTable { kind, radiance },
        ground: scene.ground.map(GroundTable::from),
        medium: scene.medium,
        output: Output { exposure: scene.exposure },
        clouds: scene.clouds.clone(),
        particles: scene.particles.clone(),
    };
    toml::to_string(&file).map_err(|e| Error::input("scene", e.to_string()))
}

pub(super) fn toml_error(text: &str, place: &str, path: &str, error: &toml::de::Error) -> Error {
    let line = error.span().map_or(0, |span| line_at(text, span.start));
    fault::from_serde(path, error.message()).in_line(place, line)
}

/// The line of a byte, counted from 1.
fn line_at(text: &str, byte: usize) -> usize {
    let before = text.as_bytes().iter().take(byte);
    1 + before.filter(|b| **b == b'\n').count()
}

/// The line where a field stands, or the table it is missing from; 0 if there is none.
pub(super) fn line_of(text: &str, field: &str) -> usize {
    let Ok(root) = DeTable::parse(text) else { return 0 };
    let mut line = 0;
    let mut value = &DeValue::Table(root.into_inner());
    for part in field.split(['.', '[']) {
        let next = match (value, part.strip_suffix(']').map(str::parse::<usize>)) {
            (DeValue::Array(list), Some(Ok(index))) => list.get(index),
            (DeValue::Table(table), None) => table.get(part),
            _ => None,
        };
        let Some(next) = next else { break };
        line = line_at(text, next.span().start);
        value = next.get_ref();
    }
    line
}
