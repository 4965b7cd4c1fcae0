// Sky: mean radiance of light scattered at least twice, by altitude and height of the sun
// (Hillaire 2020). The second order is gathered as it is; what follows it is taken as isotropic
// and alike everywhere around, so that the orders are a geometric series.
//
// Workgroup contract: one invocation owns one texel.
#import cumuli::atmosphere::{MULTIPLE_SIZE, PI, TABLE_SCALE, altitude_at_place, distance_to_ground, sun_at_place}
#import cumuli::sky_march::{AirRay, gather_all}

@group(0) @binding(0) var table: texture_storage_2d<rgba16float, write>;

// Directions: equal in the cosine of the zenith angle and in azimuth; one half mirrors the other.
const ZENITHS: u32 = 12u;
const AZIMUTHS: u32 = 6u;
const STEPS: u32 = 20u;

@compute @workgroup_size(8, 8)
fn sky_multiple(@builtin(global_invocation_id) id: vec3<u32>) {
    let place = vec2<f32>(id.xy) / (MULTIPLE_SIZE - 1.0);
    let sun_mu = sun_at_place(place.x);
    let sun_sine = sqrt(max(1.0 - sun_mu * sun_mu, 0.0));
    var ray: AirRay;
    ray.altitude = altitude_at_place(place.y);
    ray.sun_mu = sun_mu;
    var second = vec4(0.0);
    var response = vec4(0.0);
    for (var i = 0u; i < ZENITHS; i++) {
        ray.mu = (2.0 * f32(i) + 1.0) / f32(ZENITHS) - 1.0;
        let sine = sqrt(1.0 - ray.mu * ray.mu);
        let hits = distance_to_ground(ray.altitude, ray.mu) >= 0.0;
        for (var j = 0u; j < AZIMUTHS; j++) {
            let azimuth = PI * (f32(j) + 0.5) / f32(AZIMUTHS);
            ray.cos_sun = ray.mu * sun_mu + sine * sun_sine * cos(azimuth);
            let gathered = gather_all(ray, hits, STEPS);
            second += gathered.radiance;
            response += gathered.response;
        }
    }
    let mean = 1.0 / f32(ZENITHS * AZIMUTHS);
    textureStore(table, id.xy, TABLE_SCALE * second * mean / (1.0 - response * mean));
}
