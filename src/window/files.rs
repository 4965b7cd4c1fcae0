//! Files that the window reads: scenes and camera paths, by choice, by drop, and again when they
//! change on disk.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::saving;
use crate::scene::{CameraPath, Channel, Scene, WeatherMap};
use crate::{Error, Result};

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Content {
    /// A scene.
    Scene(Box<Scene>),
    /// A camera path.
    Path(CameraPath),
    /// An image, as a weather map that is laid as usual.
    Map(Box<WeatherMap>),
}

/// The ending of images' names, in lower case.
const IMAGE: &str = "png";

/// Reads a file of any kind that the window knows. `shapes` are those of the tables; `channels` is
/// what the colours of a weather map mean.
pub(super) fn read(path: &Path, shapes: &[String], channels: &[Channel]) -> Result<Content> {
    let extension = extension(path);
    if extension == IMAGE {
        return Ok(Content::Map(Box::new(WeatherMap::open_as(path, channels)?)));
    }
    if !path.is_dir() && extension != "toml" {
        return Err(Error::input(
            path.display().to_string(),
            "expected a scene or a camera path, a name that ends in .toml, or a weather map, .png",
        ));
    }
    if names(path, "keys") {
        return Ok(Content::Path(CameraPath::load(path)?));
    }
    Ok(Content::Scene(Box::new(scene(path, shapes)?)))
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Reads a scene that can be rendered with these shapes.
pub(super) fn scene(path: &Path, shapes: &[String]) -> Result<Scene> {
    let scene = Scene::load(path)?;
    let known: Vec<_> = shapes.iter().map(String::as_str).collect();
    scene.check_shapes(&path.display().to_string(), &known)?;
    Ok(scene)
}

/// Larger files are neither scenes nor paths, whose readers refuse them too, bytes.
const MOST_BYTES: u64 = 8 << 20;

/// The top of a TOML file; none where it cannot be read, which its reader tells better.
fn table(path: &Path) -> Option<toml::Table> {
    let metadata = std::fs::metadata(path).ok()?;
    if !metadata.is_file() || metadata.len() > MOST_BYTES {
        return None;
    }
    std::fs::read_to_string(path).ok()?.parse().ok()
}

fn names(path: &Path, key: &str) -> bool {
    table(path).is_some_and(|table| table.contains_key(key))
}

/// Files to choose from, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Found {
    pub scenes: Vec<PathBuf>,
    /// Weather maps.
    pub maps: Vec<PathBuf>,
    /// Camera paths.
    pub paths: Vec<PathBuf>,
}

/// Looks for scenes and maps in these folders, and for paths in others too.
pub(super) fn find(folders: &[PathBuf], more: &[PathBuf]) -> Found {
    Found {
        scenes: found_in(folders, "camera"),
        maps: all_in(folders, |path| extension(path) == IMAGE && !saving::is_saved_picture(path)),
        paths: found_in(&[folders, more].concat(), "keys"),
    }
}

/// TOML files with this key at their top.
fn found_in(folders: &[PathBuf], key: &str) -> Vec<PathBuf> {
    all_in(folders, |path| path.extension().is_some_and(|e| e == "toml") && names(path, key))
}

fn all_in(folders: &[PathBuf], is_one: impl Fn(&Path) -> bool) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = folders
        .iter()
        .filter_map(|folder| {
            let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            Some(std::fs::read_dir(here).ok()?.flatten().map(|e| folder.join(e.file_name())))
        })
        .flatten()
        .filter(|path| is_one(path))
        .collect();
    found.sort();
    found.dedup();
    found
}

/// A file on disk and others that belong to it.
#[derive(Debug)]
pub(super) struct Watched {
    files: Vec<PathBuf>,
    /// As they were read.
    known: Stamps,
    /// As they were seen last: a file that is being written changes once more.
    seen: Stamps,
}

/// Time of the last change and length of each file, where it is there.
type Stamps = Vec<Option<(SystemTime, u64)>>;

impl Watched {
    /// Looks out for changes from now on.
    pub fn new(path: &Path, others: &[PathBuf]) -> Self {
        let files = [&[path.to_owned()], others].concat();
        let known = stamps(&files);
        Self { files, seen: known.clone(), known }
    }

    /// The first file.
    pub fn path(&self) -> &Path {
        self.files.first().map_or(Path::new(""), PathBuf::as_path)
    }

    /// Whether a file has changed since it was read, and is whole by now: the same in two looks. Whatever
    /// is made of it, it is told again only with the next change.
    pub fn has_changed(&mut self) -> bool {
        let now = stamps(&self.files);
        let settled = now == self.seen;
        self.seen = now;
        if !settled || self.seen == self.known {
            return false;
        }
        self.known.clone_from(&self.seen);
        true
    }
}

/// What a scene's file depends on.
#[derive(Debug)]
pub(super) struct Sources {
    /// The file itself, and that of its particles.
    pub scene: Watched,
    /// The file of its weather map.
    pub map: Option<Watched>,
}

impl Sources {
    /// As they are now: before the scene is read, so that no change is missed.
    pub fn of(path: &Path) -> Self {
        let table = table(path).unwrap_or_default();
        let folder = path.parent().unwrap_or(Path::new(""));
        let named = |value: Option<&toml::Value>| Some(folder.join(value?.as_str()?));
        let particles = named(table.get("particles_file"));
        let map = table.get("clouds").and_then(|clouds| clouds.get("weather")?.get("file"));
        Self {
            scene: Watched::new(path, particles.as_slice()),
            map: named(map).map(|map| Watched::new(&map, &[])),
        }
    }
}

fn stamps(files: &[PathBuf]) -> Stamps {
    let stamp = |path: &PathBuf| {
        let metadata = std::fs::metadata(path).ok()?;
        Some((metadata.modified().ok()?, metadata.len()))
    };
    files.iter().map(stamp).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "[camera]\nposition = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\n\
        [sun]\ndirection = [0.0, 1.0, 0.0]\n";

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in files {
            std::fs::write(dir.path().join(name), text).expect("written");
        }
        dir
    }

    #[test]
    fn a_file_is_told_by_what_it_holds() {
        let path = "[[keys]]\ntime = 0.0\nposition = [0, 0, 0]\ntarget = [1, 0, 0]\n";
        let shaped = format!(
            "{SCENE}[[particles]]\ncentre = [0, 0, 0]\nradius = 1\nextinction = 1\nshape = \"x\"\n"
        );
        let files = [
            ("scene.toml", SCENE),
            ("path.toml", path),
            ("a.txt", SCENE),
            ("shaped.toml", &shaped),
            ("broken.png", "no image"),
        ];
        let dir = folder(&files);
        for name in ["map.PNG", "cumuli-0001.png", "frame_00012.png"] {
            let path = dir.path().join(name);
            image::GrayImage::new(4, 2).save(&path).expect("written");
        }
        let channels = [Channel::Height];
        let read = |name: &str| read(&dir.path().join(name), &["uniform".to_owned()], &channels);
        assert!(matches!(read("scene.toml"), Ok(Content::Scene(s)) if s.name == "scene"));
        assert!(matches!(read("path.toml"), Ok(Content::Path(p)) if p.keys().len() == 1));
        for (name, part) in [
            ("a.txt", ".toml"),
            ("none.toml", "no such file"),
            ("shaped.toml", "no shape `x`"),
            ("broken.png", "no PNG image"),
        ] {
            let message = read(name).expect_err(name).to_string();
            assert!(message.contains(part) && message.contains(name), "{message}");
        }
        let here = dir.path().to_owned();
        let found = find(&[here.clone(), here.clone()], &[]);
        let in_folder = |names: &[&str]| names.iter().map(|n| here.join(n)).collect::<Vec<_>>();
        assert_eq!(found.scenes, in_folder(&["scene.toml", "shaped.toml"]), "each once, no paths");
        assert_eq!(found.paths, in_folder(&["path.toml"]));
        assert_eq!(found.maps, in_folder(&["broken.png", "map.PNG"]), "no pictures of its own");
        assert!(matches!(read("map.PNG"), Ok(Content::Map(m)) if m.channels == channels));
        assert!(find(&[], &[here]).paths.len() == 1);
    }

    #[test]
    fn a_change_is_seen_once_and_when_it_is_whole() {
        let named = format!("particles_file = \"p.json\"\n{SCENE}");
        let dir = folder(&[("scene.toml", &named), ("p.json", "{\"particles\": []}")]);
        let path = dir.path().join("scene.toml");
        let mut watched = Sources::of(&path).scene;
        assert!(!watched.has_changed() && !watched.has_changed());
        for file in [&path, &dir.path().join("p.json")] {
            let text = std::fs::read_to_string(file).expect("readable");
            std::fs::write(file, &text[..5]).expect("written");
            assert!(!watched.has_changed(), "it may go on");
            std::fs::write(file, text + " ").expect("written");
            assert!(!watched.has_changed(), "it went on");
            assert!(watched.has_changed(), "it is at rest");
            assert!(!watched.has_changed(), "told once");
        }
        std::fs::remove_file(&path).expect("removed");
        assert!(!watched.has_changed() && watched.has_changed(), "a missing file is a change");
    }

    #[test]
    fn a_scene_tells_what_it_is_made_of_even_where_it_is_broken() {
        let field = "[clouds]\n[clouds.weather]\nfile = \"maps/a.png\"\n";
        let dir = folder(&[("scene.toml", &format!("{SCENE}{field}")), ("plain.toml", SCENE)]);
        let path = dir.path().join("scene.toml");
        assert!(scene(&path, &[]).is_err(), "there is no such map");
        let mut sources = Sources::of(&path);
        let map = sources.map.as_mut().expect("a map");
        assert_eq!(map.path(), dir.path().join("maps/a.png"));
        assert!(!map.has_changed());
        std::fs::create_dir(dir.path().join("maps")).expect("made");
        image::GrayImage::new(4, 2).save(map.path()).expect("written");
        assert!(!map.has_changed() && map.has_changed(), "it is there now");
        assert!(!sources.scene.has_changed(), "the scene is as it was");
        assert!(scene(&path, &[]).is_ok());
        assert!(Sources::of(&dir.path().join("plain.toml")).map.is_none());
        assert!(Sources::of(&dir.path().join("none.toml")).map.is_none());
    }
}
