//! Shadow: transmittance of the clouds between the ground and the sun, on two square maps.

use super::gpu_data::{ShadowTexel, ShadowUniforms};
use super::picture_lists::PictureLists;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Side of a workgroup; as in the shader.
const WORKGROUP: u32 = 8;
/// The near map and the far one.
const MAPS: u32 = 2;

/// The pipeline.
pub struct ShadowPass {
    kernel: Kernel,
}

/// The maps and what they are made from.
pub struct ShadowJob {
    /// Where the maps lie.
    pub uniforms: wgpu::Buffer,
    /// `ShadowTexel`s of both maps.
    pub maps: wgpu::Buffer,
    resolution: u32,
}

impl ShadowPass {
    /// Compiles the pass; it reads the tables (group 1).
    pub fn new(gpu: &Gpu, library: &ShaderLibrary, tables: &wgpu::BindGroupLayout) -> Result<Self> {
        let file = crate::shader_file!("frame/shadow.wgsl");
        Ok(Self { kernel: Kernel::new(gpu, library, file, &[], &[tables])? })
    }

    /// Makes the maps.
    pub fn job(&self, gpu: &Gpu, resolution: u32) -> ShadowJob {
        let texels = (MAPS * resolution * resolution) as usize;
        let maps = buffers::storage(gpu, "shadow maps", texels, size_of::<ShadowTexel>());
        let uniforms = buffers::uniform(
            gpu,
            "shadow places",
            &<ShadowUniforms as bytemuck::Zeroable>::zeroed(),
        );
        ShadowJob { uniforms, maps, resolution }
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
                view.as_entire_binding(),
                job.uniforms.as_entire_binding(),
                particles.as_entire_binding(),
                lists.lists.tile_offsets.as_entire_binding(),
                lists.lists.tile_entries.as_entire_binding(),
                job.maps.as_entire_binding(),
                frame.as_entire_binding(),
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
    ) {
        let groups = job.resolution.div_ceil(WORKGROUP);
        pass.set_pipeline(self.kernel.pipeline("shadow"));
        pass.set_bind_group(0, bindings, &[]);
        pass.set_bind_group(1, tables, &[]);
        pass.dispatch_workgroups(groups, groups, MAPS);
    }
}

impl ShadowJob {
    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.maps.size()
    }
}
