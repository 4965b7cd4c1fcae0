// Radiance of the sea: what the waves reflect of sky and clouds, between the rays where that is known; glitter of the sun;
// and what the water below sends back. Its binding is the last of the group of the pass that imports it, and it reads
// group 2. Twin: src/frame/cpu/sea.rs.
#define_import_path cumuli::sea_light

#import cumuli::atmosphere::{GROUND_SIZE, PI, PLANET_RADIUS, TABLE_SCALE, sea_place, sun_place, texel_centre}
#import cumuli::ray_blocks::{corners_of, share_of_rays}
#import cumuli::sea::{glitter, surface_normal}
#import cumuli::sky::{filtering, ground, is_uniform, light_at, sky}

@group(0) @binding(23) var<storage, read> reflected: array<vec4<f32>>; // rgb, ray after ray; see frame/sea.wgsl

// Interpolated between the four rays around a pixel of a picture of this size, with a ray every `block` pixels.
fn reflected_in(pixel: vec2<u32>, size: vec2<u32>, block: u32) -> vec3<f32> {
    let low = pixel / block;
    let share = share_of_rays(pixel, low, size, block);
    let across = corners_of(size, block).x;
    let ray = low.y * across + low.x;
    let upper = mix(reflected[ray].rgb, reflected[ray + 1u].rgb, share.x);
    let lower = mix(reflected[ray + across].rgb, reflected[ray + across + 1u].rgb, share.x);
    return mix(upper, lower, share.y);
}

// Share of the light along a direction that enters the water.
fn entering(mu: f32) -> f32 {
    let place = sea_place(mu);
    let low = u32(place);
    let high = low + 1u;
    return 1.0 - mix(sky.sea_reflectances[low / 4u][low % 4u], sky.sea_reflectances[high / 4u][high % 4u], place - f32(low));
}

// Radiance of the sea at a distance along a direction, before the air in front of it. `light` as for ground_radiance,
// `mirrored`: what is reflected of sky and clouds.
fn sea_radiance(dir: vec3<f32>, distance: f32, light: vec3<f32>, mirrored: vec3<f32>) -> vec3<f32> {
    let turned = (PLANET_RADIUS + sky.camera_altitude) * sky.sun.y + distance * dot(dir, sky.sun.xyz);
    let sun_mu = clamp(turned / PLANET_RADIUS, -1.0, 1.0);
    var direct = vec3(max(sun_mu, 0.0) * sky.sun.w);
    var diffuse = vec3(PI * sky.uniform_radiance);
    var facing = vec3(sky.sun.w);
    if !is_uniform(dir.y) {
        let x = texel_centre(sun_place(sun_mu), GROUND_SIZE.x);
        let scale = sky.sun.w / TABLE_SCALE;
        direct = textureSampleLevel(ground, filtering, vec2(x, 1.5 / GROUND_SIZE.y), 0.0).rgb * scale;
        diffuse = textureSampleLevel(ground, filtering, vec2(x, 2.5 / GROUND_SIZE.y), 0.0).rgb * scale;
        facing = light_at(0.0, 0.0);
    }
    let normal = surface_normal(dir * distance, sky.camera_altitude);
    let even = 1.0 - sky.sea.y;
    let water = sky.ground_colour.rgb / PI * (entering(-dot(dir, normal)) / even);
    let below = entering(sun_mu) * light.x * direct + even * (light.z * diffuse + light.y * facing);
    return mirrored + glitter(normal, -dir, sky.sun.xyz, sky.sea.x) * light.x * direct + water * below;
}
