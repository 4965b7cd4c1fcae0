//! Blend areas: where the blend has something to do. It is dispatched for those areas alone, by a count that the host
//! does not know; the others' pixels become clear.

use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary};

/// Sides of an area, pixels or blocks of them; as in the shader, and as a workgroup of the blend.
pub const AREA: u32 = 8;

/// The pipelines.
pub struct BlendAreas {
    kernel: Kernel,
}

/// What they are bound to, and the arguments of the blend's dispatch.
pub struct AreasJob {
    bindings: wgpu::BindGroup,
    groups: wgpu::Buffer,
}

/// The blend's lists, counts and targets.
pub struct AreasInputs<'a> {
    /// `FrameUniforms`.
    pub frame: &'a wgpu::Buffer,
    /// Where the lists of tiles begin.
    pub tile_offsets: &'a wgpu::Buffer,
    /// As of the blend; [`area_words`] more.
    pub counts: &'a wgpu::Buffer,
    /// Clouds, distance.
    pub targets: [&'a wgpu::TextureView; 2],
}

/// Words that hold the areas of a picture of so many blocks of pixels, and their number.
pub fn area_words(blocks: [u32; 2]) -> usize {
    let [width, height] = blocks.map(|s| s.div_ceil(AREA) as usize);
    1 + width * height
}

impl BlendAreas {
    /// Compiles them for tiles of so many blocks of pixels a side.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary, tile: u32) -> Result<Self> {
        let file = crate::shader_file!("frame/blend_areas.wgsl");
        Ok(Self { kernel: Kernel::new(gpu, library, file, &[("SCREEN_TILE", tile)], &[])? })
    }

    /// Binds them.
    pub fn job(&self, gpu: &Gpu, inputs: &AreasInputs<'_>) -> AreasJob {
        let groups = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("workgroups of the blend"),
            size: size_of::<[u32; 3]>() as u64,
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::INDIRECT
                | wgpu::BufferUsages::COPY_DST
                | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let [clouds, distance] = inputs.targets.map(wgpu::BindingResource::TextureView);
        let bindings = self.kernel.bind(
            gpu,
            &[
                inputs.frame.as_entire_binding(),
                inputs.tile_offsets.as_entire_binding(),
                inputs.counts.as_entire_binding(),
                groups.as_entire_binding(),
                clouds,
                distance,
            ],
        );
        AreasJob { bindings, groups }
    }

    /// Records them for blocks of pixels: columns, rows, and how many pixels of each.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        [columns, rows, pixels]: [u32; 3],
        job: &AreasJob,
    ) {
        gpu.queue.write_buffer(&job.groups, 0, bytemuck::bytes_of(&[0, 0, pixels]));
        let [width, height] = [columns, rows].map(|s| s.div_ceil(AREA));
        pass.set_bind_group(0, &job.bindings, &[]);
        pass.set_pipeline(self.kernel.pipeline("clear"));
        pass.dispatch_workgroups(width, height, pixels);
        pass.set_pipeline(self.kernel.pipeline("gather"));
        pass.dispatch_workgroups(1, 1, 1);
    }
}

impl AreasJob {
    /// Arguments of the blend's dispatch: x, y, z.
    pub fn groups(&self) -> &wgpu::Buffer {
        &self.groups
    }
}
