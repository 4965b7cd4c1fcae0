//! The shader against its twin, on the device.

use glam::Vec3;

use super::random::Stream;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::medium::Phase;
use crate::tables::{TableSet, TablesGpu};

const SHADER: &str = r"
#import cumuli::optical_depth::{chord_profile, chord_fraction, seen_profile, chord_step, step_fraction, word_at}
struct Chord { entry: vec3<f32>, shape: u32, exit: vec3<f32>, t: f32 }
@group(0) @binding(0) var<storage, read> chords: array<Chord>;
@group(0) @binding(1) var<storage, read_write> answers: array<vec2<f32>>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&chords) { return; }
    let c = chords[id.x];
    let profile = chord_profile(c.shape, c.entry, c.exit);
    answers[id.x] = vec2(profile.mean_density, chord_fraction(profile, c.t));
}
";

/// Entry and shape, exit and fraction.
type Chord = [f32; 8];

fn random_chords(shapes: u32) -> Vec<(u32, Vec3, Vec3, f32)> {
    (0..8192)
        .map(|i| {
            let mut random = Stream::new(3, i);
            let entry = random.on_sphere().as_vec3();
            let mut exit = random.on_sphere().as_vec3();
            // Some short ones, some along the axes and in the plane where the direction turns over.
            match i % 16 {
                0 => exit = (entry + exit * 1e-3).normalize(),
                1 => exit = entry,
                2 => exit = Vec3::new(entry.x, -entry.y, entry.z),
                3 => exit = -entry,
                _ => {}
            }
            (i as u32 % shapes, entry, exit, random.uniform() as f32)
        })
        .collect()
}

#[test]
fn shader_agrees_with_its_twin() {
    let gpu = Gpu::headless().expect("an adapter");
    let tables = TableSet::embedded().expect("built-in tables");
    let phase = Phase::hg(0.85).expect("a phase function");
    let on_gpu = TablesGpu::new(&gpu, &tables, &phase, 1.0).expect("tables on the device");
    let library = ShaderLibrary::new().expect("shaders");
    let kernel = Kernel::new(&gpu, &library, ("twin test", SHADER), &[], &[on_gpu.layout()])
        .expect("a kernel");
    let chords = random_chords(tables.shape_names().count() as u32);
    let input: Vec<Chord> = chords
        .iter()
        .map(|(shape, a, b, t)| [a.x, a.y, a.z, f32::from_bits(*shape), b.x, b.y, b.z, *t])
        .collect();
    let input = buffers::storage_with(&gpu, "chords", &input);
    let output = buffers::storage(&gpu, "answers", chords.len(), 8);
    let bindings = kernel.bind(&gpu, &[input.as_entire_binding(), output.as_entire_binding()]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(kernel.pipeline("main"));
        pass.set_bind_group(0, &bindings, &[]);
        pass.set_bind_group(1, on_gpu.bind_group(), &[]);
        pass.dispatch_workgroups(chords.len().div_ceil(64) as u32, 1, 1);
    }
    gpu.queue.submit([encoder.finish()]);
    let answers: Vec<[f32; 2]> = gpu.read_buffer(&output, chords.len()).expect("answers");

    let (mut worst, mut square, mut worst_share) = (0.0f32, 0.0f64, 0.0f32);
    for ((shape, entry, exit, t), [mean, share]) in chords.iter().zip(answers) {
        assert!(mean.is_finite() && (0.0..=1.0).contains(&share), "{mean} {share}");
        let twin = tables.chord_profile(*shape, entry.as_dvec3(), exit.as_dvec3());
        let length = (*exit - *entry).length();
        // The direction of a chord this short is lost in f32, and no optical depth is on it.
        if length < 1e-3 {
            continue;
        }
        worst = worst.max((mean - twin.mean_density).abs() * length);
        square += f64::from(((mean - twin.mean_density) * length).powi(2));
        if twin.mean_density > 0.01 {
            worst_share = worst_share.max((share - twin.fraction(*t)).abs());
        }
    }
    let rms = (square / chords.len() as f64).sqrt();
    // Filtering hardware may place a fetch to 1/256 of a texel; neighbouring texels differ by 0.05
    // on average and 0.5 at most: 2e-4 and 2e-3 of density, over chords of up to 2 radii.
    assert!(worst < 4e-3 && rms < 4e-4, "{worst} {rms}");
    // The same for shares of at least a hundredth of full density.
    assert!(worst_share < 0.02, "{worst_share}");
}
