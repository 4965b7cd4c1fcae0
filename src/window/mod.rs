//! The window: flying through a scene and changing it.
//!
//! Events go to the panel first, then to the session (scene, camera, time, quality). A redraw lets
//! time go by, orders the picture that belongs to it from a thread of its own (`studio`), and paints
//! the last one that came, with the panel over it. Where nothing moves, nothing is drawn.

mod angles;
mod app;
mod camera;
mod clock;
mod compared;
mod day;
mod documents;
mod events;
mod files;
mod flight_path;
mod gamepad;
mod graphics;
mod guard;
mod input;
mod maps;
mod overlay;
mod panel;
mod reader;
mod saving;
mod scale;
mod session;
mod studio;
mod surface;
mod truth;
mod wishes;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use winit::event_loop::EventLoop;

use crate::frame::Preset;
use crate::scene::{CameraPath, Scene};
use crate::tables::TableSet;
use crate::{Error, Result};

/// What to show.
pub struct WindowOptions {
    /// The scene at the start.
    pub scene: Scene,
    /// The file that it came from, to look out for changes.
    pub file: Option<PathBuf>,
    /// A camera path on the desk at the start.
    pub path: Option<CameraPath>,
    /// The tables to render with.
    pub tables: TableSet,
    /// Time at the start, s.
    pub time: f64,
    /// Quality at the start; without it, what suits the adapter.
    pub preset: Option<Preset>,
    /// Width and height of the window at the start, pixels.
    pub size: [u32; 2],
    /// When the program was started, to tell how long it took to the first picture.
    pub begun: Instant,
}

/// Opens a window and returns when it is closed. Only once in a program, on its first thread.
pub fn run(options: WindowOptions) -> Result<()> {
    let event_loop = EventLoop::<events::Replied>::with_user_event().build();
    let event_loop = event_loop.map_err(|e| window_error(&e.to_string()))?;
    let proxy = Mutex::new(event_loop.create_proxy());
    let wake = Arc::new(move || {
        let proxy = proxy.lock().unwrap_or_else(PoisonError::into_inner);
        // Nobody waits any more when the loop has ended.
        let _ = proxy.send_event(events::Replied);
    });
    let mut app = app::App::new(options, wake);
    event_loop.run_app(&mut app).map_err(|e| window_error(&e.to_string()))?;
    app.failure.take().map_or(Ok(()), Err)
}

/// An error of the window system, without the place in its source that it comes from.
fn window_error(message: &str) -> Error {
    let told = message.strip_prefix("os error at ").and_then(|m| m.split_once(": "));
    Error::Window(told.map_or(message, |(_, reason)| reason).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_tell_the_reason_and_not_the_source() {
        let error = window_error("os error at /a/b.rs:7: no display: none is set");
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("no display: none is set"), "{error}");
        assert!(!error.to_string().contains("b.rs"), "{error}");
        assert!(window_error("plain").to_string().contains("plain"));
    }
}
