//! What light among particles takes of a frame that follows others, as in a window: the solution of the light grid comes in
//! steps then, a few a frame.

use crate::bench::cases::{CUMULUS, Case, Motion, built_in};
use crate::bench::compare::of_times;
use crate::bench::record::LightCost;
use crate::bench::run::{Flight, Subject, fly};
use crate::bench::session::{Listener, Order};
use crate::bench::statistics::Draw;
use crate::bench::variants::Variant;
use crate::frame::{Lighting, Pass, PassTime, Preset, Quality, RenderSettings};
use crate::gpu::Gpu;
use crate::tables::TableSet;
use crate::{Error, Result};

/// The passes that are there for it.
const LIGHT: [Pass; 3] = [Pass::LightGrid, Pass::LightField, Pass::Light];

/// Time of some passes, ms.
fn sum<'a>(passes: impl IntoIterator<Item = &'a PassTime>, of: impl Fn(&str) -> bool) -> f64 {
    passes.into_iter().filter(|p| of(&p.name)).filter_map(|p| p.milliseconds).sum()
}

fn is_light(name: &str) -> bool {
    LIGHT.iter().any(|pass| pass.name() == name)
}

/// In the clouds of the default scene, which move; at this size and over so many frames.
pub fn cost(
    order: &Order,
    gpu: &Gpu,
    tables: &TableSet,
    (size, frames): ([u32; 2], u32),
    listener: &mut dyn Listener,
) -> Result<LightCost> {
    let scene = built_in("cumulus", CUMULUS)?;
    let preset = order.presets.first().copied().unwrap_or(Preset::High);
    let quality = Variant::preset(preset, &order.set).quality;
    let case = Case { name: "cumulus".to_owned(), scene, motion: Motion::Animated };
    // The first frame solves for a draft of all of the grid.
    let flight = Flight { size, warmup: 2, frames };
    listener.begin(2 * u64::from(flight.warmup + frames), "frames for the cost of light");
    let streamed = |lighting: Lighting| {
        let quality = Some(Quality { lighting, ..quality });
        let settings = RenderSettings { preset, quality, live: true, ..Default::default() };
        Subject::new(gpu, tables, &case.scene, &settings, preset.name())
    };
    let mut subjects = [streamed(Lighting::Grid)?, streamed(Lighting::Octaves)?];
    let runs = fly(&[&case, &case], &mut subjects, &flight, &mut || listener.step())?;
    let [run, octaves] = &runs[..] else {
        return Err(Error::Failed("a pair of other than two".to_owned()));
    };
    let mut over_octaves = of_times("grid over octaves", octaves, run, Draw::InPairs);
    over_octaves.retain(|ratio| ["wall", "cpu"].contains(&ratio.what.as_str()));
    let passes = || run.frames.iter().flat_map(|frame| &frame.passes);
    let a_frame = |of: &dyn Fn(&str) -> bool| sum(passes(), of) / f64::from(frames.max(1));
    let frame_ms = a_frame(&|_| true);

    let mut subject = order.subject(gpu, tables, &case.scene, preset)?;
    // Twice: the first finds out how long the lists are.
    subject.renderer.frame(&case.scene, 0.0, size)?;
    subject.renderer.forget();
    subject.renderer.time_passes(true)?;
    let alone = subject.renderer.frame(&case.scene, 0.0, size)?.passes;
    Ok(LightCost {
        case: case.name.clone(),
        preset: preset.name().to_owned(),
        size,
        frames,
        passes_ms: LIGHT
            .into_iter()
            .map(|pass| (pass.name().to_owned(), a_frame(&|name| name == pass.name())))
            .collect(),
        frame_ms,
        share: a_frame(&is_light) / frame_ms,
        share_alone: sum(&alone, is_light) / sum(&alone, |_| true),
        over_octaves,
    })
}
