// Sky: the air between the camera and what is seen, by direction and distance.
//
// Two tables whose entries change slowly, so that few of them do: optical depth over the squared
// distance coordinate (finite at 0 and at infinity), and the source function, which is inscattered
// radiance over 1 - transmittance.
//
// Workgroup contract: one invocation owns one column of directions, all distances; the first
// azimuth of each elevation also writes the optical depths.
#import cumuli::atmosphere::{AIR_SIZE, TABLE_SCALE, air_distance, air_span, air_spread, altitude_along, direction_of, ground_reach, medium_at, to_rgb}
#import cumuli::sky_march::{AirRay, Gathered, gather, phases_of, scattered_light, sky, sun_mu_along, sunlight}

@group(0) @binding(0) var sources: texture_storage_3d<rgba16float, write>;
@group(0) @binding(1) var depths_over: texture_storage_2d<rgba16float, write>;

// Steps between two distances of the table: the first and the last.
const LEAST_STEPS: f32 = 1.0;
const MOST_STEPS: f32 = 24.0;
// Optical depth from which on the rest of the light does not show in 8 bits by far.
const MOST_DEPTH: f32 = 30.0;
// Below this opacity the ratio of the two sums is taken at the start of the ray, in the limit.
const LEAST_OPACITY: f32 = 1e-9;
// Extinction of air that is none, 1/m: a millionth of that 100 km high; what it would send is below it too.
const LEAST_EXTINCTION: f32 = 1e-15;
// Optical depth below which the four wavelengths' sum stands for 1 - exp: half of it, relative, is lost.
const THIN: f32 = 1e-3;

@compute @workgroup_size(8, 8)
fn sky_air(@builtin(global_invocation_id) id: vec3<u32>) {
    let direction = direction_of(vec2<f32>(id.xy), sky.disc.zw, AIR_SIZE.xy);
    let elevation = direction.y - sky.horizon_dip;
    var ray: AirRay;
    ray.altitude = sky.camera_altitude;
    ray.mu = sin(elevation);
    ray.sun_mu = clamp(sky.sun.y, -1.0, 1.0);
    ray.cos_sun = ray.mu * ray.sun_mu + cos(elevation) * sqrt(1.0 - ray.sun_mu * ray.sun_mu) * direction.x;
    let span = air_span(ray.altitude, ray.mu);
    let below = f32(id.y) < 0.5 * AIR_SIZE.y;
    let leave = select(span.y, ground_reach(ray.altitude, ray.mu), below);
    let spread = air_spread(ray.altitude, ray.mu, span.x, below);
    let phases = phases_of(ray);

    // In the limit of no distance.
    let start = altitude_along(ray.altitude, ray.mu, span.x);
    let sun_mu = sun_mu_along(ray, start, span.x);
    let medium = medium_at(sky, start);
    let source = (medium.rayleigh * phases.x + medium.aerosol * phases.y) * sunlight(start, sun_mu)
        + (medium.rayleigh + medium.aerosol) * scattered_light(start, sun_mu);
    let near_extinction = to_rgb(sky, medium.extinction);
    var last = max(to_rgb(sky, source) / max(near_extinction, vec3(LEAST_EXTINCTION)), vec3(0.0));
    var over = near_extinction * (spread.x / spread.y);

    var sum: Gathered;
    var begin = span.x;
    for (var slice = 0u; slice < u32(AIR_SIZE.z); slice++) {
        if slice > 0u {
            let w = f32(slice) / (AIR_SIZE.z - 1.0);
            let end = clamp(span.x + air_distance(w, spread), begin, leave);
            let steps = u32(mix(LEAST_STEPS, MOST_STEPS, w * w * w * w));
            let step = (end - begin) / f32(steps);
            for (var i = 0u; i < steps; i++) {
                sum = gather(ray, phases, begin + f32(i) * step, begin + f32(i + 1u) * step, sum);
            }
            begin = end;
            let transmittance = to_rgb(sky, exp(-sum.optical_depth));
            // In thin air the four wavelengths' sum is exact where 1 - exp is not.
            let thin = to_rgb(sky, sum.optical_depth);
            let depth = select(-log(clamp(transmittance, vec3(exp(-MOST_DEPTH)), vec3(1.0))), thin, thin < vec3(THIN));
            let opacity = select(1.0 - exp(-depth), depth, depth < vec3(THIN));
            last = select(last, max(to_rgb(sky, sum.radiance), vec3(0.0)) / max(opacity, vec3(LEAST_OPACITY)), opacity > vec3(LEAST_OPACITY));
            over = max(depth, vec3(0.0)) / (w * w);
        }
        textureStore(sources, vec3(id.xy, slice), vec4(TABLE_SCALE * last, 0.0));
        if id.x == 0u {
            textureStore(depths_over, vec2(id.y, slice), vec4(over, 0.0));
        }
    }
}
