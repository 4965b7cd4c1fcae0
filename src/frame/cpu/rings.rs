//! Twin of `shaders/frame/rings.wgsl`: what the cells of a ring hold.

use glam::{IVec2, IVec3, Quat, UVec2, Vec2, Vec3};

use super::noise::{hash, hash_combine, unit_float};
use super::weather::{WeatherAt, map_excess, weather_at};
use crate::frame::gpu_data::{CloudUniforms, Particle, Ring};
use crate::frame::rings::PlacedField;

const GROWTH_SEEN: f32 = 0.2;
const GROWTH_DENSE: f32 = 0.45;
const SMALLEST_RADIUS: f32 = 0.7;
/// Largest radius of a particle relative to the height of the cloud at its place.
pub const RIM_RADIUS: f32 = 0.6;
const LEAST_RADIUS: f32 = 0.25;
const DENSE_RADIUS: f32 = 0.5;
const HEIGHT_JITTER: f32 = 0.7;
const BASE_LIFT: f32 = 0.75;

/// The coverage noise.
pub mod coverage_noise {
    use super::super::noise::gradient_noise;
    use super::*;

    const PERSISTENCE: f32 = 0.5;

    /// Sum of octaves of gradient noise at a place of the field: `cell` in innermost cells, plus
    /// `offset` cells.
    pub fn at(clouds: &CloudUniforms, cell: IVec2, offset: Vec2) -> f32 {
        let mut sum = 0.0;
        let mut amplitude = 1.0;
        for octave in 0..clouds.octaves {
            let shift = clouds.largest_shift - octave;
            let wavelength = 1_i32 << shift;
            let within = (cell & IVec2::splat(wavelength - 1)).as_vec2() + offset;
            let scaled = within / wavelength as f32;
            let whole = scaled.floor();
            let lattice = (cell >> IVec2::splat(shift as i32)) + whole.as_ivec2();
            let fraction = scaled - whole;
            let slot = octave as usize;
            sum += amplitude
                * gradient_noise(
                    hash_combine(clouds.seed, octave),
                    IVec3::new(lattice.x, clouds.evolution_cell[slot][0], lattice.y),
                    Vec3::new(fraction.x, clouds.evolution[slot][0], fraction.y),
                );
            amplitude *= PERSISTENCE;
        }
        sum
    }

    /// Independent draws from the noise with this many octaves.
    pub fn draws(octaves: u32, count: u32) -> Vec<f32> {
        let mut clouds = <CloudUniforms as bytemuck::Zeroable>::zeroed();
        clouds.octaves = octaves;
        clouds.largest_shift = octaves.max(1) - 1;
        (0..count)
            .map(|i| {
                // A new seed for every draw makes them independent.
                clouds.seed = hash(i);
                let place = Vec2::new(unit_float(hash(!i)), unit_float(hash(i ^ 0x5bd1_e995)));
                for octave in 0..octaves as usize {
                    clouds.evolution[octave][0] = unit_float(hash_combine(i, 77 + octave as u32));
                }
                at(&clouds, IVec2::ZERO, place * (1_i32 << clouds.largest_shift) as f32)
            })
            .collect()
    }
}

fn smoothstep(edges: [f32; 2], x: f32) -> f32 {
    let t = ((x - edges[0]) / (edges[1] - edges[0])).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn uniform_rotation(u: Vec3) -> Quat {
    let tau = std::f32::consts::TAU;
    let (a, b) = ((1.0 - u.x).sqrt(), u.x.sqrt());
    Quat::from_xyzw(
        a * (tau * u.y).sin(),
        a * (tau * u.y).cos(),
        b * (tau * u.z).sin(),
        b * (tau * u.z).cos(),
    )
}

/// The particle in one layer of one cell, if there is one.
pub fn candidate(
    field: &PlacedField,
    ring_index: u32,
    ring: &Ring,
    cell_in_ring: UVec2,
    layer: u32,
) -> Option<Particle> {
    let clouds = &field.uniforms;
    let cell = IVec2::new(
        ring.first_cell[0].wrapping_add(cell_in_ring.x as i32),
        ring.first_cell[1].wrapping_add(cell_in_ring.y as i32),
    );
    let column = hash_combine(hash_combine(clouds.seed, 0x51ed0 + ring_index), cell.x as u32);
    let id = hash_combine(hash_combine(column, cell.y as u32), layer);
    let h1 = hash(id ^ 0x1b87_3593);
    let h2 = hash(h1);
    let h3 = hash(h2);
    let h4 = hash(h3);
    let jitter = Vec3::new(unit_float(id), unit_float(h1), unit_float(h2));
    let jitter_flat = Vec2::new(jitter.x, jitter.z);

    let horizontal =
        Vec2::from(ring.corner) + (cell_in_ring.as_vec2() + jitter_flat) * ring.cell_size;
    let distance = horizontal.length();
    let weight = smoothstep(ring.fade_in, distance) * (1.0 - smoothstep(ring.fade_out, distance));
    if weight <= 0.0 {
        return None;
    }
    let scale = 1_i32 << ring_index;
    let place = IVec2::new(cell.x.wrapping_mul(scale), cell.y.wrapping_mul(scale));
    let offset = jitter_flat * scale as f32;
    let mut weather = WeatherAt { coverage: 1.0, height: 1.0, extinction: 1.0 };
    if let Some(map) = &field.weather {
        weather = weather_at(&clouds.map, map, ring, cell_in_ring, offset);
        if weather.coverage <= 0.0 || weather.extinction <= 0.0 {
            return None;
        }
    }
    let noise = coverage_noise::at(clouds, place, offset);
    let excess = match &field.weather {
        Some(map) => map_excess(&clouds.map, map, noise, weather.coverage),
        None => ((noise - clouds.threshold) * clouds.inverse_range).clamp(0.0, 1.0),
    };
    let height = clouds.thickness * excess * (2.0 - excess) * weather.height;
    let altitude = (layer as f32 + 0.5 + HEIGHT_JITTER * (jitter.y - 0.5)) * ring.layer_height;
    let growth = ((height - altitude) / ring.layer_height + 0.5).clamp(0.0, 1.0);
    if growth <= GROWTH_SEEN {
        return None;
    }
    let largest = clouds.particle_size * ring.cell_size;
    let size = SMALLEST_RADIUS + (1.0 - SMALLEST_RADIUS) * unit_float(h3);
    let radius = (largest * size * growth.sqrt()).min(RIM_RADIUS * height);
    if radius < LEAST_RADIUS * largest {
        return None;
    }
    let shape = clouds.shape_list[(h4 % clouds.shapes.max(1)) as usize];
    let extinction = clouds.extinction
        * weather.extinction
        * weight
        * smoothstep([GROWTH_SEEN, GROWTH_DENSE], growth)
        * smoothstep([LEAST_RADIUS * largest, DENSE_RADIUS * largest], radius);
    let turn = Vec3::new(
        unit_float(hash(h4)),
        unit_float(hash(h4 ^ 0x68bc_21eb)),
        unit_float(hash(h4 ^ 0x02e5_be93)),
    );
    Some(Particle {
        centre: [horizontal.x, clouds.base + altitude.max(BASE_LIFT * radius), horizontal.y],
        radius,
        orientation: uniform_rotation(turn).to_array(),
        extinction,
        shape: shape[0],
        id,
        optical_radius: extinction * radius * f32::from_bits(shape[1]),
    })
}

/// All particles of the field, in the device's order.
pub fn particles(field: &PlacedField) -> Vec<Particle> {
    (0..field.uniforms.rings).flat_map(|index| particles_of_ring(field, index)).collect()
}

/// Those of one ring; of none where there is no such ring.
pub fn particles_of_ring(field: &PlacedField, index: u32) -> Vec<Particle> {
    let clouds = &field.uniforms;
    let mut result = Vec::new();
    let Some(ring) = clouds.ring.get(index as usize) else { return result };
    for z in 0..clouds.cells {
        for x in 0..clouds.cells {
            for layer in 0..ring.layers {
                result.extend(candidate(field, index, ring, UVec2::new(x, z), layer));
            }
        }
    }
    result
}
