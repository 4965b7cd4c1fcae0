// March: what the blend is measured against. Each pixel marches its ray through the particles'
// density in equal steps, without tables; the same particles, lists and density volumes as the
// frame's, and the same target textures. Twin: src/bench/march/twin.rs.
//
// - Steps are spent where there are particles only: their length is the occupied length of the ray
//   over STEPS, and gaps are jumped over.
// - Without LIT the sun's ray is marched too, from every step on, with sun_steps steps through each
//   particle's chord; light of higher orders is a sum of octaves of sunlight (Wrenninge et al.,
//   "Oz: The Great and Volumetric", SIGGRAPH 2013 Talks), light of sky and ground their mean.
// - With LIT the light is the frame's own (light_grid, light): only what the ray meets is marched.
//
// Workgroup contract: one workgroup owns one tile of 8x8 pixels, one invocation one pixel; it reads
// the tile's list and writes its texels. The count of density samples is a sum.
#import cumuli::gpu_data::{FrameUniforms, Particle}
#import cumuli::numerics::{mean_scatter_fraction, mean_transmittance, unfolded}
#import cumuli::optical_depth::{copy_for, density_texture, march_between, pixels_per_radian}
#import cumuli::phase::{PhaseParams, phase_between}
#import cumuli::quaternion::rotate
#import cumuli::sky::ground_distance
#import cumuli::sun_depth::sun_depth
#import cumuli::table_sampler::table_sampler
#ifdef LIT
#import cumuli::gpu_data::ParticleLight
#import cumuli::light_field::{halo_factor, halo_row, scattered_light}
#import cumuli::lighting::own_share
#import cumuli::scattering::scattering_source
#else
#import cumuli::gpu_data::LightView
#import cumuli::light_view::light_tile
#import cumuli::sky::{sky_ambient_above, sky_ambient_below, sun_irradiance_at}
#endif

struct MarchUniforms {
    steps: u32,       // along a pixel's ray
    sun_steps: u32,   // through each chord of a sun's ray
    mean_cosine: f32, // of the phase function in the scaled medium
    padding_a: u32,
}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> phase: PhaseParams;
@group(0) @binding(2) var<uniform> march_settings: MarchUniforms;
@group(0) @binding(3) var<storage, read> particles: array<Particle>;
@group(0) @binding(4) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(5) var<storage, read> tile_entries: array<u32>;
@group(0) @binding(6) var<storage, read_write> counts: array<atomic<u32>>; // [0] samples, [1] pixels, [2] empty tiles
@group(0) @binding(7) var radiance_out: texture_storage_2d<rgba32float, write>; // rgb, transmittance
@group(0) @binding(8) var distance_out: texture_storage_2d<r32float, write>;    // m, opacity-weighted
#ifdef LIT
@group(0) @binding(9) var<storage, read> lights: array<ParticleLight>;
#else
@group(0) @binding(9) var<uniform> sun_view: LightView;
@group(0) @binding(10) var<storage, read> sun_offsets: array<u32>;
@group(0) @binding(11) var<storage, read> sun_entries: array<u32>;
#endif

const FAR: f32 = 1e30;
const PI: f32 = 3.14159265;
// Transmittance below which nothing is seen: its logarithm stays finite.
const DARK: f32 = 1e-30;
const SCREEN_TILE: u32 = #{SCREEN_TILE}u; // pixels a side that share a list
// Octaves of sunlight, and the factor from one to the next on light, optical depth and mean cosine.
const OCTAVES: u32 = 8u;
const OCTAVE: f32 = 0.5;
// Gaps between particles that one ray can jump over, at most, besides one a step.
const MOST_GAPS: u32 = 64u;

var<private> samples: u32;
var<private> list_begin: u32;
var<private> list_end: u32;
var<private> view: vec3<f32>;
var<private> far: f32;                // m, to the ground
var<private> pixels: f32;             // in a radian around the ray

// Where a particle begins and ends on the pixel's ray, m; the end before the beginning: nowhere.
fn span(particle: Particle) -> vec2<f32> {
    let middle = dot(particle.centre, view);
    let across = particle.centre - middle * view;
    let h2 = particle.radius * particle.radius - dot(across, across);
    if h2 <= 0.0 {
        return vec2(1.0, 0.0);
    }
    let h = sqrt(h2);
    return vec2(max(middle - h, 0.0), min(middle + h, far));
}

// Density of a particle at a place in it, in radii from its centre, world axes.
fn density_at(particle: Particle, place: vec3<f32>, copy: u32) -> f32 {
    if particle.shape == 0u {
        return 1.0;
    }
    samples += 1u;
    let own = rotate(particle.orientation, place);
    let at = march_between(particle.shape, own, own, copy).at;
    return textureSampleLevel(density_texture, table_sampler, at, 0.0).r;
}

// Length of the ray that any particle takes. The list is near to far by the particles, not by their
// chords: a gap that a later entry fills may be missed, so the length is at most this.
fn occupied() -> f32 {
    var covered = 0.0;
    var sum = 0.0;
    for (var entry = list_begin; entry < list_end; entry++) {
        let part = span(particles[tile_entries[entry]]);
        let start = max(part.x, covered);
        if part.y > start {
            sum += part.y - start;
            covered = part.y;
        }
    }
    return sum;
}

#ifndef LIT
// Optical depth from a point to the sun.
fn depth_to_sun(point: vec3<f32>) -> f32 {
    let sun = sun_view.towards.xyz;
    let tile = light_tile(sun_view, point);
    if tile >= sun_view.tiles.x * sun_view.tiles.y {
        return 0.0;
    }
    let own_height = dot(point, sun);
    var depth = 0.0;
    let end = min(sun_offsets[tile + 1u], arrayLength(&sun_entries));
    for (var entry = sun_offsets[tile]; entry < end; entry++) {
        let particle = particles[sun_entries[entry]];
        let height = dot(particle.centre, sun);
        // Sorted from the sun: all that follow lie behind the point.
        if height + particle.radius < own_height {
            break;
        }
        let along = own_height - height;
        let across = point - particle.centre - along * sun;
        let h2 = particle.radius * particle.radius - dot(across, across);
        if h2 <= 0.0 {
            continue;
        }
        let h = sqrt(h2);
        let begin = max(along, -h);
        if begin >= h {
            continue;
        }
        let steps = unfolded(march_settings.sun_steps, h > FAR);
        let step = (h - begin) / f32(steps);
        var sum = 0.0;
        for (var i = 0u; i < steps; i++) {
            let t = begin + (f32(i) + 0.5) * step;
            sum += density_at(particle, (across + t * sun) / particle.radius, 0u);
        }
        depth += particle.extinction * step * sum;
    }
    return depth;
}

fn henyey_greenstein(g: f32, versine: f32) -> f32 {
    // 1 + g^2 - 2 g cos, with versine = 1 - cos.
    let base = (1.0 - g) * (1.0 - g) + 2.0 * g * versine;
    return (1.0 - g * g) / (4.0 * PI * base * sqrt(base));
}

// Sunlight towards the eye per unit of irradiance, all orders, after this optical depth.
fn octaves(depth: f32) -> f32 {
    let apart = view - frame.sun.xyz;
    let versine = 0.5 * dot(apart, apart);
    // Order 1 has the whole phase function over the scaled medium, as in the frame.
    var sum = frame.albedo / frame.delta_scale * phase_between(phase, view, frame.sun.xyz) * exp(-depth);
    var share = 1.0;
    var g = march_settings.mean_cosine;
    for (var i = 1u; i < OCTAVES; i++) {
        share *= OCTAVE;
        g *= OCTAVE;
        sum += frame.albedo * share * henyey_greenstein(g, versine) * exp(-share * depth);
    }
    return sum;
}
#endif

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= frame.size) {
        return;
    }
    let tile = (id.y / SCREEN_TILE) * frame.tiles.x + id.x / SCREEN_TILE;
    list_begin = tile_offsets[tile];
    list_end = min(tile_offsets[tile + 1u], arrayLength(&tile_entries));
    var radiance = vec3(0.0);
    var transmittance = 1.0;
    var distance_sum = 0.0;
    if list_begin < list_end {
        samples = 0u;
        let ndc = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(frame.size) * 2.0 - 1.0;
        view = normalize(frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz);
        pixels = pixels_per_radian(frame.size.x, length(frame.right.xyz), dot(view, frame.forward.xyz));
        far = FAR;
        if unfolded(frame.has_ground, view.y > FAR) != 0u {
            let ground = ground_distance(view);
            far = select(FAR, ground, ground >= 0.0);
        }
#ifdef LIT
        let phase_once = phase_between(phase, view, frame.sun.xyz);
        let phase_first = frame.albedo / frame.delta_scale * phase_once;
        let sun_row = halo_row(view, frame.sun.xyz);
#endif
        let step = occupied() / f32(march_settings.steps);
        var t = 0.0;
        var since_gap = 0.0; // optical depth since the last place without particles
        var first = list_begin;
        let rounds = select(0u, 2u * march_settings.steps + MOST_GAPS, step > 0.0);
        for (var round = 0u; round < rounds; round++) {
            if transmittance <= frame.transmittance_stop {
                break;
            }
            let at = t + 0.5 * step;
            let point = at * view;
            var sigma = 0.0;
            var next = FAR;  // where the next particle begins
            var here = false;
            var passed = true;
            var light = vec3(0.0);
#ifdef LIT
            var own_light = vec3(0.0);
            let seen = scattered_light(point - frame.grid_shift.xyz);
            let depth = sun_depth(point);
            let sunlight = exp(-depth);
            let path = frame.halo_share * (depth - log(max(transmittance, DARK)));
            let order_once = phase_first * halo_factor(sun_row, path);
#endif
            for (var entry = first; entry < list_end; entry++) {
                let index = tile_entries[entry];
                let particle = particles[index];
                // No later particle of the list begins before this distance.
                if length(particle.centre) - particle.radius > min(next, select(FAR, at, here)) {
                    break;
                }
                let part = span(particle);
                let done = part.y <= at;
                // What lies behind the cursor at the head of the list need not be asked again.
                first = select(first, entry + 1u, passed && done);
                passed = passed && done;
                if done {
                    continue;
                }
                if part.x > at {
                    next = min(next, part.x);
                    continue;
                }
                here = true;
                let place = (point - particle.centre) / particle.radius;
                let copy = copy_for(particle.radius * pixels / max(length(particle.centre), particle.radius), particle.optical_radius);
                let own = particle.extinction * density_at(particle, place, copy);
                sigma += own;
#ifdef LIT
                let lit = lights[index];
                let alone = lit.ambient_below.w;
                let source = (1.0 - alone) * (seen.x + order_once * sunlight) * lit.sun_irradiance.rgb
                    + seen.y * lit.ambient_above.rgb + max(seen.z - seen.y, 0.0) * lit.ambient_below.rgb;
                if alone > 0.0 {
                    let entry_place = (part.x * view - particle.centre) / particle.radius;
                    let scattered = scattering_source(entry_place, view, frame.sun.xyz, particle.optical_radius / frame.delta_scale);
                    own_light += own * alone * (scattered.x * phase_once + scattered.y) * exp(-lit.ambient_above.w) * lit.sun_irradiance.rgb;
                }
                light += own * source;
#endif
            }
            if !here {
                if next >= FAR {
                    break;
                }
                t = next;
                since_gap = 0.0;
                continue;
            }
            if sigma > 0.0 {
#ifdef LIT
                light = (light + own_share(since_gap, sigma * step, frame.delta_scale) * own_light) / sigma;
#else
                let altitude = frame.camera_altitude + point.y;
                light = octaves(depth_to_sun(point)) * sun_irradiance_at(altitude)
                    + 0.5 * frame.albedo * (sky_ambient_above(altitude) + sky_ambient_below(altitude));
#endif
                let tau = sigma * step;
                let weight = transmittance * tau * mean_transmittance(tau);
                radiance += weight * light;
                distance_sum += weight * (t + step * mean_scatter_fraction(tau));
                transmittance *= exp(-tau);
                since_gap += tau;
            }
            t += step;
        }
        atomicAdd(&counts[0], samples);
        atomicAdd(&counts[1], 1u);
    } else if all(id.xy % SCREEN_TILE == vec2(0u)) {
        atomicAdd(&counts[2], 1u);
    }
    let opacity = 1.0 - transmittance;
    textureStore(radiance_out, id.xy, vec4(radiance, transmittance));
    textureStore(distance_out, id.xy, vec4(select(0.0, distance_sum / opacity, opacity > 0.0), 0.0, 0.0, 0.0));
}
