//! What the program does with files: it loads, watches and saves scenes.

use std::path::{Path, PathBuf};

use super::app::App;
use super::files::{self, Content, Watched};
use super::saving;
use crate::output::write_atomically;
use crate::{Error, Result};

/// Of the video that a saved path is suggested for.
const FRAMES_A_SECOND: f64 = 25.0;

impl App {
    /// Looks for scenes beside the one there is, and in the folder of those that ship.
    pub fn find_scenes(&mut self) {
        let beside = self.report.file.as_ref().and_then(|f| f.parent()).map(Path::to_owned);
        let folders: Vec<_> = beside.into_iter().chain([PathBuf::from("scenes")]).collect();
        self.report.scenes = files::scenes_in(&folders);
        self.report.maps = files::maps_in(&folders);
        let shipped = [PathBuf::new(), PathBuf::from("scenes/paths")];
        self.report.paths = files::paths_in(&[&folders[..], &shipped].concat());
    }

    /// Loads a file that was chosen or dropped.
    pub fn load(&mut self, path: &Path) {
        match files::read(path, &self.report.shapes) {
            Ok(Content::Scene(scene)) => {
                self.session.load(*scene);
                self.watch(path);
                self.report.mistake = None;
                self.report.message = format!("loaded {}", path.display());
            }
            Ok(Content::Path(found)) => {
                self.session.path.set(&found, self.session.clock.time);
                let (name, count) = (path.display(), found.keys().len());
                self.report.message = format!("loaded {name}: {count} keys; P flies along it");
            }
            Ok(Content::Map) => {
                let loaded = self.load_map(path);
                self.tell(loaded);
            }
            Err(error) => self.report.message = error.to_string(),
        }
        self.request_redraw();
    }

    /// Whether there are files that may change.
    pub fn is_watching(&self) -> bool {
        let clouds = self.session.scene.clouds.as_ref();
        self.watched.is_some() || clouds.is_some_and(|field| field.weather.is_some())
    }

    /// Looks out for changes of a scene file from now on.
    pub fn watch(&mut self, path: &Path) {
        self.watched = Some(Watched::new(path));
        self.report.file = Some(path.to_owned());
        self.find_scenes();
    }

    /// Loads again what has changed on disk: the scene, its weather map. A mistake is shown until it is
    /// mended.
    pub fn look_at_files(&mut self) {
        let map_changed = self.look_at_map();
        // A scene whose map could not be read may be sound now.
        let retry =
            map_changed && self.report.map_mistake.is_none() && self.report.mistake.is_some();
        let Some(watched) = self.watched.as_mut() else {
            if map_changed {
                self.request_redraw();
            }
            return;
        };
        if !watched.has_changed() && !retry {
            if map_changed {
                self.request_redraw();
            }
            return;
        }
        let path = watched.path().to_owned();
        match files::scene(&path, &self.report.shapes) {
            Ok(scene) => {
                self.session.reload(scene);
                self.report.mistake = None;
                self.report.message = format!("{} was changed: loaded again", path.display());
            }
            Err(error) => {
                tracing::info!("{error}");
                self.report.mistake = Some(error.to_string());
            }
        }
        self.request_redraw();
    }

    /// Writes the scene as it is seen, into this file or into a new one; what to say about it.
    pub fn save_scene(&mut self, path: Option<&Path>) -> Result<String> {
        let path = match path {
            Some(path) => path.to_owned(),
            None => saving::free_name(Path::new(""), "scene", "toml")?,
        };
        crate::output::check_file(&path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let text = self.session.seen().to_toml_in(folder)?;
        write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
        if self.report.file.as_ref() == Some(&path) {
            // What it says is what is shown already.
            self.session.start = self.session.seen();
            self.watched = Some(Watched::new(&path));
        }
        self.find_scenes();
        let (time, preset) = (self.session.clock.time, self.session.settings.preset);
        let path = path.display();
        Ok(format!(
            "saved {path}; cumuli render --scene {path} --time {time} --preset {preset} makes its picture"
        ))
    }

    /// Writes the camera path into a new file; what to say about it.
    pub fn save_path(&mut self) -> Result<String> {
        let nothing = || Error::input("camera path", "there is none: R records one, K adds a view");
        let desk = &self.session.path;
        let path = desk.path().ok_or_else(nothing)?;
        let file = saving::free_name(Path::new(""), "path", "toml")?;
        let text = path.to_toml()?;
        write_atomically(&file, |out| out.write_all(text.as_bytes()))?;
        let (frames, begun) = ((desk.end() * FRAMES_A_SECOND).ceil() as u64 + 1, desk.begun);
        self.find_scenes();
        let file = file.display();
        let scene = self.report.file.as_ref().map(|s| format!("--scene {} ", s.display()));
        let scene = scene.unwrap_or_default();
        Ok(format!(
            "saved {file}; cumuli render {scene}--path {file} --frames 0..{frames} --fps {FRAMES_A_SECOND} \
             --time {begun} --out frames --video flight.mp4 makes a video of it"
        ))
    }

    /// Shows what came of something.
    pub fn tell(&mut self, done: Result<String>) {
        self.report.message = done.unwrap_or_else(|error| error.to_string());
        tracing::info!("{}", self.report.message);
        self.request_redraw();
    }
}
