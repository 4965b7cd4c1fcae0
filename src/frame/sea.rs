//! Sea: what the sea reflects of sky and clouds, on rays through the corners of blocks of pixels. Compiled for the first
//! frame whose ground is a sea: others neither compile nor run any of it.

use bytemuck::{Pod, Zeroable};

use super::air_shadow::corners;
use super::gpu_data::gpu_struct;
use super::resolve::ResolvePass;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::medium::Sea;
use crate::medium::sea::HEIGHTS;

/// Side of a workgroup; as in the shader.
const WORKGROUP: u32 = 8;

gpu_struct! {
    /// Facets that stand for all, by the height of the view; see `shaders/frame/sea.wgsl`.
    SeaUniforms {
        /// Of every height slopes along the view, then shares of the light.
        facets: [[f32; 4]; 2 * HEIGHTS],
    }
}

impl SeaUniforms {
    /// Of these waves.
    pub fn new(sea: &Sea) -> Self {
        let mut uniforms = Self::zeroed();
        for (rows, rule) in uniforms.facets.chunks_mut(2).zip(sea.rules()) {
            for (i, row) in rows.iter_mut().enumerate() {
                *row = rule.map(|node| node[i] as f32);
            }
        }
        uniforms
    }
}

/// The pipelines: with clouds and without, and the resolve of a picture with a sea.
pub struct SeaPass {
    bare: Kernel,
    clouded: Kernel,
    /// What puts the picture together.
    pub resolve: ResolvePass,
    waves: wgpu::Buffer,
}

/// What a frame without clouds does not have: the phase function, and of the light grid's slots the share of the sunlight,
/// with the group that tells of the grid.
pub struct Clouded<'a> {
    /// `PhaseParams`.
    pub phase: &'a wgpu::Buffer,
    /// By slot.
    pub sun_mean: &'a wgpu::Buffer,
    /// Bind group 3.
    pub field: &'a wgpu::BindGroup,
}

/// What a sea reflects, ray after ray.
pub struct Reflected {
    /// Of sky and clouds.
    pub light: wgpu::Buffer,
    /// What clouds change of it, before it is smoothed.
    change: wgpu::Buffer,
}

impl Reflected {
    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.light.size() + self.change.size()
    }
}

impl SeaPass {
    /// Compiles the pass. `groups`: the sky's tables that don't depend on the view, those that do, the light field.
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        tables: &wgpu::BindGroupLayout,
        groups: &[&wgpu::BindGroupLayout; 3],
    ) -> Result<Self> {
        let file = crate::shader_file!("frame/sea.wgsl");
        Ok(Self {
            bare: Kernel::new(gpu, library, file, &[], &groups[..2])?,
            clouded: Kernel::new(gpu, library, file, &[("CLOUDS", 1)], groups)?,
            resolve: ResolvePass::over_sea(gpu, library, tables, groups[1])?,
            waves: buffers::uniform(gpu, "waves", &SeaUniforms::zeroed()),
        })
    }

    /// What it leaves for a picture of this size (pixels), and on the way there.
    pub fn buffers(&self, gpu: &Gpu, size: [u32; 2]) -> Reflected {
        let [across, up] = corners(size).map(|c| c as usize);
        let rays = |label| buffers::storage(gpu, label, across * up, size_of::<[f32; 4]>());
        Reflected { light: rays("reflected"), change: rays("changed sky") }
    }

    /// Takes the waves of the next frames.
    pub fn hold(&self, gpu: &Gpu, sea: &Sea) {
        gpu.queue.write_buffer(&self.waves, 0, bytemuck::bytes_of(&SeaUniforms::new(sea)));
    }

    /// Records the pass. `sky`: as it is seen from the surface.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        size: [u32; 2],
        (frame, reflected): (&wgpu::Buffer, &Reflected),
        sky: &wgpu::TextureView,
        groups: [&wgpu::BindGroup; 2],
        clouds: Option<&Clouded<'_>>,
    ) {
        let mut resources = vec![
            frame.as_entire_binding(),
            self.waves.as_entire_binding(),
            wgpu::BindingResource::TextureView(sky),
            reflected.light.as_entire_binding(),
        ];
        let kernel = match clouds {
            Some(clouds) => {
                resources.push(clouds.phase.as_entire_binding());
                resources.push(clouds.sun_mean.as_entire_binding());
                resources.push(reflected.change.as_entire_binding());
                pass.set_bind_group(3, clouds.field, &[]);
                &self.clouded
            }
            None => &self.bare,
        };
        pass.set_pipeline(kernel.pipeline("sea"));
        pass.set_bind_group(0, &kernel.bind(gpu, &resources), &[]);
        for (group, number) in groups.into_iter().zip(1..) {
            pass.set_bind_group(number, group, &[]);
        }
        let [across, up] = corners(size).map(|c| c.div_ceil(WORKGROUP));
        pass.dispatch_workgroups(across, up, 1);
        if clouds.is_some() {
            pass.set_pipeline(kernel.pipeline("smooth_clouds"));
            pass.dispatch_workgroups(across, up, 1);
        }
    }
}
