//! The blend against its own look-ups alone: a kernel that does as many, at the same places, and nothing else. Both take
//! the blend's place in the same frames, in turn, and are timed as that pass.

use std::sync::Arc;

use super::cases::Case;
use super::record::Ratio;
use super::run::{Flight, Subject};
use super::statistics::{Draw, ratio};
use crate::frame::Quality;
use crate::frame::blend::{BlendInputs, BlendPass};
use crate::frame::composer::{ComposeInputs, Composer};
use crate::frame::plan::Pass;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::{Error, Result};

/// Invocations of a workgroup; as in the shader.
const WORKGROUP: u32 = 64;
/// Words of the streams' head, and streams; as in the shader.
const HEAD: usize = 8;
const STREAMS: usize = 4;
/// Words of a stream: all of them are within one binding.
const STREAM_WORDS: usize = 8_000_000;
/// Records of an invocation; as in the shader.
const RUN: u32 = 32;
/// Entry point and words of a record of each stream, as in the shaders.
const KINDS: [(&str, usize); STREAMS] =
    [("fetch_densities", 12), ("fetch_sun", 4), ("fetch_field", 4), ("fetch_sources", 8)];

/// The blend, noting where it looks things up.
struct Recorder {
    blend: BlendPass,
    records: wgpu::Buffer,
}

impl Composer for Recorder {
    fn unneeded(&self) -> &'static [Pass] {
        &[]
    }

    fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        inputs: &ComposeInputs<'_>,
        groups: [&wgpu::BindGroup; 3],
    ) {
        let resources = inputs.resources;
        let blend = BlendInputs {
            frame: &resources.frame,
            phase: inputs.phase,
            particles: &resources.particles,
            lights: &resources.particle_lights,
            lists: &resources.screen,
            shadow: inputs.shadow,
            opaque: &resources.opaque.distances,
            counts: &self.records,
        };
        let targets = &resources.targets;
        let bindings = self.blend.bind(gpu, &blend, [&targets.clouds, &targets.distance]);
        let [columns, rows] = resources.layout.size;
        self.blend.encode(gpu, pass, [columns, rows, 1], &bindings, &groups);
    }
}

/// The look-ups alone.
struct Fetches {
    kernel: Arc<Kernel>,
    records: wgpu::Buffer,
    sums: wgpu::Buffer,
    groups: [u32; STREAMS],
}

impl Composer for Fetches {
    fn unneeded(&self) -> &'static [Pass] {
        &[]
    }

    fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        inputs: &ComposeInputs<'_>,
        groups: [&wgpu::BindGroup; 3],
    ) {
        let shadow = inputs.shadow;
        let buffers =
            [&inputs.resources.frame, &self.records, &self.sums, &shadow.uniforms, &shadow.texels];
        let bindings = self.kernel.bind(gpu, &buffers.map(|b| b.as_entire_binding()));
        pass.set_bind_group(0, &bindings, &[]);
        for (index, group) in (1..).zip(groups) {
            pass.set_bind_group(index, group, &[]);
        }
        for ((name, _), groups) in KINDS.iter().zip(self.groups) {
            pass.set_pipeline(self.kernel.pipeline(name));
            pass.dispatch_workgroups(groups, 1, 1);
        }
    }
}

/// What is looked up in a case's first frame, and a kernel that looks it up again.
struct Replay {
    kernel: Arc<Kernel>,
    records: wgpu::Buffer,
    sums: wgpu::Buffer,
    /// By kind.
    counts: [u32; STREAMS],
}

impl Replay {
    /// Makes the frame. `room`: words of a stream.
    fn new(
        gpu: &Gpu,
        case: &Case,
        subject: &mut Subject,
        quality: &Quality,
        size: [u32; 2],
        room: usize,
    ) -> Result<Self> {
        let renderer = &mut subject.renderer;
        let library = ShaderLibrary::new()?;
        let layouts = renderer.layouts();
        let blend = BlendPass::recording(gpu, &library, quality, &layouts)?;
        let file = crate::shader_file!("bench/fetches.wgsl");
        let kernel = Arc::new(Kernel::new(gpu, &library, file, &[], &layouts)?);
        let records =
            buffers::storage(gpu, "records of fetches", HEAD + STREAMS * room, size_of::<u32>());
        let (scene, time) = case.frame(0);
        // Lists that are too short make a frame begin anew: the first one lets them grow.
        renderer.frame(&scene, time, size)?;
        renderer.compose_with(Some(Box::new(Recorder { blend, records: records.clone() })));
        renderer.frame(&scene, time, size)?;
        renderer.compose_with(None);
        let head: Vec<u32> = gpu.read_buffer(&records, HEAD)?;
        let mut counts = [0; STREAMS];
        counts.copy_from_slice(&head[HEAD - STREAMS..]);
        for ((name, words), count) in KINDS.iter().zip(counts) {
            if count as usize * words > room {
                return Err(Error::input(
                    "--size",
                    format!(
                        "{count} records for {name} pass their buffer, expected a smaller picture"
                    ),
                ));
            }
        }
        let most = groups(counts).into_iter().max().unwrap_or(0).max(1);
        let sums = buffers::storage(gpu, "sums", (most * WORKGROUP) as usize, size_of::<f32>());
        Ok(Self { kernel, records, sums, counts })
    }

    /// In the blend's place, for so many records of each kind.
    fn composer(&self, counts: [u32; STREAMS]) -> Box<dyn Composer> {
        let (kernel, records, sums) =
            (self.kernel.clone(), self.records.clone(), self.sums.clone());
        Box::new(Fetches { kernel, records, sums, groups: groups(counts) })
    }
}

fn groups(counts: [u32; STREAMS]) -> [u32; STREAMS] {
    counts.map(|count| count.div_ceil(RUN * WORKGROUP))
}

/// Times of a case's first frame: the blend over its look-ups alone, and how many records those were, by kind.
pub fn over_fetches(
    gpu: &Gpu,
    case: &Case,
    subject: &mut Subject,
    quality: &Quality,
    flight: &Flight,
) -> Result<(Option<Ratio>, [u32; STREAMS])> {
    let replay = Replay::new(gpu, case, subject, quality, flight.size, STREAM_WORDS)?;
    let renderer = &mut subject.renderer;
    let (scene, time) = case.frame(0);
    renderer.time_passes(true)?;
    let (mut alone, mut whole) = (Vec::new(), Vec::new());
    for index in 0..flight.warmup.max(1) + flight.frames {
        for fetches in [true, false] {
            renderer.compose_with(fetches.then(|| replay.composer(replay.counts)));
            let stats = renderer.frame(&scene, time, flight.size)?;
            let pass = stats.passes.iter().find(|pass| pass.name == Pass::Blend.name());
            if let (Some(ms), true) =
                (pass.and_then(|p| p.milliseconds), index >= flight.warmup.max(1))
            {
                if fetches { &mut alone } else { &mut whole }.push(ms);
            }
        }
    }
    renderer.compose_with(None);
    let name = format!("blend_over_its_fetches {} {}", case.name, subject.name);
    Ok((ratio(&name, Pass::Blend.name(), &alone, &whole, Draw::InPairs), replay.counts))
}

#[cfg(test)]
mod tests {
    use super::super::cases::{CUMULUS, Motion, built_in};
    use super::*;
    use crate::frame::{Preset, RenderSettings};
    use crate::tables::TableSet;

    /// Words of a stream that hold what the blend has found, as in the shaders: behind the place of the step, of the light
    /// field, and of the direction. What is found of the sun's depth is not what its texels hold.
    const FOUND: [Option<usize>; STREAMS] = [Some(7), None, Some(3), Some(7)];
    const ROOM: usize = 2_000_000;

    /// As many look-ups as the blend counts, and at their places what the blend has found there.
    #[test]
    fn look_ups_are_those_of_the_blend() {
        let tables = TableSet::embedded().expect("the built-in tables");
        let gpu = Gpu::headless().expect("an adapter");
        let scene = built_in("cumulus", CUMULUS).expect("built in");
        let mut quality = Preset::Low.quality();
        quality.grid.fineness *= 0.5;
        let settings = RenderSettings { quality: Some(quality), ..Default::default() };
        let mut subject = Subject::new(&gpu, &tables, &scene, &settings, "low").expect("made");
        let case = Case { name: "cumulus".to_owned(), scene, motion: Motion::Paused };
        let size = [97, 54];
        let replay =
            Replay::new(&gpu, &case, &mut subject, &quality, size, ROOM).expect("replayed");
        let (scene, time) = case.frame(0);
        let counted = subject.renderer.frame(&scene, time, size).expect("a frame").counters;
        let records: Vec<u32> =
            gpu.read_buffer(&replay.records, HEAD + STREAMS * ROOM).expect("records");
        let bins: u64 = (0..replay.counts[0] as usize)
            .map(|i| f32::from_bits(records[HEAD + 12 * i + 3]) as u32)
            .map(|mask| u64::from(mask.count_ones()))
            .sum();
        let sources = 2 * u64::from(replay.counts[3]);
        println!("{:?} records, {bins} densities of {}", replay.counts, counted.table_lookups);
        assert!(replay.counts.iter().all(|count| *count > 100), "{:?}", replay.counts);
        // Where a chord ends at a bin's border, rounding decides whether it touches the next one.
        let off = (bins + sources).abs_diff(counted.table_lookups);
        assert!(off * 1000 < counted.table_lookups, "{bins} and {sources} of {counted:?}");
        for (kind, (name, words)) in KINDS.into_iter().enumerate() {
            let mut counts = [0; STREAMS];
            counts[kind] = replay.counts[kind];
            subject.renderer.compose_with(Some(replay.composer(counts)));
            // The same place and time: another picture size makes it anew.
            subject.renderer.forget();
            subject.renderer.frame(&scene, time, size).expect("a frame");
            let invocations = counts[kind].div_ceil(RUN) as usize;
            let sums: Vec<f32> = gpu.read_buffer(&replay.sums, invocations).expect("sums");
            assert!(sums.iter().any(|sum| *sum > 0.0), "{name}");
            let Some(found) = FOUND[kind] else { continue };
            let first = HEAD + kind * ROOM;
            let of = |i: usize| f64::from(f32::from_bits(records[first + i * words + found]));
            let mut worst = 0.0f64;
            for (i, sum) in sums.iter().enumerate() {
                let own = i * RUN as usize..((i + 1) * RUN as usize).min(counts[kind] as usize);
                let wanted: f64 = own.map(of).sum();
                worst = worst.max((f64::from(*sum) - wanted).abs() / wanted.abs().max(1e-3));
            }
            println!("{name}: sums off by {worst:.1e}");
            assert!(worst < 1e-5, "{name}: {worst}");
        }
    }
}
