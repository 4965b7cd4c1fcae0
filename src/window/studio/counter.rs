//! The blend, with the number of its steps and look-ups in place of the clouds' distance.

use crate::Result;
use crate::frame::composer::{ComposeInputs, Composer};
use crate::frame::plan::Pass;
use crate::frame::view::SCREEN_TILE;
use crate::gpu::{Gpu, Kernel, ShaderLibrary};

/// The pass.
pub(super) struct StepCounter {
    kernel: Kernel,
}

impl StepCounter {
    /// Compiles it with `steps` steps in a radius. `layouts`: tables, sky, light field.
    pub fn new(gpu: &Gpu, steps: u32, layouts: [&wgpu::BindGroupLayout; 3]) -> Result<Self> {
        let library = ShaderLibrary::new()?;
        let file = crate::shader_file!("frame/blend.wgsl");
        let defs = [("STEPS", steps), ("COUNT_STEPS", 1)];
        Ok(Self { kernel: Kernel::new(gpu, &library, file, &defs, &layouts)? })
    }
}

impl Composer for StepCounter {
    fn unneeded(&self) -> &'static [Pass] {
        &[]
    }

    fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        inputs: &ComposeInputs<'_>,
        groups: [&wgpu::BindGroup; 3],
    ) {
        let resources = inputs.resources;
        let lists = &resources.screen.lists;
        let bindings = self.kernel.bind(
            gpu,
            &[
                resources.frame.as_entire_binding(),
                inputs.phase.as_entire_binding(),
                resources.particles.as_entire_binding(),
                resources.particle_lights.as_entire_binding(),
                lists.tile_offsets.as_entire_binding(),
                lists.tile_entries.as_entire_binding(),
                resources.blend_counts.as_entire_binding(),
                wgpu::BindingResource::TextureView(&resources.targets.clouds),
                wgpu::BindingResource::TextureView(&resources.targets.distance),
                inputs.shadow.uniforms.as_entire_binding(),
                inputs.shadow.texels.as_entire_binding(),
            ],
        );
        pass.set_pipeline(self.kernel.pipeline("blend"));
        pass.set_bind_group(0, &bindings, &[]);
        for (index, group) in (1..).zip(groups) {
            pass.set_bind_group(index, group, &[]);
        }
        let [columns, rows] = resources.layout.size.map(|s| s.div_ceil(SCREEN_TILE));
        pass.dispatch_workgroups(columns, rows, 1);
    }
}
