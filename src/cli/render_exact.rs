//! `cumuli render --exact`: the frame's lighting, all else worked out exactly.

use super::engine;
use super::progress::Progress;
use super::render::{Job, RenderArgs};
use crate::error::Result;
use crate::output::Layers;
use crate::reference::{ExactPixel, Window, check_composed, exact_frame_before, picture};

/// What the channels mean.
const MEANING: &str = "R, G, B: linear Rec. 709 radiance, unit: solar irradiance per steradian, \
    clouds and all behind them; the frame's lighting, composed exactly. A: opacity of the clouds \
    alone, T: 1 - A; R, G, B are not multiplied by it.";

/// Runs the command.
pub(super) fn run(args: &RenderArgs) -> Result<()> {
    let files = args.truth.files(&args.out)?;
    let job = Job::new(args)?;
    check_composed(&job.scene)?;
    let (mut renderer, tables) = engine::made(&job, args.tables.as_deref())?;
    let (scene, size) = (&job.scene, job.size);
    renderer.frame(scene, args.time, size)?;
    let quality = job.settings.quality();
    let progress = Progress::new(u64::from(size[1]), "rows");
    let mut row = || progress.step(false);
    let window = Window::whole(size);
    let opaque = job.opaque.as_ref();
    let pixels =
        exact_frame_before(opaque, &renderer, scene, &tables, &quality, size, window, &mut row)?;
    progress.finish();
    let radiance = pixels
        .iter()
        .map(|p| p.radiance.as_vec3().extend((1.0 - p.transmittance) as f32).to_array())
        .collect();
    files.write(&layers(size, &pixels), &picture(scene, size, radiance))?;
    files.print()
}

fn layers(size: [u32; 2], pixels: &[ExactPixel]) -> Layers {
    let mut layers = Layers { size, comment: MEANING.to_owned(), ..Layers::default() };
    for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
        layers.add(name, pixels.iter().map(|p| p.radiance[axis] as f32));
    }
    layers.add("T", pixels.iter().map(|p| p.transmittance as f32));
    layers.add("A", pixels.iter().map(|p| (1.0 - p.transmittance) as f32));
    layers
}
