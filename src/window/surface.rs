//! What the window shows pictures through. It changes size, goes out of date and gets lost.

use std::sync::Arc;

use winit::window::Window;

use crate::gpu::Gpu;
use crate::{Error, Result};

/// A window's surface, configured for a device.
pub(super) struct WindowSurface {
    instance: wgpu::Instance,
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: Option<wgpu::SurfaceConfiguration>,
    /// Whether it has to be configured again before its next use.
    stale: bool,
    /// Whether it is to be taken for lost.
    lost: bool,
}

impl WindowSurface {
    /// A surface for the window, with the device that can present to it.
    pub fn new(window: Arc<Window>) -> Result<(Self, Gpu)> {
        let descriptor = wgpu::InstanceDescriptor {
            backends: wgpu::Backends::PRIMARY,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        };
        let instance = wgpu::Instance::new(descriptor.with_env());
        let surface = create(&instance, &window)?;
        let gpu = Gpu::from_instance(&instance, Some(&surface))?;
        let mut surface =
            Self { instance, window, surface, config: None, stale: true, lost: false };
        surface.config = Some(surface.choose(&gpu)?);
        Ok((surface, gpu))
    }

    /// Format of the textures it presents.
    pub fn format(&self) -> Option<wgpu::TextureFormat> {
        self.config.as_ref().map(|c| c.format)
    }

    /// The window has changed.
    pub fn resize(&mut self) {
        self.stale = true;
    }

    /// The next texture is not to be had: the surface is lost, as when a display goes.
    pub fn lose(&mut self) {
        self.lost = true;
    }

    /// The next texture to paint on. None where there is nothing to paint on now: the window is
    /// hidden, has no area, or is just changing; then it is worth trying again later.
    pub fn next(&mut self, gpu: &Gpu) -> Result<Option<wgpu::SurfaceTexture>> {
        // Once more after the surface was made fit again; if that doesn't help, in the next frame.
        for _ in 0..2 {
            if !self.configure(gpu) {
                return Ok(None);
            }
            let next = if std::mem::take(&mut self.lost) {
                wgpu::CurrentSurfaceTexture::Lost
            } else {
                self.surface.get_current_texture()
            };
            match next {
                wgpu::CurrentSurfaceTexture::Success(texture) => return Ok(Some(texture)),
                wgpu::CurrentSurfaceTexture::Suboptimal(texture) => {
                    self.stale = true;
                    return Ok(Some(texture));
                }
                wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Occluded => {
                    return Ok(None);
                }
                wgpu::CurrentSurfaceTexture::Outdated => self.stale = true,
                wgpu::CurrentSurfaceTexture::Lost => {
                    self.surface = create(&self.instance, &self.window)?;
                    self.stale = true;
                    tracing::warn!("the surface was lost; going on with a new one");
                }
                wgpu::CurrentSurfaceTexture::Validation => {
                    gpu.check()?;
                    self.stale = true;
                }
            }
        }
        Ok(None)
    }

    /// Fits the surface to the window; false where the window has no area.
    fn configure(&mut self, gpu: &Gpu) -> bool {
        let size = self.window.inner_size();
        let Some(config) = self.config.as_mut().filter(|_| size.width > 0 && size.height > 0)
        else {
            return false;
        };
        if self.stale {
            let most = gpu.device.limits().max_texture_dimension_2d;
            (config.width, config.height) = (size.width.min(most), size.height.min(most));
            self.surface.configure(&gpu.device, config);
            self.stale = false;
        }
        true
    }

    fn choose(&self, gpu: &Gpu) -> Result<wgpu::SurfaceConfiguration> {
        let unfit = || Error::Window("the adapter can't present to this window".to_owned());
        let capabilities = self.surface.get_capabilities(&gpu.adapter);
        let mut config = self.surface.get_default_config(&gpu.adapter, 1, 1).ok_or_else(unfit)?;
        // The picture and the panel are sRGB values already: no conversion on the way.
        let plain = capabilities.formats.iter().find(|f| {
            matches!(f, wgpu::TextureFormat::Rgba8Unorm | wgpu::TextureFormat::Bgra8Unorm)
        });
        config.format = *plain.unwrap_or(&config.format);
        config.present_mode = wgpu::PresentMode::AutoVsync;
        Ok(config)
    }
}

fn create(instance: &wgpu::Instance, window: &Arc<Window>) -> Result<wgpu::Surface<'static>> {
    instance.create_surface(window.clone()).map_err(|e| Error::Window(e.to_string()))
}
