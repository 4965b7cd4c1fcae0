//! Light: what the particles' lists seen from the sun say of the light that
//! reaches each particle.

use super::blend::groups_of;
use super::gpu_data::LightView;
use super::picture_lists::PictureLists;
use super::settings::Lighting;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Invocations of a workgroup; as in the shader.
const WORKGROUP: u32 = 64;

/// The pipeline.
pub struct LightPass {
    kernel: Kernel,
}

/// Buffers of one light.
pub struct LightJob {
    bindings: wgpu::BindGroup,
    particles: u32,
}

/// A buffer for the uniforms of one light's view.
pub fn view_buffer(gpu: &Gpu) -> wgpu::Buffer {
    buffers::uniform(gpu, "light view", &<LightView as bytemuck::Zeroable>::zeroed())
}

impl LightPass {
    /// Compiles the pass; it reads the tables (group 1), the sky (group 2) and, where the lighting has a grid, the light
    /// field (group 3).
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        lighting: Lighting,
        groups: &[&wgpu::BindGroupLayout; 3],
    ) -> Result<Self> {
        let file = crate::shader_file!("frame/light.wgsl");
        let defs: &[_] = if lighting.has_grid() { &[] } else { &[("GRIDLESS", 1)] };
        let groups = groups_of(groups, lighting);
        Ok(Self { kernel: Kernel::new(gpu, library, file, defs, groups)? })
    }

    /// Binds one light's lists and the particles' light.
    #[expect(clippy::too_many_arguments, reason = "one argument per binding")]
    pub fn job(
        &self,
        gpu: &Gpu,
        frame: &wgpu::Buffer,
        view: &wgpu::Buffer,
        particles: &wgpu::Buffer,
        lists: &PictureLists,
        visible: &wgpu::Buffer,
        screen: &PictureLists,
        lights: &wgpu::Buffer,
    ) -> LightJob {
        let bindings = self.kernel.bind(
            gpu,
            &[
                frame.as_entire_binding(),
                view.as_entire_binding(),
                particles.as_entire_binding(),
                lists.lists.tile_offsets.as_entire_binding(),
                lists.lists.tile_entries.as_entire_binding(),
                visible.as_entire_binding(),
                screen.order().as_entire_binding(),
                lights.as_entire_binding(),
            ],
        );
        LightJob { bindings, particles: lists.lists.size().particles }
    }

    /// Records the pass.
    pub fn encode(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        job: &LightJob,
        groups: &[&wgpu::BindGroup],
    ) {
        pass.set_pipeline(self.kernel.pipeline("light"));
        pass.set_bind_group(0, &job.bindings, &[]);
        for (index, group) in (1..).zip(groups) {
            pass.set_bind_group(index, *group, &[]);
        }
        pass.dispatch_workgroups(job.particles.div_ceil(WORKGROUP), 1, 1);
    }
}
