// Answers single rays through the tables, with the very lookups of the frame. Twin, and what the
// numbers mean: src/tables/sample.rs.

#import cumuli::numerics::opacity
#import cumuli::optical_depth::chord_part
#import cumuli::phase::{PhaseParams, phase_between}
#import cumuli::scattering::scattering_source

// `GpuRay` of the host.
struct Ray {
    entry: vec3<f32>,
    optical_radius: f32,        // extinction * radius at density 1
    dir: vec3<f32>,
    begin: f32,                 // of the part of the chord, fraction of its length
    sun: vec3<f32>,
    end: f32,
    shape: u32,
    source_radius: f32,         // optical radius of the uniform sphere that lights it
    padding_a: u32,
    padding_b: u32,
}

// `GpuSample` of the host.
struct Answer {
    optical_depth: f32,
    transmittance: f32,
    single: f32,
    multiple: f32,
}

@group(0) @binding(0) var<storage, read> rays: array<Ray>;
@group(0) @binding(1) var<storage, read_write> answers: array<Answer>;
@group(0) @binding(2) var<uniform> phase: PhaseParams;

@compute @workgroup_size(64)
fn sample(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&rays) {
        return;
    }
    let ray = rays[id.x];
    let chord = max(-2.0 * dot(ray.entry, ray.dir), 0.0);
    let matter = chord_part(ray.shape, ray.entry, ray.entry + chord * ray.dir, ray.begin, ray.end);
    let whole = ray.optical_radius * chord * matter.x;
    let before = matter.y;
    let tau = whole * max(matter.z - before, 0.0);
    let opaque = opacity(tau) * exp(-whole * before);
    let source = scattering_source(ray.entry, ray.dir, ray.sun, ray.source_radius);
    let once = phase_between(phase, ray.dir, ray.sun);
    answers[id.x] = Answer(tau, exp(-tau), once * source.x * opaque, source.y * opaque);
}
