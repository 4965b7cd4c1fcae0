// Light scattered by a uniform sphere in parallel light: order 1 by a march, all others from the table.
// Twins: src/tables/scattering/lookup.rs and march.rs; coordinates: src/tables/scattering/mapping.rs.
#define_import_path cumuli::scattering

#import cumuli::numerics::{mean_transmittance, opacity}
#import cumuli::table_sampler::table_sampler

struct ScatteringParams {
    view_nodes: f32,
    azimuth_nodes: f32,
    incidence_nodes: f32,
    radius_nodes: f32,
    radius_least: f32,
    radius_greatest: f32,
    radius_scale: f32,
    lobe_inverse: f32,
    lobe_factor: f32,
    even_factor: f32,
    albedo: f32,
    transport: f32,
}

@group(1) @binding(1) var scattering_table: texture_3d<f32>;
@group(1) @binding(4) var<uniform> scattering_params: ScatteringParams;

// Part of a slice by which f32 may misplace a fetch among 2048 of them.
const SLICE_MARGIN: f32 = 2e-4;
// Below this product of sines the azimuth has no effect.
const DEGENERATE_SINES: f32 = 1e-5;
// As in mapping.rs and terminator.rs.
const GRAZING_SHARE: f32 = 0.6;
const GRAZING_SCALE: f32 = 0.13;
const TERMINATOR_WIDTH: f32 = 0.55;
// As in march.rs.
const PIECES: u32 = 12u;
const CROWDING: f32 = 2.0;
// Optical depth below which the light of a piece is the mean transmittance's series; above it the
// difference keeps five digits.
const THIN_PIECE: f32 = 0.02;
// Twice the least height over the sun's plane for which the way out to the sun is a quotient, radii: none
// that f32 tells from 0.
const LEAST_HEIGHT: f32 = 1e-30;

// Texture place of a coordinate in 0..1 on an axis whose ends are nodes.
fn table_place(coordinate: f32, nodes: f32) -> f32 {
    return (coordinate * (nodes - 1.0) + 0.5) / nodes;
}

// What the fall of light across the terminator was divided by, from the height of the entry point
// over the plane that faces the sun. Twin: src/tables/scattering/terminator.rs.
fn terminator(elevation: f32, optical_radius: f32) -> f32 {
    let free = 1.0 / (scattering_params.transport * optical_radius);
    let width2 = TERMINATOR_WIDTH * TERMINATOR_WIDTH * free * (1.0 + free);
    let root = sqrt(elevation * elevation + width2);
    let bright = select(root + elevation, width2 / (root - elevation), elevation < 0.0);
    return bright / (1.0 + sqrt(1.0 + width2));
}

// Source of order 1 without phase function and albedo. `height` is the entry's over the plane through
// the centre that faces the sun, `climb` the cosine between view and sun.
fn single_source(chord: f32, height: f32, climb: f32, optical_radius: f32) -> f32 {
    let crowding = 1.0 + CROWDING * optical_radius * chord;
    var sum = 0.0;
    var before = 0.0;
    var depth = optical_radius * 2.0 * max(-height, 0.0);
    var light = exp(-depth);
    for (var piece = 1u; piece <= PIECES; piece++) {
        let u = f32(piece) / f32(PIECES);
        // Even at both ends in the root of the distance, which takes the root out of the sun's path.
        let x = u * u * (3.0 - 2.0 * u);
        // Not crowding - (crowding - 1) x: f32 would make 0 of it at the end of an opaque chord.
        let fraction = x / (crowding * (1.0 - x) + x);
        let t = chord * fraction;
        let along = height + t * climb;
        let inside = t * max(chord - t, 0.0);
        // On the sunward side not the difference of root and height: f32 makes 0 of it in the outermost sliver
        // of an opaque sphere, where all its light comes from.
        let root = sqrt(along * along + inside);
        let out = select(root - along, inside / max(root + along, LEAST_HEIGHT), along > 0.0);
        let here = optical_radius * (t + out);
        // Negative where the way to the sun shrinks faster than the eye's grows.
        let step = here - depth;
        let here_light = exp(-here);
        let is_thin = abs(step) < THIN_PIECE;
        let thin = light * (1.0 - step * (0.5 - step * (0.16666667 - step * 0.041666667)));
        sum += (fraction - before) * select((light - here_light) / select(step, 1.0, is_thin), thin, is_thin);
        before = fraction;
        depth = here;
        light = here_light;
    }
    return sum / mean_transmittance(optical_radius * chord);
}

// Source of order 1 without phase function, and of the orders from 2 on with it, both per unit of
// sun irradiance: radiance divided by the opacity of the chord. Unit vectors: entry into the unit
// sphere, direction away from the eye, direction towards the sun.
fn scattering_source(entry: vec3<f32>, dir: vec3<f32>, sun: vec3<f32>, optical_radius: f32) -> vec2<f32> {
    let p = scattering_params;
    let incidence_cosine = clamp(-dot(entry, dir), 0.0, 1.0);
    // As a length: next to the centre the root of a difference loses half its digits.
    let across = entry + incidence_cosine * dir;
    let incidence_sine = min(length(across), 1.0);
    let incidence = GRAZING_SHARE * (1.0 + GRAZING_SCALE) * incidence_cosine / (incidence_cosine + GRAZING_SCALE)
        + (1.0 - GRAZING_SHARE) * (1.0 - incidence_sine);
    // From the difference: the cosine loses the digits of small angles.
    let apart = dir - sun;
    let half_sine_squared = min(0.25 * dot(apart, apart), 1.0);
    let half_sine = sqrt(half_sine_squared);
    // From the sum: next to the sun's opposite the root of a difference loses half its digits.
    let together = dir + sun;
    let half_cosine = min(0.5 * length(together), 1.0);
    let scaled = half_sine * p.lobe_inverse;
    let view_sun = log(scaled + sqrt(scaled * scaled + 1.0)) * p.lobe_factor
        + (1.0 + half_sine - half_cosine) * p.even_factor;

    let sines = 2.0 * half_sine * half_cosine * incidence_sine;
    let elevation = dot(entry, sun);
    // Both are across times sun; the shorter vector brings less rounding.
    let along = select(dot(across, together), -dot(across, apart), half_sine < half_cosine);
    let azimuth_cosine = clamp(along / max(sines, DEGENERATE_SINES), -1.0, 1.0);
    let azimuth = 0.5 * (1.0 + sqrt(0.5 - 0.5 * azimuth_cosine) - sqrt(0.5 + 0.5 * azimuth_cosine));

    let radius = clamp(optical_radius, p.radius_least, p.radius_greatest);
    let level = min(log((radius + 1.0) / (p.radius_least + 1.0)) * p.radius_scale, p.radius_nodes - 1.0);
    let lower = min(floor(level), p.radius_nodes - 2.0);
    let slices = p.radius_nodes * p.incidence_nodes;
    // Kept off the slices of the next optical radius: f32 misplaces the last of many by this much.
    let layer = clamp(incidence * (p.incidence_nodes - 1.0), SLICE_MARGIN, p.incidence_nodes - 1.0 - SLICE_MARGIN);
    let slice = lower * p.incidence_nodes + layer + 0.5;
    let place = vec3(table_place(view_sun, p.view_nodes), table_place(azimuth, p.azimuth_nodes), slice / slices);
    let above = vec3(place.xy, (slice + p.incidence_nodes) / slices);
    let value = mix(
        textureSampleLevel(scattering_table, table_sampler, place, 0.0).x,
        textureSampleLevel(scattering_table, table_sampler, above, 0.0).x,
        level - lower,
    );
    let fall = terminator(elevation, radius);
    let once = single_source(2.0 * incidence_cosine, elevation, 1.0 - 2.0 * half_sine_squared, optical_radius);
    return vec2(p.albedo * once, opacity(optical_radius) * fall * exp(value));
}
