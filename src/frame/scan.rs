//! Exclusive prefix sums on the device: counts become places.

use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// The scan's pipeline.
pub struct ScanPass {
    kernel: Kernel,
}

/// One array to be scanned: `length` counts into `length + 1` offsets, the total last.
pub struct ScanJob {
    bindings: wgpu::BindGroup,
}

impl ScanPass {
    /// Compiles the pass.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary) -> Result<Self> {
        let kernel = Kernel::new(gpu, library, crate::shader_file!("frame/scan.wgsl"), &[], &[])?;
        Ok(Self { kernel })
    }

    /// Binds one array and its result.
    pub fn job(
        &self,
        gpu: &Gpu,
        counts: &wgpu::Buffer,
        offsets: &wgpu::Buffer,
        length: u32,
    ) -> ScanJob {
        let params = buffers::uniform(gpu, "scan", &[length, 0, 0, 0]);
        let bindings = self.kernel.bind(
            gpu,
            &[params.as_entire_binding(), counts.as_entire_binding(), offsets.as_entire_binding()],
        );
        ScanJob { bindings }
    }

    /// Records the scan.
    pub fn encode(&self, pass: &mut wgpu::ComputePass<'_>, job: &ScanJob) {
        pass.set_pipeline(self.kernel.pipeline("scan"));
        pass.set_bind_group(0, &job.bindings, &[]);
        pass.dispatch_workgroups(1, 1, 1);
    }
}
