//! Reuse: a frame shades one pixel of every block and takes the others from the frame before. Where
//! there is none of use, it shades all; where nothing changes, the next ones shade what is left, until
//! the picture is what it is alone.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::gpu_data::{FrameUniforms, gpu_struct};
use super::targets::Targets;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Side of a workgroup; as in the shader.
const WORKGROUP: u32 = 8;
/// Longest step of the scene's time over which pixels are taken over, s: a fortieth of the turnover of
/// a default field's smallest features.
const LONGEST_STEP: f64 = 2.0;

gpu_struct! {
    /// How the frame before saw what this one sees.
    ReuseUniforms {
        /// Image x axis of the frame before.
        right: [f32; 4],
        /// Image y axis.
        up: [f32; 4],
        /// View axis.
        forward: [f32; 4],
        /// m, the eye now relative to the eye before, both as the clouds drift.
        motion: [f32; 4],
    }
}

/// Which pixels a frame shades.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shading {
    /// All of them.
    All,
    /// One of every block; the others stay.
    Still(u32),
    /// One of every block; the others come from the frame before.
    Moving(u32),
}

/// From where and when a frame is seen.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Its axes.
    pub frame: FrameUniforms,
    /// m.
    pub eye: DVec3,
    /// s.
    pub time: f64,
    /// m/s, of the clouds.
    pub wind: DVec3,
}

/// What the frames before have shaded.
#[derive(Debug, Default)]
pub struct History {
    last: Option<Seen>,
    /// Pixel of the blocks that was shaded last.
    pixel: u32,
    /// Pixels of the blocks that are of the present.
    present: u32,
}

impl History {
    /// Nothing on the device is of use.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Whether some pixels are of the past.
    pub fn is_unfinished(&self, stride: u32) -> bool {
        self.last.is_some() && self.present < stride * stride
    }

    /// What the next frame shades. `changed`: it would not show what the last one does.
    pub fn shading(&self, stride: u32, changed: bool, now: &Seen) -> Shading {
        let next = (self.pixel + 1) % (stride * stride);
        match &self.last {
            _ if stride == 1 => Shading::All,
            Some(_) if !changed => Shading::Still(next),
            Some(last) if (now.time - last.time).abs() <= LONGEST_STEP => Shading::Moving(next),
            _ => Shading::All,
        }
    }

    /// Notes what has been shaded.
    pub fn done(&mut self, stride: u32, shading: Shading, now: Seen) {
        self.last = Some(now);
        (self.pixel, self.present) = match shading {
            Shading::All => (self.pixel, stride * stride),
            Shading::Still(pixel) => (pixel, self.present + 1),
            Shading::Moving(pixel) => (pixel, 1),
        };
    }

    /// How the last frame saw what a frame sees now.
    pub fn uniforms(&self, now: &Seen) -> Option<ReuseUniforms> {
        let last = self.last.as_ref()?;
        let motion = now.eye - last.eye - now.wind * (now.time - last.time);
        let FrameUniforms { right, up, forward, .. } = last.frame;
        Some(ReuseUniforms { right, up, forward, motion: motion.as_vec3().extend(0.0).to_array() })
    }
}

/// The pipeline.
pub struct ReusePass {
    kernel: Kernel,
}

/// Textures of one picture size.
pub struct ReuseJob {
    /// One pixel of every block: rgb radiance, a transmittance.
    pub fresh: wgpu::TextureView,
    /// Their distances, m.
    pub fresh_distance: wgpu::TextureView,
    history: wgpu::Texture,
    history_distance: wgpu::Texture,
    uniforms: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    bytes: u64,
}

impl ReusePass {
    /// Compiles the pass.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary) -> Result<Self> {
        let file = crate::shader_file!("frame/reuse.wgsl");
        Ok(Self { kernel: Kernel::new(gpu, library, file, &[], &[])? })
    }

    /// Makes the textures for blocks of `stride` x `stride` pixels. `opaque`: distances of what is opaque, and
    /// whether there may be any: then all pixels of a block may be new.
    pub fn job(
        &self,
        gpu: &Gpu,
        frame: &wgpu::Buffer,
        targets: &Targets,
        stride: u32,
        opaque: (&wgpu::TextureView, bool),
    ) -> ReuseJob {
        let blocks = targets.size.map(|s| s.div_ceil(stride));
        let fresh_size = if opaque.1 { blocks.map(|s| s * stride) } else { blocks };
        let mut bytes = 0;
        let mut texture = |label, size: [u32; 2], format: wgpu::TextureFormat| {
            let texels = u64::from(size[0]) * u64::from(size[1]);
            bytes += texels * u64::from(format.block_copy_size(None).unwrap_or(0));
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::STORAGE_BINDING
                    | wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_SRC
                    | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        };
        let (colour, metres) = (wgpu::TextureFormat::Rgba32Float, wgpu::TextureFormat::R32Float);
        let fresh = texture("new clouds", fresh_size, colour);
        let fresh_distance = texture("new distance", fresh_size, metres);
        let history = texture("clouds before", targets.size, colour);
        let history_distance = texture("distance before", targets.size, metres);
        let uniforms = buffers::uniform(gpu, "reuse", &ReuseUniforms::zeroed());
        let view = |t: &wgpu::Texture| t.create_view(&Default::default());
        let views = [&fresh, &fresh_distance, &history, &history_distance].map(view);
        let [new, new_distance, old, old_distance] = views.each_ref();
        let bindings = self.kernel.bind(
            gpu,
            &[
                frame.as_entire_binding(),
                uniforms.as_entire_binding(),
                wgpu::BindingResource::TextureView(new),
                wgpu::BindingResource::TextureView(new_distance),
                wgpu::BindingResource::TextureView(old),
                wgpu::BindingResource::TextureView(old_distance),
                wgpu::BindingResource::TextureView(&targets.clouds),
                wgpu::BindingResource::TextureView(&targets.distance),
                wgpu::BindingResource::TextureView(opaque.0),
            ],
        );
        let [fresh, fresh_distance, ..] = views;
        ReuseJob { fresh, fresh_distance, history, history_distance, uniforms, bindings, bytes }
    }

    /// Records the pass: the last frame's clouds are kept first, then their place is filled anew.
    pub fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        job: &ReuseJob,
        targets: &Targets,
        before: &ReuseUniforms,
    ) {
        gpu.queue.write_buffer(&job.uniforms, 0, bytemuck::bytes_of(before));
        for (from, to) in
            [(&targets.clouds, &job.history), (&targets.distance, &job.history_distance)]
        {
            let from = from.texture();
            encoder.copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("reuse"),
            timestamp_writes: None,
        });
        let [width, height] = targets.size.map(|s| s.div_ceil(WORKGROUP));
        pass.set_pipeline(self.kernel.pipeline("reuse"));
        pass.set_bind_group(0, &job.bindings, &[]);
        pass.dispatch_workgroups(width, height, 1);
    }
}

impl ReuseJob {
    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}
