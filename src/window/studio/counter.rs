//! The blend, with the number of its steps and look-ups in place of the clouds' distance.

use crate::Result;
use crate::frame::Quality;
use crate::frame::blend::{BlendInputs, BlendPass};
use crate::frame::composer::{ComposeInputs, Composer};
use crate::frame::plan::Pass;
use crate::gpu::{Gpu, ShaderLibrary};

/// The pass.
pub(super) struct StepCounter {
    blend: BlendPass,
}

impl StepCounter {
    /// Compiles it. `layouts`: tables, sky, light field.
    pub fn new(gpu: &Gpu, quality: &Quality, layouts: [&wgpu::BindGroupLayout; 3]) -> Result<Self> {
        let library = ShaderLibrary::new()?;
        Ok(Self { blend: BlendPass::counting(gpu, &library, quality, &layouts)? })
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
        let blend = BlendInputs {
            frame: &resources.frame,
            phase: inputs.phase,
            particles: &resources.particles,
            lights: &resources.particle_lights,
            lists: &resources.screen,
            shadow: inputs.shadow,
            opaque: &resources.opaque.distances,
            counts: &resources.blend_counts,
        };
        let targets = &resources.targets;
        let bindings = self.blend.bind(gpu, &blend, [&targets.clouds, &targets.distance]);
        let [columns, rows] = resources.layout.size;
        self.blend.encode(gpu, pass, [columns, rows, 1], &bindings, &groups);
    }
}
