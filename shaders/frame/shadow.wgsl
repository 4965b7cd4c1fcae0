// Shadow: transmittance of the clouds between the ground and the sun, from the sun's own lists, on
// two square maps around the camera (a near fine one and a far coarse one).
// Twin: src/frame/cpu/shadow.rs.
//
// Workgroup contract: one invocation owns one texel of one map.
#import cumuli::gpu_data::{LightView, Particle}
#import cumuli::light_lists::{OPTICAL_DEPTH_LIMIT, light_tile, particle_occlusion}
#import cumuli::shadow_maps::{ShadowUniforms, shadow_point}

@group(0) @binding(0) var<uniform> view: LightView;
@group(0) @binding(1) var<uniform> maps: ShadowUniforms;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(4) var<storage, read> tile_entries: array<u32>;
@group(0) @binding(5) var shadows: texture_storage_2d_array<r32float, write>;

@compute @workgroup_size(8, 8)
fn shadow(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= vec2(maps.resolution)) {
        return;
    }
    let point = shadow_point(maps, id.z, id.xy);
    let tile = light_tile(view, point);
    var tau = 0.0;
    if tile < view.tiles.x * view.tiles.y {
        let end = min(tile_offsets[tile + 1u], arrayLength(&tile_entries));
        for (var i = tile_offsets[tile]; i < end; i++) {
            tau += particle_occlusion(particles[tile_entries[i]], view.towards.xyz, point).front;
            if tau > OPTICAL_DEPTH_LIMIT {
                break;
            }
        }
    }
    textureStore(shadows, id.xy, id.z, vec4(exp(-tau), 0.0, 0.0, 0.0));
}
