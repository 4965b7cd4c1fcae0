//! Files that the window reads: scenes and camera paths, by choice, by drop, and again when they
//! change on disk.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::scene::{CameraPath, Scene};
use crate::{Error, Result};

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Content {
    /// A scene.
    Scene(Box<Scene>),
    /// A camera path.
    Path(CameraPath),
    /// An image, for a weather map.
    Map,
}

/// The ending of images' names, in lower case.
const IMAGE: &str = "png";

/// Reads a file of any kind that the window knows. `shapes` are those of the tables.
pub(super) fn read(path: &Path, shapes: &[String]) -> Result<Content> {
    let extension = extension(path);
    if extension == IMAGE {
        return Ok(Content::Map);
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

/// The top of a TOML file; none where it cannot be read, which its reader tells better.
fn table(path: &Path) -> Option<toml::Table> {
    std::fs::read_to_string(path).ok()?.parse().ok()
}

fn names(path: &Path, key: &str) -> bool {
    table(path).is_some_and(|table| table.contains_key(key))
}

/// Scenes in these folders, by name.
pub(super) fn scenes_in(folders: &[PathBuf]) -> Vec<PathBuf> {
    found_in(folders, "camera")
}

/// Camera paths in these folders, by name.
pub(super) fn paths_in(folders: &[PathBuf]) -> Vec<PathBuf> {
    found_in(folders, "keys")
}

/// Images in these folders, by name.
pub(super) fn maps_in(folders: &[PathBuf]) -> Vec<PathBuf> {
    all_in(folders, |path| extension(path) == IMAGE)
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

/// A scene file on disk and the file of particles that it names, or another file.
pub(super) struct Watched {
    path: PathBuf,
    /// Whether the file may name others.
    alone: bool,
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
    pub fn new(path: &Path) -> Self {
        let mut files = vec![path.to_owned()];
        let particles =
            table(path).and_then(|t| Some(t.get("particles_file")?.as_str()?.to_owned()));
        let folder = path.parent().unwrap_or(Path::new(""));
        files.extend(particles.map(|name| folder.join(name)));
        let known = stamps(&files);
        Self { path: path.to_owned(), alone: false, files, seen: known.clone(), known }
    }

    /// The same for a file that names no others.
    pub fn alone(path: &Path) -> Self {
        let files = vec![path.to_owned()];
        let known = stamps(&files);
        Self { path: path.to_owned(), alone: true, files, seen: known.clone(), known }
    }

    /// The scene file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether a file has changed since it was read, and is whole by now: the same in two looks.
    pub fn has_changed(&mut self) -> bool {
        let now = stamps(&self.files);
        let settled = now == self.seen;
        self.seen = now;
        if !settled || self.seen == self.known {
            return false;
        }
        // Whatever is made of it, it is not read again before the next change.
        let again = if self.alone { Self::alone } else { Self::new };
        *self = again(&self.path.clone());
        true
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
            ("map.PNG", "an image, as long as nobody reads it"),
        ];
        let dir = folder(&files);
        let read = |name: &str| read(&dir.path().join(name), &["uniform".to_owned()]);
        assert!(matches!(read("scene.toml"), Ok(Content::Scene(s)) if s.name == "scene"));
        assert!(matches!(read("path.toml"), Ok(Content::Path(p)) if p.keys().len() == 1));
        for (name, part) in
            [("a.txt", ".toml"), ("none.toml", "no such file"), ("shaped.toml", "no shape `x`")]
        {
            let message = read(name).expect_err(name).to_string();
            assert!(message.contains(part) && message.contains(name), "{message}");
        }
        let found = scenes_in(&[dir.path().to_owned(), dir.path().to_owned()]);
        let names = ["scene.toml", "shaped.toml"].map(|n| dir.path().join(n));
        assert_eq!(found, names, "each once, and no paths");
        assert!(matches!(read("map.PNG"), Ok(Content::Map)));
        assert_eq!(maps_in(&[dir.path().to_owned()]), [dir.path().join("map.PNG")]);
        assert_eq!(paths_in(&[dir.path().to_owned()]), [dir.path().join("path.toml")]);
    }

    #[test]
    fn a_change_is_seen_once_and_when_it_is_whole() {
        let named = format!("particles_file = \"p.json\"\n{SCENE}");
        let dir = folder(&[("scene.toml", &named), ("p.json", "{\"particles\": []}")]);
        let path = dir.path().join("scene.toml");
        let mut watched = Watched::new(&path);
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
}
