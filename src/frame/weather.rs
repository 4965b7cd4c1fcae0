//! The weather map of a cloud field on the device, and where it lies under the rings' cells.

use std::sync::Arc;

use glam::{DVec2, UVec2};

use super::gpu_data::{CloudUniforms, MapUniforms, Ring};
use super::rings;
use crate::gpu::{Gpu, buffers};
use crate::scene::{CloudField, Outside, WeatherImage, WeatherMap};

/// Knots of the curves, from coverage 0 to 1; as in the shader. What lies below the second is next to
/// nothing: 0.4 % of the sky.
pub const CURVE_KNOTS: usize = 257;
/// Above all values of the coverage noise, which is below 1.5 in its largest octave and below 3 in all.
const BEYOND_NOISE: f32 = 4.0;

/// What makes a share of the sky covered: the coverage noise's threshold and 1 / the range above it, by
/// coverage.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverageCurve {
    /// Noise above this is cloud.
    pub thresholds: [f32; CURVE_KNOTS],
    /// 1 / what the noise rises by from there to the tallest clouds.
    pub inverse_ranges: [f32; CURVE_KNOTS],
    octaves: u32,
}

impl CoverageCurve {
    fn new(octaves: u32) -> Self {
        let mut curve = Self {
            thresholds: [BEYOND_NOISE; CURVE_KNOTS],
            inverse_ranges: [0.0; CURVE_KNOTS],
            octaves,
        };
        for knot in 1..CURVE_KNOTS {
            let coverage = knot as f64 / (CURVE_KNOTS - 1) as f64;
            let [threshold, inverse] = rings::threshold(octaves, coverage);
            curve.thresholds[knot] = threshold;
            curve.inverse_ranges[knot] = inverse;
        }
        curve.inverse_ranges[0] = curve.inverse_ranges[1];
        curve
    }
}

/// A weather map as the rings read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Weather {
    /// Its pixels.
    pub image: Arc<WeatherImage>,
    /// What its coverage means for the noise.
    pub curve: Arc<CoverageCurve>,
}

impl Weather {
    /// Of a map, for a field with so many octaves of noise.
    pub fn new(map: &WeatherMap, octaves: u32) -> Self {
        static MADE: std::sync::Mutex<Vec<Arc<CoverageCurve>>> = std::sync::Mutex::new(Vec::new());
        let mut made = MADE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let known = made.iter().find(|curve| curve.octaves == octaves).cloned();
        let curve = known.unwrap_or_else(|| {
            let new = Arc::new(CoverageCurve::new(octaves));
            made.push(new.clone());
            new
        });
        Self { image: map.image.clone(), curve }
    }
}

/// Units of a place on the map in a texel: 32 bits for the whole, 32 for the share.
const UNITS: f64 = 4_294_967_296.0;
/// Farther than this from a map that does not repeat, texels, all places are the same: a ring adds 2^28 at
/// most, so nothing passes 32 bits.
const FARTHEST: i128 = 1 << 30;

/// Notes in the uniforms where the map lies. `first_cells` are those of the rings, in cells of their own;
/// their numbers do not wrap.
pub(super) fn place(
    field: &CloudField,
    map: &WeatherMap,
    clouds: &mut CloudUniforms,
    first_cells: &[[i64; 2]],
) {
    let size = map.image.size();
    let pixels = UVec2::from(size).as_dvec2();
    // Texels in an innermost cell, and where the field's origin lies; a texel's place is its middle.
    let texels = pixels * field.cell_size / map.extent;
    let origin = (0.5 * map.extent - map.centre) / map.extent * pixels - DVec2::splat(0.5);
    clouds.map = MapUniforms {
        size,
        texels: texels.as_vec2().to_array(),
        coverage: field.coverage as f32,
        noise: map.noise as f32,
        outside: map.outside as u32,
        padding_a: 0,
    };
    let repeats = map.outside == Outside::Repeat;
    for (index, (ring, first)) in clouds.ring.iter_mut().zip(first_cells).enumerate() {
        for axis in 0..2 {
            let around = i128::from(size[axis].max(1)) << 32;
            let in_range = |units: i128| {
                let farthest = FARTHEST << 32;
                if repeats { units.rem_euclid(around) } else { units.clamp(-farthest, farthest) }
            };
            let step = (texels[axis] * UNITS).round() as i128;
            let first = (i128::from(first[axis]) << index) * step;
            set(
                ring,
                axis,
                [first + (origin[axis] * UNITS).round() as i128, step << index].map(in_range),
            );
        }
    }
}

fn set(ring: &mut Ring, axis: usize, [first, step]: [i128; 2]) {
    ring.map_first[axis] = (first >> 32) as i32;
    ring.map_first_share[axis] = first as u32;
    ring.map_step[axis] = (step >> 32) as i32;
    ring.map_step_share[axis] = step as u32;
}

/// The map on the device; one word where there is none.
pub struct WeatherBuffer {
    layout: wgpu::BindGroupLayout,
    words: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
    holds: Option<Weather>,
}

impl WeatherBuffer {
    /// Without a map.
    pub fn new(gpu: &Gpu) -> Self {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("weather"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: true },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let words = buffers::storage(gpu, "weather", 1, size_of::<u32>());
        let bind_group = bind(gpu, &layout, &words);
        Self { layout, words, bind_group, holds: None }
    }

    /// Bind group 1 of the rings.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// What is bound to it.
    pub fn bind_group(&self) -> &wgpu::BindGroup {
        &self.bind_group
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.words.size()
    }

    /// Holds this map from now on. Copies nothing where it does already.
    pub fn hold(&mut self, gpu: &Gpu, weather: Option<&Weather>) {
        if self.holds.as_ref() == weather {
            // Equal pixels may be others in memory, after a reload: the same ones are told apart at once.
            self.holds = weather.cloned();
            return;
        }
        let count = weather.map_or(1, |w| 2 * CURVE_KNOTS + w.image.texels().len());
        if self.words.size() != (count * size_of::<u32>()) as u64 {
            self.words = buffers::storage(gpu, "weather", count, size_of::<u32>());
            self.bind_group = bind(gpu, &self.layout, &self.words);
        }
        if let Some(Weather { image, curve }) = weather {
            let curves = [curve.thresholds, curve.inverse_ranges];
            let queue = &gpu.queue;
            queue.write_buffer(&self.words, 0, bytemuck::cast_slice(&curves));
            let at = size_of_val(&curves) as u64;
            queue.write_buffer(&self.words, at, bytemuck::cast_slice(image.texels()));
        }
        self.holds = weather.cloned();
    }
}

fn bind(gpu: &Gpu, layout: &wgpu::BindGroupLayout, words: &wgpu::Buffer) -> wgpu::BindGroup {
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("weather"),
        layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: words.as_entire_binding() }],
    })
}
