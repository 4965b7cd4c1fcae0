//! What keys and buttons ask for beyond the session.

use std::path::PathBuf;

use crate::output::Format;
use crate::scene::Channel;

/// Something to do.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Wish {
    /// End the program.
    Quit,
    /// Save the view in these formats.
    Screenshot(Vec<Format>),
    /// Save the scene as it is seen: into this file, or into a new one.
    SaveScene(Option<PathBuf>),
    /// Save the camera path into a new file.
    SavePath,
    /// Load this file, whatever it is.
    Open(PathBuf),
    /// Let the colours of the weather map mean this.
    TakeChannels(Vec<Channel>),
    /// Take the window's surface for lost.
    LoseSurface,
    /// Throw the device away, as a driver that is reset does, and go on with a new one.
    LoseDevice,
}
