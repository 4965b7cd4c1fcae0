//! The one error type of the library: every variant is a sentence a user can act on.

use std::path::{Path, PathBuf};

/// What can go wrong, told in one sentence that names the place and what was expected.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file, option or field holds something that cannot be used.
    #[error("{place}: {message}")]
    Input {
        /// Where: the file and the field, or the option.
        place: String,
        /// What was expected and what was found.
        message: String,
    },
    /// The operating system refused to read or write a file.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, as a verb: "read", "write", "create the folder".
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// No graphics adapter fits.
    #[error("no usable graphics adapter: {0}")]
    NoAdapter(String),
    /// No window can be opened.
    #[error("no window can be opened: {0}; pictures need none: cumuli render")]
    Window(String),
    /// The graphics device failed, was lost, or lacks something.
    #[error("graphics device: {0}")]
    Gpu(String),
}

/// The library's result.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Bad input at a place ("scene.toml: camera.fov_x") with what was expected there.
    pub fn input(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Input { place: place.into(), message: message.into() }
    }

    /// A refusal of the operating system.
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), action, source }
    }

    /// Exit code of the programs: 2 for bad input, 1 for everything that failed on good input.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input { .. } => 2,
            Self::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => 2,
            Self::NoAdapter(_) | Self::Window(_) => 2,
            Self::Io { .. } | Self::Gpu(_) => 1,
        }
    }
}
