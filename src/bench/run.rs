//! Makes frames and takes their times.

use std::time::Instant;

use cpu_time::ProcessTime;

use super::cases::Case;
use super::record::{Frame, PassSpread, Run, Spread};
use crate::frame::{Counters, FrameStats, Pass, PassTime, Picture, RenderSettings, Renderer};
use crate::gpu::Gpu;
use crate::scene::Scene;
use crate::tables::TableSet;
use crate::{Error, Result};

/// A renderer with what it is made for, and what making it took.
pub struct Subject {
    /// The renderer.
    pub renderer: Renderer,
    /// Its name in the records.
    pub name: String,
    /// Time of its making, shaders included, ms.
    pub start_ms: f64,
    /// Whether its frames take over what frames before them have made: pixels, steps of the light grid's solution.
    takes_over: bool,
}

impl Subject {
    /// Makes a renderer.
    pub fn new(
        gpu: &Gpu,
        tables: &TableSet,
        scene: &Scene,
        settings: &RenderSettings,
        name: &str,
    ) -> Result<Self> {
        let start = Instant::now();
        let renderer = Renderer::new(gpu, tables, scene, settings)?;
        gpu.wait()?;
        let start_ms = 1e3 * start.elapsed().as_secs_f64();
        let quality = settings.quality();
        let takes_over = quality.pixel_stride > 1 || quality.grid.slice > 0;
        Ok(Self { renderer, name: name.to_owned(), start_ms, takes_over })
    }
}

/// Times of a piece of work: wall, processor, ms.
#[derive(Clone, Copy, Debug, Default)]
pub struct Times {
    /// Elapsed.
    pub wall_ms: f64,
    /// Of all threads of the process.
    pub cpu_ms: f64,
}

/// Does something and takes its times.
pub fn timed<T>(work: impl FnOnce() -> Result<T>) -> Result<(T, Times)> {
    let (start, cpu) = (Instant::now(), ProcessTime::now());
    let done = work()?;
    let cpu_ms = 1e3 * cpu.elapsed().as_secs_f64();
    Ok((done, Times { wall_ms: 1e3 * start.elapsed().as_secs_f64(), cpu_ms }))
}

/// One frame of a case; it has been waited for, its counts are read back.
pub fn frame(
    renderer: &mut Renderer,
    case: &Case,
    size: [u32; 2],
    frame: u32,
) -> Result<(FrameStats, Times)> {
    let (scene, time) = case.frame(frame);
    timed(|| renderer.frame(&scene, time, size))
}

/// How many frames.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Pixels.
    pub size: [u32; 2],
    /// Frames before the first that counts, at least 1.
    pub warmup: u32,
    /// Frames that count.
    pub frames: u32,
}

/// Flies cases with a renderer each, frame by frame in turn: what the machine does meanwhile
/// meets them all alike. `step` hears of every frame.
///
/// Wall time is taken without timing passes, which on a software driver takes a wait for each; a
/// second flight over the same frames takes the times of the passes. As many cases as renderers are expected.
pub fn fly(
    cases: &[&Case],
    subjects: &mut [Subject],
    flight: &Flight,
    step: &mut dyn FnMut(),
) -> Result<Vec<Run>> {
    let all = flight.warmup.max(1) + flight.frames;
    let mut first = vec![0.0; subjects.len()];
    let mut frames: Vec<Vec<Frame>> = subjects.iter().map(|_| Vec::new()).collect();
    for timing in [false, true] {
        for (subject, frames) in subjects.iter_mut().zip(&frames) {
            // Light that served all frames of the first flight serves those of the second.
            if !timing || subject.takes_over || frames.iter().any(makes_light) {
                subject.renderer.forget();
            }
            subject.renderer.time_passes(timing)?;
        }
        for index in 0..all {
            for (at, subject) in subjects.iter_mut().enumerate() {
                let case = cases[at];
                let (stats, times) = frame(&mut subject.renderer, case, flight.size, index)?;
                if index == 0 && !timing {
                    first[at] = times.wall_ms;
                }
                let Some(place) = index.checked_sub(flight.warmup.max(1)) else { continue };
                match frames[at].get_mut(place as usize) {
                    Some(known) => add_passes(known, stats)?,
                    None => frames[at].push(record(index, case, stats, times)),
                }
            }
            step();
        }
    }
    subjects
        .iter()
        .zip(frames)
        .zip(first)
        .zip(cases)
        .map(|(((subject, frames), first_ms), case)| summed(case, subject, frames, first_ms))
        .collect()
}

/// Whether the light among clouds was made anew in a frame.
fn makes_light(frame: &Frame) -> bool {
    frame.passes.iter().any(|pass| pass.name == Pass::LightGrid.name() && pass.ran)
}

fn record(index: u32, case: &Case, stats: FrameStats, times: Times) -> Frame {
    Frame {
        frame: index,
        time: case.frame(index).1,
        wall_ms: times.wall_ms,
        cpu_ms: times.cpu_ms,
        passes: stats.passes,
        counters: stats.counters,
    }
}

/// Takes the passes' times from the second flight, which must have done the same work.
fn add_passes(frame: &mut Frame, stats: FrameStats) -> Result<()> {
    // Buffers that grew in the first flight are large from the second one's beginning.
    let Counters { bytes_resident, attempts, .. } = frame.counters;
    let counters = Counters { bytes_resident, attempts, ..stats.counters };
    let ran = |passes: &[PassTime]| {
        passes.iter().filter(|p| p.ran).map(|p| p.name.clone()).collect::<Vec<_>>()
    };
    let (first, second) = (ran(&frame.passes), ran(&stats.passes));
    if counters != frame.counters || first != second {
        let index = frame.frame;
        return Err(Error::Failed(format!(
            "frame {index} does other work when it is made again: {:?} {first:?}, then {counters:?} \
             {second:?}",
            frame.counters
        )));
    }
    frame.passes = stats.passes;
    Ok(())
}

fn summed(case: &Case, subject: &Subject, frames: Vec<Frame>, first_ms: f64) -> Result<Run> {
    let none = || Error::input("--frames", "expected at least one frame");
    let spread = |of: &dyn Fn(&Frame) -> f64| {
        Spread::of(&frames.iter().map(of).collect::<Vec<_>>()).ok_or_else(none)
    };
    let (wall_ms, cpu_ms) = (spread(&|f| f.wall_ms)?, spread(&|f| f.cpu_ms)?);
    let names: Vec<String> =
        frames.first().map_or_else(Vec::new, |f| f.passes.iter().map(|p| p.name.clone()).collect());
    let pass = |name: String| {
        let ran = || frames.iter().flat_map(|f| &f.passes).filter(|p| p.name == name && p.ran);
        let ms: Vec<f64> = ran().filter_map(|p| p.milliseconds).collect();
        PassSpread { ran: ran().count() as u32, ms: Spread::of(&ms), name }
    };
    let passes = names.into_iter().map(pass).collect();
    let (case, preset) = (case.name.clone(), subject.name.clone());
    Ok(Run { case, preset, start_ms: subject.start_ms, first_ms, frames, wall_ms, cpu_ms, passes })
}

/// One frame of a case with its picture, made as if there were none before it.
pub fn picture_alone(
    renderer: &mut Renderer,
    case: &Case,
    size: [u32; 2],
    frame: u32,
) -> Result<Picture> {
    renderer.forget();
    let (scene, time) = case.frame(frame);
    renderer.render(&scene, time, size)
}
