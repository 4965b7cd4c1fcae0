// Sky: light that reaches an altitude: of the sun, the mean radiance of the hemisphere above, and that of
// the one below in parts: of the air, of the ground as the sun lights it and as the sky does.
//
// Workgroup contract: one invocation owns one texel.
#import cumuli::atmosphere::{ALTITUDE_SIZE, PI, TABLE_SCALE, altitude_at_place, distance_to_ground, to_rgb}
#import cumuli::sky_march::{AirRay, gather_air, ground_by_sky, ground_by_sun, sky, sun_mu_on_ground, sunlight}

@group(0) @binding(0) var table: texture_storage_2d<rgba16float, write>;

// Directions in a hemisphere: equal in the cosine of the zenith angle and in azimuth; one half
// mirrors the other.
const ZENITHS: u32 = 12u;
const AZIMUTHS: u32 = 8u;
const STEPS: u32 = 24u;

@compute @workgroup_size(64)
fn sky_altitude(@builtin(global_invocation_id) id: vec3<u32>) {
    let altitude = altitude_at_place(f32(id.x) / (ALTITUDE_SIZE.x - 1.0));
    let sun_mu = clamp(sky.sun.y, -1.0, 1.0);
    if id.y == 0u {
        textureStore(table, id.xy, vec4(TABLE_SCALE * max(to_rgb(sky, sunlight(altitude, sun_mu)), vec3(0.0)), 0.0));
        return;
    }
    let sun_sine = sqrt(max(1.0 - sun_mu * sun_mu, 0.0));
    let side = select(-1.0, 1.0, id.y == 1u);
    var ray: AirRay;
    ray.altitude = altitude;
    ray.sun_mu = sun_mu;
    var sum = vec4(0.0);
    for (var i = 0u; i < ZENITHS; i++) {
        ray.mu = side * (f32(i) + 0.5) / f32(ZENITHS);
        let sine = sqrt(1.0 - ray.mu * ray.mu);
        let hits = distance_to_ground(altitude, ray.mu) >= 0.0;
        for (var j = 0u; j < AZIMUTHS; j++) {
            let azimuth = PI * (f32(j) + 0.5) / f32(AZIMUTHS);
            ray.cos_sun = ray.mu * sun_mu + sine * sun_sine * cos(azimuth);
            let air = gather_air(ray, hits, STEPS);
            if id.y <= 2u {
                sum += air.radiance;
            } else if hits {
                let sun_below = sun_mu_on_ground(ray);
                let ground = select(ground_by_sky(sun_below), ground_by_sun(sun_below), id.y == 3u);
                sum += exp(-air.optical_depth) * ground;
            }
        }
    }
    let mean = to_rgb(sky, sum) / f32(ZENITHS * AZIMUTHS);
    textureStore(table, id.xy, vec4(TABLE_SCALE * max(mean, vec3(0.0)), 0.0));
}
