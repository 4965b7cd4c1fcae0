//! Twin of `shaders/frame/air_shadow.wgsl`, `shaders/shared/air_shadow.wgsl` and
//! `shaders/shared/air_shadow_place.wgsl`: sunlight that clouds take from the air before the eye, for whatever
//! tells the optical depth to the sun. In f64.

use glam::DVec3;

use super::sky::Sky;
use crate::frame::air_shadow::NODES;
use crate::frame::gpu_data::ShadowUniforms;

/// Below the lowest of what is shadowed rays go on so far, m.
const BELOW: f64 = 500.0;
/// Least component of a direction.
const LEAST: f64 = 1e-9;
/// Steps from one node to the next; as in the shader.
pub const STEPS: u32 = 4;

/// Part of a ray between two distances that lies within two places along an axis.
fn within(span: [f64; 2], low: f64, high: f64, slope: f64) -> [f64; 2] {
    let slope = if slope.abs() < LEAST { LEAST.copysign(slope) } else { slope };
    let (a, b) = (low / slope, high / slope);
    [span[0].max(a.min(b)), span[1].min(a.max(b))]
}

/// Part of a ray from the eye that clouds may shade, m.
pub fn shaded_span(maps: &ShadowUniforms, dir: DVec3) -> [f64; 2] {
    let axis = |v: [f32; 4]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
    let [x, y, texel, _] = maps.corner[(maps.maps as usize).clamp(1, 8) - 1].map(f64::from);
    let side = texel * f64::from(maps.resolution);
    let span = [0.0, 4.0 * side + f64::from(maps.reach)];
    let span = within(span, x, x + side, dir.dot(axis(maps.axis_u)));
    let span = within(span, y, y + side, dir.dot(axis(maps.axis_v)));
    within(span, f64::from(maps.lowest) - BELOW, maps.highest.into(), dir.y)
}

/// Distance of a node.
pub fn node_distance(span: [f64; 2], node: f64) -> f64 {
    span[0] + (span[1] - span[0]) * (node / f64::from(NODES)).powi(2)
}

/// Light that clouds take from the air of a ray up to distances (m) that grow, rgb, with so many steps from
/// one to the next; none before `begin`. `sun_depth`: optical depth from a point relative to the eye to the
/// sun.
pub fn lost_along(
    sky: &Sky,
    dir: DVec3,
    begin: f64,
    distances: &[f64],
    steps: u32,
    sun_depth: &dyn Fn(DVec3) -> f64,
) -> Vec<DVec3> {
    let mut sum = DVec3::ZERO;
    let mut from = begin;
    distances
        .iter()
        .map(|&to| {
            let step = (to - from) / f64::from(steps);
            if step > 0.0 {
                for i in 0..steps {
                    let middle = from + (f64::from(i) + 0.5) * step;
                    let shaded = -(-sun_depth(dir * middle)).exp_m1();
                    if shaded > 0.0 {
                        sum += sky.sunlit_air(dir, middle, step) * shaded;
                    }
                }
                from = to;
            }
            sum
        })
        .collect()
}
