// The two shadow maps on the ground, and how a place on the ground finds its texel.
#define_import_path cumuli::shadow_maps

struct ShadowUniforms {
    corner: array<vec4<f32>, 2>, // xy: m, x and z of the map's corner relative to the camera; z: m, side
    resolution: u32,             // texels a side
    ground: f32,                 // m, altitude of the ground relative to the camera
    seen_only: u32,              // 1: only what the picture may show is made
    padding_b: u32,
}

// A texel, made in the frame of this epoch.
struct ShadowTexel {
    transmittance: f32,
    epoch: f32,
}

// Index of a texel of a map.
fn shadow_index(maps: ShadowUniforms, index: u32, texel: vec2<u32>) -> u32 {
    return (index * maps.resolution + texel.y) * maps.resolution + texel.x;
}

// Point on the ground in the middle of a texel, relative to the camera.
fn shadow_point(maps: ShadowUniforms, index: u32, texel: vec2<u32>) -> vec3<f32> {
    let corner = maps.corner[index];
    let place = corner.xy + (vec2<f32>(texel) + 0.5) * (corner.z / f32(maps.resolution));
    return vec3(place.x, maps.ground, place.y);
}

// Place on a map (0 to 1, outside of that off the map) of a point on the ground.
fn shadow_place(maps: ShadowUniforms, index: u32, point: vec3<f32>) -> vec2<f32> {
    let corner = maps.corner[index];
    return (point.xz - corner.xy) / corner.z;
}
