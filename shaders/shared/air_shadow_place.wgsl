// Where it is known what clouds change of the light of air and ground: on rays through the corners of blocks of
// pixels, at nodes along the part of each where clouds are about. Twin: src/frame/cpu/air_shadow.rs.
#define_import_path cumuli::air_shadow_place

#import cumuli::shadow_maps::{AIR_BELOW, AIR_SIDES}
#import cumuli::sun_depth::shadow_maps

const NODES: u32 = 24u; // along a ray, behind the first, where nothing has changed yet
// Numbers of a ray: those of its nodes and of the ground behind them.
const ENTRIES: u32 = NODES + 2u;
// Over the highest matter they begin or end so far (m): what clouds send up lights the air there too.
const ABOVE: f32 = 1000.0;
// Least component of a direction: along an axis across which it does not move it never leaves the maps.
const LEAST: f32 = 1e-9;

// Part of a ray from the eye between two distances that lies within two places along an axis; `slope`: what
// the ray moves along the axis per metre.
fn within(span: vec2<f32>, low: f32, high: f32, slope: f32) -> vec2<f32> {
    let s = select(slope, select(-LEAST, LEAST, slope >= 0.0), abs(slope) < LEAST);
    let a = low / s;
    let b = high / s;
    return vec2(max(span.x, min(a, b)), min(span.y, max(a, b)));
}

// Part of a ray where clouds are about, m from the eye: on the maps, not much higher than the last matter;
// empty where the second is not beyond the first.
fn clouded_span(dir: vec3<f32>) -> vec2<f32> {
    let corner = shadow_maps.corner[min(shadow_maps.maps, 8u) - 1u];
    let side = corner.z * f32(shadow_maps.resolution);
    var span = vec2(0.0, AIR_SIDES * side + shadow_maps.reach);
    span = within(span, corner.x, corner.x + side, dot(dir, shadow_maps.axis_u.xyz));
    span = within(span, corner.y, corner.y + side, dot(dir, shadow_maps.axis_v.xyz));
    span = within(span, shadow_maps.lowest - AIR_BELOW, shadow_maps.highest + ABOVE, dir.y);
    return span;
}

// Distance of a node from 0 to NODES; they are denser towards the eye.
fn node_distance(span: vec2<f32>, node: f32) -> f32 {
    let share = node / f32(NODES);
    return span.x + (span.y - span.x) * share * share;
}

// The node at a distance.
fn node_at(span: vec2<f32>, distance: f32) -> f32 {
    let share = saturate((distance - span.x) / max(span.y - span.x, LEAST));
    return f32(NODES) * sqrt(share);
}
