//! Lists of particles per tile of a picture (the screen's, the sun's), in sorted
//! order, through bins of 8x8 tiles.

use super::scan::{ScanJob, ScanPass};
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Tiles a side of a bin; as in the shader.
const BIN: u32 = 8;
/// Bins that one invocation of the bin passes owns; as in the shader.
const BIN_RUN: u32 = 8;
/// Least number of sorted particles that one invocation tests against its bins.
const CHUNK: u32 = 256;
/// Most counts of bins and chunks: what the scan does in half the turns that the most narrow-minded driver
/// allows ([`MOST_TURNS`]), and what workgroups of [`BIN_WORKGROUP`] can be dispatched for.
const MOST_COUNTS: u32 = 4_000_000;
/// Turns after which lavapipe (Mesa 22.3) ends all loops of an invocation, without a word.
pub const MOST_TURNS: u32 = 65_535;
/// Entries of a bin that a tile looks at in a turn; as in the shader.
pub const TURN_ENTRIES: u32 = 16;
/// Invocations of a workgroup in the bin passes; as in the shader.
const BIN_WORKGROUP: u32 = 64;

/// Words behind the offsets of the tiles.
pub const LENGTHS: u64 = 2;

/// The pipelines.
pub struct TileListPass {
    kernel: Kernel,
    /// For lists that end at what is opaque: the others need not know of it.
    limited: Kernel,
}

/// How large the lists of one picture may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListSize {
    /// Tiles across and up.
    pub tiles: [u32; 2],
    /// Particles that are sorted.
    pub particles: u32,
    /// Entries of all bins.
    pub bin_entries: u32,
    /// Entries of all tiles.
    pub tile_entries: u32,
}

/// The lists of one picture.
pub struct TileLists {
    /// First entry of each tile, and the total; behind them the lengths of the longest list of a tile
    /// and of the longest of a bin.
    pub tile_offsets: wgpu::Buffer,
    /// Particles, tile after tile.
    pub tile_entries: wgpu::Buffer,
    /// First entry of each (bin, chunk), and the total last.
    pub bin_offsets: wgpu::Buffer,
    size: ListSize,
    bins: [u32; 2],
    chunks: u32,
    is_limited: bool,
    bin_bindings: wgpu::BindGroup,
    tile_count_bindings: wgpu::BindGroup,
    tile_write_bindings: wgpu::BindGroup,
    bin_scan: ScanJob,
    tile_scan: ScanJob,
    bytes: u64,
}

/// What the lists are made from.
pub struct ListInputs<'a> {
    /// Number of sorted particles: a word of a buffer.
    pub lengths: &'a wgpu::Buffer,
    /// Which word.
    pub length_index: u32,
    /// Particles in sorted order.
    pub order: &'a wgpu::Buffer,
    /// First tile and one past the last, x in the low half, per particle.
    pub rectangles: &'a wgpu::Buffer,
    /// Where lists end at what is opaque.
    pub limits: Option<ListLimits<'a>>,
}

/// Where lists end.
#[derive(Clone, Copy)]
pub struct ListLimits<'a> {
    /// Keys of particles, per particle.
    pub nearest: &'a wgpu::Buffer,
    /// Keys beyond which a tile, and a bin of tiles, lists nothing: a texel each.
    pub keys: &'a [wgpu::TextureView; 2],
}

impl TileListPass {
    /// Compiles the pass.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary) -> Result<Self> {
        let file = crate::shader_file!("frame/tile_lists.wgsl");
        Ok(Self {
            kernel: Kernel::new(gpu, library, file, &[], &[])?,
            limited: Kernel::new(gpu, library, file, &[("LIMITED", 1)], &[])?,
        })
    }

    /// Makes the lists of one picture.
    pub fn lists(
        &self,
        gpu: &Gpu,
        scan: &ScanPass,
        size: ListSize,
        inputs: &ListInputs<'_>,
    ) -> TileLists {
        let bins = [size.tiles[0].div_ceil(BIN), size.tiles[1].div_ceil(BIN)];
        let bin_count = bins[0] * bins[1];
        let most_chunks = (MOST_COUNTS / bin_count.max(1)).max(1);
        let chunk = CHUNK.max(size.particles.div_ceil(most_chunks));
        let chunks = size.particles.div_ceil(chunk).max(1);
        let tile_count = size.tiles[0] * size.tiles[1];
        let params = buffers::uniform(
            gpu,
            "tile lists",
            &[
                size.tiles[0],
                size.tiles[1],
                bins[0],
                bins[1],
                chunks,
                size.bin_entries,
                size.tile_entries,
                inputs.length_index,
                chunk,
                0,
            ],
        );
        let words =
            |label, count: u32| buffers::storage(gpu, label, count as usize, size_of::<u32>());
        let bin_counts = words("bin counts", bin_count * chunks);
        let bin_offsets = words("bin offsets", bin_count * chunks + 1);
        let bin_entries = words("bin entries", size.bin_entries);
        let tile_counts = words("tile counts", tile_count);
        let tile_offsets = words("tile offsets", tile_count + 1 + LENGTHS as u32);
        let tile_entries = words("tile entries", size.tile_entries);
        let bind = |counts: &wgpu::Buffer| {
            let buffers = [
                &params,
                inputs.lengths,
                inputs.order,
                inputs.rectangles,
                counts,
                &bin_offsets,
                &bin_entries,
                &tile_entries,
            ];
            let mut resources = buffers.map(|b| b.as_entire_binding()).to_vec();
            if let Some(ListLimits { nearest, keys }) = inputs.limits {
                resources.push(nearest.as_entire_binding());
                resources.extend(keys.iter().map(wgpu::BindingResource::TextureView));
            }
            self.kernel(inputs.limits.is_some()).bind(gpu, &resources)
        };
        let all =
            [&bin_counts, &bin_offsets, &bin_entries, &tile_counts, &tile_offsets, &tile_entries];
        let bytes = all.iter().map(|b| b.size()).sum();
        TileLists {
            bin_bindings: bind(&bin_counts),
            tile_count_bindings: bind(&tile_counts),
            tile_write_bindings: bind(&tile_offsets),
            bin_scan: scan.job(gpu, &bin_counts, &bin_offsets, bin_count * chunks),
            tile_scan: scan.job(gpu, &tile_counts, &tile_offsets, tile_count),
            size,
            bins,
            chunks,
            is_limited: inputs.limits.is_some(),
            tile_offsets,
            tile_entries,
            bin_offsets,
            bytes,
        }
    }

    fn kernel(&self, is_limited: bool) -> &Kernel {
        if is_limited { &self.limited } else { &self.kernel }
    }

    /// Records the making of the lists.
    pub fn encode(&self, pass: &mut wgpu::ComputePass<'_>, scan: &ScanPass, lists: &TileLists) {
        let kernel = self.kernel(lists.is_limited);
        let runs = lists.bins[0].div_ceil(BIN_RUN) * lists.bins[1];
        let bin_groups = (runs * lists.chunks).div_ceil(BIN_WORKGROUP);
        let tile_groups = [lists.size.tiles[0].div_ceil(BIN), lists.size.tiles[1].div_ceil(BIN)];
        pass.set_pipeline(kernel.pipeline("count_bins"));
        pass.set_bind_group(0, &lists.bin_bindings, &[]);
        pass.dispatch_workgroups(bin_groups, 1, 1);
        scan.encode(pass, &lists.bin_scan);
        pass.set_pipeline(kernel.pipeline("write_bins"));
        pass.set_bind_group(0, &lists.bin_bindings, &[]);
        pass.dispatch_workgroups(bin_groups, 1, 1);
        pass.set_pipeline(kernel.pipeline("count_tiles"));
        pass.set_bind_group(0, &lists.tile_count_bindings, &[]);
        pass.dispatch_workgroups(tile_groups[0], tile_groups[1], 1);
        scan.encode(pass, &lists.tile_scan);
        pass.set_pipeline(kernel.pipeline("write_tiles"));
        pass.set_bind_group(0, &lists.tile_write_bindings, &[]);
        pass.dispatch_workgroups(tile_groups[0], tile_groups[1], 1);
        pass.set_pipeline(kernel.pipeline("measure"));
        pass.dispatch_workgroups(1, 1, 1);
    }
}

impl TileLists {
    /// The sizes these lists were made for.
    pub fn size(&self) -> ListSize {
        self.size
    }

    /// Index of the word of `bin_offsets` that holds the number of bin entries wanted.
    pub fn bin_total_index(&self) -> u64 {
        u64::from(self.bins[0] * self.bins[1] * self.chunks)
    }

    /// Index of the word of `tile_offsets` that holds the number of tile entries wanted; [`LENGTHS`] more
    /// words follow.
    pub fn tile_total_index(&self) -> u64 {
        u64::from(self.size.tiles[0] * self.size.tiles[1])
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}
