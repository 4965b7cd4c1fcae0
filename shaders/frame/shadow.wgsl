// Shadow: transmittance of the clouds between the ground and the sun, from the sun's own lists, on
// two square maps around the camera (a near fine one and a far coarse one).
// Twin: src/frame/cpu/shadow.rs.
//
// Only texels that the picture may show are made, each once an epoch: when the camera turns, those
// that come into view are added.
//
// Workgroup contract: one invocation owns one texel of one map.
#import cumuli::atmosphere::PLANET_RADIUS
#import cumuli::gpu_data::{FrameUniforms, LightView, Particle}
#import cumuli::light_lists::{OPTICAL_DEPTH_LIMIT, light_tile, particle_occlusion}
#import cumuli::shadow_maps::{ShadowTexel, ShadowUniforms, shadow_index, shadow_point}

@group(0) @binding(0) var<uniform> view: LightView;
@group(0) @binding(1) var<uniform> maps: ShadowUniforms;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(4) var<storage, read> tile_entries: array<u32>;
@group(0) @binding(5) var<storage, read_write> shadows: array<ShadowTexel>;
@group(0) @binding(6) var<uniform> frame: FrameUniforms;

// Texels around a point of the picture that it is filtered from: less than one away along both axes.
const FILTER: f32 = 1.5;

// Whether the picture may show ground within a distance of a point of the plane of the maps: the
// ground there is a sphere.
fn in_view(point: vec3<f32>, margin: f32) -> bool {
    let ground = point - vec3(0.0, dot(point.xz, point.xz) / (2.0 * PLANET_RADIUS), 0.0);
    let ahead = dot(ground, frame.forward.xyz);
    // Half widths of the picture at a distance of 1.
    let sides = vec2(length(frame.right.xyz), length(frame.up.xyz));
    let across = abs(vec2(dot(ground, frame.right.xyz), dot(ground, frame.up.xyz))) / sides;
    return ahead > -margin && all(across - sides * ahead < margin * sqrt(1.0 + sides * sides));
}

@compute @workgroup_size(8, 8)
fn shadow(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= vec2(maps.resolution)) {
        return;
    }
    let point = shadow_point(maps, id.z, id.xy);
    // Small integers are exact as floats.
    let epoch = f32(frame.shadow_epoch);
    let index = shadow_index(maps, id.z, id.xy);
    if shadows[index].epoch == epoch {
        return;
    }
    if maps.seen_only != 0u && !in_view(point, FILTER * maps.corner[id.z].z / f32(maps.resolution)) {
        return;
    }
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
    shadows[index] = ShadowTexel(exp(-tau), epoch);
}
