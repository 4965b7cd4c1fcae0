//! The window's events, and what becomes of them.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{DeviceEvent, DeviceId, ElementState, KeyEvent, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::PhysicalKey;
use winit::window::{CursorGrabMode, Window, WindowId};

use super::graphics::Graphics;
use super::input::Key;
use super::panel::Report;
use super::session::Session;
use super::{WindowOptions, window_error};
use crate::{Error, Result};

/// A notch of the wheel on devices that count in pixels.
const PIXELS_PER_NOTCH: f64 = 50.0;
/// A device that is lost again sooner than this is given up.
const PATIENCE: Duration = Duration::from_secs(10);
/// What a frame after a rest counts for, s: a tap on a key then moves as far as it should.
const FIRST_STEP: f64 = 1.0 / 60.0;
/// Share of a new frame in the shown frame time.
const SMOOTHING: f64 = 0.2;

/// The running program.
pub(super) struct App {
    options: WindowOptions,
    session: Session,
    report: Report,
    // Graphics before the window it shows itself in.
    graphics: Option<Graphics>,
    window: Option<Arc<Window>>,
    looking: bool,
    wants_screenshot: bool,
    /// Whether the quality at the start was chosen for the adapter.
    adapted: bool,
    last_frame: Option<Instant>,
    last_loss: Option<Instant>,
    /// When the panel wants to be painted again.
    repaint_at: Option<Instant>,
    /// Why the program ends, if not because it was asked to.
    pub failure: Option<Error>,
}

impl App {
    /// The program before there is a window.
    pub fn new(options: WindowOptions) -> Self {
        let mut session = Session::new(options.scene.clone(), options.time);
        if let Some(preset) = options.preset {
            session.settings.preset = preset;
        }
        Self {
            options,
            session,
            report: Report::default(),
            graphics: None,
            window: None,
            looking: false,
            wants_screenshot: false,
            adapted: false,
            last_frame: None,
            last_loss: None,
            repaint_at: None,
            failure: None,
        }
    }

    fn open(&self, event_loop: &ActiveEventLoop) -> Result<Arc<Window>> {
        let [width, height] = self.options.size;
        let attributes = Window::default_attributes()
            .with_title("Cumuli")
            .with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop.create_window(attributes);
        Ok(Arc::new(window.map_err(|e| window_error(&e.to_string()))?))
    }

    /// A device for the window, and a quality that suits it.
    fn make_graphics(&mut self, window: &Arc<Window>) -> Result<()> {
        let graphics = Graphics::new(window)?;
        (self.report.adapter, self.report.software) = graphics.adapter();
        if self.report.software && !self.adapted {
            self.session.for_software();
            if let Some(preset) = self.options.preset {
                self.session.settings.preset = preset;
            }
        }
        self.adapted = true;
        self.graphics = Some(graphics);
        Ok(())
    }

    fn redraw(&mut self) -> Result<()> {
        let Some(window) = self.window.clone() else { return Ok(()) };
        let size: [u32; 2] = window.inner_size().into();
        if size.contains(&0) {
            // Minimised: an event tells when there is something to show again.
            self.last_frame = None;
            return Ok(());
        }
        self.step();
        if self.graphics.is_none() {
            self.make_graphics(&window)?;
        }
        let Some(graphics) = &mut self.graphics else { return Ok(()) };
        if graphics.is_cold(&self.session) {
            // Something to look at while shaders compile.
            let said = std::mem::replace(&mut self.report.message, "preparing…".to_owned());
            graphics.present(&mut self.session, &self.report)?;
            self.report.message = said;
        }
        if std::mem::take(&mut self.wants_screenshot) {
            let (tables, session) = (&self.options.tables, &self.session);
            let saved = graphics.screenshot(tables, session, size, Path::new(""));
            self.report.message = match saved {
                Ok(path) => format!("saved {}", path.display()),
                // A full disk is no reason to end.
                Err(e @ (Error::Io { .. } | Error::Input { .. })) => e.to_string(),
                Err(e) => return Err(e),
            };
        }
        graphics.render(&self.options.tables, &self.session, size, &mut self.report)?;
        let again = graphics.present(&mut self.session, &self.report)?;
        self.repaint_at = again.and_then(|wait| Instant::now().checked_add(wait));
        Ok(())
    }

    /// Lets the time since the last frame go by.
    fn step(&mut self) {
        let now = Instant::now();
        let Some(last) = self.last_frame.replace(now) else {
            self.session.step(FIRST_STEP);
            return;
        };
        let seconds = now.duration_since(last).as_secs_f64();
        self.session.step(seconds);
        let shown = &mut self.report.frame_time;
        *shown = if *shown == 0.0 { seconds } else { *shown + SMOOTHING * (seconds - *shown) };
    }

    /// Ends with an error, or starts again with a new device where the old one was lost.
    fn fail(&mut self, event_loop: &ActiveEventLoop, error: Error) {
        let lost = matches!(error, Error::Gpu(_)) && self.graphics.take().is_some();
        let soon = self.last_loss.is_some_and(|at| at.elapsed() < PATIENCE);
        if lost && !soon {
            tracing::warn!("{error}; starting again with a new device");
            self.last_loss = Some(Instant::now());
            self.report.message = error.to_string();
            self.request_redraw();
        } else {
            self.failure = Some(error);
            event_loop.exit();
        }
    }

    fn key(&mut self, event_loop: &ActiveEventLoop, event: &KeyEvent, consumed: bool) {
        let PhysicalKey::Code(code) = event.physical_key else { return };
        let Some(key) = Key::of(code) else { return };
        let down = event.state == ElementState::Pressed;
        // What was typed into the panel is not meant for the flight; but no key stays stuck.
        if down && consumed {
            return;
        }
        match key {
            Key::Push(push) if !event.repeat => self.session.fly.push(push, down),
            Key::Faster => self.session.fly.fast = down,
            _ if !down || event.repeat => {}
            Key::Push(_) => {}
            Key::Pause => self.session.clock.running ^= true,
            Key::Panel => self.session.panel ^= true,
            Key::Home => self.session.fly.reset(),
            Key::Screenshot => self.wants_screenshot = true,
            Key::Quit => event_loop.exit(),
        }
        self.request_redraw();
    }

    /// Starts or ends looking around. The pointer stays in the window and out of sight meanwhile.
    fn look(&mut self, looking: bool) {
        self.looking = looking;
        let Some(window) = &self.window else { return };
        window.set_cursor_visible(!looking);
        let grabbed = if looking {
            window
                .set_cursor_grab(CursorGrabMode::Locked)
                .or_else(|_| window.set_cursor_grab(CursorGrabMode::Confined))
        } else {
            window.set_cursor_grab(CursorGrabMode::None)
        };
        if let Err(error) = grabbed {
            // It works without, as far as the edge of the screen.
            tracing::debug!("the pointer can't be held: {error}");
        }
    }

    fn request_redraw(&self) {
        if let Some(window) = &self.window {
            window.request_redraw();
        }
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_some() {
            return;
        }
        match self.open(event_loop) {
            Ok(window) => {
                self.window = Some(window);
                self.request_redraw();
            }
            Err(error) => {
                self.failure = Some(error);
                event_loop.exit();
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let response = self.graphics.as_mut().map(|g| g.event(&event)).unwrap_or_default();
        // A redraw that asked for the next one would never end.
        if response.repaint && event != WindowEvent::RedrawRequested {
            self.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => {
                if let Some(graphics) = &mut self.graphics {
                    graphics.resize();
                }
                self.request_redraw();
            }
            WindowEvent::Occluded(false) => self.request_redraw(),
            WindowEvent::Focused(false) => {
                self.session.fly.release();
                self.look(false);
            }
            WindowEvent::KeyboardInput { event, .. } => {
                self.key(event_loop, &event, response.consumed);
            }
            WindowEvent::MouseInput { state, .. } => {
                let down = state == ElementState::Pressed;
                if down != self.looking && !(down && response.consumed) {
                    self.look(down);
                }
            }
            WindowEvent::MouseWheel { delta, .. } if !response.consumed => {
                self.session.fly.wheel(match delta {
                    MouseScrollDelta::LineDelta(_, notches) => notches.into(),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_NOTCH,
                });
                self.report.message = format!("{:.0} m/s", self.session.fly.speed);
            }
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.redraw() {
                    self.fail(event_loop, error);
                }
            }
            _ => {}
        }
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        let (DeviceEvent::MouseMotion { delta: (x, y) }, true) = (event, self.looking) else {
            return;
        };
        let Some(window) = &self.window else { return };
        // What is under the pointer stays under it, near the middle of the picture.
        let degrees = self.session.scene.camera.fov_x / f64::from(window.inner_size().width.max(1));
        self.session.fly.look([x, y], degrees);
        self.request_redraw();
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let now = Instant::now();
        let unfinished = self.report.stats.unfinished;
        if self.session.is_lively() || unfinished || self.repaint_at.is_some_and(|at| at <= now) {
            self.repaint_at = None;
            self.request_redraw();
        }
        if !self.session.is_lively() {
            // The time at rest is no part of the next frame's.
            self.last_frame = None;
        }
        event_loop.set_control_flow(match self.repaint_at {
            Some(at) => ControlFlow::WaitUntil(at),
            None => ControlFlow::Wait,
        });
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // While the connection to the display still stands.
        self.graphics = None;
        self.window = None;
    }
}
