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
    /// Show or hide the panel.
    Panel,
    /// Back to the start of the flight.
    Home,
    /// Save the picture.
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
            KeyCode::F1 => Self::Panel,
            KeyCode::Home => Self::Home,
            KeyCode::F12 => Self::Screenshot,
            KeyCode::Escape => Self::Quit,
            _ => return None,
        })
    }
}

/// The keys, for people.
pub(super) const HELP: [(&str, &str); 9] = [
    ("mouse, button held", "look around"),
    ("W A S D", "fly ahead, left, back, right"),
    ("E Q", "up, down"),
    ("shift", "faster"),
    ("wheel", "speed"),
    ("space", "pause"),
    ("home", "back to the start"),
    ("F1 / F12", "panel / save the picture"),
    ("esc", "quit"),
];
