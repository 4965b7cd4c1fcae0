//! What the program does with files: it loads, watches and saves scenes.

use std::path::{Path, PathBuf};

use super::app::App;
use super::files::{Content, Sources, Watched};
use super::reader::{Done, Job};
use super::saving;
use crate::output::write_atomically;
use crate::scene::{Channel, Scene};
use crate::{Error, Result};

/// Of the video that a saved path is suggested for.
const FRAMES_A_SECOND: f64 = 25.0;

impl App {
    /// Looks for files to choose from: beside the scene there is, and in the folder of those that ship.
    pub fn find_files(&mut self) {
        let beside = self.report.file.as_ref().and_then(|f| f.parent()).map(Path::to_owned);
        let folders = beside.into_iter().chain([PathBuf::from("scenes")]).collect();
        let more = vec![PathBuf::new(), PathBuf::from("scenes/paths")];
        self.read(Job::Find { folders, more });
    }

    /// Loads a file that was chosen or dropped, as soon as it is read.
    pub fn load(&mut self, path: &Path) {
        let clouds = self.session.scene.clouds.as_ref();
        let map = clouds.and_then(|field| field.weather.as_ref());
        let channels = map.map_or_else(|| vec![Channel::Coverage], |map| map.channels.clone());
        let shapes = self.report.shapes.clone();
        self.read(Job::Open { path: path.to_owned(), shapes, channels });
    }

    /// Has the thread for it do something.
    pub(super) fn read(&mut self, job: Job) {
        self.reader.send(job);
        self.report.reading = self.reader.waits_for();
        self.request_redraw();
    }

    /// Takes over what the thread has read.
    pub(super) fn take_read(&mut self) {
        while let Some(done) = self.reader.done() {
            match done {
                Done::Opened(path, sources, content) => self.opened(&path, sources, content),
                Done::Reloaded(path, sources, scene) => self.reloaded(&path, sources, scene),
                Done::Maps(read) => self.take_maps(read),
                Done::Channels(map) => self.take_meanings(map),
                Done::Found(found) => self.report.found = found,
                Done::Broken(error) => self.tell(Err(error)),
            }
        }
        self.report.reading = self.reader.waits_for();
    }

    fn opened(&mut self, path: &Path, sources: Sources, content: Result<Content>) {
        let done = content.map(|content| match content {
            Content::Scene(scene) => {
                self.session.load(*scene);
                self.report.file = Some(path.to_owned());
                self.report.mistake = None;
                self.report.map_mistakes.clear();
                self.watch(sources);
                self.find_files();
                format!("loaded {}", path.display())
            }
            Content::Path(found) => {
                self.session.path.set(&found, self.session.clock.time);
                let (name, count) = (path.display(), found.keys().len());
                format!("loaded {name}: {count} keys; P flies along it")
            }
            Content::Map(map) => {
                self.watched_maps.retain(|watched| watched.path() != path);
                self.watched_maps.push(sources.scene);
                self.take_map(*map)
            }
        });
        self.tell(done);
    }

    /// Whether there are files that may change.
    pub fn is_watching(&self) -> bool {
        self.watched.is_some() || !self.map_files().is_empty()
    }

    /// Looks out for changes of a scene that was read.
    fn watch(&mut self, sources: Sources) {
        self.watched = Some(sources.scene);
        self.watched_cause = None;
        self.watched_maps = sources.map.into_iter().collect();
    }

    /// Loads again what has changed on disk: the scene, its weather map. A mistake is shown until it is
    /// mended.
    pub fn look_at_files(&mut self) {
        self.look_at_maps();
        let changed = self.watched.as_mut().is_some_and(Watched::has_changed);
        let mended = self.watched_cause.as_mut().is_some_and(Watched::has_changed);
        let Some(watched) = self.watched.as_ref().filter(|_| changed || mended) else { return };
        let path = watched.path().to_owned();
        self.read(Job::Reload { path, shapes: self.report.shapes.clone() });
    }

    fn reloaded(&mut self, path: &Path, sources: Sources, scene: Result<Box<Scene>>) {
        if self.watched.as_ref().map(Watched::path) != Some(path) {
            // Another one was chosen meanwhile.
            return;
        }
        match scene {
            Ok(scene) => {
                self.session.reload(*scene);
                self.watch(sources);
                self.report.mistake = None;
                self.report.map_mistakes.clear();
                let message = format!("{} was changed: loaded again", path.display());
                self.tell(Ok(message));
            }
            Err(error) => {
                tracing::info!("{error}");
                self.report.mistake = Some(error.to_string());
                self.watched = Some(sources.scene);
                self.watched_cause = sources.map;
                self.request_redraw();
            }
        }
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
            self.watched = Some(Sources::of(&path).scene);
            self.watched_cause = None;
            self.report.mistake = None;
        }
        self.find_files();
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
        self.find_files();
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
        self.report.message.tell(done.unwrap_or_else(|error| error.to_string()));
        tracing::info!("{}", self.report.message.text);
        self.request_redraw();
    }
}
