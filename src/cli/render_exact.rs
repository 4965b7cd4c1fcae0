//! `cumuli render --exact`: the frame's lighting, all else worked out exactly.

use glam::DVec3;
use rayon::prelude::*;

use super::engine;
use super::progress::Progress;
use super::render::{Job, RenderArgs};
use crate::error::{Error, Result};
use crate::frame::cpu::blend::ChordInputs;
use crate::frame::view::frame_uniforms;
use crate::output::Layers;
use crate::reference::{Exact, ExactPixel, Filter, View, picture};

/// What the channels mean.
const MEANING: &str = "R, G, B: linear Rec. 709 radiance, unit: solar irradiance per steradian, \
    clouds and all behind them; the frame's lighting, composed exactly. A: opacity of the clouds \
    alone, T: 1 - A; R, G, B are not multiplied by it.";

/// Runs the command.
pub(super) fn run(args: &RenderArgs) -> Result<()> {
    let files = args.truth.files(&args.out)?;
    let job = Job::new(args)?;
    let (mut renderer, tables) = engine::made(&job, args.tables.as_deref())?;
    let (scene, size) = (&job.scene, job.size);
    renderer.frame(scene, args.time, size)?;
    let (particles, lights) = renderer.particles()?;

    let medium = &scene.medium;
    let scattering = tables.scattering_for(&medium.phase, medium.albedo).ok_or_else(|| {
        Error::Failed(format!("the tables hold no scattering of {}", medium.phase))
    })?;
    let quality = job.settings.preset.quality();
    let mean_cosine = medium.phase.mean_cosine() as f32;
    let frame = frame_uniforms(scene, &scene.camera, size, mean_cosine, &quality, 0, true);
    let phase = medium.phase.prepare();
    let inputs = ChordInputs { frame: &frame, tables: &tables, scattering, phase };
    let exact = Exact::new(scene, inputs, particles, lights)?;

    let view = View::new(&scene.camera, size, None, Filter::Centre);
    let progress = Progress::new(u64::from(size[1]), "rows");
    let mut pixels: Vec<ExactPixel> = Vec::new();
    for y in 0..size[1] {
        let direction =
            |x: u32| -> DVec3 { view.ray([f64::from(x) + 0.5, f64::from(y) + 0.5], [0.0; 2]).dir };
        pixels.par_extend((0..size[0]).into_par_iter().map(|x| exact.pixel(direction(x))));
        progress.step(false);
    }
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
