// What clouds change of the light of the air before a place, and of the ground: sunlight that they take, light
// that they send. Its binding is the last of the group of the pass that imports it.
// Twin: src/frame/cpu/air_shadow.rs.
#define_import_path cumuli::air_shadow

#import cumuli::air_shadow_place::{ENTRIES, NODES, clouded_span, node_at}
#import cumuli::ray_blocks::{corners_of, share_of_rays}

@group(0) @binding(22) var<storage, read> changed_light: array<vec2<u32>>; // ray after ray, entry after entry

fn entry_of(ray: u32, entry: u32) -> vec3<f32> {
    let packed = changed_light[ray * ENTRIES + entry];
    return vec3(unpack2x16float(packed.x), unpack2x16float(packed.y).x);
}

fn between_entries(ray: u32, entry: f32) -> vec3<f32> {
    let first = u32(entry);
    // The entry behind the last node is no node.
    let second = min(first + 1u, NODES + 1u);
    return mix(entry_of(ray, first), entry_of(ray, second), entry - f32(first));
}

// Interpolated between the four rays around a pixel of a picture of this size, with a ray every `block` pixels.
fn between_rays(pixel: vec2<u32>, size: vec2<u32>, block: u32, entry: f32) -> vec3<f32> {
    let low = pixel / block;
    let share = share_of_rays(pixel, low, size, block);
    let across = corners_of(size, block).x;
    let ray = low.y * across + low.x;
    let upper = mix(between_entries(ray, entry), between_entries(ray + 1u, entry), share.x);
    let lower = mix(between_entries(ray + across, entry), between_entries(ray + across + 1u, entry), share.x);
    return mix(upper, lower, share.y);
}

// Change of the radiance of the air before a distance in a pixel, in TABLE_SCALE per unit of the sun's
// irradiance.
fn change_before(pixel: vec2<u32>, size: vec2<u32>, block: u32, dir: vec3<f32>, distance: f32) -> vec3<f32> {
    return between_rays(pixel, size, block, node_at(clouded_span(dir), distance));
}

// What reaches the ground that a pixel sees, besides the sun's beam. x: irradiance that clouds scatter down,
// per unit of the sun's on a surface that faces it; y: the sky's share that they leave.
fn light_on_ground(pixel: vec2<u32>, size: vec2<u32>, block: u32) -> vec2<f32> {
    return between_rays(pixel, size, block, f32(NODES + 1u)).xy;
}
