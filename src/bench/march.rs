//! March: a ray marcher over the frame's own particles, without tables, in place of the blend. It
//! is what the frame's time is measured against.
//!
//! It samples the density volumes of 64 x 64 x 64 nodes that the tables hold, not the noise they
//! were filled from: they are what a shape's density is defined by, the reference traces them too,
//! and a sample of them is two orders of magnitude cheaper than one of the noise. So the marcher
//! gets the quickest density that shows the same clouds.

pub mod twin;

use bytemuck::{Pod, Zeroable};

use crate::Result;
use crate::frame::composer::{ComposeInputs, Composer};
use crate::frame::gpu_data::gpu_struct;
use crate::frame::plan::Pass;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Sides of a workgroup, pixels; as in the shader.
const WORKGROUP: u32 = 8;
/// Steps along a pixel's ray that are measured.
pub const STEPS: [u32; 5] = [8, 16, 32, 64, 128];
/// Steps of a pixel's ray for one through each chord of a sun's ray: a chord is a small part of a
/// cloud, and its light needs less detail than its outline.
const STEPS_FOR_ONE: u32 = 8;

gpu_struct! {
    /// What the shader is told besides the frame.
    MarchUniforms {
        /// Along a pixel's ray.
        steps: u32,
        /// Through each chord of a sun's ray.
        sun_steps: u32,
        /// Of the phase function in the scaled medium.
        mean_cosine: f32,
        /// Unused.
        padding_a: u32,
    }
}

/// Where the light at a step comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarchLight {
    /// From marching the sun's ray, and octaves of it for higher orders.
    SunRays,
    /// From the frame's own passes: only what the eye's ray meets is marched.
    Frame,
}

/// How finely to march.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MarchSettings {
    /// Where light comes from.
    pub light: MarchLight,
    /// Along a pixel's ray.
    pub steps: u32,
}

impl MarchSettings {
    /// Steps through each chord of a sun's ray.
    pub fn sun_steps(&self) -> u32 {
        (self.steps / STEPS_FOR_ONE).max(1)
    }

    /// "march-32", or "view-march-32" with the frame's light.
    pub fn name(&self) -> String {
        match self.light {
            MarchLight::SunRays => format!("march-{}", self.steps),
            MarchLight::Frame => format!("view-march-{}", self.steps),
        }
    }
}

/// The pass.
pub struct March {
    kernel: Kernel,
    uniforms: wgpu::Buffer,
    settings: MarchSettings,
}

impl March {
    /// Compiles it. `layouts`: tables, sky, light field; `tile`: sides of the frame's tiles, pixels;
    /// `mean_cosine`: that of the phase function without its forward peak.
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        layouts: [&wgpu::BindGroupLayout; 3],
        settings: MarchSettings,
        tile: u32,
        mean_cosine: f64,
    ) -> Result<Self> {
        let file = crate::shader_file!("bench/march.wgsl");
        let tile = ("SCREEN_TILE", tile);
        let kernel = match settings.light {
            MarchLight::SunRays => Kernel::new(gpu, library, file, &[tile], &layouts[..2])?,
            MarchLight::Frame => Kernel::new(gpu, library, file, &[tile, ("LIT", 1)], &layouts)?,
        };
        let uniforms = MarchUniforms {
            steps: settings.steps,
            sun_steps: settings.sun_steps(),
            mean_cosine: mean_cosine as f32,
            padding_a: 0,
        };
        let uniforms = buffers::uniform(gpu, "march", &uniforms);
        Ok(Self { kernel, uniforms, settings })
    }
}

impl Composer for March {
    fn unneeded(&self) -> &'static [Pass] {
        match self.settings.light {
            MarchLight::SunRays => {
                &[Pass::LightGrid, Pass::LightField, Pass::Light, Pass::AirShadow]
            }
            MarchLight::Frame => &[],
        }
    }

    fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        inputs: &ComposeInputs<'_>,
        groups: [&wgpu::BindGroup; 3],
    ) {
        let resources = inputs.resources;
        let (screen, sun) = (&resources.screen.lists, &resources.light);
        let mut bindings = vec![
            resources.frame.as_entire_binding(),
            inputs.phase.as_entire_binding(),
            self.uniforms.as_entire_binding(),
            resources.particles.as_entire_binding(),
            screen.tile_offsets.as_entire_binding(),
            screen.tile_entries.as_entire_binding(),
            resources.blend_counts.as_entire_binding(),
            wgpu::BindingResource::TextureView(&resources.targets.clouds),
            wgpu::BindingResource::TextureView(&resources.targets.distance),
        ];
        let shared = match self.settings.light {
            MarchLight::SunRays => {
                let lists = &sun.lists.lists;
                bindings.push(sun.view.as_entire_binding());
                bindings.push(lists.tile_offsets.as_entire_binding());
                bindings.push(lists.tile_entries.as_entire_binding());
                &groups[..2]
            }
            MarchLight::Frame => {
                bindings.push(resources.particle_lights.as_entire_binding());
                bindings.push(inputs.shadow.uniforms.as_entire_binding());
                bindings.push(inputs.shadow.texels.as_entire_binding());
                &groups[..]
            }
        };
        pass.set_pipeline(self.kernel.pipeline("march"));
        pass.set_bind_group(0, &self.kernel.bind(gpu, &bindings), &[]);
        for (index, group) in (1..).zip(shared) {
            pass.set_bind_group(index, *group, &[]);
        }
        let [columns, rows] = resources.layout.size.map(|s| s.div_ceil(WORKGROUP));
        pass.dispatch_workgroups(columns, rows, 1);
    }
}
