// Sea: what the sea reflects of sky and clouds, on rays through the corners of blocks of pixels; waves blur it over
// more than a block. Few facets stand for all (src/medium/sea.rs). Along the mirrored ray of each, the light grid tells
// where clouds are and what they send: sunlight that they scatter once by their phase function, all other light as towards
// the eye, from which the cells are seen nearly as from the mirror. The facets that look for clouds lie elsewhere from ray to
// ray, within what each stands for, and so do the steps: `smooth_clouds` takes the mean of a square of rays that has all their
// places once. Without clouds the grid is one empty cell out of the way. Twin of what has none: src/frame/cpu/sea.rs.
//
// Workgroup contract: one invocation owns one ray; `smooth_clouds` reads what `sea` wrote and is a dispatch of its own.
#import cumuli::atmosphere::{PI, TABLE_SCALE, VIEW_SIZE, direction_place, ground_reach, sea_place, to_rgb}
#import cumuli::gpu_data::FrameUniforms
#import cumuli::ray_blocks::{corners_of, ray_place}
#import cumuli::sea::{mirrored, surface_normal}
#import cumuli::sky::{is_uniform, sky}
#import cumuli::light_field::{grid_cells, ground_shares, halo_factor, halo_row, last_with_matter, level_of, light_grid, scattered_light}
#import cumuli::light_grid_data::{EMPTY_CELL, grid_index}
#import cumuli::numerics::opacity
#import cumuli::phase::{PhaseParams, phase_between}
#import cumuli::sky::{sky_ambient_above, sky_below, sun_irradiance_at}
#import cumuli::sky_march::{AirRay, Gathered, gather, phases_of}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> waves: SeaUniforms;
@group(0) @binding(2) var sky_over_sea: texture_2d<f32>;                        // as `view`, from the surface
@group(0) @binding(3) var<storage, read_write> reflected: array<vec4<f32>>;     // rgb, ray after ray
@group(0) @binding(4) var<uniform> phase: PhaseParams;
@group(0) @binding(5) var<storage, read> sun_mean: array<f32>; // by slot: share of the sunlight
@group(0) @binding(6) var<storage, read_write> changed_sky: array<vec4<f32>>; // rgb: what clouds change of `reflected`

// Facets by the cosine of the view's zenith angle: at every height two rows, of slopes along the view and of shares.
struct SeaUniforms {
    facets: array<vec4<f32>, 64>,
}

const ALONG: u32 = 4u;
const ACROSS: u32 = 3u;
// Hermite's nodes and weights, over the root mean square slope.
const ACROSS_PLACE: f32 = 1.2247449;
const ACROSS_MIDDLE: f32 = 0.66666667;
const ACROSS_SIDE: f32 = 0.16666667;
// Where a ray misses the sea, that next below the horizon stands for it: rad.
const BELOW_HORIZON: f32 = 1e-4;
// Level part of a view below which it is straight down: every azimuth is as good.
const LEAST_LEVEL: f32 = 1e-6;
// Steps of a mirrored ray through the grid.
const STEPS: u32 = 48u;
// Rays a side of a square over which facets and steps have all their places.
const SQUARE: u32 = 4u;
// Steps of a sequence that is even in four dimensions (Roberts 2018).
const EVEN_PLACES = vec2<f32>(0.85667488, 0.73389185);
const EVEN_AGAIN = vec2<f32>(0.62870672, 0.53859725);
// Steps of the air before what of the clouds is seen.
const AIR_STEPS: u32 = 4u;
// Transmittance below which a ray has ended.
const DARK: f32 = 0.01;
// Least component of a direction: along an axis across which it does not move it never leaves the grid.
const LEAST: f32 = 1e-9;
// A step of the golden ratio from ray to ray: their steps do not line up.
const GOLDEN: f32 = 0.61803399;

fn sky_texel(texel: vec2<u32>) -> vec3<f32> {
    return textureLoad(sky_over_sea, texel, 0).rgb;
}

// Radiance of the sky over the sea, by direction.
fn sky_from_sea(dir: vec3<f32>, normal: vec3<f32>, up: f32) -> vec3<f32> {
    if is_uniform(dir.y) {
        return vec3(sky.uniform_radiance);
    }
    let level = dir - up * normal;
    let sun = sky.sun.xyz - dot(sky.sun.xyz, normal) * normal;
    let azimuth = dot(level, sun) / max(length(level) * length(sun), LEAST_LEVEL * LEAST_LEVEL);
    let place = direction_place(clamp(azimuth, -1.0, 1.0), asin(saturate(up)), vec2(0.5 * PI), VIEW_SIZE);
    // Between four texels by hand: textures of a pass's own group have no filter.
    let texel = clamp(place * VIEW_SIZE - 0.5, vec2(0.0), VIEW_SIZE - 1.001);
    let low = vec2<u32>(texel);
    let upper = mix(sky_texel(low), sky_texel(low + vec2(1u, 0u)), fract(texel.x));
    let lower = mix(sky_texel(low + vec2(0u, 1u)), sky_texel(low + 1u), fract(texel.x));
    return mix(upper, lower, fract(texel.y)) * (sky.sun.w / TABLE_SCALE);
}

// Part of a ray in the widest level of the grid with matter, m. Point relative to the grid's anchor.
fn span_of_grid(point: vec3<f32>, dir: vec3<f32>) -> vec2<f32> {
    let level = light_grid.level[last_with_matter()];
    let slow = abs(dir) < vec3(LEAST);
    let rate = select(dir, vec3(LEAST), slow);
    let a = (level.low.xyz - point) / rate;
    let b = (level.low.xyz + vec3<f32>(level.size.xyz) * level.cell.xyz - point) / rate;
    let near = min(a, b);
    let far = max(a, b);
    return vec2(max(max(near.x, near.y), max(near.z, 0.0)), min(far.x, min(far.y, far.z)));
}

// Light of the clouds on the way, and of the air before them, less what they hide of the sky behind.
// Point relative to the eye; `turn`: 0 to 1.
fn change_by_clouds(point: vec3<f32>, dir: vec3<f32>, up: f32, normal: vec3<f32>, turn: f32, behind: vec3<f32>) -> vec3<f32> {
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
        return vec3(0.0);
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
    return light - opacity_of_all * behind;
}

// Where the slopes along the view begin and end for which a facet of the rule stands.
fn cell_of_slope(slopes: vec4<f32>, k: u32) -> vec2<f32> {
    let before = 0.5 * (slopes[max(k, 1u)] - slopes[max(k, 1u) - 1u]);
    let after = 0.5 * (slopes[min(k, ALONG - 2u) + 1u] - slopes[min(k, ALONG - 2u)]);
    return vec2(slopes[k] - before, slopes[k] + after);
}

@compute @workgroup_size(8, 8)
fn sea(@builtin(global_invocation_id) id: vec3<u32>) {
    let corners = corners_of(frame.size, frame.ray_block);
    if any(id.xy >= corners) {
        return;
    }
    let ndc = ray_place(id.xy, frame.size, frame.ray_block) / vec2<f32>(frame.size) * 2.0 - 1.0;
    let dir = normalize(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
    let lowest = -sin(min(sky.horizon_dip + BELOW_HORIZON, 0.5 * PI));
    // Rays that no pixel of the sea has to do with: those next to it, and their squares, stand for the horizon.
    let beside = f32((SQUARE / 2u + 1u) * frame.ray_block) * 2.0 / vec2<f32>(frame.size);
    let raw = frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz;
    let least_up = raw.y - beside.x * abs(frame.right.y) - beside.y * abs(frame.up.y);
    // No ray is shorter than the view axis, before it has unit length.
    if least_up > lowest {
        reflected[id.y * corners.x + id.x] = vec4(0.0);
        changed_sky[id.y * corners.x + id.x] = vec4(0.0);
        return;
    }
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
    for (var i = 0u; i < ALONG; i++) {
        for (var k = 0u; k < ACROSS; k++) {
            let aslant = (f32(k) - 1.0) * ACROSS_PLACE * sky.sea.x;
            let turned = mirrored(mu, vec2(slopes[i], aslant));
            let up = max(turned.z, 0.0);
            let light = normalize(turned.x * ahead + turned.y * aside + up * normal);
            let share = shares[i] * select(ACROSS_SIDE, ACROSS_MIDDLE, k == 1u);
            sum += share * sky_from_sea(light, normal, dot(light, normal));
        }
    }
    let ray = id.y * corners.x + id.x;
    reflected[ray] = vec4(sum, 0.0);
    let in_square = f32((id.y % SQUARE) * SQUARE + id.x % SQUARE);
    var change = vec3(0.0);
    for (var i = 0u; i < ALONG; i++) {
        let turn = fract((in_square + 0.5 + f32(i) * f32(SQUARE * SQUARE)) * EVEN_PLACES);
        let again = fract((in_square + 0.5 + f32(i) * f32(SQUARE * SQUARE)) * EVEN_AGAIN);
        let span = cell_of_slope(slopes, i);
        // Three even numbers are as good as a Gaussian one, of the same variance.
        let aside_slope = sqrt(2.0) * (turn.y + again.x + again.y - 1.5) * sky.sea.x;
        let facet = vec2(mix(span.x, span.y, turn.x), aside_slope);
        let turned = mirrored(mu, facet);
        let up = max(turned.z, 0.0);
        let light = normalize(turned.x * ahead + turned.y * aside + up * normal);
        let height = saturate(dot(light, normal));
        let behind = sky_from_sea(light, normal, height);
        let step = fract((in_square + 0.5) / f32(SQUARE * SQUARE) + f32(i) * GOLDEN);
        change += shares[i] * change_by_clouds(point, light, height, normal, step, behind);
    }
    changed_sky[ray] = vec4(change, 0.0);
}

// Adds what clouds change: the mean of the square of rays around each.
@compute @workgroup_size(8, 8)
fn smooth_clouds(@builtin(global_invocation_id) id: vec3<u32>) {
    let corners = corners_of(frame.size, frame.ray_block);
    if any(id.xy >= corners) {
        return;
    }
    // Two before and two behind: those at both ends count half.
    var sum = vec3(0.0);
    for (var i = 0u; i < (SQUARE + 1u) * (SQUARE + 1u); i++) {
        let offset = vec2(i % (SQUARE + 1u), i / (SQUARE + 1u));
        let at = clamp(vec2<i32>(id.xy + offset) - i32(SQUARE / 2u), vec2(0), vec2<i32>(corners) - 1);
        let ends = select(vec2(1.0), vec2(0.5), (offset == vec2(0u)) | (offset == vec2(SQUARE)));
        sum += ends.x * ends.y * changed_sky[u32(at.y) * corners.x + u32(at.x)].rgb;
    }
    let ray = id.y * corners.x + id.x;
    let light = reflected[ray].rgb + sum / f32(SQUARE * SQUARE);
    reflected[ray] = vec4(max(light, vec3(0.0)), 0.0);
}
