// Sun at points: what the clouds let through of the sunlight on its way to any point, from the sun's own lists and the
// tables. Host: src/frame/sun_at.rs; twin: src/frame/cpu/light.rs.
//
// Workgroup contract: one invocation owns one point; it reads the list of the point's tile.
#import cumuli::gpu_data::{LightView, Particle}
#import cumuli::light_lists::{OPTICAL_DEPTH_LIMIT, particle_occlusion}
#import cumuli::light_view::light_tile

@group(0) @binding(0) var<uniform> view: LightView;
@group(0) @binding(1) var<storage, read> particles: array<Particle>;
@group(0) @binding(2) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(3) var<storage, read> tile_entries: array<u32>;
@group(0) @binding(4) var<storage, read> points: array<vec4<f32>>; // xyz: m, relative to the camera
@group(0) @binding(5) var<storage, read_write> transmittances: array<f32>;

@compute @workgroup_size(64)
fn sun_at(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&points) {
        return;
    }
    let point = points[id.x].xyz;
    let tile = light_tile(view, point);
    var depth = 0.0;
    if tile < view.tiles.x * view.tiles.y {
        let end = min(tile_offsets[tile + 1u], arrayLength(&tile_entries));
        for (var i = tile_offsets[tile]; i < end; i++) {
            depth += particle_occlusion(particles[tile_entries[i]], view.towards.xyz, point).front;
            if depth > OPTICAL_DEPTH_LIMIT {
                break;
            }
        }
    }
    transmittances[id.x] = exp(-depth);
}
