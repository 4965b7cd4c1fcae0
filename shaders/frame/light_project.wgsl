// Light projection: which tiles of a light's picture each particle touches, and the key that sorts
// them from the light. All particles take part: one out of sight still throws its shadow.
// Twin: src/frame/cpu/light_project.rs.
//
// Workgroup contract: one invocation owns one particle slot and writes its key, value and rectangle.
#import cumuli::gpu_data::{FrameUniforms, LightView, Particle}
#import cumuli::light_view::warped
#import cumuli::numerics::sortable

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> view: LightView;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read_write> keys: array<u32>;
@group(0) @binding(4) var<storage, read_write> values: array<u32>;
@group(0) @binding(5) var<storage, read_write> rectangles: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read> particle_count: array<u32>;

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
