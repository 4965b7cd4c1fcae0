//! Buffers of the light grid for one size.

use bytemuck::Zeroable;

use super::inputs::GridInputs;
use super::levels::GridRoom;
use super::relaxation::{least_eigenvalue, relaxations};
use super::slots::SlotsJob;
use crate::frame::gpu_data::{GridEye, GridStage, LightGridUniforms, Particle};
use crate::frame::passes::Passes;
use crate::frame::rings::{RingJob, particle_count_buffer};
use crate::gpu::{Gpu, buffers};

/// What the grid's buffers are made for, besides its levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridSize {
    /// Room for particles.
    pub capacity: u32,
    /// Columns of cells of the cloud field; 0 without one.
    pub columns: u32,
}

/// Words of the list of large particles before them; as in the shader.
const LARGE_HEAD: usize = 2;
/// Turns of loops that a part of a sweep may take: lavapipe ends loops after 65,535 of a group of eight invocations.
const SWEEP_TURNS: u32 = 64_000;
/// Turns a cell of a row takes where each of the eight goes on alone: to walk there, and to scatter.
const CELL_TURNS: u32 = 2 * 8;
/// The same for a cell of the first row of a plane, once for each of the eight: to let light in by two turns of corners.
const ENTERING_TURNS: u32 = 3 * 8;
/// Turns a row has besides those for its cells.
const ROW_TURNS: u32 = 16;
/// Bytes of a texel of the field.
const TEXEL_BYTES: u64 = 8;
/// Bytes from one stage to the next: what WebGPU asks of offsets into uniforms at most.
const STAGE_STRIDE: usize = 256;

/// Names of the jobs that there may be at a time - of what is shown, of what comes next, and a spare one -
/// for those who watch what is bound.
pub(super) const PARTS: [&str; 3] = ["light grid", "second light grid", "third light grid"];

/// Buffers for one size of grid and number of turns.
pub(super) struct Job {
    /// One of `PARTS`.
    pub part: &'static str,
    pub sizes: Vec<[u32; 4]>,
    pub directions: u32,
    pub cells: u32,
    pub grid_size: GridSize,
    pub room: GridRoom,
    pub turns: [u32; 2],
    pub least_eigenvalue: f64,
    pub uniforms: wgpu::Buffer,
    pub eye: wgpu::Buffer,
    pub particles: wgpu::Buffer,
    pub count: wgpu::Buffer,
    pub rings: Option<RingJob>,
    pub slots: SlotsJob,
    pub large: wgpu::Buffer,
    pub sun: wgpu::Buffer,
    pub sources: wgpu::Buffer,
    pub lights: wgpu::Buffer,
    pub light_words: usize,
    pub bytes: u64,
    pub splat: wgpu::BindGroup,
    /// By level, turn and part of a sweep.
    pub stages: Vec<Vec<Vec<wgpu::BindGroup>>>,
    pub ground: wgpu::BindGroup,
    pub field: wgpu::BindGroup,
    pub read: wgpu::BindGroup,
}

impl Job {
    /// Whether a solution of these inputs can be made in it.
    pub fn fits(&self, inputs: &GridInputs, size: GridSize) -> bool {
        self.sizes == inputs.levels.sizes()
            && self.directions == inputs.levels.directions
            && self.grid_size == size
            && self.room == inputs.room
            && self.turns == inputs.turns
            && self.least_eigenvalue == least_eigenvalue(&inputs.uniforms)
    }

    pub fn new(
        gpu: &Gpu,
        passes: &Passes,
        part: &'static str,
        grid_size: GridSize,
        inputs: &GridInputs,
    ) -> Self {
        gpu.begin_part(part);
        let pass = &passes.light_grid;
        let GridSize { capacity, columns } = grid_size;
        let cells = inputs.levels.cells();
        let size = inputs.levels.texture_size();
        let word = size_of::<u32>();
        let uniforms = buffers::uniform(gpu, "light grid", &LightGridUniforms::zeroed());
        let eye = buffers::uniform(gpu, "grid eye", &GridEye::zeroed());
        let particles =
            buffers::storage(gpu, "grid particles", capacity as usize, size_of::<Particle>());
        let count = particle_count_buffer(gpu, 0);
        let room = inputs.room;
        let slots = pass.slots.job(gpu, &passes.lists.scan, &uniforms, inputs);
        let large = buffers::storage(gpu, "grid large", capacity as usize + LARGE_HEAD, word);
        let sun = buffers::storage(gpu, "grid sun", room.kept as usize, word);
        let light = |label, count| {
            buffers::storage(gpu, label, count as usize, pass.light_words as usize * word)
        };
        let sources = light("grid sources", room.matter * inputs.levels.directions);
        let lights = light("grid lights", inputs.levels.lights(room.kept));
        let columns_of_levels = inputs.levels.columns() as usize;
        let fallen = buffers::storage(gpu, "grid fallen", columns_of_levels, size_of::<[f32; 4]>());
        let shares = buffers::storage(gpu, "grid shares", columns_of_levels, size_of::<[f32; 2]>());
        let (stages_buffer, offsets) = stages(gpu, inputs);
        let splat = pass.matter.bind(
            gpu,
            &[
                uniforms.as_entire_binding(),
                particles.as_entire_binding(),
                count.as_entire_binding(),
                pass.spreads.as_entire_binding(),
                slots.cells.as_entire_binding(),
                large.as_entire_binding(),
            ],
        );
        let stage = |offset: u64| {
            pass.solve.bind(
                gpu,
                &[
                    uniforms.as_entire_binding(),
                    wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                        buffer: &stages_buffer,
                        offset,
                        size: wgpu::BufferSize::new(size_of::<GridStage>() as u64),
                    }),
                    slots.cells.as_entire_binding(),
                    slots.cell_of.as_entire_binding(),
                    slots.offsets[0].as_entire_binding(),
                    slots.offsets[1].as_entire_binding(),
                    sun.as_entire_binding(),
                    sources.as_entire_binding(),
                    lights.as_entire_binding(),
                ],
            )
        };
        let parts = |turn: Vec<u64>| turn.into_iter().map(stage).collect();
        let turns = |level: Vec<Vec<u64>>| level.into_iter().map(parts).collect();
        let stages = offsets.into_iter().map(turns).collect();
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
        let ground = pass.ground.bind(
            gpu,
            &[
                uniforms.as_entire_binding(),
                sun.as_entire_binding(),
                slots.cells.as_entire_binding(),
                lights.as_entire_binding(),
                fallen.as_entire_binding(),
                shares.as_entire_binding(),
            ],
        );
        let field = pass.field.bind(
            gpu,
            &[
                eye.as_entire_binding(),
                uniforms.as_entire_binding(),
                lights.as_entire_binding(),
                shares.as_entire_binding(),
                wgpu::BindingResource::TextureView(&view),
                slots.cells.as_entire_binding(),
                slots.cell_of.as_entire_binding(),
                slots.offsets[0].as_entire_binding(),
                slots.offsets[1].as_entire_binding(),
            ],
        );
        let read = pass.bind(gpu, &uniforms, &view, &slots.cells);
        let rings = (columns > 0)
            .then(|| passes.rings.job(gpu, &passes.lists.scan, columns, &particles, &count));
        let texels = u64::from(size[0]) * u64::from(size[1]) * u64::from(size[2]);
        let bytes = particles.size()
            + slots.bytes
            + sun.size()
            + large.size()
            + sources.size()
            + lights.size()
            + fallen.size()
            + shares.size()
            + stages_buffer.size()
            + texels * TEXEL_BYTES
            + rings.as_ref().map_or(0, RingJob::bytes);
        Self {
            part,
            sizes: inputs.levels.sizes(),
            directions: inputs.levels.directions,
            cells,
            grid_size,
            room,
            turns: inputs.turns,
            least_eigenvalue: least_eigenvalue(&inputs.uniforms),
            uniforms,
            eye,
            particles,
            count,
            rings,
            slots,
            large,
            sun,
            sources,
            lights,
            light_words: pass.light_words as usize,
            bytes,
            splat,
            stages,
            ground,
            field,
            read,
        }
    }
}

/// Rows of slanted planes in parts, each of them few enough for a driver that ends loops.
fn parts(longest: u32) -> impl Iterator<Item = [u32; 2]> {
    let left = SWEEP_TURNS.saturating_sub(ENTERING_TURNS * longest);
    let rows = (left / (CELL_TURNS * longest + ROW_TURNS)).max(1);
    (0..longest.max(1)).step_by(rows as usize).map(move |first| [first, first + rows])
}

/// The stages of a solution, and where each one is, by level, turn and part of a sweep.
fn stages(gpu: &Gpu, inputs: &GridInputs) -> (wgpu::Buffer, Vec<Vec<Vec<u64>>>) {
    let (mut bytes, mut offsets) = (Vec::new(), Vec::new());
    for (level, cells) in inputs.levels.levels.iter().enumerate() {
        let longest = cells.size[..3].iter().max().copied().unwrap_or(0);
        let mut of_level = Vec::new();
        let steps = relaxations(inputs.turns_of(level), least_eigenvalue(&inputs.uniforms));
        for (turn, relaxation) in steps.iter().copied().enumerate() {
            let is_last = u32::from(turn + 1 == steps.len());
            let mut of_turn = Vec::new();
            for [first_row, end_row] in parts(longest) {
                let level = level as u32;
                let zeroed = GridStage::zeroed();
                let stage = GridStage { level, relaxation, is_last, first_row, end_row, ..zeroed };
                of_turn.push(bytes.len() as u64);
                bytes.extend_from_slice(bytemuck::bytes_of(&stage));
                bytes.resize(bytes.len().next_multiple_of(STAGE_STRIDE), 0);
            }
            of_level.push(of_turn);
        }
        offsets.push(of_level);
    }
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("grid stages"),
        size: bytes.len().max(STAGE_STRIDE) as u64,
        usage: wgpu::BufferUsages::UNIFORM
            | wgpu::BufferUsages::COPY_DST
            | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, &bytes);
    (buffer, offsets)
}
