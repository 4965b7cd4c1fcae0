//! Everything that lives on the device: made together, and made again when the device is lost.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use winit::window::Window;

use super::overlay::Overlay;
use super::panel::{self, Report};
use super::screenshot;
use super::session::Session;
use super::surface::WindowSurface;
use crate::frame::{Picture, RenderSettings, Renderer};
use crate::gpu::Gpu;
use crate::scene::Medium;
use crate::tables::TableSet;
use crate::{Error, Result};

/// Device, surface, panel, and the clouds.
pub(super) struct Graphics {
    // In this order they go: what was made on the device before the device.
    clouds: Option<Clouds>,
    overlay: Overlay,
    surface: WindowSurface,
    gpu: Gpu,
}

/// A renderer with what it was made for.
struct Clouds {
    renderer: Renderer,
    settings: RenderSettings,
    medium: Medium,
}

impl Graphics {
    /// Makes a device for the window. The clouds come with the first frame.
    pub fn new(window: &Arc<Window>) -> Result<Self> {
        let (surface, gpu) = WindowSurface::new(window.clone())?;
        let format = surface
            .format()
            .ok_or_else(|| Error::Window("the adapter can't present to this window".to_owned()))?;
        let overlay = Overlay::new(&gpu, window.clone(), format);
        Ok(Self { clouds: None, overlay, surface, gpu })
    }

    /// The adapter's name, and whether it is a program instead of a graphics card.
    pub fn adapter(&self) -> (String, bool) {
        let info = self.gpu.adapter.get_info();
        (info.name, info.device_type == wgpu::DeviceType::Cpu)
    }

    /// Hands an event to the panel first.
    pub fn event(&mut self, event: &winit::event::WindowEvent) -> egui_winit::EventResponse {
        self.overlay.event(event)
    }

    /// The window has changed its size.
    pub fn resize(&mut self) {
        self.surface.resize();
    }

    /// Whether the next frame has to compile shaders first.
    pub fn is_cold(&self, session: &Session) -> bool {
        !self.clouds.as_ref().is_some_and(|c| c.fits(session))
    }

    /// Makes the frame that belongs to a window of this size.
    pub fn render(
        &mut self,
        tables: &TableSet,
        session: &Session,
        window: [u32; 2],
        report: &mut Report,
    ) -> Result<()> {
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        let size = session.picture_size(window, most);
        let clouds = Self::clouds(&mut self.clouds, &self.gpu, tables, session)?;
        report.stats = clouds.renderer.frame(&session.seen(), session.clock.time, size)?;
        report.size = size;
        if let Some(texture) = clouds.renderer.display() {
            self.overlay.set_picture(&self.gpu, texture);
        }
        Ok(())
    }

    /// Puts the last frame and the panel on the screen. None where the window shows nothing now;
    /// otherwise the time after which the panel wants to be painted again.
    pub fn present(&mut self, session: &mut Session, report: &Report) -> Result<Option<Duration>> {
        let Some(target) = self.surface.next(&self.gpu)? else {
            return Ok(None);
        };
        let again = self.overlay.paint(&self.gpu, &target.texture, |ctx| {
            if session.panel {
                panel::show(ctx, session, report);
            }
        });
        self.gpu.queue.present(target);
        self.gpu.check()?;
        Ok(Some(again))
    }

    /// Saves the view at the window's full size into a folder.
    pub fn screenshot(
        &mut self,
        tables: &TableSet,
        session: &Session,
        window: [u32; 2],
        folder: &Path,
    ) -> Result<PathBuf> {
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        let size = window.map(|side| side.clamp(1, most));
        let clouds = Self::clouds(&mut self.clouds, &self.gpu, tables, session)?;
        // Nothing of it is left for later frames.
        clouds.renderer.forget();
        let picture: Picture = clouds.renderer.render(&session.seen(), session.clock.time, size)?;
        screenshot::save(folder, &picture)
    }

    /// The renderer for a session, made again where the one there is doesn't fit.
    fn clouds<'a>(
        clouds: &'a mut Option<Clouds>,
        gpu: &Gpu,
        tables: &TableSet,
        session: &Session,
    ) -> Result<&'a mut Clouds> {
        let made = match clouds.take().filter(|c| c.fits(session)) {
            Some(clouds) => clouds,
            None => Clouds {
                renderer: Renderer::new(gpu, tables, &session.scene, &session.settings)?,
                settings: session.settings,
                medium: session.scene.medium,
            },
        };
        Ok(clouds.insert(made))
    }
}

impl Clouds {
    fn fits(&self, session: &Session) -> bool {
        self.settings == session.settings && self.medium == session.scene.medium
    }
}
