//! What is in the sky: camera, sun, air, ground, and clouds as a field or as listed particles.
//!
//! A [`Scene`] comes from a TOML file, every value of which is checked when it is read, so the
//! passes behind it can rely on finite numbers in the ranges of [`limits`].

mod bodies;
mod camera;
mod check;
mod clouds;
mod fault;
mod file;
pub mod limits;
mod particles;
pub mod path;
mod text_file;
mod vector;
mod weather;

use std::path::Path;

pub use bodies::{Ground, GroundKind, Medium, Sky, Sun};
pub use camera::{Camera, CameraBasis};
pub use clouds::CloudField;
pub use particles::ParticleSpec;
pub use path::CameraPath;
pub use weather::{Channel, Outside, WeatherImage, WeatherMap};

use crate::error::{Error, Result};
use fault::At;

/// The scene that is shown when none is named.
pub const DEFAULT_SCENE: &str = include_str!("../../scenes/cumulus.toml");

/// Everything a picture depends on apart from time, size and quality.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// A name for people; the file's stem where the file gives none.
    pub name: String,
    /// Where the picture is taken from.
    pub camera: Camera,
    /// The only light besides the sky.
    pub sun: Sun,
    /// What is behind and between the clouds.
    pub sky: Sky,
    /// The ground at altitude 0, if the file asks for one; see [`Scene::effective_ground`].
    pub ground: Option<Ground>,
    /// What the particles are filled with.
    pub medium: Medium,
    /// Particles listed one by one.
    pub particles: Vec<ParticleSpec>,
    /// Clouds generated around the camera.
    pub clouds: Option<CloudField>,
    /// Exposure of the tone-mapped picture, EV: each step doubles the brightness. The linear
    /// radiance is not touched by it.
    pub exposure: f64,
}

impl Default for Scene {
    /// A clear sky in the afternoon, seen by someone standing on the ground.
    fn default() -> Self {
        Self {
            name: String::new(),
            camera: Camera::default(),
            sun: Sun::default(),
            sky: Sky::Atmosphere,
            ground: None,
            medium: Medium::default(),
            particles: Vec::new(),
            clouds: None,
            exposure: 0.0,
        }
    }
}

impl Scene {
    /// Reads a scene file, and the particles file and the weather map that it may name.
    pub fn load(path: &Path) -> Result<Self> {
        let text = text_file::read(path, text_file::SCENE)?;
        let base = path.parent().unwrap_or(Path::new(""));
        let mut scene = Self::from_toml(&text, &path.display().to_string(), base)?;
        if scene.name.is_empty() {
            scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
        Ok(scene)
    }

    /// Reads a scene from text. `place` names it in errors, and the files that it names are looked
    /// for in `base_dir`.
    pub fn from_toml(text: &str, place: &str, base_dir: &Path) -> Result<Self> {
        file::parse(text, place, base_dir)
    }

    /// Reads a list of particles from the text of a particles file; `place` names it in errors.
    pub fn particles_from_json(text: &str, place: &str) -> Result<Vec<ParticleSpec>> {
        particles::parse(text, place)
    }

    /// Writes the scene as TOML, with all particles listed in it; [`Scene::from_toml`] reads
    /// back an equal scene. A weather map is named as it can be opened from the current folder.
    pub fn to_toml(&self) -> Result<String> {
        file::write(self)
    }

    /// The same for a file in `folder`, from where a weather map is found.
    pub fn to_toml_in(&self, folder: &Path) -> Result<String> {
        let mut scene = self.clone();
        if let Some(map) = scene.clouds.as_mut().and_then(|clouds| clouds.weather.as_mut()) {
            map.file = weather::named_from(folder, &map.file);
        }
        scene.to_toml()
    }

    /// The scene as TOML with a mark of the weather map's pixels, which the TOML only names: equal
    /// for two scenes of this program only where their pictures are.
    pub fn identity(&self) -> Result<String> {
        let map = self.clouds.as_ref().and_then(|clouds| clouds.weather.as_ref());
        let mark = map.map(|m| format!("# weather map {:016x}\n", m.image.fingerprint()));
        // Not how the map is named: that depends on the folder the program was started in.
        let mut scene = self.clone();
        if let Some(map) = scene.clouds.as_mut().and_then(|clouds| clouds.weather.as_mut()) {
            map.file = "map".into();
        }
        Ok(scene.to_toml()? + &mark.unwrap_or_default())
    }

    /// Checks every value, for scenes that were made by a program. What [`Scene::load`] returns
    /// has passed.
    pub fn validate(&self) -> Result<()> {
        check::scene(self).and_then(|()| check::units(self)).map_err(|f| f.in_place("scene"))
    }

    /// Checks that every shape the scene names is among `known` (the shapes of the tables).
    pub fn check_shapes(&self, place: &str, known: &[&str]) -> Result<()> {
        check::shapes(self, known).map_err(|f| f.in_place(place))
    }

    /// The ground that is seen and that reflects: the scene's own; under an atmosphere a default
    /// one where the scene has none; nothing under a uniform sky that doesn't ask for one.
    pub fn effective_ground(&self) -> Option<Ground> {
        match (self.ground, self.sky) {
            (Some(ground), _) => Some(ground),
            (None, Sky::Atmosphere) => Some(Ground::default()),
            (None, Sky::Uniform { .. }) => None,
        }
    }

    /// Whether the ground is a sea.
    pub fn is_sea(&self) -> bool {
        self.effective_ground().is_some_and(|ground| ground.wind_speed().is_some())
    }
}

/// Checks a time in seconds that comes from outside; `place` names it ("--time").
pub fn check_time(place: &str, seconds: f64) -> Result<()> {
    At::Root.number(seconds, &limits::TIME).map_err(|f| Error::input(place, f.message()))
}
