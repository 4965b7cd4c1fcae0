//! Reads text from files that may be anything: missing, a folder, endless, not text.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};

/// A kind of text file.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    /// For messages, with an article.
    pub name: &'static str,
    /// Larger files are refused before they are read, bytes.
    pub limit: u64,
    /// Whether it must be a plain file: a scene may come through a pipe that the user names, but
    /// a file named inside a scene must not make the program wait for a pipe or a terminal.
    pub plain: bool,
}

/// A scene: 4 MiB, some 30,000 particles. More belong into a particles file.
pub(super) const SCENE: Kind = Kind { name: "a scene in TOML", limit: 4 << 20, plain: false };

/// A camera path: 4 MiB, hours of a recording.
pub(super) const PATH: Kind = Kind { name: "a camera path in TOML", limit: 4 << 20, plain: false };

/// Listed particles: 256 MiB, more than [`super::limits::MOST_PARTICLES`] take.
pub(super) const PARTICLES: Kind =
    Kind { name: "a JSON file of particles", limit: 256 << 20, plain: true };

/// Reads a whole file of at most `kind.limit` bytes of UTF-8.
pub(super) fn read(path: &Path, kind: Kind) -> Result<String> {
    let name = kind.name;
    let place = path.display().to_string();
    let refuse = |message: String| Error::input(place.clone(), message);
    let unreadable = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => refuse(format!("there is no such file, expected {name}")),
        _ => refuse(format!("cannot be read ({e}), expected {name}")),
    };

    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(refuse(format!("is a folder, expected {name}")));
    }
    if kind.plain && !metadata.is_file() {
        return Err(refuse(format!("is not a plain file, expected {name}")));
    }
    let too_large = || refuse(format!("is larger than {} MiB, expected {name}", kind.limit >> 20));
    if metadata.len() > kind.limit {
        return Err(too_large());
    }

    // A device or a growing file has no length to trust, so reading stops one byte past the limit.
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(unreadable)?;
    file.take(kind.limit + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > kind.limit {
        return Err(too_large());
    }
    String::from_utf8(bytes).map_err(|e| {
        let good = e.utf8_error().valid_up_to();
        refuse(format!(
            "is not UTF-8 text (byte {good} is not part of any character), expected {name}"
        ))
    })
}
