// Sky: irradiance of sky and sun on the ground, by the height of the sun.
//
// Workgroup contract: one invocation owns one column.
#import cumuli::atmosphere::{GROUND_SIZE, PI, TABLE_SCALE, sun_at_place, to_rgb}
#import cumuli::sky_march::{AirRay, gather_all, sky, sunlight}

@group(0) @binding(0) var table: texture_storage_2d<rgba16float, write>;

// Directions: equal in the squared cosine of the zenith angle (so each weighs the same on the
// ground) and in azimuth; one half mirrors the other.
const ZENITHS: u32 = 12u;
const AZIMUTHS: u32 = 8u;
const STEPS: u32 = 24u;

@compute @workgroup_size(64)
fn sky_ground(@builtin(global_invocation_id) id: vec3<u32>) {
    let sun_mu = sun_at_place(f32(id.x) / (GROUND_SIZE.x - 1.0));
    let sun_sine = sqrt(max(1.0 - sun_mu * sun_mu, 0.0));
    var ray: AirRay;
    ray.sun_mu = sun_mu;
    var sum = vec4(0.0);
    for (var i = 0u; i < ZENITHS; i++) {
        ray.mu = sqrt((f32(i) + 0.5) / f32(ZENITHS));
        let sine = sqrt(1.0 - ray.mu * ray.mu);
        for (var j = 0u; j < AZIMUTHS; j++) {
            let azimuth = PI * (f32(j) + 0.5) / f32(AZIMUTHS);
            ray.cos_sun = ray.mu * sun_mu + sine * sun_sine * cos(azimuth);
            sum += gather_all(ray, false, STEPS).radiance;
        }
    }
    let diffuse = sum * (PI / f32(ZENITHS * AZIMUTHS));
    let direct = max(sun_mu, 0.0) * sunlight(0.0, sun_mu);
    textureStore(table, vec2(id.x, 0u), TABLE_SCALE * diffuse);
    textureStore(table, vec2(id.x, 1u), vec4(TABLE_SCALE * max(to_rgb(sky, direct), vec3(0.0)), 0.0));
    textureStore(table, vec2(id.x, 2u), vec4(TABLE_SCALE * max(to_rgb(sky, diffuse), vec3(0.0)), 0.0));
}
