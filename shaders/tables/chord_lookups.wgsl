// What the ways to look a chord up cost on a device: those of the frame, and mappings that were measured
// and not taken. Host: src/tables/optical_depth/chord_lookups.rs; twins: alternatives.rs there.
//
// Workgroup contract: one invocation owns one chord.
#import cumuli::optical_depth::{chord_step, density_texture, march_from, table_channels}
#import cumuli::table_sampler::table_sampler

struct Chord {
    entry: vec4<f32>,
    exit: vec4<f32>,
}

@group(0) @binding(0) var<storage, read> chords: array<Chord>;
@group(0) @binding(1) var<storage, read_write> answers: array<vec4<f32>>;

const STEPS: u32 = #{STEPS}u;
const PI: f32 = 3.14159265;
const TAU: f32 = 6.2831853;
const HALF_PI: f32 = 1.57079633;
// Radii; a shorter chord has no direction in f32.
const SHORTEST_CHORD: f32 = 1e-6;
// A noise shape.
const SHAPE: u32 = 1u;

// An angle as a fraction of the circle.
fn turn(y: f32, x: f32) -> f32 {
    return fract(atan2(y, x) / TAU);
}

// Zenith and azimuth of the entry, and of the direction in the frame there, all linear.
fn linear_angles(entry: vec3<f32>, exit: vec3<f32>) -> vec4<f32> {
    let cosine = clamp(entry.z, -1.0, 1.0);
    let sine = length(entry.xy);
    let level = select(vec2(1.0, 0.0), entry.xy / max(sine, SHORTEST_CHORD), sine > SHORTEST_CHORD);
    let along = vec3(cosine * level, -sine);
    let across = vec3(-level.y, level.x, 0.0);
    let chord = exit - entry;
    let size = length(chord);
    let d = select(-entry, chord / max(size, SHORTEST_CHORD), size > SHORTEST_CHORD);
    let zenith = acos(clamp(-dot(d, entry), 0.0, 1.0));
    return vec4(zenith / HALF_PI, turn(dot(d, across), dot(d, along)), acos(cosine) / PI, turn(entry.y, entry.x));
}

// 1 for 0 too.
fn sign_of(p: vec2<f32>) -> vec2<f32> {
    return select(vec2(-1.0), vec2(1.0), p >= vec2(0.0));
}

// Octahedral map of the sphere to the square 0..1.
fn octahedral(d: vec3<f32>) -> vec2<f32> {
    let p = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
    return 0.5 + 0.5 * select((1.0 - abs(p.yx)) * sign_of(p), p, d.z >= 0.0);
}

// Entry and exit on a square each.
fn two_points(entry: vec3<f32>, exit: vec3<f32>) -> vec4<f32> {
    return vec4(octahedral(entry), octahedral(exit));
}

// Two fetches at a place of 0..1 in all axes.
fn fetch(at: vec4<f32>) -> vec4<f32> {
    return vec4(table_channels(SHAPE, 2.0 * at.xy - 1.0, 2.0 * at.zw - 1.0), 0.0);
}

@compute @workgroup_size(64)
fn nothing(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&chords) {
        answers[id.x] = chords[id.x].entry + chords[id.x].exit;
    }
}

@compute @workgroup_size(64)
fn by_linear_angles(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&chords) {
        answers[id.x] = fetch(linear_angles(chords[id.x].entry.xyz, chords[id.x].exit.xyz));
    }
}

@compute @workgroup_size(64)
fn by_two_points(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&chords) {
        answers[id.x] = fetch(two_points(chords[id.x].entry.xyz, chords[id.x].exit.xyz));
    }
}

@compute @workgroup_size(64)
fn by_disc(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&chords) {
        let found = chord_step(SHAPE, chords[id.x].entry.xyz, chords[id.x].exit.xyz);
        answers[id.x] = vec4(found.mean_density, found.start, found.inverse_extent, found.smoothness);
    }
}

@compute @workgroup_size(64)
fn by_march(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&chords) {
        let step = (chords[id.x].exit.xyz - chords[id.x].entry.xyz) / f32(STEPS);
        let m = march_from(SHAPE, chords[id.x].entry.xyz + 0.5 * step, step, 0u);
        var sum = 0.0;
        for (var i = 0u; i < STEPS; i++) {
            sum += textureSampleLevel(density_texture, table_sampler, m.at + f32(i) * m.step, 0.0).r;
        }
        answers[id.x] = vec4(sum / f32(STEPS), 0.0, 0.0, 0.0);
    }
}

@compute @workgroup_size(64)
fn place_of_linear_angles(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&chords) {
        answers[id.x] = linear_angles(chords[id.x].entry.xyz, chords[id.x].exit.xyz);
    }
}

@compute @workgroup_size(64)
fn place_of_two_points(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&chords) {
        answers[id.x] = two_points(chords[id.x].entry.xyz, chords[id.x].exit.xyz);
    }
}
