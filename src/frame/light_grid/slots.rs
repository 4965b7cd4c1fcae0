//! Slots of the light grid: the passes that say which cells keep light (`light_grid_slots.wgsl`), and their buffers.

use super::inputs::GridInputs;
use crate::Result;
use crate::frame::scan::{ScanJob, ScanPass};
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Invocations of a workgroup; as in the shader.
const WORKGROUP: u32 = 64;

/// The pipelines.
pub struct SlotsPass {
    kernel: Kernel,
}

/// Buffers of one grid.
pub(super) struct SlotsJob {
    /// By cell its slot, and behind all cells the extinctions by slot. Before there are slots, counts of matter.
    pub cells: wgpu::Buffer,
    /// By slot, of cells with matter first: index of its cell.
    pub cell_of: wgpu::Buffer,
    /// By word of cells: slots of cells with matter before it, of cells without; behind the last word, all.
    pub offsets: [wgpu::Buffer; 2],
    /// Words of cells.
    pub words: u32,
    /// Device memory, bytes.
    pub bytes: u64,
    bindings: wgpu::BindGroup,
    scans: [ScanJob; 2],
}

impl SlotsPass {
    /// Compiles the pass.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary) -> Result<Self> {
        let file = crate::shader_file!("frame/light_grid_slots.wgsl");
        Ok(Self { kernel: Kernel::new(gpu, library, file, &[], &[])? })
    }

    pub(super) fn job(
        &self,
        gpu: &Gpu,
        scan: &ScanPass,
        uniforms: &wgpu::Buffer,
        inputs: &GridInputs,
    ) -> SlotsJob {
        let (words, room) = (inputs.levels.words(), inputs.room);
        let storage = |label, count: u32| buffers::storage(gpu, label, count as usize, 4);
        let cells = storage("grid cells", inputs.levels.cells() + room.matter);
        let cell_of = storage("grid cell of slot", room.kept);
        let bits = ["grid matter bits", "grid kept bits"].map(|label| storage(label, words));
        let counts = ["grid matter counts", "grid empty counts"].map(|label| storage(label, words));
        let offsets =
            ["grid matter offsets", "grid empty offsets"].map(|label| storage(label, words + 1));
        let all =
            [&cells].into_iter().chain(&bits).chain(&counts).chain(&offsets).chain([&cell_of]);
        let bindings: Vec<_> =
            [uniforms].into_iter().chain(all.clone()).map(|b| b.as_entire_binding()).collect();
        let bindings = self.kernel.bind(gpu, &bindings);
        let scans = [0, 1].map(|i| scan.job(gpu, &counts[i], &offsets[i], words));
        let bytes = all.map(wgpu::Buffer::size).sum();
        SlotsJob { cells, cell_of, offsets, words, bytes, bindings, scans }
    }

    /// Records it, after the matter's.
    pub(super) fn encode(&self, pass: &mut wgpu::ComputePass<'_>, scan: &ScanPass, job: &SlotsJob) {
        let mut run = |entry, scans: &[ScanJob]| {
            pass.set_pipeline(self.kernel.pipeline(entry));
            pass.set_bind_group(0, &job.bindings, &[]);
            pass.dispatch_workgroups(job.words.div_ceil(WORKGROUP), 1, 1);
            scans.iter().for_each(|job| scan.encode(pass, job));
        };
        run("occupied", &[]);
        run("keep", &job.scans);
        run("place", &[]);
    }
}
