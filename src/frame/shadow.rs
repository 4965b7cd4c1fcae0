//! Shadow: deep shadow maps of the clouds, seen from the sun.

use super::gpu_data::{SHADOW_MAPS, ShadowUniforms};
use super::picture_lists::PictureLists;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Side of a workgroup; as in the shader.
const WORKGROUP: u32 = 8;
/// Bytes of a texel.
const TEXEL_BYTES: u64 = 16;

/// The pipeline.
pub struct ShadowPass {
    kernel: Kernel,
}

/// The maps and what they are made from.
pub struct ShadowJob {
    /// Where the maps lie.
    pub uniforms: wgpu::Buffer,
    /// Nodes of each texel, a layer for each map.
    pub texture: wgpu::Texture,
    resolution: u32,
}

impl ShadowPass {
    /// Compiles the pass with `steps` steps in a radius; it reads the tables (group 1).
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        steps: u32,
        tables: &wgpu::BindGroupLayout,
    ) -> Result<Self> {
        let file = crate::shader_file!("frame/shadow.wgsl");
        let defs = [("SHADOW_STEPS", steps)];
        Ok(Self { kernel: Kernel::new(gpu, library, file, &defs, &[tables])? })
    }

    /// Makes the maps.
    pub fn job(&self, gpu: &Gpu, resolution: u32) -> ShadowJob {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow maps"),
            size: wgpu::Extent3d {
                width: resolution,
                height: resolution,
                depth_or_array_layers: SHADOW_MAPS as u32,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let uniforms =
            buffers::uniform(gpu, "shadow maps", &<ShadowUniforms as bytemuck::Zeroable>::zeroed());
        ShadowJob { uniforms, texture, resolution }
    }

    /// Binds the sun's lists.
    pub fn bind(
        &self,
        gpu: &Gpu,
        job: &ShadowJob,
        frame: &wgpu::Buffer,
        view: &wgpu::Buffer,
        particles: &wgpu::Buffer,
        lists: &PictureLists,
    ) -> wgpu::BindGroup {
        self.kernel.bind(
            gpu,
            &[
                frame.as_entire_binding(),
                view.as_entire_binding(),
                job.uniforms.as_entire_binding(),
                particles.as_entire_binding(),
                lists.lists.tile_offsets.as_entire_binding(),
                lists.lists.tile_entries.as_entire_binding(),
                wgpu::BindingResource::TextureView(&job.view()),
            ],
        )
    }

    /// Records the pass.
    pub fn encode(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        job: &ShadowJob,
        bindings: &wgpu::BindGroup,
        tables: &wgpu::BindGroup,
        maps: u32,
    ) {
        let groups = job.resolution.div_ceil(WORKGROUP);
        pass.set_pipeline(self.kernel.pipeline("shadow"));
        pass.set_bind_group(0, bindings, &[]);
        pass.set_bind_group(1, tables, &[]);
        pass.dispatch_workgroups(groups, groups, maps);
    }
}

impl ShadowJob {
    /// All maps as one array.
    pub fn view(&self) -> wgpu::TextureView {
        self.texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        })
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        u64::from(self.resolution * self.resolution) * SHADOW_MAPS as u64 * TEXEL_BYTES
    }
}
