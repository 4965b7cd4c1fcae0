//! The window: flying through a scene and changing it.
//!
//! Events go to the panel first, then to the session (scene, camera, time, quality). A redraw lets
//! time go by, makes a frame on the device, and paints it with the panel over it. Where nothing
//! moves, nothing is drawn.

mod angles;
mod app;
mod camera;
mod clock;
mod graphics;
mod input;
mod overlay;
mod panel;
mod screenshot;
mod session;
mod surface;

use winit::event_loop::EventLoop;

use crate::frame::Preset;
use crate::scene::Scene;
use crate::tables::TableSet;
use crate::{Error, Result};

/// What to show.
pub struct WindowOptions {
    /// The scene at the start.
    pub scene: Scene,
    /// The tables to render with.
    pub tables: TableSet,
    /// Time at the start, s.
    pub time: f64,
    /// Quality at the start; without it, what suits the adapter.
    pub preset: Option<Preset>,
    /// Width and height of the window at the start, pixels.
    pub size: [u32; 2],
}

/// Opens a window and returns when it is closed. Only once in a program, on its first thread.
pub fn run(options: WindowOptions) -> Result<()> {
    let event_loop = EventLoop::new().map_err(|e| window_error(&e.to_string()))?;
    let mut app = app::App::new(options);
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
