//! egui in the window: takes the events, paints the picture of the clouds and the panel over it.

use std::sync::Arc;
use std::time::Duration;

use egui_wgpu::ScreenDescriptor;
use winit::event::WindowEvent;
use winit::window::Window;

use super::studio::Image;
use crate::gpu::Gpu;

/// egui with its textures on one device.
pub(super) struct Overlay {
    window: Arc<Window>,
    state: egui_winit::State,
    renderer: egui_wgpu::Renderer,
    /// Pictures behind the panel: that of the clouds, and one to compare with.
    pictures: [Option<Backdrop>; 2],
    /// Where the pointer is, in points. egui itself learns it with the next frame only: a press that
    /// follows a quick movement would be judged by where the pointer was.
    pointer: Option<egui::Pos2>,
    /// Pixels a point as the last event told them, over those that winit's window tells: on X11 it goes on
    /// with the old ones when the display's scale changes (winit 0.30), and egui asks the window.
    beside_winit: f32,
}

/// A texture that egui knows.
struct Backdrop {
    texture: wgpu::Texture,
    id: egui::TextureId,
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
        Self { window, state, renderer, pictures: [None, None], pointer: None, beside_winit: 1.0 }
    }

    /// Hands an event on; whether it asks for a new frame.
    pub fn event(&mut self, event: &WindowEvent) -> bool {
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                let scale = egui_winit::pixels_per_point(self.state.egui_ctx(), &self.window);
                let at = position.cast::<f32>();
                self.pointer = Some(egui::pos2(at.x, at.y) / scale);
            }
            WindowEvent::CursorLeft { .. } => self.pointer = None,
            WindowEvent::ScaleFactorChanged { scale_factor, .. } => {
                let beside = (scale_factor / self.window.scale_factor()) as f32;
                let ctx = self.state.egui_ctx();
                // A zoom that was chosen by keys stays.
                ctx.set_zoom_factor(ctx.zoom_factor() * beside / self.beside_winit);
                self.beside_winit = beside;
            }
            _ => {}
        }
        self.state.on_window_event(&self.window, event).repaint
    }

    /// Whether the pointer is over the panel or another window of egui's.
    pub fn is_under_pointer(&self) -> bool {
        let layer = self.pointer.and_then(|at| self.state.egui_ctx().layer_id_at(at));
        layer.is_some_and(|layer| layer.order != egui::Order::Background)
    }

    /// Whether a text is being typed: then keys are not meant for the flight.
    pub fn is_typing(&self) -> bool {
        self.state.egui_ctx().egui_wants_keyboard_input()
    }

    /// Whether a list is open, which Escape closes.
    pub fn is_list_open(&self) -> bool {
        egui::Popup::is_any_open(self.state.egui_ctx())
    }

    /// Shows this behind the panel from now on: as the picture (0), or beside it (1).
    pub fn set_picture(&mut self, gpu: &Gpu, place: usize, image: Option<&Image>) {
        let Some(slot) = self.pictures.get_mut(place) else { return };
        let texture = match image {
            None => {
                if let Some(old) = slot.take() {
                    self.renderer.free_texture(&old.id);
                }
                return;
            }
            Some(Image::Texture(texture)) => texture.clone(),
            Some(Image::Pixels(size, pixels)) => {
                let fits = |b: &Backdrop| [b.texture.width(), b.texture.height()] == *size;
                let old = slot.as_ref().filter(|b| fits(b)).map(|b| b.texture.clone());
                let texture = old.unwrap_or_else(|| empty_texture(gpu, *size));
                upload(gpu, &texture, *size, pixels);
                texture
            }
        };
        if slot.as_ref().is_some_and(|shown| shown.texture == texture) {
            return;
        }
        let view = texture.create_view(&Default::default());
        let filter = wgpu::FilterMode::Linear;
        let id = match slot.take() {
            Some(Backdrop { id, .. }) => {
                let (device, renderer) = (&gpu.device, &mut self.renderer);
                renderer.update_egui_texture_from_wgpu_texture(device, &view, filter, id);
                id
            }
            None => self.renderer.register_native_texture(&gpu.device, &view, filter),
        };
        *slot = Some(Backdrop { texture, id });
    }

    /// Paints the pictures, the second one from `split` (0 to 1 from the left) on, and what `ui`
    /// shows over them. Returns after which time egui wants to paint again, if nothing else happens.
    pub fn paint(
        &mut self,
        gpu: &Gpu,
        target: &wgpu::Texture,
        split: f32,
        mut ui: impl FnMut(&egui::Context),
    ) -> Duration {
        let input = self.state.take_egui_input(&self.window);
        let ctx = self.state.egui_ctx().clone();
        let pictures = self.pictures.each_ref().map(|p| p.as_ref().map(|b| b.id));
        let mut output = ctx.run_ui(input, |root| {
            backdrop(root.ctx(), pictures, split);
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

/// Paints the pictures over the whole window.
fn backdrop(ctx: &egui::Context, pictures: [Option<egui::TextureId>; 2], split: f32) {
    let area = ctx.content_rect();
    let painter = ctx.layer_painter(egui::LayerId::background());
    let whole = egui::Rect::from_min_max(egui::Pos2::ZERO, egui::pos2(1.0, 1.0));
    if let Some(id) = pictures[0] {
        painter.image(id, area, whole, egui::Color32::WHITE);
    }
    if let Some(id) = pictures[1] {
        let x = egui::lerp(area.x_range(), split);
        let right = egui::Rect::from_min_max(egui::pos2(x, area.top()), area.max);
        painter.with_clip_rect(right).image(id, area, whole, egui::Color32::WHITE);
        painter.vline(x, area.y_range(), (1.0, egui::Color32::WHITE));
    }
}

/// A texture for sRGB values that come from the host.
fn empty_texture(gpu: &Gpu, size: [u32; 2]) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture from the host"),
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

fn upload(gpu: &Gpu, texture: &wgpu::Texture, size: [u32; 2], pixels: &[[u8; 4]]) {
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(4 * size[0]),
        rows_per_image: None,
    };
    let bytes = bytemuck::cast_slice(pixels);
    gpu.queue.write_texture(texture.as_image_copy(), bytes, layout, extent(size));
}

fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
}
