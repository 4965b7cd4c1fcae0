//! The shader against its twin, on the device.

use glam::Vec3;

use super::lookup::PACKING;
use super::random::Stream;
use super::volume::copy_for;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::medium::Phase;
use crate::tables::{TableSet, TablesGpu};

const SHADER: &str = r"
#import cumuli::optical_depth::{chord_profile, chord_fraction, chord_part, chord_step, step_fraction, copy_for}
struct Chord { entry: vec3<f32>, shape: u32, exit: vec3<f32>, t: f32 }
@group(0) @binding(0) var<storage, read> chords: array<Chord>;
struct Answers { profile: vec2<f32>, copied: vec2<f32>, step: vec2<f32>, copy: vec2<f32>, exact: vec2<f32>, deep: vec2<f32> }
@group(0) @binding(1) var<storage, read_write> answers: array<Answers>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&chords) { return; }
    let c = chords[id.x];
    let pixels = 20.0 * c.t;
    let optical_radius = 40.0 * abs(c.entry.x);
    let copy = copy_for(pixels, optical_radius);
    let profile = chord_profile(c.shape, c.entry, c.exit, 0u);
    let copied = chord_profile(c.shape, c.entry, c.exit, copy);
    let step = chord_step(c.shape, c.entry, c.exit);
    answers[id.x] = Answers(
        vec2(profile.mean_density, chord_fraction(profile, c.t)),
        vec2(copied.mean_density, chord_fraction(copied, c.t)),
        vec2(step.mean_density, step_fraction(step, c.t)),
        vec2(f32(copy), pixels),
        chord_part(c.shape, c.entry, c.exit, 0.0, c.t).xz,
        vec2(optical_radius, 0.0),
    );
}
";

/// Entry and shape, exit and fraction.
type Chord = [f32; 8];
/// Mean density and share by the march, by a filtered copy, by the 4D table; the copy and the
/// radius in pixels; mean density and share by the march without packing; the optical radius.
type Answers = [[f32; 2]; 6];

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
    let output = buffers::storage(&gpu, "answers", chords.len(), size_of::<Answers>());
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
    let answers: Vec<Answers> = gpu.read_buffer(&output, chords.len()).expect("answers");

    let mut marched = Difference::default();
    let mut unpacked = Difference::default();
    let mut copied = Difference::default();
    let mut stepped = Difference::default();
    for ((shape, entry, exit, t), answers) in chords.iter().zip(answers) {
        let [packed, filtered, quick, [copy, pixels], exact, [deep, _]] = answers;
        assert_eq!(copy as usize, copy_for(pixels, deep), "{pixels} {deep}");
        let (a, b) = (entry.as_dvec3(), exit.as_dvec3());
        let length = (*exit - *entry).length();
        // The direction of a chord this short is lost in f32, and no optical depth is on it.
        if length < 1e-3 {
            continue;
        }
        let profile = tables.chord_profile(*shape, a, b);
        let small = tables.copied_profile(*shape, a, b, copy as usize);
        let step = tables.chord_step(*shape, a, b);
        marched.add(packed, [profile.mean_density, profile.fraction(*t)], length);
        unpacked.add(exact, [profile.mean_density, profile.fraction(*t)], length);
        copied.add(filtered, [small.mean_density, small.fraction(*t)], length);
        stepped.add(quick, [step.mean_density, step.fraction(*t)], length);
    }
    // Filtering hardware may place a fetch to 1/256 of a texel. In the 4D table neighbouring texels
    // differ by 0.05 on average and 0.5 at most: 2e-4 and 2e-3 of density, over chords of up to 2
    // radii; in a volume by as much, and the mean of 21 errs less.
    stepped.check(4e-3, 4e-4, 0.02);
    unpacked.check(2e-3, 2e-4, 0.002);
    marched.check(2e-3, 2e-4, 0.002 + PACKING);
    copied.check(2e-3, 2e-4, 0.002 + PACKING);
}

/// Of the shader's answers from those of its twin.
#[derive(Default)]
struct Difference {
    worst: f32,
    squares: f64,
    count: f64,
    worst_share: f32,
}

impl Difference {
    fn add(&mut self, [mean, share]: [f32; 2], [twin_mean, twin_share]: [f32; 2], length: f32) {
        assert!(mean.is_finite() && (0.0..=1.0 + 1e-6).contains(&share), "{mean} {share}");
        let difference = (mean - twin_mean).abs() * length;
        self.worst = self.worst.max(difference);
        self.squares += f64::from(difference).powi(2);
        self.count += 1.0;
        // Shares of at least a hundredth of full density.
        if twin_mean > 0.01 {
            self.worst_share = self.worst_share.max((share - twin_share).abs());
        }
    }

    fn check(&self, worst: f32, rms: f64, share: f32) {
        let got = (self.worst, (self.squares / self.count).sqrt(), self.worst_share);
        println!("{got:?}");
        assert!(got.0 < worst && got.1 < rms && got.2 < share, "{got:?}");
    }
}
