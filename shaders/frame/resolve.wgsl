// Resolve: puts sky, ground, what is opaque, and air around the clouds; linear radiance out.
//
// Workgroup contract: one invocation owns one pixel.
#import cumuli::air_shadow::{change_before, light_on_ground}
#import cumuli::atmosphere::TABLE_SCALE
#import cumuli::gpu_data::FrameUniforms
#import cumuli::numerics::unfolded
#import cumuli::opaque_distance::opaque_distance
#import cumuli::sky::{air_between, ground_distance, ground_radiance, sky, sky_radiance, sun_disc_radiance}
#import cumuli::sun_depth::sun_depth
#ifdef SEA
#import cumuli::sea_light::{reflected_in, sea_radiance}
#endif

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var clouds: texture_2d<f32>;         // rgb radiance, a transmittance
@group(0) @binding(2) var cloud_distance: texture_2d<f32>; // m
@group(0) @binding(3) var picture: texture_storage_2d<rgba32float, write>;
@group(0) @binding(4) var opaque_radiance: texture_2d<f32>; // rgb, of what is opaque
@group(0) @binding(5) var opaque_sunlit: texture_2d<f32>;   // rgb, what sunlight adds to it

// For `unfolded`, and the distance of nothing: m, beyond every point; a column of pixels beyond every picture's.
const NOWHERE: f32 = 1e30;
const NO_PIXEL: u32 = 0xffffffffu;

// Transmittance of the clouds between a point and the sun.
fn sun_visibility(point: vec3<f32>) -> f32 {
    // Nobody has made the maps.
    if unfolded(frame.has_shadows, point.y > NOWHERE) == 0u {
        return 1.0;
    }
    return exp(-sun_depth(point));
}

// Light of the air before a distance as clouds leave it.
fn clouded(light: vec3<f32>, pixel: vec2<u32>, dir: vec3<f32>, distance: f32) -> vec3<f32> {
    if unfolded(frame.has_air_shadow, pixel.x == NO_PIXEL) == 0u {
        return light;
    }
    let change = change_before(pixel, frame.size, frame.ray_block, dir, distance) * (sky.sun.w / TABLE_SCALE);
    return max(light + change, vec3(0.0));
}

// What reaches the ground: of the sun's beam, of clouds, of the sky; see ground_radiance.
fn ground_light(pixel: vec2<u32>, point: vec3<f32>) -> vec3<f32> {
    let beam = sun_visibility(point);
    if unfolded(frame.has_air_shadow, pixel.x == NO_PIXEL) == 0u {
        return vec3(beam, 0.0, 1.0);
    }
    return vec3(beam, light_on_ground(pixel, frame.size, frame.ray_block));
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= frame.size) {
        return;
    }
    let outside = id.x == NO_PIXEL;
    let has_air = unfolded(frame.has_air, outside) != 0u;
    let ndc = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(frame.size) * 2.0 - 1.0;
    let dir = normalize(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
    var cloud = vec4(0.0, 0.0, 0.0, 1.0);
    if unfolded(frame.has_clouds, outside) != 0u {
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
        if unfolded(frame.has_ground, outside) != 0u {
            ground = ground_distance(dir);
        }
        let surface = opaque_distance(id.xy);
        let is_surface = (surface < NOWHERE) & !((ground >= 0.0) & (ground < surface));
        let end = select(ground, surface, is_surface);
        if end >= 0.0 {
            let light = ground_light(id.xy, dir * end);
            let shaded = textureLoad(opaque_radiance, min(id.xy, textureDimensions(opaque_radiance) - 1u), 0).rgb;
            let sunlit = textureLoad(opaque_sunlit, min(id.xy, textureDimensions(opaque_sunlit) - 1u), 0).rgb;
#ifdef SEA
            let bare = sea_radiance(dir, end, light, reflected_in(id.xy, frame.size, frame.ray_block));
#else
            let bare = ground_radiance(dir, end, light);
#endif
            behind = select(bare, shaded + sunlit * light.x, is_surface);
            if has_air {
                let air = air_between(dir, end);
                behind = behind * air.transmittance + clouded(air.inscatter, id.xy, dir, end);
            }
        } else {
            behind = clouded(sky_radiance(dir), id.xy, dir, NOWHERE) + sun_disc_radiance(dir) * (straight / transmittance);
        }
    }
    var front = cloud.rgb;
    if has_air && opacity > 0.0 {
        let distance = textureLoad(cloud_distance, id.xy, 0).r;
        let air = air_between(dir, distance);
        front = front * air.transmittance + clouded(air.inscatter, id.xy, dir, distance) * opacity;
    }
    textureStore(picture, id.xy, vec4(front + transmittance * behind, 1.0 - straight));
}
