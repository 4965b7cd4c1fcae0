//! Counts and times of a frame, read back from the device.

use std::time::Instant;

use wgpu_profiler::{GpuProfiler, GpuProfilerSettings};

use super::picture::{Counters, PassTime};
use super::plan::{FramePlan, Pass};
use super::resources::{BLEND_COUNTS, Capacities, ListCapacity, Resources};
use super::shadow::ShadowJob;
use super::tile_lists::{LENGTHS, MOST_TURNS, TURN_ENTRIES};
use crate::gpu::{Gpu, buffers};
use crate::{Error, Result};

/// Exact counts of one frame, as the device wrote them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Particles wanted, before any capacity cut them.
    pub particles: u32,
    /// The same of the light grid's own particles.
    pub grid_particles: u32,
    /// Cells of the light grid with matter, and all that keep light.
    pub grid_cells: [u32; 2],
    /// Particles in view.
    pub visible: u32,
    /// Entries wanted of bins and tiles: screen, sun.
    pub lists: [[u32; 2]; 2],
    /// Table look-ups of the blend.
    pub lookups: u32,
    /// Pixels in tiles with particles.
    pub pixels: u32,
    /// Screen tiles without particles.
    pub empty_tiles: u32,
    /// Longest list of a tile and of a bin: screen, sun.
    pub longest: [[u32; 2]; 2],
    /// Rays of pixels, and of texels of shadow maps, that the device left before their end; invocations that did
    /// not come to spread all large particles over the light grid.
    pub cut: [u32; 3],
}

/// How the passes are timed.
pub enum Clock {
    /// By the device's timestamps.
    Device(Box<GpuProfiler>),
    /// By the host's clock: each pass is submitted alone and waited for. For software adapters,
    /// whose timestamps do not bracket compute work (Mesa 22.3.6 reports a blend of 100 ms as
    /// 0.05 ms), and for adapters without timestamps.
    Host(Vec<(Pass, f64)>),
    /// Not at all.
    Off,
}

impl Clock {
    fn new(gpu: &Gpu, time_passes: bool) -> Result<Self> {
        let software = gpu.is_software();
        let stamps = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        Ok(if stamps && !software {
            // Debug groups crash inside lavapipe (Mesa 22.3.6) when a build has debug assertions;
            // they are of no use without a capture tool anywhere else.
            let settings = GpuProfilerSettings { enable_debug_groups: false, ..Default::default() };
            let profiler = GpuProfiler::new(&gpu.device, settings)
                .map_err(|e| Error::Gpu(format!("timestamps: {e}")))?;
            Self::Device(Box::new(profiler))
        } else if time_passes {
            Self::Host(Vec::new())
        } else {
            Self::Off
        })
    }
}

/// Where all counts are gathered for one read.
pub struct StatsReader {
    words: wgpu::Buffer,
    clock: Clock,
}

const WORDS: usize = 2 + 1 + 2 * (2 + LENGTHS as usize) + BLEND_COUNTS + 2 + 2;
const WORD: u64 = size_of::<u32>() as u64;

/// Turns that a pass over a list has besides.
const OTHER_TURNS: u32 = 64;

impl StatsReader {
    /// Makes the reader. `time_passes`: times are wanted even where they cost time.
    pub fn new(gpu: &Gpu, time_passes: bool) -> Result<Self> {
        let clock = Clock::new(gpu, time_passes)?;
        Ok(Self { words: buffers::storage(gpu, "counts", WORDS, WORD as usize), clock })
    }

    /// Whether times are wanted from the next frame on, even where they cost time.
    pub fn set_timing(&mut self, gpu: &Gpu, time_passes: bool) -> Result<()> {
        self.clock = Clock::new(gpu, time_passes)?;
        Ok(())
    }

    /// Records one pass with `record`, timed.
    pub fn timed(
        &mut self,
        gpu: &Gpu,
        pass: Pass,
        encoder: &mut wgpu::CommandEncoder,
        record: impl FnOnce(&mut wgpu::CommandEncoder),
    ) -> Result<()> {
        match &mut self.clock {
            Clock::Device(profiler) => record(&mut profiler.scope(pass.name(), encoder)),
            Clock::Off => record(encoder),
            Clock::Host(times) => {
                flush(gpu, encoder);
                gpu.wait()?;
                let start = Instant::now();
                record(encoder);
                flush(gpu, encoder);
                gpu.wait()?;
                times.push((pass, start.elapsed().as_secs_f64()));
            }
        }
        Ok(())
    }

    /// Records the gathering, after all passes.
    pub fn gather(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &Resources,
        shadow: &ShadowJob,
        [grid_count, grid_large]: [Option<&wgpu::Buffer>; 2],
        grid_slots: Option<([&wgpu::Buffer; 2], u64)>,
    ) {
        let mut at = 0;
        let mut copy = |from: &wgpu::Buffer, first: u64, count: u64| {
            encoder.copy_buffer_to_buffer(from, first * WORD, &self.words, at * WORD, count * WORD);
            at += count;
        };
        // ParticleCount.wanted
        copy(&resources.particle_count, 1, 1);
        // Without a grid the frame's own count stands for it.
        copy(grid_count.unwrap_or(&resources.particle_count), 1, 1);
        copy(&resources.visible, 0, 1);
        let pictures = [&resources.screen, &resources.light.lists];
        for picture in pictures {
            let lists = &picture.lists;
            copy(&lists.bin_offsets, lists.bin_total_index(), 1);
            copy(&lists.tile_offsets, lists.tile_total_index(), 1 + LENGTHS);
        }
        copy(&resources.blend_counts, 0, BLEND_COUNTS as u64);
        copy(&shadow.cut, 0, 1);
        match grid_large {
            Some(large) => copy(large, 1, 1),
            None => encoder.clear_buffer(&self.words, at * WORD, Some(WORD)),
        }
        let at = (WORDS as u64 - 2) * WORD;
        match grid_slots {
            Some((counts, index)) => {
                for (count, to) in counts.into_iter().zip([at, at + WORD]) {
                    encoder.copy_buffer_to_buffer(count, index * WORD, &self.words, to, WORD);
                }
            }
            None => encoder.clear_buffer(&self.words, at, Some(2 * WORD)),
        }
        if let Clock::Device(profiler) = &mut self.clock {
            profiler.resolve_queries(encoder);
        }
    }

    /// Waits for the frame and reads its counts.
    pub fn read(&mut self, gpu: &Gpu) -> Result<Counts> {
        let words = gpu.read_buffer::<u32>(&self.words, WORDS)?;
        let wrong = || Error::Gpu("a read-back of the wrong size".to_owned());
        let (of_particles, rest) = words.split_first_chunk().ok_or_else(wrong)?;
        let (of_screen, rest) = rest.split_first_chunk().ok_or_else(wrong)?;
        let (of_sun, rest) = rest.split_first_chunk().ok_or_else(wrong)?;
        let [lookups, pixels, empty_tiles, blend_cut, shadow_cut, grid_cut, matter, empty] = *rest
        else {
            return Err(wrong());
        };
        let [particles, grid_particles, visible] = *of_particles;
        let lists = [*of_screen, *of_sun];
        Ok(Counts {
            particles,
            grid_particles,
            grid_cells: [matter, matter.saturating_add(empty)],
            visible,
            lists: lists.map(|[bins, tiles, ..]: [u32; 4]| [bins, tiles]),
            lookups,
            pixels,
            empty_tiles,
            longest: lists.map(|[.., tile, bin]| [tile, bin]),
            cut: [blend_cut, shadow_cut, grid_cut],
        })
    }

    /// Waits for the frame and returns the seconds of its passes, where they are known.
    pub fn times(&mut self, gpu: &Gpu) -> Result<Vec<(Pass, f64)>> {
        let profiler = match &mut self.clock {
            Clock::Off => return Ok(Vec::new()),
            Clock::Host(times) => return Ok(std::mem::take(times)),
            Clock::Device(profiler) => profiler,
        };
        profiler.end_frame().map_err(|e| Error::Gpu(format!("timestamps: {e}")))?;
        gpu.wait()?;
        let scopes = profiler.process_finished_frame(gpu.queue.get_timestamp_period());
        Ok(scopes
            .unwrap_or_default()
            .iter()
            .filter_map(|scope| {
                let pass = Pass::ALL.into_iter().find(|p| p.name() == scope.label)?;
                scope.time.as_ref().map(|t| (pass, t.end - t.start))
            })
            .collect())
    }
}

/// Submits what is recorded so far, and goes on with a fresh encoder.
fn flush(gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) {
    let next =
        gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
    gpu.queue.submit([std::mem::replace(encoder, next).finish()]);
}

/// Room that is added when something grows: a quarter, so that a slow growth does not make new
/// buffers every frame.
fn with_room(wanted: u32) -> u32 {
    wanted.saturating_add(wanted / 4).max(64)
}

impl Counts {
    /// The capacities that hold this frame, or none where the present ones do.
    pub fn grown(&self, now: &Capacities) -> Option<Capacities> {
        let list = |wanted: [u32; 2], now: ListCapacity| ListCapacity {
            bins: if wanted[0] > now.bins { with_room(wanted[0]) } else { now.bins },
            tiles: if wanted[1] > now.tiles { with_room(wanted[1]) } else { now.tiles },
        };
        let wanted = self.particles.max(self.grid_particles);
        let next = Capacities {
            particles: if wanted > now.particles { with_room(wanted) } else { now.particles },
            screen: list(self.lists[0], now.screen),
            light: list(self.lists[1], now.light),
            grid: now.grid.grown(self.grid_cells, with_room),
        };
        (next != *now).then_some(next)
    }

    /// Entries and particles that found no room.
    pub fn overflowed(&self, now: &Capacities) -> u64 {
        let over = |wanted: u32, room: u32| u64::from(wanted.saturating_sub(room));
        let list = |wanted: [u32; 2], room: ListCapacity| {
            over(wanted[0], room.bins) + over(wanted[1], room.tiles)
        };
        over(self.particles.max(self.grid_particles), now.particles)
            + list(self.lists[0], now.screen)
            + list(self.lists[1], now.light)
            + over(self.grid_cells[0], now.grid.matter)
            + over(self.grid_cells[1], now.grid.kept)
    }

    /// Rays and sums of the light grid that were cut, and lists that pass what a software driver walks: those of bins by the passes that
    /// make the tiles' from them, those of the sun's tiles by the light.
    pub fn cut(&self, is_software: bool) -> u64 {
        let [[_, screen_bin], [sun_tile, sun_bin]] = self.longest;
        // The light looks at other things in a few turns besides.
        let turns = [screen_bin.div_ceil(TURN_ENTRIES), sun_bin.div_ceil(TURN_ENTRIES), sun_tile];
        let too_long = turns.iter().filter(|turns| **turns > MOST_TURNS - OTHER_TURNS).count();
        let lists = if is_software { too_long as u64 } else { 0 };
        self.cut.iter().map(|rays| u64::from(*rays)).sum::<u64>() + lists
    }

    /// What of them a frame of this plan did: what was skipped has left the counts of before.
    pub fn of_plan(self, plan: &FramePlan, [columns, rows]: [u32; 2]) -> Self {
        let mut counts = self;
        if !plan.has_clouds() {
            let lists = [[0; 2], self.lists[1]];
            let empty_tiles = columns * rows;
            let (longest, cut) = ([[0; 2], self.longest[1]], [0; 3]);
            counts = Self { visible: 0, lists, longest, cut, ..counts };
            counts = Self { lookups: 0, pixels: 0, empty_tiles, ..counts };
        }
        if !plan.has_particles() {
            let (lists, longest) = Default::default();
            counts = Self { particles: 0, grid_particles: 0, lists, longest, ..counts };
        }
        counts
    }

    /// As part of the public statistics.
    pub fn counters(
        &self,
        capacities: &Capacities,
        tiles: [u32; 2],
        bytes: u64,
        is_software: bool,
    ) -> Counters {
        Counters {
            particles_generated: self.particles.into(),
            particles_visible: self.visible.into(),
            light_list_entries: self.lists[1][1].into(),
            screen_list_entries: self.lists[0][1].into(),
            table_lookups: self.lookups.into(),
            pixels_shaded: self.pixels.into(),
            tiles: u64::from(tiles[0]) * u64::from(tiles[1]),
            tiles_empty: self.empty_tiles.into(),
            bytes_resident: bytes,
            attempts: 1,
            overflowed: self.overflowed(capacities),
            cut: self.cut(is_software),
            ..Counters::default()
        }
    }
}

/// The passes of a frame with their times and reasons.
pub fn pass_times(plan: &FramePlan, times: &[(Pass, f64)]) -> Vec<PassTime> {
    plan.decisions()
        .iter()
        .map(|decision| {
            let seconds = times.iter().find(|(pass, _)| *pass == decision.pass).map(|t| t.1);
            PassTime {
                name: decision.pass.name().to_owned(),
                milliseconds: seconds.filter(|_| decision.runs).map(|s| s * 1e3),
                ran: decision.runs,
                reason: decision.reason.to_owned(),
            }
        })
        .collect()
}

/// Passes of a frame of which some ran in an earlier attempt already, and had nothing left to do in this one.
pub fn with_earlier(earlier: &[PassTime], passes: Vec<PassTime>) -> Vec<PassTime> {
    let of_earlier = |pass: &PassTime| {
        earlier.iter().find(|e| e.name == pass.name && e.ran && !pass.ran).cloned()
    };
    passes.into_iter().map(|pass| of_earlier(&pass).unwrap_or(pass)).collect()
}
