//! Sun at points: what the clouds let through of the sunlight on its way to any point.

use super::resources::Resources;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Invocations of a workgroup; as in the shader.
const WORKGROUP: u32 = 64;
/// Points at a time: what is dispatched along one axis.
const MOST_POINTS: usize = WORKGROUP as usize * 65_535;

/// The pass.
pub struct SunAtPass {
    kernel: Kernel,
}

impl SunAtPass {
    /// Compiles the pass; it reads the tables (group 1).
    pub fn new(gpu: &Gpu, tables: &wgpu::BindGroupLayout) -> Result<Self> {
        let library = ShaderLibrary::new()?;
        let file = crate::shader_file!("frame/sun_at.wgsl");
        Ok(Self { kernel: Kernel::new(gpu, &library, file, &[], &[tables])? })
    }

    /// Transmittances to the sun from points (m, relative to the camera; the fourth number is not used).
    pub fn transmittances(
        &self,
        gpu: &Gpu,
        resources: &Resources,
        tables: &wgpu::BindGroup,
        points: &[[f32; 4]],
    ) -> Result<Vec<f32>> {
        let mut found = Vec::new();
        for points in points.chunks(MOST_POINTS) {
            let from = buffers::storage_with(gpu, "points", points);
            let to = buffers::storage(gpu, "transmittances", points.len(), size_of::<f32>());
            let lists = &resources.light.lists.lists;
            let buffers = [
                &resources.light.view,
                &resources.particles,
                &lists.tile_offsets,
                &lists.tile_entries,
                &from,
                &to,
            ];
            let bindings = self.kernel.bind(gpu, &buffers.map(|b| b.as_entire_binding()));
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(self.kernel.pipeline("sun_at"));
                pass.set_bind_group(0, &bindings, &[]);
                pass.set_bind_group(1, tables, &[]);
                pass.dispatch_workgroups((points.len() as u32).div_ceil(WORKGROUP), 1, 1);
            }
            gpu.queue.submit([encoder.finish()]);
            found.extend(gpu.read_buffer::<f32>(&to, points.len())?);
        }
        Ok(found)
    }
}
