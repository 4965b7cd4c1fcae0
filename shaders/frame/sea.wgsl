// Sea: what the sea reflects of sky and clouds, on rays through the corners of blocks of pixels; waves blur it over
// more than a block. Few facets stand for all (src/medium/sea.rs). Along the mirrored ray of each, the light grid tells
// where clouds are and what they send: sunlight that they scatter once by their phase function, all other light as towards
// the eye, from which the cells are seen nearly as from the mirror. Twin: src/frame/cpu/sea.rs.
//
// Workgroup contract: one invocation owns one ray.
#import cumuli::atmosphere::{PI, SEA_HEIGHTS, TABLE_SCALE, VIEW_SIZE, direction_place, ground_reach, sea_place, to_rgb}
#import cumuli::gpu_data::FrameUniforms
#import cumuli::numerics::unfolded
#import cumuli::sea::{mirrored, surface_normal}
#import cumuli::sky::{filtering, is_uniform, sky}
#ifdef CLOUDS
#import cumuli::light_field::{grid_cells, ground_shares, halo_factor, halo_row, last_level, level_of, light_grid, scattered_light}
#import cumuli::light_grid_data::{EMPTY_CELL, grid_index}
#import cumuli::numerics::opacity
#import cumuli::phase::{PhaseParams, phase_between}
#import cumuli::sky::{sky_ambient_above, sky_below, sun_irradiance_at}
#import cumuli::sky_march::{AirRay, Gathered, gather, phases_of}
#endif

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> waves: SeaUniforms;
@group(0) @binding(2) var sky_over_sea: texture_2d<f32>;                        // as `view`, from the surface
@group(0) @binding(3) var<storage, read_write> reflected: array<vec4<f32>>;     // rgb, ray after ray
#ifdef CLOUDS
@group(0) @binding(4) var<uniform> phase: PhaseParams;
@group(0) @binding(5) var<storage, read> sun_mean: array<f32>; // by slot: share of the sunlight
#endif

// Facets by the cosine of the view's zenith angle: at every height two rows, of slopes along the view and of shares.
struct SeaUniforms {
    facets: array<vec4<f32>, 64>,
}

const BLOCK: u32 = 8u;  // pixels a side
const ALONG: u32 = 4u;
const ACROSS: u32 = 3u;
// Hermite's nodes and weights, over the root mean square slope.
const ACROSS_PLACE: f32 = 1.2247449;
const ACROSS_SHARE = vec3<f32>(0.16666667, 0.66666667, 0.16666667);
// Where a ray misses the sea, that next below the horizon stands for it: in angles to the horizon.
const BELOW_HORIZON: f32 = 1e-4;
// Level part of a view below which it is straight down: every azimuth is as good.
const LEAST_LEVEL: f32 = 1e-6;
// Steps of a mirrored ray through the grid.
const STEPS: u32 = 24u;
// Steps of the air before what of the clouds is seen.
const AIR_STEPS: u32 = 4u;
// Transmittance below which a ray has ended.
const DARK: f32 = 0.01;
// Least component of a direction: along an axis across which it does not move it never leaves the grid.
const LEAST: f32 = 1e-9;
// A step of the golden ratio from ray to ray: their steps do not line up.
const GOLDEN: f32 = 0.61803399;

// Radiance of the sky over the sea, by direction.
fn sky_from_sea(dir: vec3<f32>, normal: vec3<f32>, up: f32) -> vec3<f32> {
    if is_uniform(dir.y) {
        return vec3(sky.uniform_radiance);
    }
    let level = dir - up * normal;
    let sun = sky.sun.xyz - dot(sky.sun.xyz, normal) * normal;
    let azimuth = dot(level, sun) / max(length(level) * length(sun), LEAST_LEVEL * LEAST_LEVEL);
    let place = direction_place(clamp(azimuth, -1.0, 1.0), asin(saturate(up)), 0.0, VIEW_SIZE);
    return textureSampleLevel(sky_over_sea, filtering, place, 0.0).rgb * (sky.sun.w / TABLE_SCALE);
}

#ifdef CLOUDS
// Part of a ray in the coarsest level of the grid, m. Point relative to the grid's anchor.
fn span_of_grid(point: vec3<f32>, dir: vec3<f32>) -> vec2<f32> {
    let level = light_grid.level[last_level()];
    let slow = abs(dir) < vec3(LEAST);
    let rate = select(dir, vec3(LEAST), slow);
    let a = (level.low.xyz - point) / rate;
    let b = (level.low.xyz + vec3<f32>(level.size.xyz) * level.cell.xyz - point) / rate;
    let near = min(a, b);
    let far = max(a, b);
    return vec2(max(max(near.x, near.y), max(near.z, 0.0)), min(far.x, min(far.y, far.z)));
}

// Light of the clouds on the way, and of the air before them; then what is left of the sky behind.
// Point relative to the eye; `turn`: 0 to 1.
fn with_clouds(point: vec3<f32>, dir: vec3<f32>, up: f32, normal: vec3<f32>, turn: f32, behind: vec3<f32>) -> vec3<f32> {
    let start = point - frame.grid_shift.xyz;
    let span = span_of_grid(start, dir);
    let step = (span.y - span.x) / f32(STEPS);
    let sun_row = halo_row(dir, frame.sun.xyz);
    let once = frame.albedo / frame.delta_scale * phase_between(phase, dir, frame.sun.xyz);
    var transmittance = 1.0;
    var sunlight = 0.0;
    var above = 0.0;
    var below = 0.0;
    var distance_sum = 0.0;
    if span.y > span.x {
        for (var i = 0u; i < STEPS; i++) {
            let distance = span.x + (f32(i) + turn) * step;
            let at = start + distance * dir;
            let level = light_grid.level[level_of(at)];
            let cell = clamp((at - level.low.xyz) / level.cell.xyz, vec3(0.0), vec3<f32>(level.size.xyz) - 1.0);
            let slot = grid_cells[grid_index(level, vec3<u32>(cell))];
            if slot < EMPTY_CELL {
                let tau = bitcast<f32>(grid_cells[light_grid.cells + slot]) * step;
                let weight = transmittance * opacity(tau);
                let seen = scattered_light(at);
                let sunlit = sun_mean[slot];
                let path = frame.halo_share * -log(max(sunlit * transmittance, DARK * DARK));
                sunlight += weight * (once * halo_factor(sun_row, path) * sunlit + seen.x);
                above += weight * seen.y;
                below += weight * max(seen.z - seen.y, 0.0);
                distance_sum += weight * distance;
                transmittance *= exp(-tau);
                if transmittance < DARK {
                    transmittance = 0.0;
                    break;
                }
            }
        }
    }
    if transmittance >= 1.0 {
        return behind;
    }
    let opacity_of_all = 1.0 - transmittance;
    let distance = distance_sum / max(opacity_of_all, LEAST);
    let place = point + distance * dir;
    let altitude = max(frame.camera_altitude + place.y, 0.0);
    var light = sunlight * sun_irradiance_at(altitude) + above * sky_ambient_above(altitude)
        + below * sky_below(altitude, ground_shares(place - frame.grid_shift.xyz));
    if !is_uniform(dir.y) {
        var ray: AirRay;
        ray.altitude = 0.0;
        ray.mu = up;
        ray.sun_mu = clamp(dot(sky.sun.xyz, normal), -1.0, 1.0);
        ray.cos_sun = clamp(dot(sky.sun.xyz, dir), -1.0, 1.0);
        let phases = phases_of(ray);
        var air: Gathered;
        for (var i = 0u; i < AIR_STEPS; i++) {
            let piece = distance / f32(AIR_STEPS);
            air = gather(ray, phases, f32(i) * piece, f32(i + 1u) * piece, air);
        }
        let added = max(to_rgb(sky, air.radiance), vec3(0.0)) * sky.sun.w;
        light = light * max(to_rgb(sky, exp(-air.optical_depth)), vec3(0.0)) + opacity_of_all * added;
    }
    return light + transmittance * behind;
}
#endif

@compute @workgroup_size(8, 8)
fn sea(@builtin(global_invocation_id) id: vec3<u32>) {
    let corners = (frame.size + BLOCK - 1u) / BLOCK + 1u;
    if any(id.xy >= corners) {
        return;
    }
    let ndc = vec2<f32>(min(id.xy * BLOCK, frame.size)) / vec2<f32>(frame.size) * 2.0 - 1.0;
    let dir = normalize(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
    let lowest = -sin(sky.horizon_dip) - BELOW_HORIZON;
    let across = max(length(dir.xz), LEAST_LEVEL);
    let flat = vec2(dir.x, dir.z) / across * sqrt(max(1.0 - lowest * lowest, 0.0));
    let seen = select(dir, vec3(flat.x, lowest, flat.y), dir.y > lowest);
    let point = seen * ground_reach(sky.camera_altitude, seen.y);
    let normal = surface_normal(point, sky.camera_altitude);
    let mu = saturate(-dot(seen, normal));
    let level = -seen - mu * normal;
    let any_level = vec3(1.0, 0.0, 0.0) - normal.x * normal;
    let ahead = normalize(select(any_level, level, length(level) > LEAST_LEVEL));
    let aside = cross(normal, ahead);
    let place = sea_place(mu);
    let row = 2u * u32(place);
    let slopes = mix(waves.facets[row], waves.facets[row + 2u], fract(place));
    let shares = mix(waves.facets[row + 1u], waves.facets[row + 3u], fract(place));
    var sum = vec3(0.0);
    for (var i = 0u; i < ALONG * ACROSS; i++) {
        let k = i % ACROSS;
        let facet = vec2(slopes[i / ACROSS], (f32(k) - 1.0) * ACROSS_PLACE * sky.sea.x);
        let turned = mirrored(mu, facet);
        let up = max(turned.z, 0.0);
        let light = normalize(turned.x * ahead + turned.y * aside + up * normal);
        var found = sky_from_sea(light, normal, dot(light, normal));
#ifdef CLOUDS
        found = with_clouds(point, light, saturate(dot(light, normal)), normal, fract((f32(i) + 0.5) * GOLDEN), found);
#endif
        sum += shares[i / ACROSS] * ACROSS_SHARE[k] * found;
    }
    reflected[id.y * corners.x + id.x] = vec4(sum, 0.0);
}
