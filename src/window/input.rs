//! What keys mean.

use winit::keyboard::KeyCode;

use super::camera::Push;

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    /// Fly while it is held.
    Push(Push),
    /// Fly faster while it is held.
    Faster,
    /// Let time run or stand.
    Pause,
    /// Let time run at half or double its pace.
    Slower,
    Quicker,
    /// Show or hide the panel.
    Panel,
    /// Show or hide the keys.
    Help,
    /// Back to the start of the flight.
    Home,
    /// Begin or end the recording of a camera path.
    Record,
    /// Add the view to the camera path.
    AddView,
    /// Fly along the camera path, or stop.
    Replay,
    /// Save the scene.
    SaveScene,
    /// Save the camera path.
    SavePath,
    /// Show or hide the reference.
    Compare,
    /// Show the next view of the insides.
    Inside,
    /// Throw the device away and make a new one.
    LoseDevice,
    /// Throw the window's surface away and make a new one.
    LoseSurface,
    /// Save the picture, as displayed and as radiance.
    Screenshot,
    /// End the program.
    Quit,
}

impl Key {
    /// The meaning of a key by its place, so that WASD lie together on every keyboard.
    pub fn of(code: KeyCode) -> Option<Self> {
        Some(match code {
            KeyCode::KeyW => Self::Push(Push::Forward),
            KeyCode::KeyS => Self::Push(Push::Back),
            KeyCode::KeyA => Self::Push(Push::Left),
            KeyCode::KeyD => Self::Push(Push::Right),
            KeyCode::KeyE => Self::Push(Push::Up),
            KeyCode::KeyQ => Self::Push(Push::Down),
            KeyCode::ShiftLeft | KeyCode::ShiftRight => Self::Faster,
            KeyCode::Space => Self::Pause,
            KeyCode::Comma => Self::Slower,
            KeyCode::Period => Self::Quicker,
            KeyCode::F1 => Self::Panel,
            KeyCode::KeyH => Self::Help,
            KeyCode::KeyR => Self::Record,
            KeyCode::KeyK => Self::AddView,
            KeyCode::KeyP => Self::Replay,
            KeyCode::F6 => Self::SaveScene,
            KeyCode::F7 => Self::SavePath,
            KeyCode::KeyT => Self::Compare,
            KeyCode::KeyI => Self::Inside,
            KeyCode::F9 => Self::LoseSurface,
            KeyCode::F10 => Self::LoseDevice,
            KeyCode::Home => Self::Home,
            KeyCode::F12 => Self::Screenshot,
            KeyCode::Escape => Self::Quit,
            _ => return None,
        })
    }
}

/// The keys, for people.
pub(super) const HELP: [(&str, &str); 18] = [
    ("mouse, button held", "look around"),
    ("W A S D", "fly ahead, left, back, right"),
    ("E Q", "up, down"),
    ("shift", "faster"),
    ("wheel", "speed"),
    ("space", "pause"),
    ("comma, full stop", "slower, quicker time"),
    ("home", "back to the start"),
    ("F1", "panel"),
    ("H", "keys"),
    ("R / K", "record a camera path / add this view to it"),
    ("P", "fly along the camera path"),
    ("F6 / F7", "save the scene / the camera path"),
    ("T", "the path-traced reference beside the frame"),
    ("I", "views of the insides, one after the other"),
    ("F12", "save the picture: PNG and EXR"),
    ("F9 / F10", "a new surface / graphics device, as after a loss"),
    ("esc", "quit"),
];
