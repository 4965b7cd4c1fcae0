//! The window's events, and what becomes of them.

use std::time::{Duration, Instant};

use winit::application::ApplicationHandler;
use winit::event::{DeviceEvent, DeviceId, ElementState, KeyEvent, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::PhysicalKey;
use winit::window::WindowId;

use super::app::App;
use super::graphics::Graphics;
use super::input::Key;

/// A notch of the wheel on devices that count in pixels.
const PIXELS_PER_NOTCH: f64 = 50.0;
/// How often the files of the scene are looked at.
const LOOK_INTERVAL: Duration = Duration::from_millis(250);

/// The thread that makes pictures has a reply.
pub(super) struct Replied;

impl App {
    fn key(&mut self, event: &KeyEvent, typing: bool) {
        let PhysicalKey::Code(code) = event.physical_key else { return };
        let Some(key) = Key::of(code) else { return };
        let down = event.state == ElementState::Pressed;
        // What is typed into the panel is not meant for the flight; but no key stays stuck.
        let list_open = self.graphics.as_ref().is_some_and(Graphics::is_list_open);
        if down && (typing || (key == Key::Quit && list_open)) {
            return;
        }
        self.session.key(key, down, event.repeat);
        self.request_redraw();
    }

    fn settle(&mut self, event_loop: &ActiveEventLoop, done: crate::Result<()>) {
        if let Err(error) = done {
            self.fail(event_loop, error);
        }
    }
}

impl ApplicationHandler<Replied> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_some() {
            return;
        }
        match self.open(event_loop) {
            Ok(()) => self.request_redraw(),
            Err(error) => {
                self.failure = Some(error);
                event_loop.exit();
            }
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, _: Replied) {
        // Even where nothing is painted, as in a window that is minimised.
        let taken = self.take_replies();
        self.settle(event_loop, taken);
        self.request_redraw();
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let typing = self.graphics.as_ref().is_some_and(Graphics::is_typing);
        let repaint = self.graphics.as_mut().is_some_and(|g| g.event(&event));
        let on_panel = self.graphics.as_ref().is_some_and(Graphics::is_panel_under_pointer);
        // A redraw that asked for the next one would never end.
        if repaint && event != WindowEvent::RedrawRequested {
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
            WindowEvent::DroppedFile(path) => self.load(&path),
            WindowEvent::Occluded(false) => self.request_redraw(),
            WindowEvent::Focused(false) => {
                self.session.fly.release();
                self.look(false);
            }
            WindowEvent::KeyboardInput { event, .. } => self.key(&event, typing),
            WindowEvent::MouseInput { state, .. } => {
                let down = state == ElementState::Pressed;
                if down != self.looking && !(down && on_panel) {
                    self.look(down);
                }
            }
            WindowEvent::MouseWheel { delta, .. } if !on_panel => {
                self.session.fly.wheel(match delta {
                    MouseScrollDelta::LineDelta(_, notches) => notches.into(),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_NOTCH,
                });
                self.report.message.tell(format!("{:.0} m/s", self.session.fly.speed));
                self.request_redraw();
            }
            WindowEvent::RedrawRequested => {
                let drawn = self.redraw();
                self.settle(event_loop, drawn);
            }
            _ => {}
        }
        self.grant(event_loop);
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        let (DeviceEvent::MouseMotion { delta: (x, y) }, true) = (event, self.looking) else {
            return;
        };
        let Some(window) = &self.window else { return };
        // What is under the pointer stays under it, near the middle of the picture.
        let degrees = self.session.fly.camera().fov_x / f64::from(window.inner_size().width.max(1));
        self.session.fly.look([x, y], degrees);
        self.request_redraw();
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let now = Instant::now();
        // While a picture is made its reply is waited for: time goes on with it.
        let moves = self.session.is_lively() && !self.is_busy() && !self.hidden;
        // Not every window system tells when a window is shown again.
        if self.hidden && self.look_at <= now {
            self.request_redraw();
        }
        if moves || self.repaint_at.is_some_and(|at| at <= now) {
            self.repaint_at = None;
            self.request_redraw();
        }
        let watching = self.is_watching();
        if (watching || self.hidden) && self.look_at <= now {
            self.look_at = now + LOOK_INTERVAL;
            if watching {
                self.look_at_files();
            }
        }
        let look_at = (watching || self.hidden).then_some(self.look_at);
        let next = [self.repaint_at, look_at].into_iter().flatten().min();
        event_loop.set_control_flow(next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        self.close();
    }
}
