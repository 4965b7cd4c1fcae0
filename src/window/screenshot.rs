//! Pictures saved from the window.

use std::path::{Path, PathBuf};

use crate::frame::Picture;
use crate::output::write_picture;
use crate::{Error, Result};

/// More pictures in one folder are refused: looking for a free name takes its time.
const MOST: u32 = 9999;

/// Saves a picture under the first free name in a folder.
pub(super) fn save(folder: &Path, picture: &Picture) -> Result<PathBuf> {
    let names = (1..=MOST).map(|number| folder.join(format!("cumuli-{number:04}.png")));
    let free = names.into_iter().find(|path| !path.exists()).ok_or_else(|| {
        Error::input(folder.display().to_string(), format!("holds {MOST} pictures already"))
    })?;
    write_picture(&free, picture)?;
    Ok(free)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::tests::gradient;

    #[test]
    fn no_picture_replaces_another() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let paths = [1, 2].map(|seed| save(dir.path(), &gradient([4, 3], seed)).expect("saved"));
        assert_eq!(paths[0], dir.path().join("cumuli-0001.png"));
        assert_eq!(paths[1], dir.path().join("cumuli-0002.png"));
        std::fs::remove_file(&paths[0]).expect("removed");
        let again = save(dir.path(), &gradient([4, 3], 3)).expect("saved");
        assert_eq!(again, paths[0]);
    }
}
