//! What the window shows itself with: made together, and made again when the device is lost.

use std::sync::Arc;
use std::time::Duration;

use winit::window::Window;

use super::overlay::Overlay;
use super::studio::Image;
use super::surface::WindowSurface;
use crate::gpu::Gpu;
use crate::{Error, Result};

/// Device, surface and panel.
pub(super) struct Graphics {
    // In this order they go: what was made on the device before the device.
    overlay: Overlay,
    surface: WindowSurface,
    gpu: Gpu,
}

impl Graphics {
    /// Makes a device for the window.
    pub fn new(window: &Arc<Window>) -> Result<Self> {
        let (surface, gpu) = WindowSurface::new(window.clone())?;
        let format = surface
            .format()
            .ok_or_else(|| Error::Window("the adapter can't present to this window".to_owned()))?;
        let overlay = Overlay::new(&gpu, window.clone(), format);
        Ok(Self { overlay, surface, gpu })
    }

    /// The adapter's name, and whether it is a program instead of a graphics card.
    pub fn adapter(&self) -> (String, bool) {
        let info = self.gpu.adapter.get_info();
        (info.name, info.device_type == wgpu::DeviceType::Cpu)
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Longest side of a picture, pixels.
    pub fn most_pixels(&self) -> u32 {
        self.gpu.device.limits().max_texture_dimension_2d
    }

    /// Hands an event to the panel first; whether it asks for a new frame.
    pub fn event(&mut self, event: &winit::event::WindowEvent) -> bool {
        self.overlay.event(event)
    }

    /// Whether the pointer is over the panel.
    pub fn is_panel_under_pointer(&self) -> bool {
        self.overlay.is_under_pointer()
    }

    /// Whether a text is being typed.
    pub fn is_typing(&self) -> bool {
        self.overlay.is_typing()
    }

    /// Whether a list is open.
    pub fn is_list_open(&self) -> bool {
        self.overlay.is_list_open()
    }

    /// The window has changed its size.
    pub fn resize(&mut self) {
        self.surface.resize();
    }

    /// The next time something is painted, the surface is lost.
    pub fn lose_surface(&mut self) {
        self.surface.lose();
    }

    /// Shows this behind the panel from now on: as the picture (0), or beside it (1).
    pub fn set_picture(&mut self, place: usize, image: Option<&Image>) {
        self.overlay.set_picture(&self.gpu, place, image);
    }

    /// Puts the pictures, with `split` between them, and what `ui` shows on the screen. None where
    /// the window shows nothing now; otherwise the time after which the panel wants to be painted
    /// again.
    pub fn present(
        &mut self,
        split: f32,
        ui: impl FnMut(&egui::Context),
    ) -> Result<Option<Duration>> {
        let Some(target) = self.surface.next(&self.gpu)? else {
            return Ok(None);
        };
        let again = self.overlay.paint(&self.gpu, &target.texture, split, ui);
        self.gpu.queue.present(target);
        self.gpu.check()?;
        Ok(Some(again))
    }
}
