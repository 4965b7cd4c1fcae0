//! Names for what is saved from the window.

use std::path::{Path, PathBuf};

use crate::output::{Format, is_frame_name};
use crate::{Error, Result};

/// More files of a kind in one folder are refused: looking for a free name takes its time.
const MOST: u32 = 9999;

/// The first names in a folder that no file has: `stem-0001` and so on, the same for all formats.
pub(super) fn free_names(folder: &Path, stem: &str, formats: &[Format]) -> Result<Vec<PathBuf>> {
    let ends: Vec<_> = formats.iter().map(|f| f.extension()).collect();
    free(folder, stem, &ends)
}

/// The first name in a folder that no file has, with this end.
pub(super) fn free_name(folder: &Path, stem: &str, end: &str) -> Result<PathBuf> {
    let names = free(folder, stem, &[end])?;
    names.into_iter().next().ok_or_else(|| Error::Failed("no name".to_owned()))
}

/// Stem of pictures that are saved from the window.
pub(super) const PICTURE: &str = "cumuli";

/// Whether a picture is called like one that the program saves: of the window, or of a sequence.
pub(super) fn is_saved_picture(path: &Path) -> bool {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let number = stem.strip_prefix(PICTURE).and_then(|rest| rest.strip_prefix('-'));
    let number = number.unwrap_or_default();
    let numbered = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    numbered || is_frame_name(path)
}

fn free(folder: &Path, stem: &str, ends: &[&str]) -> Result<Vec<PathBuf>> {
    (1..=MOST)
        .map(|number| {
            let name = |end: &&str| folder.join(format!("{stem}-{number:04}.{end}"));
            ends.iter().map(name).collect::<Vec<_>>()
        })
        .find(|names| names.iter().all(|name| !name.exists()))
        .ok_or_else(|| {
            Error::input(folder.display().to_string(), format!("holds {MOST} such files already"))
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saved_pictures_are_told_by_their_names() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let saved = free_names(dir.path(), PICTURE, &[Format::Png]).expect("a name");
        assert!(is_saved_picture(&saved[0]) && is_saved_picture(Path::new("out/frame_00012.png")));
        for other in ["cumuli.png", "cumuli-.png", "cumuli-map.png", "map-0001.png", "frame_a.png"]
        {
            assert!(!is_saved_picture(Path::new(other)), "{other}");
        }
    }

    #[test]
    fn no_file_replaces_another() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let both = [Format::Png, Format::Exr];
        let names = |formats: &[Format]| free_names(dir.path(), "a", formats).expect("names");
        let write = |path: &Path| std::fs::write(path, "").expect("written");
        assert_eq!(names(&both), ["a-0001.png", "a-0001.exr"].map(|n| dir.path().join(n)));
        write(&dir.path().join("a-0001.exr"));
        assert_eq!(names(&both), ["a-0002.png", "a-0002.exr"].map(|n| dir.path().join(n)));
        assert_eq!(names(&both[..1]), [dir.path().join("a-0001.png")]);
        write(&dir.path().join("a-0001.toml"));
        let free = free_name(dir.path(), "a", "toml").expect("a name");
        assert_eq!(free, dir.path().join("a-0002.toml"));
    }
}
