//! Rings: cells around the camera become particles. The host says where the rings lie at this
//! time, the device fills them.

use std::collections::HashMap;
use std::sync::{Mutex, OnceLock};

use glam::{DVec2, DVec3, IVec2, Vec2};

use super::cpu::rings::coverage_noise;
use super::gpu_data::{CloudUniforms, FIELD_SLOTS, ParticleCount, Ring};
use super::scan::{ScanJob, ScanPass};
use super::weather::{self, Weather, WeatherBuffer};
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::scene::CloudField;
use crate::{Error, Result};

/// Invocations of a workgroup; as in the shader.
const WORKGROUP: u32 = 64;
/// Most octaves of coverage noise: below 1/32 of the largest wavelength the particles themselves
/// give the detail.
const MOST_OCTAVES: u32 = 6;
/// Share of a ring's reach over which it fades into the next.
const FADE_SHARE: f64 = 0.3;
/// Share of the distance within which a ring ends at once: eight steps of f32.
const SUDDEN: f32 = 8.0 * f32::EPSILON;
/// Draws from the coverage noise for its quantiles: the standard error of the coverage is then
/// below 0.4 %.
const QUANTILE_DRAWS: u32 = 16384;
/// Quantile of the noise at which a cloud has its full height.
const TALLEST_QUANTILE: f64 = 0.995;
/// Octaves evolve faster the smaller they are, by this factor from one to the next: turnover time
/// goes with the 2/3 power of size in the inertial range (Kolmogorov 1941).
const EVOLUTION_RATIO: f64 = 0.629_960_524_947_436_6; // 2^(-2/3)

/// A shape that particles may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldShape {
    /// Index in the tables.
    pub index: u32,
    /// Volume mean of its density.
    pub mean_density: f32,
}

/// The pipelines.
pub struct RingPass {
    kernel: Kernel,
}

/// Buffers of the pass, for one number of columns and one capacity.
pub struct RingJob {
    uniforms: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    scan: ScanJob,
    columns: u32,
    bytes: u64,
}

impl RingPass {
    /// Compiles the pass; `weather` is the layout of [`WeatherBuffer`].
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        weather: &wgpu::BindGroupLayout,
    ) -> Result<Self> {
        let file = crate::shader_file!("frame/rings.wgsl");
        let kernel = Kernel::new(gpu, library, file, &[], &[weather])?;
        Ok(Self { kernel })
    }

    /// Binds the particle buffers for a field of `columns` columns.
    pub fn job(
        &self,
        gpu: &Gpu,
        scan: &ScanPass,
        columns: u32,
        particles: &wgpu::Buffer,
        particle_count: &wgpu::Buffer,
    ) -> RingJob {
        let uniforms =
            buffers::uniform(gpu, "clouds", &<CloudUniforms as bytemuck::Zeroable>::zeroed());
        let word = size_of::<u32>();
        let counts = buffers::storage(gpu, "column counts", columns as usize, word);
        let offsets = buffers::storage(gpu, "column offsets", columns as usize + 1, word);
        let bindings = self.kernel.bind(
            gpu,
            &[
                uniforms.as_entire_binding(),
                counts.as_entire_binding(),
                offsets.as_entire_binding(),
                particles.as_entire_binding(),
                particle_count.as_entire_binding(),
            ],
        );
        let scan = scan.job(gpu, &counts, &offsets, columns);
        let bytes = counts.size() + offsets.size();
        RingJob { uniforms, bindings, scan, columns, bytes }
    }

    /// Records the making of all particles; `weather` must hold the field's map.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        scan: &ScanPass,
        (job, field): (&RingJob, &PlacedField),
        weather: &WeatherBuffer,
    ) {
        gpu.queue.write_buffer(&job.uniforms, 0, bytemuck::bytes_of(&field.uniforms));
        let groups = job.columns.div_ceil(WORKGROUP);
        pass.set_pipeline(self.kernel.pipeline("count"));
        pass.set_bind_group(0, &job.bindings, &[]);
        pass.set_bind_group(1, weather.bind_group(), &[]);
        pass.dispatch_workgroups(groups, 1, 1);
        scan.encode(pass, &job.scan);
        pass.set_pipeline(self.kernel.pipeline("write"));
        pass.set_bind_group(0, &job.bindings, &[]);
        pass.set_bind_group(1, weather.bind_group(), &[]);
        pass.dispatch_workgroups(groups, 1, 1);
    }
}

impl RingJob {
    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// A buffer for the number of particles, with the number of a listed scene.
pub fn particle_count_buffer(gpu: &Gpu, particles: u32) -> wgpu::Buffer {
    let count = ParticleCount { particles, wanted: particles };
    buffers::storage_with(gpu, "particle count", &[count])
}

/// Columns of cells in all rings of a field.
pub fn columns(field: &CloudField) -> Result<u32> {
    let rings = field.rings as usize;
    if rings == 0 || rings > FIELD_SLOTS {
        return Err(Error::input(
            "clouds.rings",
            format!("expected 1 to {FIELD_SLOTS} rings, found {rings}"),
        ));
    }
    field
        .cells
        .checked_mul(field.cells)
        .and_then(|c| c.checked_mul(field.rings))
        .ok_or_else(|| Error::input("clouds.cells", "too many cells"))
}

/// Distance (m) within which the outermost ring's particles lie.
pub fn reach(field: &CloudField) -> f64 {
    let outermost = field.cell_size * f64::from(1u32 << (field.rings.clamp(1, 31) - 1));
    (f64::from(field.cells) / 2.0 - 1.0).max(1.0) * outermost
}

/// A cloud field around a place at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedField {
    /// Its numbers.
    pub uniforms: CloudUniforms,
    /// Its weather map.
    pub weather: Option<Weather>,
}

impl PlacedField {
    /// Everything the device needs to know of the field, for a camera (m, world) and a time (s).
    /// World coordinates are double: what reaches the device is relative to the camera.
    pub fn new(
        field: &CloudField,
        camera: DVec3,
        time: f64,
        shapes: &[FieldShape],
        first_slot: u32,
        capacity: u32,
    ) -> Self {
        let uniforms = uniforms(field, camera, time, shapes, first_slot, capacity);
        let weather = field.weather.as_ref().map(|map| Weather::new(map, uniforms.octaves));
        Self { uniforms, weather }
    }
}

impl PlacedField {
    /// Lets rings end in the middle of the zones in which they fade into each other.
    pub(super) fn end_at_once(&mut self) {
        let mut before = self.uniforms.ring[0].fade_in;
        for ring in self.uniforms.ring.iter_mut().take(self.uniforms.rings as usize) {
            let middle = 0.5 * (ring.fade_out[0] + ring.fade_out[1]);
            ring.fade_in = before;
            ring.fade_out = [middle, middle * (1.0 + SUDDEN)];
            before = ring.fade_out;
        }
    }
}

fn uniforms(
    field: &CloudField,
    camera: DVec3,
    time: f64,
    shapes: &[FieldShape],
    first_slot: u32,
    capacity: u32,
) -> CloudUniforms {
    let mut result = <CloudUniforms as bytemuck::Zeroable>::zeroed();
    let wavelengths = (field.feature_size / field.cell_size).log2().round().clamp(0.0, 20.0);
    result.largest_shift = wavelengths as u32;
    result.octaves = (result.largest_shift + 1).min(MOST_OCTAVES);
    result.seed = field.seed;
    result.rings = field.rings.min(FIELD_SLOTS as u32);
    result.cells = field.cells;
    result.columns = result.rings * field.cells * field.cells;
    let drifted = camera - field.wind * time;
    result.base = (field.base - drifted.y) as f32;
    result.thickness = field.thickness as f32;
    result.extinction = field.extinction as f32;
    result.particle_size = field.particle_size as f32;
    result.first_slot = first_slot;
    result.capacity = capacity;
    [result.threshold, result.inverse_range] = threshold(result.octaves, field.coverage);
    let mut turnover = field.evolution_time;
    for octave in 0..result.octaves as usize {
        let phase = time / turnover;
        // Wraps after 2^32 turnovers: more than the age of the universe at a second each.
        result.evolution_cell[octave][0] = phase.floor() as i64 as i32;
        result.evolution[octave][0] = (phase - phase.floor()) as f32;
        turnover *= EVOLUTION_RATIO;
    }
    result.shapes = shapes.len().min(FIELD_SLOTS) as u32;
    for (slot, shape) in result.shape_list.iter_mut().zip(shapes) {
        *slot = [shape.index, shape.mean_density.to_bits(), 0, 0];
    }
    let mut layers = field.layers;
    let mut cell_size = field.cell_size;
    let mut fade_in = [-2.0_f32, -1.0];
    let mut first_cells = [[0; 2]; FIELD_SLOTS];
    for (index, ring) in result.ring.iter_mut().take(result.rings as usize).enumerate() {
        let first = &mut first_cells[index];
        (*first, *ring) = place_ring(field, DVec2::new(drifted.x, drifted.z), cell_size, layers);
        ring.first_column = index as u32 * field.cells * field.cells;
        ring.fade_in = fade_in;
        fade_in = ring.fade_out;
        cell_size *= 2.0;
        layers = layers.div_ceil(2);
    }
    if let Some(map) = &field.weather {
        weather::place(field, map, &mut result, &first_cells);
    }
    result
}

/// A ring, and the number of its first cell.
fn place_ring(field: &CloudField, camera: DVec2, cell_size: f64, layers: u32) -> ([i64; 2], Ring) {
    let first = (camera / cell_size).floor() - f64::from(field.cells / 2);
    let reach = (f64::from(field.cells / 2) - 1.0).max(1.0) * cell_size;
    // Wraps at 2^31 cells: 1e11 m from the origin with cells of 50 m.
    let number = [first.x as i64, first.y as i64];
    let wrapped = IVec2::from(number.map(|n| n as i32));
    let corner: Vec2 = (first * cell_size - camera).as_vec2();
    let ring = Ring {
        first_cell: wrapped.to_array(),
        corner: corner.to_array(),
        cell_size: cell_size as f32,
        layer_height: (field.thickness / f64::from(layers.max(1))) as f32,
        fade_in: [0.0; 2],
        fade_out: [((1.0 - FADE_SHARE) * reach) as f32, reach as f32],
        layers,
        first_column: 0,
        ..<Ring as bytemuck::Zeroable>::zeroed()
    };
    (number, ring)
}

/// The coverage noise's threshold where this share of the sky is covered, and 1 / the range from
/// there to the tallest clouds.
pub(super) fn threshold(octaves: u32, coverage: f64) -> [f32; 2] {
    let shares = [1.0 - coverage, 1.0 - (1.0 - TALLEST_QUANTILE) * coverage];
    let [threshold, tallest] = coverage_quantiles(octaves, shares);
    [threshold, 1.0 / (tallest - threshold).max(1e-6)]
}

/// Quantiles of the coverage noise with this many octaves. The noise is stationary and its lattice
/// is hashed, so they are the same for every seed, place and time.
fn coverage_quantiles<const N: usize>(octaves: u32, shares: [f64; N]) -> [f32; N] {
    static DRAWN: OnceLock<Mutex<HashMap<u32, Vec<f32>>>> = OnceLock::new();
    let mut drawn =
        DRAWN.get_or_init(Default::default).lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let sorted = drawn.entry(octaves).or_insert_with(|| {
        let mut values = coverage_noise::draws(octaves, QUANTILE_DRAWS);
        values.sort_by(f32::total_cmp);
        values
    });
    let last = sorted.len() - 1;
    shares.map(|share| sorted[((share.clamp(0.0, 1.0) * last as f64).round() as usize).min(last)])
}
