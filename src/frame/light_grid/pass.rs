//! The passes of the light grid on the device.

use bytemuck::Zeroable;
use glam::DVec3;

use super::inputs::{GridInputs, Spreads};
use crate::frame::cpu::light_grid::{FieldSeen, GridLight};
use crate::frame::gpu_data::{GRID_LEVELS, GridEye, GridStage, LightGridUniforms, Particle};
use crate::frame::passes::Passes;
use crate::frame::rings::{RingJob, particle_count_buffer};
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::medium::Halo;
use crate::{Error, Result};

/// Invocations of a workgroup of the kernels without planes; as in the shaders.
const WORKGROUP: u32 = 64;
/// Directions of travel; as in the shaders.
const DIRECTIONS: u32 = 12;
/// Bytes of a texel of the field.
const TEXEL_BYTES: u64 = 8;
/// Planes of cells a workgroup of `sweep`; as in the shader.
const SWEEP_PLANES: u32 = 32;

/// The pipelines, and the layout of what the blend reads.
pub struct LightGridPass {
    solve: Kernel,
    field: Kernel,
    /// Bytes of a cell's light along one direction.
    light_bytes: usize,
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    spreads: wgpu::Buffer,
    halo: wgpu::Buffer,
    stages: Vec<wgpu::Buffer>,
}

/// What the passes are compiled for.
pub struct GridMedium<'a> {
    /// Of the shapes.
    pub spreads: &'a Spreads,
    /// Light around the sun.
    pub halo: &'a Halo,
    /// Single-scattering albedo.
    pub albedo: f64,
}

/// Buffers for one size of grid.
struct Job {
    size: [u32; 3],
    cells: u32,
    grid_size: GridSize,
    uniforms: wgpu::Buffer,
    eye: wgpu::Buffer,
    particles: wgpu::Buffer,
    count: wgpu::Buffer,
    rings: Option<RingJob>,
    matter: wgpu::Buffer,
    sun: wgpu::Buffer,
    lights: wgpu::Buffer,
    bytes: u64,
    solve: Vec<wgpu::BindGroup>,
    field: wgpu::BindGroup,
    read: wgpu::BindGroup,
}

/// The grid of one renderer.
#[derive(Default)]
pub struct LightGrid {
    job: Option<Job>,
    made: Option<GridInputs>,
    seen_from: Option<[f32; 3]>,
}

impl LightGridPass {
    /// Compiles the passes.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary, medium: &GridMedium<'_>) -> Result<Self> {
        let absorbing = medium.albedo < 1.0;
        let defs: &[(&str, u32)] = if absorbing { &[("ABSORBING", 1)] } else { &[] };
        let light_bytes = if absorbing { 8 } else { 4 };
        let solve =
            Kernel::new(gpu, library, crate::shader_file!("frame/light_grid.wgsl"), defs, &[])?;
        let field =
            Kernel::new(gpu, library, crate::shader_file!("frame/light_field.wgsl"), defs, &[])?;
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
        let stages = (0..GRID_LEVELS as u32)
            .map(|level| {
                buffers::uniform(gpu, "grid stage", &GridStage { level, ..GridStage::zeroed() })
            })
            .collect();
        let spreads = buffers::storage_with(gpu, "spreads", &medium.spreads.0);
        let halo = buffers::storage_with(gpu, "halo", &medium.halo.factors);
        Ok(Self { solve, field, light_bytes, layout, sampler, spreads, halo, stages })
    }

    /// Layout of bind group 3 of passes that read the field.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// Binds a field for passes that read it: `LightGridUniforms`, the texture, and the extinction
    /// (1/m) of every cell.
    pub fn bind(
        &self,
        gpu: &Gpu,
        uniforms: &wgpu::Buffer,
        field: &wgpu::TextureView,
        matter: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let resources = [
            uniforms.as_entire_binding(),
            wgpu::BindingResource::TextureView(field),
            wgpu::BindingResource::Sampler(&self.sampler),
            self.halo.as_entire_binding(),
            matter.as_entire_binding(),
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

    fn job(&self, gpu: &Gpu, passes: &Passes, grid_size: GridSize, inputs: &GridInputs) -> Job {
        let GridSize { capacity, columns } = grid_size;
        let cells = inputs.levels.cells();
        let size = inputs.levels.texture_size();
        let word = size_of::<u32>();
        let uniforms = buffers::uniform(gpu, "light grid", &LightGridUniforms::zeroed());
        let eye = buffers::uniform(gpu, "grid eye", &GridEye::zeroed());
        let particles =
            buffers::storage(gpu, "grid particles", capacity as usize, size_of::<Particle>());
        let count = particle_count_buffer(gpu, 0);
        let matter = buffers::storage(gpu, "grid matter", cells as usize, word);
        let extinction = buffers::storage(gpu, "grid extinction", cells as usize, word);
        let sun = buffers::storage(gpu, "grid sun", cells as usize, word);
        let light =
            |label| buffers::storage(gpu, label, (cells * DIRECTIONS) as usize, self.light_bytes);
        let (sources, lights) = (light("grid sources"), light("grid lights"));
        let solve = self
            .stages
            .iter()
            .map(|stage| {
                self.solve.bind(
                    gpu,
                    &[
                        uniforms.as_entire_binding(),
                        stage.as_entire_binding(),
                        particles.as_entire_binding(),
                        count.as_entire_binding(),
                        matter.as_entire_binding(),
                        extinction.as_entire_binding(),
                        sun.as_entire_binding(),
                        sources.as_entire_binding(),
                        lights.as_entire_binding(),
                        self.spreads.as_entire_binding(),
                    ],
                )
            })
            .collect();
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("light field"),
            size: wgpu::Extent3d {
                width: size[0],
                height: size[1],
                depth_or_array_layers: size[2],
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        let field = self.field.bind(
            gpu,
            &[
                eye.as_entire_binding(),
                uniforms.as_entire_binding(),
                sun.as_entire_binding(),
                lights.as_entire_binding(),
                wgpu::BindingResource::TextureView(&view),
            ],
        );
        let read = self.bind(gpu, &uniforms, &view, &extinction);
        let rings = (columns > 0)
            .then(|| passes.rings.job(gpu, &passes.lists.scan, columns, &particles, &count));
        let texels = u64::from(size[0]) * u64::from(size[1]) * u64::from(size[2]);
        let bytes = particles.size()
            + 3 * matter.size()
            + 2 * lights.size()
            + texels * TEXEL_BYTES
            + rings.as_ref().map_or(0, RingJob::bytes);
        Job {
            size,
            cells,
            grid_size,
            uniforms,
            eye,
            particles,
            count,
            rings,
            matter,
            sun,
            lights,
            bytes,
            solve,
            field,
            read,
        }
    }

    /// Records the making of the grid's light.
    pub fn encode_solve(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        passes: &Passes,
        grid: &LightGrid,
        inputs: &GridInputs,
    ) {
        let Some(job) = &grid.job else { return };
        gpu.queue.write_buffer(&job.uniforms, 0, bytemuck::bytes_of(&inputs.uniforms));
        gpu.queue.write_buffer(&job.particles, 0, bytemuck::cast_slice(&inputs.listed));
        let listed = inputs.listed.len() as u32;
        if inputs.clouds.is_none() {
            gpu.queue.write_buffer(&job.count, 0, bytemuck::cast_slice(&[listed, listed]));
        }
        encoder.clear_buffer(&job.matter, 0, None);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("light grid"),
            timestamp_writes: None,
        });
        let pass = &mut pass;
        if let (Some(ring_job), Some(clouds)) = (&job.rings, &inputs.clouds) {
            passes.rings.encode(gpu, pass, &passes.lists.scan, ring_job, clouds);
        }
        let most = if inputs.clouds.is_some() { job.grid_size.capacity } else { listed };
        self.dispatch(pass, job, 0, "splat", [most.div_ceil(WORKGROUP), 1]);
        self.dispatch(pass, job, 0, "density", [job.cells.div_ceil(WORKGROUP), 1]);
        let coarsest = inputs.levels.levels.len().saturating_sub(1);
        for (index, level) in inputs.levels.levels.iter().enumerate().rev() {
            let groups = level.size[..3].iter().product::<u32>().div_ceil(WORKGROUP);
            let longest = level.size[..3].iter().max().copied().unwrap_or(0);
            let planes = longest.div_ceil(SWEEP_PLANES);
            self.dispatch(pass, job, index, "begin", [groups, DIRECTIONS]);
            self.dispatch(pass, job, index, "sunlight", [1, 1]);
            for _ in 0..inputs.turns[usize::from(index != coarsest)] {
                self.dispatch(pass, job, index, "scatter", [groups, 1]);
                self.dispatch(pass, job, index, "sweep", [planes, DIRECTIONS]);
            }
        }
    }

    fn dispatch(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        job: &Job,
        level: usize,
        entry: &str,
        [x, y]: [u32; 2],
    ) {
        pass.set_pipeline(self.solve.pipeline(entry));
        pass.set_bind_group(0, &job.solve[level], &[]);
        pass.dispatch_workgroups(x, y, 1);
    }

    /// Records what the eye sees of it.
    pub fn encode_field(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        grid: &LightGrid,
        inputs: &GridInputs,
        shift: DVec3,
    ) {
        let Some(job) = &grid.job else { return };
        let [x, y, z] = (-shift).as_vec3().to_array();
        let eye = GridEye { position: [x, y, z, 0.0] };
        gpu.queue.write_buffer(&job.eye, 0, bytemuck::bytes_of(&eye));
        let largest = inputs.levels.levels.iter().map(|l| l.size[..3].iter().product::<u32>());
        let groups = largest.max().unwrap_or(0).div_ceil(WORKGROUP);
        pass.set_pipeline(self.field.pipeline("light_field"));
        pass.set_bind_group(0, &job.field, &[]);
        pass.dispatch_workgroups(groups, inputs.levels.levels.len() as u32, 1);
    }
}

/// What the grid's buffers are made for, besides its levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridSize {
    /// Room for particles.
    pub capacity: u32,
    /// Columns of cells of the cloud field; 0 without one.
    pub columns: u32,
}

/// What of the grid a frame has to make.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GridWork {
    /// The light itself.
    pub solve: bool,
    /// What the eye sees of it.
    pub field: bool,
}

impl LightGrid {
    /// Makes the buffers fit and says what has changed since they were filled. `shift` is the anchor
    /// relative to the camera, m.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        passes: &Passes,
        size: GridSize,
        inputs: &GridInputs,
        shift: DVec3,
    ) -> GridWork {
        let fits = self.job.as_ref().is_some_and(|j| {
            j.size == inputs.levels.texture_size()
                && j.cells == inputs.levels.cells()
                && j.grid_size == size
        });
        if !fits {
            gpu.begin_part("light grid");
            self.job = Some(passes.light_grid.job(gpu, passes, size, inputs));
            self.made = None;
        }
        let eye = (-shift).as_vec3().to_array();
        let solve = self.made.as_ref() != Some(inputs);
        GridWork { solve, field: solve || self.seen_from != Some(eye) }
    }

    /// Notes what has been made.
    pub fn done(&mut self, inputs: &GridInputs, shift: DVec3) {
        self.made = Some(inputs.clone());
        self.seen_from = Some((-shift).as_vec3().to_array());
    }

    /// Bind group 3 of passes that read the field.
    pub fn bind_group(&self) -> Option<&wgpu::BindGroup> {
        self.job.as_ref().map(|j| &j.read)
    }

    /// `ParticleCount` of the grid's own particles.
    pub fn particle_count(&self) -> Option<&wgpu::Buffer> {
        self.job.as_ref().map(|j| &j.count)
    }

    /// What the last eye sees of it, read back.
    pub fn seen(&self, gpu: &Gpu) -> Result<FieldSeen> {
        let (Some(job), Some(made), Some(eye)) = (&self.job, &self.made, self.seen_from) else {
            return Err(Error::Gpu("the light grid was not made".to_owned()));
        };
        let count = (job.cells * DIRECTIONS) as usize;
        let words = gpu.read_buffer::<u32>(&job.lights, job.lights.size() as usize / 4)?;
        let sun = gpu.read_buffer::<f32>(&job.sun, job.cells as usize)?;
        let light = GridLight::from_device(&made.uniforms, &words, words.len() / count, &sun);
        Ok(light.seen_from(DVec3::from_array(eye.map(f64::from))))
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.job.as_ref().map_or(0, |j| j.bytes)
    }
}
