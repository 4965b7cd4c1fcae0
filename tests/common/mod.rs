//! What tests on the device share: one device a test binary, and WGSL run over arrays.
#![allow(dead_code, reason = "every test binary uses its own part")]

use std::sync::OnceLock;

use bytemuck::Pod;
use cumuli::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use cumuli::tables::TableSet;

/// The device of this test binary.
pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| Gpu::headless().expect("an adapter"))
}

/// All shared shader modules, parsed once.
pub fn library() -> &'static ShaderLibrary {
    static LIBRARY: OnceLock<ShaderLibrary> = OnceLock::new();
    LIBRARY.get_or_init(|| ShaderLibrary::new().expect("the shader modules"))
}

/// The tables that are part of the program.
pub fn tables() -> &'static TableSet {
    static TABLES: OnceLock<TableSet> = OnceLock::new();
    TABLES.get_or_init(|| TableSet::embedded().expect("the built-in tables"))
}

/// Records compute work and hands it to the device; reading a buffer back waits for it.
pub fn submit(record: impl FnOnce(&mut wgpu::ComputePass<'_>)) {
    let mut encoder = gpu().device.create_command_encoder(&Default::default());
    record(&mut encoder.begin_compute_pass(&Default::default()));
    gpu().queue.submit([encoder.finish()]);
}

/// A layout and a bind group for group 1, 2, … of a kernel (tables, sky).
pub type Group<'a> = (&'a wgpu::BindGroupLayout, &'a wgpu::BindGroup);

/// A function in WGSL of one value.
#[derive(Clone, Copy)]
pub struct Snippet<'a> {
    /// Imports, structs and functions.
    pub declarations: &'a str,
    /// WGSL type of the argument, of the same layout as `I` of [`map`].
    pub input: &'a str,
    /// WGSL type of the result, of the same layout as `O` of [`map`].
    pub output: &'a str,
    /// The result as an expression of the argument `x`.
    pub result: &'a str,
}

/// Runs a snippet on every value of an array, on the device.
pub fn map<I: Pod, O: Pod>(snippet: Snippet<'_>, groups: &[Group<'_>], inputs: &[I]) -> Vec<O> {
    map_with(snippet, groups, &[], inputs)
}

/// The same of a snippet that declares more bindings of group 0, from 2 on.
pub fn map_with<I: Pod, O: Pod>(
    snippet: Snippet<'_>,
    groups: &[Group<'_>],
    more: &[wgpu::BindingResource<'_>],
    inputs: &[I],
) -> Vec<O> {
    let Snippet { declarations, input, output, result } = snippet;
    let source = format!(
        "{declarations}
@group(0) @binding(0) var<storage, read> inputs: array<{input}>;
@group(0) @binding(1) var<storage, read_write> outputs: array<{output}>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
    if id.x >= arrayLength(&inputs) {{
        return;
    }}
    let x = inputs[id.x];
    outputs[id.x] = {result};
}}
"
    );
    // Kernels keep the text of program files, which live for ever.
    let source: &'static str = source.leak();
    let layouts: Vec<_> = groups.iter().map(|g| g.0).collect();
    let kernel =
        Kernel::new(gpu(), library(), ("snippet", source), &[], &layouts).expect("a kernel");
    let from = buffers::storage_with(gpu(), "inputs", inputs);
    let to = buffers::storage(gpu(), "outputs", inputs.len(), size_of::<O>());
    let own = [from.as_entire_binding(), to.as_entire_binding()];
    let bindings = kernel.bind(gpu(), &[&own, more].concat());
    submit(|pass| {
        pass.set_pipeline(kernel.pipeline("main"));
        pass.set_bind_group(0, &bindings, &[]);
        for (index, group) in groups.iter().enumerate() {
            pass.set_bind_group(index as u32 + 1, group.1, &[]);
        }
        pass.dispatch_workgroups(inputs.len().div_ceil(64) as u32, 1, 1);
    });
    gpu().read_buffer(&to, inputs.len()).expect("outputs")
}

/// Random numbers for test inputs: always the same (Steele, Lea and Flood's SplitMix64, 2014).
pub struct Random(pub u64);

impl Random {
    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> glam::DVec3 {
        let (z, turn) = (self.between(-1.0, 1.0), self.between(0.0, std::f64::consts::TAU));
        let across = (1.0 - z * z).sqrt();
        glam::DVec3::new(across * turn.cos(), across * turn.sin(), z)
    }
}
