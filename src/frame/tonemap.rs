//! Tone map: linear radiance to display values.

use super::targets::Targets;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary};

/// Side of a workgroup; as in the shader.
const WORKGROUP: u32 = 8;

/// The pipeline.
pub struct TonemapPass {
    kernel: Kernel,
}

impl TonemapPass {
    /// Compiles the pass.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary) -> Result<Self> {
        let kernel =
            Kernel::new(gpu, library, crate::shader_file!("frame/tonemap.wgsl"), &[], &[])?;
        Ok(Self { kernel })
    }

    /// Binds the picture and the display values.
    pub fn bind(&self, gpu: &Gpu, frame: &wgpu::Buffer, targets: &Targets) -> wgpu::BindGroup {
        let picture = targets.picture.create_view(&Default::default());
        let display = targets.display.create_view(&Default::default());
        self.kernel.bind(
            gpu,
            &[
                frame.as_entire_binding(),
                wgpu::BindingResource::TextureView(&picture),
                wgpu::BindingResource::TextureView(&display),
            ],
        )
    }

    /// Records the pass.
    pub fn encode(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        size: [u32; 2],
        bindings: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(self.kernel.pipeline("tonemap"));
        pass.set_bind_group(0, bindings, &[]);
        pass.dispatch_workgroups(size[0].div_ceil(WORKGROUP), size[1].div_ceil(WORKGROUP), 1);
    }
}
