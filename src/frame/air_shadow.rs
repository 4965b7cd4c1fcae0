//! Air shadow: what clouds change of the light of the air between the eye and what it sees, and of the ground.

use super::shadow::ShadowJob;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Side of a workgroup; as in the shader.
const WORKGROUP: u32 = 8;
/// Sides of a block of pixels, whose corners have rays; as in the shader.
pub const BLOCK: u32 = 8;
/// Nodes along a ray, behind the first; as in the shader.
pub const NODES: u32 = 24;
/// Numbers of a ray: those of its nodes and of the ground behind them; as in the shader.
pub const ENTRIES: usize = NODES as usize + 2;
/// Bytes of one.
const ENTRY_BYTES: usize = 8;

/// Rays across and up for a picture of this size, pixels.
pub fn corners(size: [u32; 2]) -> [u32; 2] {
    size.map(|s| s.div_ceil(BLOCK) + 1)
}

/// The pipeline.
pub struct AirShadowPass {
    kernel: Kernel,
}

impl AirShadowPass {
    /// Compiles the pass with `steps` steps from node to node. `groups`: the sky's tables that don't depend on the view, those that do, and the
    /// light field.
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        steps: u32,
        groups: &[&wgpu::BindGroupLayout; 3],
    ) -> Result<Self> {
        let file = crate::shader_file!("frame/air_shadow.wgsl");
        Ok(Self { kernel: Kernel::new(gpu, library, file, &[("STEPS", steps)], groups)? })
    }

    /// What it leaves for a picture of this size, pixels.
    pub fn changed_light(&self, gpu: &Gpu, size: [u32; 2]) -> wgpu::Buffer {
        let [across, up] = corners(size).map(|c| c as usize);
        buffers::storage(gpu, "changed light", across * up * ENTRIES, ENTRY_BYTES)
    }

    /// Binds the shadow maps.
    pub fn bind(
        &self,
        gpu: &Gpu,
        frame: &wgpu::Buffer,
        shadow: &ShadowJob,
        changed_light: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        self.kernel.bind(
            gpu,
            &[
                frame.as_entire_binding(),
                changed_light.as_entire_binding(),
                shadow.uniforms.as_entire_binding(),
                shadow.texels.as_entire_binding(),
            ],
        )
    }

    /// Records the pass.
    pub fn encode(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        size: [u32; 2],
        bindings: &wgpu::BindGroup,
        groups: [&wgpu::BindGroup; 3],
    ) {
        let [across, up] = corners(size).map(|c| c.div_ceil(WORKGROUP));
        pass.set_pipeline(self.kernel.pipeline("air_shadow"));
        pass.set_bind_group(0, bindings, &[]);
        for (group, number) in groups.into_iter().zip(1..) {
            pass.set_bind_group(number, group, &[]);
        }
        pass.dispatch_workgroups(across, up, 1);
    }
}
