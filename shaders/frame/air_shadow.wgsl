// Air shadow: sunlight that clouds take from the air between the eye and what it sees, on rays through the
// corners of blocks of pixels, up to each of some distances. The deep shadow maps tell how much of the sun
// reaches a place. Twin: src/frame/cpu/air_shadow.rs.
//
// Workgroup contract: one invocation owns one ray.
#import cumuli::air_shadow_place::{BLOCK, NODES, corners_of, node_distance, shaded_span}
#import cumuli::atmosphere::{TABLE_SCALE, air_span, altitude_along, medium_at, to_rgb}
#import cumuli::gpu_data::FrameUniforms
#import cumuli::sky_march::{AirRay, mean_transmittance, phases_of, sky, sun_mu_along, sunlight}
#import cumuli::sun_depth::sun_depth

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<storage, read_write> lost_light: array<vec2<u32>>; // ray after ray, node after node

// Steps from one node to the next.
const STEPS: u32 = 4u;
// Steps to where the part begins that clouds may shade.
const STEPS_BEFORE: u32 = 12u;

fn optical_depth(ray: AirRay, begin: f32, end: f32) -> vec4<f32> {
    let altitude = max(altitude_along(ray.altitude, ray.mu, 0.5 * (begin + end)), 0.0);
    return medium_at(sky, altitude).extinction * (end - begin);
}

// Radiance from a piece of a ray that clouds take away, before the air in front of the piece.
fn taken(ray: AirRay, phases: vec2<f32>, dir: vec3<f32>, begin: f32, end: f32) -> vec4<f32> {
    let middle = 0.5 * (begin + end);
    let shaded = 1.0 - exp(-sun_depth(dir * middle));
    let altitude = max(altitude_along(ray.altitude, ray.mu, middle), 0.0);
    let medium = medium_at(sky, altitude);
    let scattered = medium.rayleigh * phases.x + medium.aerosol * phases.y;
    let light = scattered * sunlight(altitude, sun_mu_along(ray, altitude, middle));
    return light * mean_transmittance(medium.extinction * (end - begin)) * ((end - begin) * shaded);
}

@compute @workgroup_size(8, 8)
fn air_shadow(@builtin(global_invocation_id) id: vec3<u32>) {
    let corners = corners_of(frame.size);
    if any(id.xy >= corners) {
        return;
    }
    let ndc = vec2<f32>(id.xy * BLOCK) / vec2<f32>(frame.size) * 2.0 - 1.0;
    let dir = normalize(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
    var ray: AirRay;
    ray.altitude = sky.camera_altitude;
    ray.mu = dir.y;
    ray.sun_mu = clamp(sky.sun.y, -1.0, 1.0);
    ray.cos_sun = clamp(dot(dir, sky.sun.xyz), -1.0, 1.0);
    let phases = phases_of(ray);
    let span = shaded_span(dir);
    let air = air_span(ray.altitude, ray.mu).x;
    var depth = vec4(0.0);
    let before = max(span.x - air, 0.0) / f32(STEPS_BEFORE);
    if before > 0.0 {
        for (var i = 0u; i < STEPS_BEFORE; i++) {
            depth += optical_depth(ray, air + f32(i) * before, air + f32(i + 1u) * before);
        }
    }
    let first = (id.y * corners.x + id.x) * (NODES + 1u);
    lost_light[first] = vec2(0u);
    var sum = vec4(0.0);
    var begin = span.x;
    for (var node = 1u; node <= NODES; node++) {
        let end = node_distance(span, f32(node));
        if span.y > span.x {
            let step = (end - begin) / f32(STEPS);
            for (var i = 0u; i < STEPS; i++) {
                let a = begin + f32(i) * step;
                sum += exp(-depth) * taken(ray, phases, dir, a, a + step);
                depth += optical_depth(ray, a, a + step);
            }
        }
        begin = end;
        let rgb = TABLE_SCALE * to_rgb(sky, sum);
        lost_light[first + node] = vec2(pack2x16float(rgb.rg), pack2x16float(vec2(rgb.b, 0.0)));
    }
}
