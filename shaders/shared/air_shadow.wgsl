// Sunlight that clouds take from the air before a place. Its binding is the last of the group of the pass
// that imports it. Twin: src/frame/cpu/air_shadow.rs.
#define_import_path cumuli::air_shadow

#import cumuli::air_shadow_place::{BLOCK, NODES, corners_of, node_at, shaded_span}

@group(0) @binding(22) var<storage, read> lost_light: array<vec2<u32>>; // ray after ray, node after node

fn lost_at_node(ray: u32, node: u32) -> vec3<f32> {
    let packed = lost_light[ray * (NODES + 1u) + node];
    return vec3(unpack2x16float(packed.x), unpack2x16float(packed.y).x);
}

fn lost_on_ray(ray: u32, node: f32) -> vec3<f32> {
    let first = min(u32(node), NODES - 1u);
    return mix(lost_at_node(ray, first), lost_at_node(ray, first + 1u), node - f32(first));
}

// Radiance that is missing before a distance in a pixel of a picture of this size, in TABLE_SCALE per unit of
// the sun's irradiance.
fn lost_before(pixel: vec2<u32>, size: vec2<u32>, dir: vec3<f32>, distance: f32) -> vec3<f32> {
    let node = node_at(shaded_span(dir), distance);
    let place = (vec2<f32>(pixel) + 0.5) / f32(BLOCK);
    let low = floor(place);
    let share = place - low;
    let across = corners_of(size).x;
    let ray = u32(low.y) * across + u32(low.x);
    let upper = mix(lost_on_ray(ray, node), lost_on_ray(ray + 1u, node), share.x);
    let lower = mix(lost_on_ray(ray + across, node), lost_on_ray(ray + across + 1u, node), share.x);
    return mix(upper, lower, share.y);
}
