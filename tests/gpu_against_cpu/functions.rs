//! Functions of the shaders one by one against f64, at random and at the ends of their ranges. What is found stands in
//! `docs/shader-functions.md`; a test there asks for a line for every function.

mod air;
mod grid;
mod listed;
mod maps;
mod octaves;
mod parts;
mod rays;
mod sea;
mod sea_light;
mod sky;
mod sky_march;
mod tables;

use crate::common::{Group, Random, Snippet, map_with};

/// Step of f32 at 1.
const STEP: f64 = f32::EPSILON as f64;
/// Numbers of a result.
type Four = [f64; 4];

/// A function on the device.
struct Function<'a> {
    /// As in `docs/shader-functions.md`.
    name: &'a str,
    /// Imports, or the text itself.
    declarations: &'a str,
    /// Four numbers from the arguments `x[0]`, `x[1]` and so on.
    call: &'a str,
    /// Tables that it reads.
    groups: &'a [Group<'a>],
    /// Resources of group 0 besides the arguments.
    more: &'a [wgpu::BindingResource<'a>],
    /// Results count as no less than this: where terms of that size cancel, they leave what is rounded of them.
    least: f64,
}

impl<'a> Function<'a> {
    fn new(name: &'a str, declarations: &'a str, call: &'a str) -> Self {
        Self { name, declarations, call, groups: &[], more: &[], least: 0.0 }
    }

    fn reading(self, groups: &'a [Group<'a>]) -> Self {
        Self { groups, ..self }
    }

    fn of_terms(self, least: f64) -> Self {
        Self { least, ..self }
    }

    /// Asserts that no result is farther from the twin's than `most` steps: one step is that of f32 in the result,
    /// and what a step of f32 in each of the arguments changes.
    #[track_caller]
    fn agrees<const N: usize>(
        &self,
        inputs: &[[f32; N]],
        most: f64,
        twin: impl Fn([f64; N]) -> Four,
    ) {
        self.agrees_filtered(inputs, most, 0, |_, input| twin(input));
    }

    /// The same of a function that reads filtered textures. `twin(0, …)` is exact; the others, up to `shifts`, place
    /// every fetch farther along an axis, by as much as a device may: what they change is allowed besides.
    #[track_caller]
    fn agrees_filtered<const N: usize>(
        &self,
        inputs: &[[f32; N]],
        most: f64,
        shifts: usize,
        twin: impl Fn(usize, [f64; N]) -> Four,
    ) {
        let exactly = |input| twin(0, input);
        let mut worst = 0.0f64;
        for (input, result) in inputs.iter().zip(self.on_device(inputs)) {
            let arguments = input.map(f64::from);
            let exact = exactly(arguments);
            let condition = condition(input, exact, &exactly);
            let shifted: Vec<Four> = (1..=shifts).map(|shift| twin(shift, arguments)).collect();
            for i in 0..4 {
                let off = (f64::from(result[i]) - exact[i]).abs();
                assert!(!off.is_nan(), "{}: {input:?}: {result:?} for {exact:?}", self.name);
                let step = condition[i] + self.least * STEP;
                let steps = off / step;
                worst = worst.max(steps);
                let allowed: f64 = shifted.iter().map(|there| (there[i] - exact[i]).abs()).sum();
                assert!(
                    off <= most * step + allowed,
                    "{}: {steps} steps, {allowed} by filters, at {input:?}: {result:?} for {exact:?}",
                    self.name
                );
            }
        }
        println!("{}: {worst:.1} steps", self.name);
        assert!(inputs.len() > 3, "{}: nothing asked", self.name);
    }

    fn on_device<const N: usize>(&self, inputs: &[[f32; N]]) -> Vec<[f32; 4]> {
        let input = format!("array<f32, {N}>");
        let snippet = Snippet {
            declarations: self.declarations,
            input: &input,
            output: "vec4<f32>",
            result: self.call,
        };
        map_with(snippet, self.groups, self.more, inputs)
    }
}

/// What a step of f32 in a result and in every argument makes of the result.
fn condition<const N: usize>(
    input: &[f32; N],
    exact: Four,
    twin: &impl Fn([f64; N]) -> Four,
) -> Four {
    // Beside a place where a function jumps, roundings within decide.
    const FAR: f64 = 8.0;
    // The smallest numbers may be flushed to 0.
    let mut all = exact.map(|v| v.abs() * STEP + f64::from(f32::MIN_POSITIVE));
    for i in 0..N {
        let mut most = [0.0f64; 4];
        for steps in [1.0, -1.0, FAR, -FAR] {
            let mut beside = input.map(f64::from);
            beside[i] += steps * (beside[i].abs() * STEP).max(f64::from(f32::MIN_POSITIVE));
            let there = twin(beside);
            for (most, (a, b)) in most.iter_mut().zip(there.iter().zip(exact)) {
                *most = most.max((a - b).abs() / steps.abs());
            }
        }
        for (sum, most) in all.iter_mut().zip(most) {
            *sum += if most.is_nan() { 0.0 } else { most };
        }
    }
    all
}

/// One number of four.
fn one(value: f64) -> Four {
    [value, 0.0, 0.0, 0.0]
}

/// By magnitude.
fn magnitude(random: &mut Random, low: f64, high: f64) -> f32 {
    (low.ln() + (high / low).ln() * random.uniform()).exp() as f32
}

/// So many random arguments.
fn many<const N: usize>(seed: u64, mut one: impl FnMut(&mut Random) -> [f32; N]) -> Vec<[f32; N]> {
    let mut random = Random(seed);
    (0..8192).map(|_| one(&mut random)).collect()
}
