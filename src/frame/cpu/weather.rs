//! Twin of `shaders/shared/weather.wgsl`: what a weather map says of a place.

use glam::{IVec2, UVec2, Vec2, Vec3};

use crate::frame::gpu_data::{MapUniforms, Ring};
use crate::frame::weather::{CURVE_KNOTS, Weather};

const CURVE_STEPS: f32 = (CURVE_KNOTS - 1) as f32;
const SHARE_UNIT: f32 = 2.328_306_4e-10;
const REPEAT: u32 = 0;
const CLEAR: u32 = 2;

/// What the map says of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeatherAt {
    /// Share of the sky that is covered, 0 to 1.
    pub coverage: f32,
    /// Factor on the field's thickness.
    pub height: f32,
    /// Factor on the field's extinction.
    pub extinction: f32,
}

/// Whole texel and share (in units of 2^-32) of the corner of a cell of a ring.
pub fn map_place(ring: &Ring, cell_in_ring: UVec2) -> (IVec2, UVec2) {
    let axis = |axis: usize| {
        let step = i64::from(ring.map_step[axis]) << 32 | i64::from(ring.map_step_share[axis]);
        let first = i64::from(ring.map_first[axis]) << 32 | i64::from(ring.map_first_share[axis]);
        let place = first.wrapping_add(i64::from(cell_in_ring[axis]).wrapping_mul(step));
        ((place >> 32) as i32, place as u32)
    };
    let ((x, x_share), (z, z_share)) = (axis(0), axis(1));
    (IVec2::new(x, z), UVec2::new(x_share, z_share))
}

fn map_texel(map: &MapUniforms, weather: &Weather, texel: IVec2) -> Vec3 {
    let size = UVec2::from(map.size).as_ivec2().max(IVec2::ONE);
    let around = texel.rem_euclid(size);
    let within = texel.clamp(IVec2::ZERO, size - 1);
    let at = if map.outside == REPEAT { around } else { within }.as_uvec2();
    let index = at.y as usize * size.x as usize + at.x as usize;
    let word = weather.image.texels().get(index).copied().unwrap_or(0);
    let is_clear = map.outside == CLEAR && texel != within;
    let coverage = if is_clear { 0.0 } else { (word & 0xffff) as f32 / 65535.0 };
    Vec3::new(coverage, ((word >> 16) & 0xff) as f32 / 255.0, (word >> 24) as f32 / 255.0)
}

fn mix<T>(a: T, b: T, t: f32) -> T
where
    T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
{
    a * (1.0 - t) + b * t
}

/// What the map says `offset` innermost cells beside the corner of a cell.
pub fn weather_at(
    map: &MapUniforms,
    weather: &Weather,
    ring: &Ring,
    cell_in_ring: UVec2,
    offset: Vec2,
) -> WeatherAt {
    let (texel, share) = map_place(ring, cell_in_ring);
    let beside = share.as_vec2() * SHARE_UNIT + offset * Vec2::from(map.texels);
    let whole = beside.floor();
    let fraction = beside - whole;
    let texel = texel.wrapping_add(whole.as_ivec2());
    let at = |x, z| map_texel(map, weather, texel.wrapping_add(IVec2::new(x, z)));
    let upper = mix(at(0, 0), at(1, 0), fraction.x);
    let lower = mix(at(0, 1), at(1, 1), fraction.x);
    let value = mix(upper, lower, fraction.y);
    WeatherAt { coverage: map.coverage * value.x, height: value.y, extinction: value.z }
}

/// How far the coverage noise rises above what leaves the sky clear where this share of it is
/// covered, 0 to 1; or the coverage itself, as far as the map does without noise.
pub fn map_excess(map: &MapUniforms, weather: &Weather, noise: f32, coverage: f32) -> f32 {
    let at = coverage.clamp(0.0, 1.0) * CURVE_STEPS;
    let knot = (at as usize).min(CURVE_KNOTS - 2);
    let t = at - knot as f32;
    let curve = &weather.curve;
    let threshold = mix(curve.thresholds[knot], curve.thresholds[knot + 1], t);
    let inverse = mix(curve.inverse_ranges[knot], curve.inverse_ranges[knot + 1], t);
    let excess = ((noise - threshold) * inverse).clamp(0.0, 1.0);
    mix(coverage, excess, map.noise)
}
