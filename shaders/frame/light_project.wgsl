// Light projection: which tiles of a light's picture each particle touches, and the key that sorts
// them from the light. Those out of sight take part where the light's line through them passes what is in sight,
// which then has their shadow, or where a texel of the deep shadow maps that is read has it.
// Twin: src/frame/cpu/light_project.rs.
//
// Workgroup contract: one invocation owns one particle slot and writes its key, value and rectangle.
#import cumuli::gpu_data::{FrameUniforms, LightView, Particle}
#import cumuli::light_view::warped
#import cumuli::numerics::sortable
#import cumuli::shadow_maps::{MARGIN, ShadowUniforms, lit_part, may_be_seen}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> view: LightView;
@group(0) @binding(2) var<uniform> maps: ShadowUniforms;
@group(0) @binding(3) var<storage, read> particles: array<Particle>;
@group(0) @binding(4) var<storage, read_write> keys: array<u32>;
@group(0) @binding(5) var<storage, read_write> values: array<u32>;
@group(0) @binding(6) var<storage, read_write> rectangles: array<vec2<u32>>;
@group(0) @binding(7) var<storage, read> particle_count: array<u32>;

// Whether the light's line through a particle passes anything in sight. What is lit there may stick out of the picture
// by its own radius, and maps are read some texels beyond.
fn matters(centre: vec3<f32>, radius: f32) -> bool {
    let coarsest = maps.corner[max(maps.maps, 1u) - 1u].z;
    let across = radius + maps.most_radius + MARGIN * coarsest;
    let towards = view.towards.xyz;
    let altitudes = vec2(maps.lowest, maps.highest);
    let along = -dot(centre, towards);
    // A line is told by where it crosses the plane through the camera.
    let origin = centre + along * towards;
    let part = lit_part(origin, towards, across, vec2(maps.nearest, maps.reach), altitudes, frame.has_ground);
    return (maps.seen_only == 0u) | may_be_seen(origin, towards, across, part, frame.right.xyz, frame.up.xyz, frame.forward.xyz);
}

@compute @workgroup_size(64)
fn project(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.particle_capacity {
        return;
    }
    values[id.x] = id.x;
    keys[id.x] = 0xffffffffu;
    rectangles[id.x] = vec2(0u, 0u);
    if id.x >= particle_count[0] {
        return;
    }
    let particle = particles[id.x];
    let c = particle.centre;
    keys[id.x] = sortable(-dot(c, view.towards.xyz) - particle.radius);
    let place = vec2(dot(c, view.axis_u.xyz), dot(c, view.axis_v.xyz));
    if !matters(c, particle.radius) {
        return;
    }
    let tiles = vec2<f32>(view.tiles);
    let low = clamp(floor((warped(view, place - particle.radius) - view.origin) * view.inverse_tile_size), vec2(0.0), tiles);
    let high = clamp(floor((warped(view, place + particle.radius) - view.origin) * view.inverse_tile_size) + 1.0, vec2(0.0), tiles);
    if any(low >= high) {
        return;
    }
    let first = vec2<u32>(low);
    let last = vec2<u32>(high);
    rectangles[id.x] = vec2(first.x | (first.y << 16u), last.x | (last.y << 16u));
}
