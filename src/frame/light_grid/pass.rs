//! The passes of the light grid on the device.

use glam::DVec3;

use super::grid::{GridWork, LightGrid, Solution};
use super::inputs::Spreads;
use super::slots::SlotsPass;
use crate::Result;
use crate::frame::gpu_data::GridEye;
use crate::frame::passes::Passes;
use crate::frame::weather::WeatherBuffer;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::medium::Halo;

/// Invocations of a workgroup of the kernels without planes; as in the shaders.
const WORKGROUP: u32 = 64;
/// Workgroups that spread large particles over a level, each one after the other, at least.
const LARGE_GROUPS: u32 = 256;
/// Invocations of each; as in the shader.
const LARGE_WORKGROUP: u32 = 256;
/// Turns of loops that listed particles may take of an invocation: some are left to those of a field, which are
/// hardly larger than what they are spread over.
const LISTED_TURNS: u64 = 50_000;
/// Most workgroups along an axis: what WebGPU lets every device dispatch.
const MOST_GROUPS: u64 = 65_535;
/// Planes of cells a workgroup of `sweep`; as in the shader.
const SWEEP_PLANES: u32 = 32;

/// Words of a cell's light along one direction: where nothing is absorbed, uniform light is not kept.
pub(super) fn light_words(albedo: f64) -> u32 {
    if albedo < 1.0 { 2 } else { 1 }
}

/// The pipelines, and the layout of what the blend reads.
pub struct LightGridPass {
    pub(super) matter: Kernel,
    pub(super) slots: SlotsPass,
    pub(super) solve: Kernel,
    pub(super) ground: Kernel,
    pub(super) field: Kernel,
    /// Words of a cell's light along one direction.
    pub(super) light_words: u32,
    pub(super) spreads: wgpu::Buffer,
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    halo: wgpu::Buffer,
}

/// What the passes are compiled for.
pub struct GridMedium<'a> {
    /// Of the shapes.
    pub spreads: &'a Spreads,
    /// Layout of the tables.
    pub tables: &'a wgpu::BindGroupLayout,
    /// Light around the sun.
    pub halo: &'a Halo,
    /// Single-scattering albedo.
    pub albedo: f64,
}

/// What the matter is made from.
#[derive(Clone, Copy)]
pub struct GridWith<'a> {
    /// With the rings.
    pub passes: &'a Passes,
    /// The weather map.
    pub weather: &'a WeatherBuffer,
    /// Densities of the shapes.
    pub tables: &'a wgpu::BindGroup,
}

impl LightGridPass {
    /// Compiles the passes.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary, medium: &GridMedium<'_>) -> Result<Self> {
        let light_words = light_words(medium.albedo);
        let defs: &[(&str, u32)] = if light_words > 1 { &[("ABSORBING", 1)] } else { &[] };
        let kernel = |file| Kernel::new(gpu, library, file, defs, &[]);
        let file = crate::shader_file!("frame/light_grid_matter.wgsl");
        let matter = Kernel::new(gpu, library, file, defs, &[medium.tables])?;
        let slots = SlotsPass::new(gpu, library)?;
        let solve = kernel(crate::shader_file!("frame/light_grid.wgsl"))?;
        let ground = kernel(crate::shader_file!("frame/light_ground.wgsl"))?;
        let field = kernel(crate::shader_file!("frame/light_field.wgsl"))?;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let read_only = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("light field"),
            entries: &[
                entry(
                    0,
                    wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Uniform,
                        has_dynamic_offset: false,
                        min_binding_size: None,
                    },
                ),
                entry(
                    1,
                    wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Float { filterable: true },
                        view_dimension: wgpu::TextureViewDimension::D3,
                        multisampled: false,
                    },
                ),
                entry(2, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
                entry(3, read_only),
                entry(4, read_only),
            ],
        });
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("light field"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let spreads = buffers::storage_with(gpu, "spreads", &medium.spreads.0);
        let halo = buffers::storage_with(gpu, "halo", &medium.halo.factors);
        Ok(Self {
            matter,
            slots,
            solve,
            ground,
            field,
            light_words,
            spreads,
            layout,
            sampler,
            halo,
        })
    }

    /// Layout of bind group 3 of passes that read the field.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// Binds a field for passes that read it: `LightGridUniforms`, the texture, and the slot of every
    /// cell with the extinctions (1/m) by slot behind them.
    pub fn bind(
        &self,
        gpu: &Gpu,
        uniforms: &wgpu::Buffer,
        field: &wgpu::TextureView,
        cells: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let resources = [
            uniforms.as_entire_binding(),
            wgpu::BindingResource::TextureView(field),
            wgpu::BindingResource::Sampler(&self.sampler),
            self.halo.as_entire_binding(),
            cells.as_entire_binding(),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("light field"),
            layout: &self.layout,
            entries: &entries,
        })
    }

    /// Records steps of the making of the grid's light.
    pub fn encode_solve(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        with: GridWith<'_>,
        grid: &LightGrid,
        work: &GridWork,
    ) {
        let Some(solution) = grid.making(work) else { return };
        if work.steps.start == 0 {
            self.encode_matter(gpu, encoder, with, solution);
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("light grid"),
            timestamp_writes: None,
        });
        let pass = &mut pass;
        let Solution { job, inputs } = solution;
        let levels = inputs.levels.levels.iter().zip(&job.stages).rev();
        let turns =
            levels.flat_map(|(level, stages)| stages.iter().enumerate().map(move |s| (level, s)));
        for (level, (turn, stage)) in
            (1..).zip(turns).filter(|(step, _)| work.steps.contains(step)).map(|t| t.1)
        {
            // How many of its cells keep light the device alone knows.
            let cells = level.size[..3].iter().product::<u32>();
            let with_matter = cells.min(job.room.matter).div_ceil(WORKGROUP);
            let kept = cells.min(job.room.kept).div_ceil(WORKGROUP);
            // A direction moves no farther across a level than along it.
            let longest = level.size[..3].iter().max().copied().unwrap_or(0);
            let planes = (2 * longest).div_ceil(SWEEP_PLANES);
            let mut dispatch = |entry, part, x, y| {
                pass.set_pipeline(self.solve.pipeline(entry));
                pass.set_bind_group(0, part, &[]);
                pass.dispatch_workgroups(x, y, 1);
            };
            let Some(first) = stage.first() else { continue };
            let directions = inputs.levels.directions;
            if turn == 0 {
                dispatch("begin", first, with_matter, directions);
                dispatch("sunlight", first, kept, 1);
            }
            dispatch("scatter", first, with_matter, 1);
            for part in stage {
                dispatch("sweep", part, planes, directions);
            }
        }
        if work.solved {
            let columns = inputs.levels.columns().div_ceil(WORKGROUP);
            pass.set_bind_group(0, &job.ground, &[]);
            for entry in ["fall", "rise"] {
                pass.set_pipeline(self.ground.pipeline(entry));
                pass.dispatch_workgroups(columns, 1, 1);
            }
        }
    }

    /// Records the first step: particles, and what they fill the cells with.
    fn encode_matter(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        GridWith { passes, weather, tables }: GridWith<'_>,
        Solution { job, inputs }: &Solution,
    ) {
        gpu.queue.write_buffer(&job.uniforms, 0, bytemuck::bytes_of(&inputs.uniforms));
        gpu.queue.write_buffer(&job.particles, 0, bytemuck::cast_slice(&inputs.listed));
        let listed = inputs.listed.len() as u32;
        if inputs.clouds.is_none() {
            gpu.queue.write_buffer(&job.count, 0, bytemuck::cast_slice(&[listed, listed]));
        }
        encoder.clear_buffer(&job.slots.cells, 0, None);
        encoder.clear_buffer(&job.large, 0, None);
        // What no slot is of is neither written nor read: nothing shall be left there of a solution that was
        // given up on its way.
        encoder.clear_buffer(&job.sources, 0, None);
        encoder.clear_buffer(&job.lights, 0, None);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("light grid"),
            timestamp_writes: None,
        });
        let pass = &mut pass;
        if let (Some(ring_job), Some(clouds)) = (&job.rings, &inputs.clouds) {
            passes.rings.encode(gpu, pass, &passes.lists.scan, (ring_job, clouds), weather);
        }
        let most = if inputs.clouds.is_some() { job.grid_size.capacity } else { listed };
        pass.set_bind_group(0, &job.splat, &[]);
        pass.set_bind_group(1, tables, &[]);
        pass.set_pipeline(self.matter.pipeline("splat"));
        pass.dispatch_workgroups(most.div_ceil(WORKGROUP), 1, 1);
        pass.set_pipeline(self.matter.pipeline("splat_large"));
        let levels = inputs.levels.levels.len() as u32;
        let groups = large_groups(listed, &inputs.levels.sizes()).max(LARGE_GROUPS);
        pass.dispatch_workgroups(most.min(groups), levels, 1);
        self.slots.encode(pass, &passes.lists.scan, &job.slots);
    }

    /// Records what the eye sees of it.
    pub fn encode_field(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        grid: &LightGrid,
        work: &GridWork,
        shift: DVec3,
    ) {
        let Some(Solution { job, inputs }) = grid.shown() else { return };
        let [x, y, z] = (-shift).as_vec3().to_array();
        let eye = GridEye { position: [x, y, z, 0.0] };
        gpu.queue.write_buffer(&job.eye, 0, bytemuck::bytes_of(&eye));
        let largest = inputs.levels.levels.iter().map(|l| l.size[..3].iter().product::<u32>());
        let groups = largest.max().unwrap_or(0).div_ceil(WORKGROUP);
        pass.set_bind_group(0, &job.field, &[]);
        if work.solved {
            pass.set_pipeline(self.field.pipeline("field_outside"));
            let along = groups.min(MOST_GROUPS as u32);
            let levels = inputs.levels.levels.len() as u32;
            pass.dispatch_workgroups(along, levels, groups.div_ceil(along.max(1)));
        }
        pass.set_pipeline(self.field.pipeline("light_field"));
        pass.dispatch_workgroups(job.room.kept.div_ceil(WORKGROUP), 1, 1);
    }
}

/// Workgroups for so many listed particles over levels of these sizes, each of them as large as a level: few
/// enough particles for each one that a driver which ends loops lets it come to its end.
fn large_groups(listed: u32, sizes: &[[u32; 4]]) -> u32 {
    let cells = |size: &[u32; 4]| size[..3].iter().map(|n| u64::from(*n)).product::<u64>();
    let most = sizes.iter().map(cells).max().unwrap_or(0);
    // One to go on to the particle.
    let turns = 1 + most.div_ceil(LARGE_WORKGROUP.into());
    let of_a_group = (LISTED_TURNS / turns).max(1);
    u64::from(listed).div_ceil(of_a_group).min(MOST_GROUPS) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::tile_lists::MOST_TURNS;
    use crate::scene::limits;

    #[test]
    fn large_particles_are_few_enough_for_each_workgroup() {
        // The most cells over a list, and over a field with particles as large as itself.
        let most = limits::MOST_PARTICLES as u32;
        for (side, most) in [(1, most), (9, most), (76, most), (141, 300_000)] {
            let size = [side, side, side, 0];
            let turns = 1 + u64::from(side).pow(3).div_ceil(LARGE_WORKGROUP.into());
            for listed in [0, 1, 300, 20_000, most] {
                let groups = u64::from(large_groups(listed, &[[2, 2, 2, 0], size]));
                assert!(groups <= MOST_GROUPS && groups <= u64::from(listed));
                let of_a_group = u64::from(listed).div_ceil(groups.max(1));
                assert!(of_a_group * turns < u64::from(MOST_TURNS), "{side} {listed}: {groups}");
            }
        }
    }
}
