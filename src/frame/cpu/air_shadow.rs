//! Twin of `shaders/frame/air_shadow.wgsl`, `shaders/shared/air_shadow.wgsl` and
//! `shaders/shared/air_shadow_place.wgsl`: what clouds change of the light of the air before the eye, and of the
//! ground. In f64.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, DVec4};

use super::light_grid::{FieldSeen, share_from_above};
use super::sky::Sky;
use crate::frame::air_shadow::NODES;
use crate::frame::gpu_data::ShadowUniforms;

/// The air is shadowed so far below the lowest of what else is, m.
const BELOW: f64 = 500.0;
/// Over the highest matter they begin or end so far, m.
pub const ABOVE: f64 = 1000.0;
/// Least share of the light from above in what the field holds of an even light.
const LEAST_SHARE: f64 = 0.05;
/// What clouds send into the air, less the skylight that they hide from it, over what the field holds of their
/// sunlight.
pub const NET: f64 = 0.4;
/// The same of the ground.
const NET_GROUND: f64 = 0.25;
/// Albedo of droplets below which the field tells nothing.
const LEAST_ALBEDO: f64 = 1e-3;
/// Least component of a direction.
const LEAST: f64 = 1e-9;
/// Steps to where the part begins where clouds are about.
const STEPS_BEFORE: u32 = 12;

/// Part of a ray between two distances that lies within two places along an axis.
pub fn within(span: [f64; 2], low: f64, high: f64, slope: f64) -> [f64; 2] {
    let slope = if slope.abs() < LEAST { LEAST.copysign(slope) } else { slope };
    let (a, b) = (low / slope, high / slope);
    [span[0].max(a.min(b)), span[1].min(a.max(b))]
}

/// Part of a ray from the eye where clouds are about, m.
pub fn clouded_span(maps: &ShadowUniforms, dir: DVec3) -> [f64; 2] {
    let axis = |v: [f32; 4]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
    let [x, y, texel, _] = maps.corner[(maps.maps as usize).clamp(1, 8) - 1].map(f64::from);
    let side = texel * f64::from(maps.resolution);
    let span = [0.0, 4.0 * side + f64::from(maps.reach)];
    let span = within(span, x, x + side, dir.dot(axis(maps.axis_u)));
    let span = within(span, y, y + side, dir.dot(axis(maps.axis_v)));
    within(span, f64::from(maps.lowest) - BELOW, f64::from(maps.highest) + ABOVE, dir.y)
}

/// Distance of a node.
pub fn node_distance(span: [f64; 2], node: f64) -> f64 {
    span[0] + (span[1] - span[0]) * (node / f64::from(NODES)).powi(2)
}

/// What clouds send and hide: optical depth from a point relative to the eye to the sun, and the light that they
/// scatter among themselves.
pub struct CloudLight<'a> {
    /// Optical depth to the sun.
    pub sun_depth: &'a dyn Fn(DVec3) -> f64,
    /// By the light grid.
    pub field: &'a FieldSeen,
}

/// Light that clouds leave at a point relative to the eye, as in the field, but for all directions that droplets
/// would scatter from.
fn light_around(field: &FieldSeen, point: DVec3) -> DVec2 {
    field.from_afar(point).truncate() / f64::from(field.uniforms().albedo).max(LEAST_ALBEDO)
}

/// Change of the light of the air of a ray up to distances (m) that grow, rgb, with so many steps from one to
/// the next; none before the first.
pub fn change_along(
    sky: &Sky,
    dir: DVec3,
    distances: &[f64],
    steps: u32,
    clouds: &CloudLight<'_>,
) -> Vec<DVec3> {
    let (air, ray) = (sky.air(), sky.ray(dir));
    let mut begin = distances.first().copied().unwrap_or_default();
    let entry = sky.air_span(dir, begin)[0];
    let mut depth = air.depth_between(&ray, entry, begin.max(entry), STEPS_BEFORE);
    let mut sum = DVec4::ZERO;
    distances
        .iter()
        .map(|&end| {
            let step = (end - begin) / f64::from(steps);
            for i in 0..if step > 0.0 { steps } else { 0 } {
                let [from, to] = [i, i + 1].map(|i| begin + f64::from(i) * step);
                let point = dir * (0.5 * (from + to));
                let beam = (-(clouds.sun_depth)(point)).exp_m1();
                let scattered = NET * light_around(clouds.field, point).x;
                if beam != 0.0 || scattered != 0.0 {
                    sum += (-depth).exp() * air.sunlit(&ray, from, to, [beam, scattered]);
                }
                depth += air.depth_between(&ray, from, to, 1);
            }
            begin = begin.max(end);
            sky.colour_of(sum)
        })
        .collect()
}

/// What reaches a point of the ground relative to the eye besides the sun's beam: irradiance that clouds scatter
/// down, per unit of the sun's on a surface that faces it, and the share of the skylight that they leave.
pub fn light_on_ground(field: &FieldSeen, point: DVec3) -> [f64; 2] {
    let grid = field.uniforms();
    if grid.levels == 0 {
        return [0.0, 1.0];
    }
    let even = share_from_above(grid, point.normalize_or_zero()).max(LEAST_SHARE);
    let light = light_around(field, point);
    let known = f64::from(grid.albedo) >= LEAST_ALBEDO;
    let sky = if known { (light.y / even).min(1.0) } else { 1.0 };
    [NET_GROUND * PI * light.x / even, 1.0 + NET_GROUND * (sky - 1.0)]
}
