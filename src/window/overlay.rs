//! egui in the window: takes the events, paints the picture of the clouds and the panel over it.

use std::sync::Arc;
use std::time::Duration;

use egui_wgpu::ScreenDescriptor;
use winit::event::WindowEvent;
use winit::window::Window;

use crate::gpu::Gpu;

/// egui with its textures on one device.
pub(super) struct Overlay {
    window: Arc<Window>,
    state: egui_winit::State,
    renderer: egui_wgpu::Renderer,
    picture: Option<(wgpu::Texture, egui::TextureId)>,
}

impl Overlay {
    /// egui for a window whose surface has this format.
    pub fn new(gpu: &Gpu, window: Arc<Window>, format: wgpu::TextureFormat) -> Self {
        let most = gpu.device.limits().max_texture_dimension_2d as usize;
        let state = egui_winit::State::new(
            egui::Context::default(),
            egui::ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            window.theme(),
            Some(most),
        );
        let options = egui_wgpu::RendererOptions { dithering: false, ..Default::default() };
        let renderer = egui_wgpu::Renderer::new(&gpu.device, format, options);
        Self { window, state, renderer, picture: None }
    }

    /// Hands an event on; `consumed` where it was meant for the panel.
    pub fn event(&mut self, event: &WindowEvent) -> egui_winit::EventResponse {
        self.state.on_window_event(&self.window, event)
    }

    /// Shows this texture behind the panel from now on; sRGB values.
    pub fn set_picture(&mut self, gpu: &Gpu, texture: &wgpu::Texture) {
        if self.picture.as_ref().is_some_and(|(shown, _)| shown == texture) {
            return;
        }
        let view = texture.create_view(&Default::default());
        let filter = wgpu::FilterMode::Linear;
        let id = match self.picture.take() {
            Some((_, id)) => {
                let (device, renderer) = (&gpu.device, &mut self.renderer);
                renderer.update_egui_texture_from_wgpu_texture(device, &view, filter, id);
                id
            }
            None => self.renderer.register_native_texture(&gpu.device, &view, filter),
        };
        self.picture = Some((texture.clone(), id));
    }

    /// Paints the picture and what `ui` shows over it. Returns after which time egui wants to
    /// paint again, if nothing else happens.
    pub fn paint(
        &mut self,
        gpu: &Gpu,
        target: &wgpu::Texture,
        mut ui: impl FnMut(&egui::Context),
    ) -> Duration {
        let input = self.state.take_egui_input(&self.window);
        let ctx = self.state.egui_ctx().clone();
        let picture = self.picture.as_ref().map(|(_, id)| *id);
        let mut output = ctx.run_ui(input, |root| {
            if let Some(id) = picture {
                let uv = egui::Rect::from_min_max(egui::Pos2::ZERO, egui::pos2(1.0, 1.0));
                let painter = root.ctx().layer_painter(egui::LayerId::background());
                painter.image(id, root.ctx().content_rect(), uv, egui::Color32::WHITE);
            }
            ui(root.ctx());
        });
        self.state
            .handle_platform_output(&self.window, std::mem::take(&mut output.platform_output));

        let (device, queue) = (&gpu.device, &gpu.queue);
        for (id, deltas) in std::mem::take(&mut output.textures_delta.set) {
            for delta in &deltas {
                self.renderer.update_texture(device, queue, id, delta);
            }
        }
        let shapes = std::mem::take(&mut output.shapes);
        let jobs = ctx.tessellate(shapes, output.pixels_per_point);
        let screen = ScreenDescriptor {
            size_in_pixels: [target.width(), target.height()],
            pixels_per_point: output.pixels_per_point,
        };
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut commands =
            self.renderer.update_buffers(device, queue, &mut encoder, &jobs, &screen);
        let view = target.create_view(&Default::default());
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        self.renderer.render(&mut pass.forget_lifetime(), &jobs, &screen);
        commands.push(encoder.finish());
        queue.submit(commands);
        for id in std::mem::take(&mut output.textures_delta.free) {
            self.renderer.free_texture(&id);
        }
        let viewport = output.viewport_output.get(&egui::ViewportId::ROOT);
        viewport.map_or(Duration::MAX, |v| v.repaint_delay)
    }
}
