//! Stable radix sort on the device. Equal keys keep their order, so the result depends on the
//! input alone.

use super::scan::{ScanJob, ScanPass};
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Bits a round sorts by; as in the shader.
const DIGIT_BITS: u32 = 4;
const DIGITS: u32 = 1 << DIGIT_BITS;
/// Pairs a workgroup owns; as in the shader.
const BLOCK: u32 = 512;
/// Rounds for a 32-bit key. Even, so that the result lies where the input lay.
const ROUNDS: u32 = 32 / DIGIT_BITS;

/// The sort's pipelines.
pub struct SortPass {
    kernel: Kernel,
}

/// Buffers for sorting up to `capacity` pairs.
pub struct SortJob {
    /// Keys before and after.
    pub keys: wgpu::Buffer,
    /// Values before and after.
    pub values: wgpu::Buffer,
    blocks: u32,
    rounds: Vec<wgpu::BindGroup>,
    scan: ScanJob,
    bytes: u64,
}

impl SortPass {
    /// Compiles the pass.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary) -> Result<Self> {
        let kernel = Kernel::new(gpu, library, crate::shader_file!("frame/sort.wgsl"), &[], &[])?;
        Ok(Self { kernel })
    }

    /// Makes the buffers for exactly `length` pairs; fill unused ones with the largest key.
    pub fn job(&self, gpu: &Gpu, scan: &ScanPass, length: u32) -> SortJob {
        let count = length as usize;
        let make = |label| buffers::storage(gpu, label, count, size_of::<u32>());
        let (keys, values) = (make("sort keys"), make("sort values"));
        let (other_keys, other_values) = (make("sort keys, other"), make("sort values, other"));
        let blocks = length.div_ceil(BLOCK).max(1);
        let table = (blocks * DIGITS) as usize;
        let histograms = buffers::storage(gpu, "sort histograms", table, size_of::<u32>());
        let offsets = buffers::storage(gpu, "sort offsets", table + 1, size_of::<u32>());
        let rounds = (0..ROUNDS)
            .map(|round| {
                let params =
                    buffers::uniform(gpu, "sort", &[length, round * DIGIT_BITS, blocks, 0]);
                let (from, to) = if round % 2 == 0 {
                    ((&keys, &values), (&other_keys, &other_values))
                } else {
                    ((&other_keys, &other_values), (&keys, &values))
                };
                self.kernel.bind(
                    gpu,
                    &[
                        params.as_entire_binding(),
                        from.0.as_entire_binding(),
                        from.1.as_entire_binding(),
                        to.0.as_entire_binding(),
                        to.1.as_entire_binding(),
                        histograms.as_entire_binding(),
                        offsets.as_entire_binding(),
                    ],
                )
            })
            .collect();
        let bytes = [&keys, &values, &other_keys, &other_values, &histograms, &offsets]
            .iter()
            .map(|b| b.size())
            .sum();
        let scan = scan.job(gpu, &histograms, &offsets, blocks * DIGITS);
        SortJob { keys, values, blocks, rounds, scan, bytes }
    }

    /// Records the sort.
    pub fn encode(&self, pass: &mut wgpu::ComputePass<'_>, scan: &ScanPass, job: &SortJob) {
        for round in &job.rounds {
            pass.set_pipeline(self.kernel.pipeline("histogram"));
            pass.set_bind_group(0, round, &[]);
            pass.dispatch_workgroups(job.blocks, 1, 1);
            scan.encode(pass, &job.scan);
            pass.set_pipeline(self.kernel.pipeline("scatter"));
            pass.set_bind_group(0, round, &[]);
            pass.dispatch_workgroups(job.blocks, 1, 1);
        }
    }
}

impl SortJob {
    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}
