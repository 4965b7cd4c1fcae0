// Air shadow: what clouds change of the light of the air between the eye and what it sees, and of the ground, on
// rays through the corners of blocks of pixels; of the air up to each of some distances. The deep shadow maps tell
// how much of the sun reaches a place, the light field what clouds scatter to it. Skylight in the air stays as
// it is without clouds. Twin: src/frame/cpu/air_shadow.rs.
//
// Workgroup contract: one invocation owns one ray.
#import cumuli::air_shadow_place::{ENTRIES, NODES, clouded_span, node_distance}
#import cumuli::atmosphere::{TABLE_SCALE, air_span, altitude_along, ground_reach, medium_at, to_rgb}
#import cumuli::gpu_data::FrameUniforms
#import cumuli::light_field::{light_from_afar, light_grid}
#import cumuli::light_grid_data::{grid_direction, grid_phase}
#import cumuli::numerics::unfolded
#import cumuli::ray_blocks::{corners_of, ray_place}
#import cumuli::sky_march::{AirRay, mean_transmittance, phases_of, sky, sun_mu_along, sunlight}
#import cumuli::sun_depth::sun_depth

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<storage, read_write> changed_light: array<vec2<u32>>; // ray after ray, entry after entry

const PI: f32 = 3.14159265;
// What clouds send into the air, less the skylight that they hide from it, over what the field holds of their
// sunlight, which is what droplets in its place would scatter to the eye. Fitted: see
// ARCHITECTURE.md.
const NET: f32 = 0.4;
// The same of the ground, where light from above is taken for even though most of it comes in level: what clouds
// send counts by its height.
const NET_GROUND: f32 = 0.25;
// Steps from one node to the next.
const STEPS: u32 = #{STEPS}u;
// Steps to where the part begins where clouds are about.
const STEPS_BEFORE: u32 = 12u;
// Where a ray misses the ground, that next below the horizon stands for it: in angles to the horizon.
const BELOW_HORIZON: f32 = 1e-3;
// Least share of the light from above in what the field holds of an even light: seen from straight above, where
// it counts least, it is more than three times that.
const LEAST_SHARE: f32 = 0.05;
// Beyond the components of every view: for `unfolded`.
const LONGEST: f32 = 2.0;
// Albedo of droplets below which the field, which holds what they scatter, tells nothing.
const LEAST_ALBEDO: f32 = 1e-3;

// Light that clouds leave at a place, as in the field, but for all directions that droplets would scatter from.
fn light_around(point: vec3<f32>) -> vec2<f32> {
    return light_from_afar(point).xy / max(light_grid.albedo, LEAST_ALBEDO);
}

fn optical_depth(ray: AirRay, begin: f32, end: f32) -> vec4<f32> {
    let altitude = max(altitude_along(ray.altitude, ray.mu, 0.5 * (begin + end)), 0.0);
    return medium_at(sky, altitude).extinction * (end - begin);
}

// Radiance from a piece of a ray that clouds add, before the air in front of the piece; mostly below 0.
fn added(ray: AirRay, phases: vec2<f32>, dir: vec3<f32>, begin: f32, end: f32) -> vec4<f32> {
    let middle = 0.5 * (begin + end);
    let beam = exp(-sun_depth(dir * middle)) - 1.0;
    let scattered = NET * light_around(dir * middle - frame.grid_shift.xyz).x;
    let altitude = max(altitude_along(ray.altitude, ray.mu, middle), 0.0);
    let medium = medium_at(sky, altitude);
    let light = (medium.rayleigh * phases.x + medium.aerosol * phases.y) * beam
        + (medium.rayleigh + medium.aerosol) * scattered;
    return light * sunlight(altitude, sun_mu_along(ray, altitude, middle))
        * mean_transmittance(medium.extinction * (end - begin)) * (end - begin);
}

// Share of the light that comes from above in what the field sends along a view where light is even.
fn share_from_above(view: vec3<f32>) -> f32 {
    var sum = 0.0;
    let directions = unfolded(2u * light_grid.axes, view.y > LONGEST);
    for (var d = 0u; d < directions; d++) {
        let axis = light_grid.axis[d >> 1u];
        let travel = grid_direction(axis, d);
        let phase = grid_phase(vec2(light_grid.moment_first, light_grid.moment_second), -dot(travel, view));
        sum += select(0.0, axis.w * phase, travel.y < 0.0);
    }
    return sum;
}

// See light_on_ground in shared/air_shadow.wgsl.
fn on_ground(dir: vec3<f32>) -> vec2<f32> {
    let lowest = -sin(sky.horizon_dip) - BELOW_HORIZON;
    let level = max(length(dir.xz), BELOW_HORIZON);
    let flat = vec3(dir.x / level, 0.0, dir.z / level) * sqrt(1.0 - lowest * lowest);
    let seen = select(dir, vec3(flat.x, lowest, flat.z), dir.y > lowest);
    let light = light_around(seen * ground_reach(sky.camera_altitude, seen.y) - frame.grid_shift.xyz);
    let even = max(share_from_above(seen), LEAST_SHARE);
    // Black droplets hide the sky, but nothing is known of how much of it.
    let left = select(1.0, min(light.y / even, 1.0), light_grid.albedo >= LEAST_ALBEDO);
    return vec2(NET_GROUND * PI * light.x / even, mix(1.0, left, NET_GROUND));
}

@compute @workgroup_size(8, 8)
fn air_shadow(@builtin(global_invocation_id) id: vec3<u32>) {
    let corners = corners_of(frame.size, frame.ray_block);
    if any(id.xy >= corners) {
        return;
    }
    // Not beyond the picture: there the shadow maps hold nothing.
    let place = ray_place(id.xy, frame.size, frame.ray_block);
    let ndc = place / vec2<f32>(frame.size) * 2.0 - 1.0;
    let dir = normalize(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
    var ray: AirRay;
    ray.altitude = sky.camera_altitude;
    ray.mu = dir.y;
    ray.sun_mu = clamp(sky.sun.y, -1.0, 1.0);
    ray.cos_sun = clamp(dot(dir, sky.sun.xyz), -1.0, 1.0);
    let phases = phases_of(ray);
    let span = clouded_span(dir);
    let air = air_span(ray.altitude, ray.mu).x;
    var depth = vec4(0.0);
    let before = max(span.x - air, 0.0) / f32(STEPS_BEFORE);
    if before > 0.0 {
        for (var i = 0u; i < STEPS_BEFORE; i++) {
            depth += optical_depth(ray, air + f32(i) * before, air + f32(i + 1u) * before);
        }
    }
    let first = (id.y * corners.x + id.x) * ENTRIES;
    changed_light[first] = vec2(0u);
    var sum = vec4(0.0);
    var begin = span.x;
    for (var node = 1u; node <= NODES; node++) {
        let end = node_distance(span, f32(node));
        if span.y > span.x {
            let step = (end - begin) / f32(STEPS);
            for (var i = 0u; i < STEPS; i++) {
                let a = begin + f32(i) * step;
                sum += exp(-depth) * added(ray, phases, dir, a, a + step);
                depth += optical_depth(ray, a, a + step);
            }
        }
        begin = end;
        let rgb = TABLE_SCALE * to_rgb(sky, sum);
        changed_light[first + node] = vec2(pack2x16float(rgb.rg), pack2x16float(vec2(rgb.b, 0.0)));
    }
    changed_light[first + NODES + 1u] = vec2(pack2x16float(on_ground(dir)), 0u);
}
