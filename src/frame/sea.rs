//! Sea: what the sea reflects of sky and clouds, on rays through the corners of blocks of pixels. Compiled for the first
//! frame whose ground is a sea: others neither compile nor run any of it.

use bytemuck::{Pod, Zeroable};

use super::air_shadow::{corners, most_rays};
use super::gpu_data::{LightGridUniforms, gpu_struct};
use super::light_grid::LightGridPass;
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

/// The pipeline, and the resolve of a picture with a sea.
pub struct SeaPass {
    kernel: Kernel,
    /// What puts the picture together.
    pub resolve: ResolvePass,
    waves: wgpu::Buffer,
    no_sun: wgpu::Buffer,
    no_clouds: wgpu::BindGroup,
}

/// What a frame without clouds does not have: of the light grid's slots the share of the sunlight, and the group that tells
/// of the grid.
pub struct Clouded<'a> {
    /// By slot.
    pub sun_mean: &'a wgpu::Buffer,
    /// Bind group 3.
    pub field: &'a wgpu::BindGroup,
}

/// A grid of one cell without light, below everything that a ray from the sea meets: lavapipe of Mesa 22.3 ends with a fault in a
/// kernel of its own for pictures without clouds.
fn no_clouds(gpu: &Gpu, grid: &LightGridPass) -> wgpu::BindGroup {
    let mut uniforms = LightGridUniforms { levels: 1, cells: 1, ..LightGridUniforms::zeroed() };
    uniforms.level[0].low = [0.0, BELOW_ALL, 0.0, 0.0];
    uniforms.level[0].cell = [1.0, 1.0, 1.0, 0.0];
    uniforms.level[0].size = [1, 1, 1, 0];
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("no light"),
        size: wgpu::Extent3d::default(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let uniforms = buffers::uniform(gpu, "no light grid", &uniforms);
    let cells = buffers::storage_with(gpu, "no cells", &[NO_SLOT, 0]);
    grid.bind(gpu, &uniforms, &texture.create_view(&Default::default()), &cells)
}

/// Height of that cell, m.
const BELOW_ALL: f32 = -1e9;
/// A cell that keeps no light; as in the shaders.
const NO_SLOT: u32 = u32::MAX;

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
    /// Compiles the pass. Layouts: of the tables, of the sky's that don't depend on the view, of those that do.
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        [tables, march, sky]: [&wgpu::BindGroupLayout; 3],
        grid: &LightGridPass,
    ) -> Result<Self> {
        let file = crate::shader_file!("frame/sea.wgsl");
        Ok(Self {
            kernel: Kernel::new(gpu, library, file, &[], &[march, sky, grid.layout()])?,
            resolve: ResolvePass::over_sea(gpu, library, tables, sky)?,
            waves: buffers::uniform(gpu, "waves", &SeaUniforms::zeroed()),
            no_sun: buffers::storage_with(gpu, "no sun", &[0.0f32]),
            no_clouds: no_clouds(gpu, grid),
        })
    }

    /// What it leaves for a picture of this size (pixels), and on the way there.
    pub fn buffers(&self, gpu: &Gpu, size: [u32; 2]) -> Reflected {
        let rays = |label| buffers::storage(gpu, label, most_rays(size), size_of::<[f32; 4]>());
        Reflected { light: rays("reflected"), change: rays("changed sky") }
    }

    /// Takes the waves of the next frames.
    pub fn hold(&self, gpu: &Gpu, sea: &Sea) {
        gpu.queue.write_buffer(&self.waves, 0, bytemuck::bytes_of(&SeaUniforms::new(sea)));
    }

    /// Records the pass for a picture of this size with blocks of so many pixels a side. `sky`: as it is seen from the surface.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        (size, block): ([u32; 2], u32),
        ([frame, phase], reflected, sky): ([&wgpu::Buffer; 2], &Reflected, &wgpu::TextureView),
        groups: [&wgpu::BindGroup; 2],
        clouds: Option<Clouded<'_>>,
    ) {
        let none = Clouded { sun_mean: &self.no_sun, field: &self.no_clouds };
        let clouds = clouds.unwrap_or(none);
        let bindings = self.kernel.bind(
            gpu,
            &[
                frame.as_entire_binding(),
                self.waves.as_entire_binding(),
                wgpu::BindingResource::TextureView(sky),
                reflected.light.as_entire_binding(),
                phase.as_entire_binding(),
                clouds.sun_mean.as_entire_binding(),
                reflected.change.as_entire_binding(),
            ],
        );
        pass.set_bind_group(0, &bindings, &[]);
        for (group, number) in groups.into_iter().chain([clouds.field]).zip(1..) {
            pass.set_bind_group(number, group, &[]);
        }
        let [across, up] = corners(size, block).map(|c| c.div_ceil(WORKGROUP));
        for entry in ["sea", "smooth_clouds"] {
            pass.set_pipeline(self.kernel.pipeline(entry));
            pass.dispatch_workgroups(across, up, 1);
        }
    }
}
