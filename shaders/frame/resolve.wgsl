// Resolve: puts sky, ground and air around the clouds; linear radiance out.
//
// Workgroup contract: one invocation owns one pixel.
#import cumuli::gpu_data::FrameUniforms
#import cumuli::shadow_maps::{ShadowTexel, ShadowUniforms, shadow_index, shadow_place}
#import cumuli::sky::{air_between, ground_distance, ground_radiance, sky_radiance, sun_disc_radiance}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> maps: ShadowUniforms;
@group(0) @binding(2) var clouds: texture_2d<f32>;         // rgb radiance, a transmittance
@group(0) @binding(3) var cloud_distance: texture_2d<f32>; // m
@group(0) @binding(4) var<storage, read> shadows: array<ShadowTexel>;
@group(0) @binding(5) var picture: texture_storage_2d<rgba32float, write>;

// Width of the blend between the two maps and at the outer border, as a share of a map's side.
const BORDER: f32 = 0.08;

fn shadow_texel(index: u32, x: i32, y: i32) -> f32 {
    return shadows[shadow_index(maps, index, vec2(u32(x), u32(y)))].transmittance;
}

// Bilinear.
fn shadow_sample(index: u32, place: vec2<f32>) -> f32 {
    let size = i32(maps.resolution);
    let texel = place * f32(size) - 0.5;
    let low = vec2<i32>(floor(texel));
    let f = texel - floor(texel);
    let a = clamp(low, vec2(0), vec2(size - 1));
    let b = clamp(low + 1, vec2(0), vec2(size - 1));
    let top = mix(shadow_texel(index, a.x, a.y), shadow_texel(index, b.x, a.y), f.x);
    let bottom = mix(shadow_texel(index, a.x, b.y), shadow_texel(index, b.x, b.y), f.x);
    return mix(top, bottom, f.y);
}

// 1 well inside a map, 0 at its border.
fn inside(place: vec2<f32>) -> f32 {
    let margin = min(min(place.x, place.y), min(1.0 - place.x, 1.0 - place.y));
    return smoothstep(0.0, BORDER, margin);
}

// Transmittance of the clouds between a point on the ground and the sun.
fn sun_visibility(point: vec3<f32>) -> f32 {
    // Nobody has made the maps.
    if frame.has_shadows == 0u {
        return 1.0;
    }
    let near_place = shadow_place(maps, 0u, point);
    let far_place = shadow_place(maps, 1u, point);
    let near_weight = inside(near_place);
    var visibility = 1.0;
    if near_weight < 1.0 {
        visibility = mix(1.0, shadow_sample(1u, far_place), inside(far_place));
    }
    if near_weight > 0.0 {
        visibility = mix(visibility, shadow_sample(0u, near_place), near_weight);
    }
    return visibility;
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= frame.size) {
        return;
    }
    let ndc = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(frame.size) * 2.0 - 1.0;
    let dir = normalize(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
    var cloud = vec4(0.0, 0.0, 0.0, 1.0);
    if frame.has_clouds != 0u {
        cloud = textureLoad(clouds, id.xy, 0);
    }
    // Light that is only scattered within the forward peak still comes from nearly the same place:
    // all smooth things are seen with it, the sun's disc without.
    let transmittance = cloud.a;
    let straight = pow(transmittance, 1.0 / frame.delta_scale);
    let opacity = 1.0 - transmittance;

    var behind = vec3(0.0);
    // Nothing behind a finished pixel is seen.
    if transmittance > 0.0 {
        var ground = -1.0;
        if frame.has_ground != 0u {
            ground = ground_distance(dir);
        }
        if ground >= 0.0 {
            behind = ground_radiance(dir, ground, sun_visibility(dir * ground));
            if frame.has_air != 0u {
                let air = air_between(dir, ground);
                behind = behind * air.transmittance + air.inscatter;
            }
        } else {
            behind = sky_radiance(dir) + sun_disc_radiance(dir) * (straight / transmittance);
        }
    }
    var front = cloud.rgb;
    if frame.has_air != 0u && opacity > 0.0 {
        let air = air_between(dir, textureLoad(cloud_distance, id.xy, 0).r);
        front = front * air.transmittance + air.inscatter * opacity;
    }
    textureStore(picture, id.xy, vec4(front + transmittance * behind, 1.0 - straight));
}
