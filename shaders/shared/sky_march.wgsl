// Light gathered along a ray through the air. Reads the tables that do not depend on the view
// (group 1). Twin: src/frame/cpu/sky.rs.
#define_import_path cumuli::sky_march

#import cumuli::numerics::SERIES_BELOW
#import cumuli::atmosphere::{Medium, PI, PLANET_RADIUS, SkyUniforms, aerosol_phase, air_span, altitude_along, altitude_place, depth_place, ground_reach, medium_at, rayleigh_phase, sea_place, sun_place, sun_visible, texel_centre, DEPTH_SIZE, GROUND_SIZE, MULTIPLE_SIZE, TABLE_SCALE}

@group(1) @binding(0) var<uniform> sky: SkyUniforms;
@group(1) @binding(1) var filtering: sampler;
@group(1) @binding(2) var depths: texture_2d<f32>;
@group(1) @binding(3) var multiple: texture_2d<f32>;
@group(1) @binding(4) var ground: texture_2d<f32>;

// A ray with all that its places need of the sun.
struct AirRay {
    altitude: f32, // m, of its start
    mu: f32,       // cosine of its zenith angle
    sun_mu: f32,   // cosine of the sun's zenith angle, at its start
    cos_sun: f32,  // cosine of the angle between ray and sun
}

struct Gathered {
    radiance: vec4<f32>,      // per unit of the sun's irradiance
    optical_depth: vec4<f32>,
    response: vec4<f32>,      // radiance where unit radiance comes from all sides everywhere
}

// Without its digits for small optical depths 1 - exp(-tau) would be noise in thin air.
fn mean_transmittance(tau: vec4<f32>) -> vec4<f32> {
    let series = 1.0 - tau * (0.5 - tau * (0.16666667 - tau * 0.041666667));
    let below = vec4(SERIES_BELOW);
    return select((1.0 - exp(-tau)) / max(tau, below), series, tau < below);
}

// Sunlight that arrives at a place.
fn sunlight(altitude: f32, sun_mu: f32) -> vec4<f32> {
    let visible = sun_visible(max(altitude, 0.0), sun_mu);
    if visible <= 0.0 {
        return vec4(0.0);
    }
    let place = depth_place(altitude, sun_mu);
    let uv = vec2(texel_centre(place.x, DEPTH_SIZE.x), texel_centre(place.y, DEPTH_SIZE.y));
    return visible * exp(-textureSampleLevel(depths, filtering, uv, 0.0));
}

// Mean radiance of all that was scattered at least twice (Hillaire 2020).
fn scattered_light(altitude: f32, sun_mu: f32) -> vec4<f32> {
    let uv = vec2(texel_centre(sun_place(sun_mu), MULTIPLE_SIZE.x), texel_centre(altitude_place(altitude), MULTIPLE_SIZE.y));
    return textureSampleLevel(multiple, filtering, uv, 0.0) / TABLE_SCALE;
}

// Irradiance of the sky on the ground.
fn sky_on_ground(sun_mu: f32) -> vec4<f32> {
    let uv = vec2(texel_centre(sun_place(sun_mu), GROUND_SIZE.x), 0.5 / GROUND_SIZE.y);
    return textureSampleLevel(ground, filtering, uv, 0.0) / TABLE_SCALE;
}

// Share of the light from this height that a sea reflects; 0 where there is none.
fn sea_reflectance(mu: f32) -> f32 {
    let place = sea_place(mu);
    let low = u32(place);
    let high = low + 1u;
    return mix(sky.sea_reflectances[low / 4u][low % 4u], sky.sea_reflectances[high / 4u][high % 4u], place - f32(low));
}

// Albedo of the ground for light of which this share is reflected before it enters the water.
fn ground_albedo(reflected: f32) -> vec4<f32> {
    return sky.ground_albedo + reflected * (1.0 - sky.ground_albedo);
}

// The part of the ground's radiance that it has from the sun. A sea sends it in all directions alike, as far as air and clouds
// know.
fn ground_by_sun(sun_mu: f32) -> vec4<f32> {
    return ground_albedo(sea_reflectance(sun_mu)) / PI * max(sun_mu, 0.0) * sunlight(0.0, sun_mu);
}

// The part that it has from the sky.
fn ground_by_sky(sun_mu: f32) -> vec4<f32> {
    return ground_albedo(sky.sea.y) / PI * sky_on_ground(sun_mu);
}

// Radiance of the bare ground.
fn ground_light(sun_mu: f32) -> vec4<f32> {
    return ground_by_sun(sun_mu) + ground_by_sky(sun_mu);
}

// Cosine of the sun's zenith angle after a distance along a ray.
fn sun_mu_along(ray: AirRay, altitude: f32, distance: f32) -> f32 {
    let turned = (PLANET_RADIUS + ray.altitude) * ray.sun_mu + distance * ray.cos_sun;
    return clamp(turned / (PLANET_RADIUS + altitude), -1.0, 1.0);
}

// Goes on from `begin` to `end` with the air in the middle between them.
fn gather(ray: AirRay, phases: vec2<f32>, begin: f32, end: f32, so_far: Gathered) -> Gathered {
    let middle = 0.5 * (begin + end);
    let altitude = max(altitude_along(ray.altitude, ray.mu, middle), 0.0);
    let sun_mu = sun_mu_along(ray, altitude, middle);
    let medium = medium_at(sky, altitude);
    let scattering = medium.rayleigh + medium.aerosol;
    let source = (medium.rayleigh * phases.x + medium.aerosol * phases.y) * sunlight(altitude, sun_mu)
        + scattering * scattered_light(altitude, sun_mu);
    let tau = medium.extinction * (end - begin);
    let weight = exp(-so_far.optical_depth) * mean_transmittance(tau) * (end - begin);
    var result: Gathered;
    result.radiance = so_far.radiance + weight * source;
    result.response = so_far.response + weight * scattering;
    result.optical_depth = so_far.optical_depth + tau;
    return result;
}

fn phases_of(ray: AirRay) -> vec2<f32> {
    return vec2(rayleigh_phase(ray.cos_sun), aerosol_phase(ray.cos_sun));
}

// Light of the air along a ray to the ground or to the end of the air. Steps grow with the square of
// the distance: the air changes most near the start.
fn gather_air(ray: AirRay, hits_ground: bool, steps: u32) -> Gathered {
    let span = air_span(ray.altitude, ray.mu);
    var end = span.y;
    if hits_ground {
        end = ground_reach(ray.altitude, ray.mu);
    }
    let phases = phases_of(ray);
    var sum: Gathered;
    var begin = span.x;
    for (var i = 1u; i <= steps; i++) {
        let x = f32(i) / f32(steps);
        let next = span.x + (end - span.x) * x * x;
        sum = gather(ray, phases, begin, next, sum);
        begin = next;
    }
    return sum;
}

// Cosine of the sun's zenith angle where a ray meets the ground.
fn sun_mu_on_ground(ray: AirRay) -> f32 {
    return sun_mu_along(ray, 0.0, ground_reach(ray.altitude, ray.mu));
}

// All light along a ray to the ground, which is seen at its end, or to the end of the air.
fn gather_all(ray: AirRay, hits_ground: bool, steps: u32) -> Gathered {
    var sum = gather_air(ray, hits_ground, steps);
    if hits_ground {
        let through = exp(-sum.optical_depth);
        sum.radiance += through * ground_light(sun_mu_on_ground(ray));
        sum.response += through * ground_albedo(sky.sea.y);
    }
    return sum;
}
