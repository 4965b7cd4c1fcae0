//! Shadow: deep shadow maps of the clouds, seen from the sun.

use super::gpu_data::{SHADOW_MAPS, ShadowUniforms};
use super::picture_lists::PictureLists;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Side of a workgroup; as in the shader.
const WORKGROUP: u32 = 8;
/// Bytes of a texel.
const TEXEL_BYTES: usize = 16;

/// The pipeline.
pub struct ShadowPass {
    kernel: Kernel,
}

/// The maps and what they are made from.
pub struct ShadowJob {
    /// Where the maps lie.
    pub uniforms: wgpu::Buffer,
    /// Nodes of each texel: map after map, row after row.
    pub texels: wgpu::Buffer,
    /// A word: texels whose march was ended before its time, in the last making of the maps.
    pub cut: wgpu::Buffer,
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
        let defs = [("STEPS", steps)];
        Ok(Self { kernel: Kernel::new(gpu, library, file, &defs, &[tables])? })
    }

    /// Makes the maps.
    pub fn job(&self, gpu: &Gpu, resolution: u32) -> ShadowJob {
        let count = resolution as usize * resolution as usize * SHADOW_MAPS;
        let texels = buffers::storage(gpu, "shadow maps", count, TEXEL_BYTES);
        let uniforms = buffers::uniform(
            gpu,
            "shadow places",
            &<ShadowUniforms as bytemuck::Zeroable>::zeroed(),
        );
        let cut = buffers::storage(gpu, "shadows cut", 1, size_of::<u32>());
        ShadowJob { uniforms, texels, cut, resolution }
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
                job.texels.as_entire_binding(),
                job.cut.as_entire_binding(),
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
    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.texels.size()
    }
}
