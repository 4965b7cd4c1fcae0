//! Twin of `shaders/frame/shadow.wgsl`, in double precision.

use glam::DVec3;

use super::light::occlusion;
use crate::frame::gpu_data::{Particle, ShadowUniforms};
use crate::tables::TableSet;

/// Point on the ground (m, relative to the camera) in the middle of a texel of a map.
pub fn point(maps: &ShadowUniforms, map: usize, texel: [u32; 2]) -> DVec3 {
    let [x, z, side, _] = maps.corner[map].map(f64::from);
    let step = side / f64::from(maps.resolution);
    let at = |corner: f64, texel: u32| corner + (f64::from(texel) + 0.5) * step;
    DVec3::new(at(x, texel[0]), maps.ground.into(), at(z, texel[1]))
}

/// Transmittance of all particles from a point on the ground towards the sun.
pub fn transmittance(tables: &TableSet, particles: &[Particle], sun: DVec3, point: DVec3) -> f64 {
    (-occlusion(tables, particles, None, sun, point).front).exp()
}
