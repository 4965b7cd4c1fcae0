// The sky for the other passes: what is seen where there is nothing, the air before what there is,
// and the light that both give. Radiance per unit of whatever the sun's irradiance is given in.
// Reads group 2. Twin: src/frame/cpu/sky.rs.
#define_import_path cumuli::sky

#import cumuli::atmosphere::{AIR_SIZE, ALTITUDE_SIZE, GROUND_SIZE, PI, PLANET_RADIUS, SkyUniforms, TABLE_SCALE, TOP_ALTITUDE, VIEW_SIZE, air_place, air_span, air_spread, altitude_place, direction_place, distance_to_ground, sun_place, texel_centre}
#import cumuli::numerics::{opacity, unfolded}

@group(2) @binding(0) var<uniform> sky: SkyUniforms;
@group(2) @binding(1) var filtering: sampler;
@group(2) @binding(2) var ground: texture_2d<f32>;
@group(2) @binding(3) var by_altitude: texture_2d<f32>;
@group(2) @binding(4) var view: texture_2d<f32>;
@group(2) @binding(5) var air_sources: texture_3d<f32>;
@group(2) @binding(6) var air_depths: texture_2d<f32>;

// Air between the camera and a place.
struct Air {
    inscatter: vec3<f32>,
    transmittance: vec3<f32>,
}

// No direction has a component as large, no place is as high (m): for `unfolded`.
const NOWHERE: f32 = 1e30;

// Product of the level parts of two directions below which one of them is straight up or down: every
// azimuth is as good there, and 0 comes out.
const LEAST_LEVEL: f32 = 1e-12;

// Whether there is no air; takes any component of a direction, or an altitude.
fn is_uniform(of_invocation: f32) -> bool {
    return unfolded(sky.is_uniform, of_invocation > NOWHERE) != 0u;
}

// Angle over the true horizon and cosine of the azimuth from the sun.
fn sky_direction(dir: vec3<f32>) -> vec2<f32> {
    let level = dot(dir.xz, dir.xz);
    let lengths = sqrt(level * dot(sky.sun.xz, sky.sun.xz));
    let azimuth = clamp(dot(dir.xz, sky.sun.xz) / max(lengths, LEAST_LEVEL), -1.0, 1.0);
    return vec2(azimuth, atan2(dir.y, sqrt(level)) + sky.horizon_dip);
}

// Radiance of the sky without the sun's disc; below the horizon the bare ground through the air.
fn sky_radiance(dir: vec3<f32>) -> vec3<f32> {
    if is_uniform(dir.y) {
        return vec3(sky.uniform_radiance);
    }
    let direction = sky_direction(dir);
    let place = direction_place(direction.x, direction.y, sky.disc.zw, VIEW_SIZE);
    return textureSampleLevel(view, filtering, place, 0.0).rgb * (sky.sun.w / TABLE_SCALE);
}

// Radiance of the sun's disc: 0 away from it and where the ground is before it. The rim is
// soft, so that a disc of a few pixels has no steps.
fn sun_disc_radiance(dir: vec3<f32>) -> vec3<f32> {
    // Chord of the angle between the two: exact where the angle's cosine is not.
    let chord = length(dir - sky.sun.xyz);
    let radius = sky.disc.x;
    if chord >= radius * (1.0 + DISC_RIM) {
        return vec3(0.0);
    }
    let x = chord / radius;
    let limb = 1.0 - LIMB_DARKENING * (1.0 - sqrt(max(1.0 - x * x, 0.0)));
    let rim = 1.0 - smoothstep(1.0 - DISC_RIM, 1.0 + DISC_RIM, x);
    let radiance = vec3(sky.disc.y * sky.sun.w * limb * rim);
    if is_uniform(dir.y) {
        return radiance;
    }
    let direction = sky_direction(dir);
    if direction.y < 0.0 {
        return vec3(0.0);
    }
    // The air up to infinity.
    let place = direction_place(direction.x, direction.y, sky.disc.zw, AIR_SIZE.xy);
    let depth = textureSampleLevel(air_depths, filtering, vec2(place.y, texel_centre(1.0, AIR_SIZE.z)), 0.0).rgb;
    return radiance * exp(-depth);
}

// Half the width of the disc's rim, in radii.
const DISC_RIM: f32 = 0.3;
// Linear limb darkening at 0.55 um: Allen, Astrophysical Quantities.
const LIMB_DARKENING: f32 = 0.6;

fn light_at(altitude: f32, row: f32) -> vec3<f32> {
    let uv = vec2(texel_centre(altitude_place(altitude), ALTITUDE_SIZE.x), (row + 0.5) / ALTITUDE_SIZE.y);
    return textureSampleLevel(by_altitude, filtering, uv, 0.0).rgb * (sky.sun.w / TABLE_SCALE);
}

// Irradiance of the sun on a surface that faces it, after the air.
fn sun_irradiance_at(altitude: f32) -> vec3<f32> {
    if is_uniform(altitude) {
        return vec3(sky.sun.w);
    }
    return light_at(altitude, 0.0);
}

// Mean radiance of the upper hemisphere, without the sun's disc.
fn sky_ambient_above(altitude: f32) -> vec3<f32> {
    if is_uniform(altitude) {
        return vec3(sky.uniform_radiance);
    }
    return light_at(altitude, 1.0);
}

// Mean radiance of the lower hemisphere: the air, and the ground of which clouds leave these shares,
// lit by the sun and by the sky.
fn sky_below(altitude: f32, shares: vec2<f32>) -> vec3<f32> {
    if is_uniform(altitude) {
        let by_sun = sky.sun.w * max(sky.sun.y, 0.0) / PI;
        // What a sea reflects before it enters the water: nothing where there is none.
        let reflected = sky.sea.z * (shares.x * by_sun) + sky.sea.y * (shares.y * sky.uniform_radiance);
        let lit = sky.ground_colour.rgb * (shares.x * by_sun + shares.y * sky.uniform_radiance)
            + (1.0 - sky.ground_colour.rgb) * reflected;
        return select(vec3(sky.uniform_radiance), lit, sky.ground_colour.w > 0.0);
    }
    return light_at(altitude, 2.0) + shares.x * light_at(altitude, 3.0) + shares.y * light_at(altitude, 4.0);
}

// The same over bare ground.
fn sky_ambient_below(altitude: f32) -> vec3<f32> {
    return sky_below(altitude, vec2(1.0));
}

// The air between the camera and a place, up to infinity.
fn air_between(dir: vec3<f32>, distance: f32) -> Air {
    var air: Air;
    air.transmittance = vec3(1.0);
    if is_uniform(dir.y) {
        return air;
    }
    let direction = sky_direction(dir);
    let place = direction_place(direction.x, direction.y, sky.disc.zw, AIR_SIZE.xy);
    // Distances count from where the air begins.
    var before = 0.0;
    if (dir.y < NOWHERE) & (sky.camera_altitude > TOP_ALTITUDE) {
        before = air_span(sky.camera_altitude, dir.y).x;
    }
    let spread = air_spread(sky.camera_altitude, dir.y, before, direction.y < 0.0);
    let w = air_place(distance - before, spread);
    let z = texel_centre(w, AIR_SIZE.z);
    let depth = w * w * textureSampleLevel(air_depths, filtering, vec2(place.y, z), 0.0).rgb;
    let source = textureSampleLevel(air_sources, filtering, vec3(place, z), 0.0).rgb * (sky.sun.w / TABLE_SCALE);
    air.transmittance = exp(-depth);
    air.inscatter = source * vec3(opacity(depth.r), opacity(depth.g), opacity(depth.b));
    return air;
}

// Distance to the ground; -1 where there is none.
fn ground_distance(dir: vec3<f32>) -> f32 {
    return distance_to_ground(sky.camera_altitude, dir.y);
}

// Radiance of the ground at a distance along a direction, before the air in front of it.
// `light`: share of the sunlight that the clouds let through, irradiance that they scatter down per unit of the
// sun's on a surface that faces it, share of the skylight that they let through; 1, 0, 1 without them.
fn ground_radiance(dir: vec3<f32>, distance: f32, light: vec3<f32>) -> vec3<f32> {
    let turned = (PLANET_RADIUS + sky.camera_altitude) * sky.sun.y + distance * dot(dir, sky.sun.xyz);
    let sun_mu = clamp(turned / PLANET_RADIUS, -1.0, 1.0);
    let reflected = sky.ground_colour.rgb * (sky.sun.w / PI);
    if is_uniform(dir.y) {
        let by_sun = max(sun_mu, 0.0) * light.x + light.y;
        return reflected * by_sun + sky.ground_colour.rgb * (sky.uniform_radiance * light.z);
    }
    let x = texel_centre(sun_place(sun_mu), GROUND_SIZE.x);
    let direct = textureSampleLevel(ground, filtering, vec2(x, 1.5 / GROUND_SIZE.y), 0.0).rgb;
    let diffuse = textureSampleLevel(ground, filtering, vec2(x, 2.5 / GROUND_SIZE.y), 0.0).rgb;
    let by_clouds = sky.ground_colour.rgb * (light_at(0.0, 0.0) * (light.y / PI));
    return reflected * (direct * light.x + diffuse * light.z) / TABLE_SCALE + by_clouds;
}
