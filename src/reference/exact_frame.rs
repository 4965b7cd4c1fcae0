//! The last frame of a renderer, composed exactly.

use glam::DVec3;
use rayon::prelude::*;

use super::exact::{Exact, ExactPixel, SunTruth};
use super::view::{Filter, View};
use crate::error::{Error, Result};
use crate::frame::cpu::segments::ChordInputs;
use crate::frame::opaque::OpaquePicture;
use crate::frame::view::frame_uniforms;
use crate::frame::{Quality, Renderer};
use crate::medium::{Halo, Truncation};
use crate::scene::Scene;
use crate::tables::TableSet;

/// A part of a picture, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Its upper left pixel.
    pub corner: [u32; 2],
    /// Its width and height.
    pub size: [u32; 2],
}

impl Window {
    /// A whole picture.
    pub fn whole(size: [u32; 2]) -> Self {
        Self { corner: [0, 0], size }
    }

    /// The middle of a picture: along both axes one of so many parts.
    pub fn middle(size: [u32; 2], parts: u32) -> Self {
        let parts = parts.max(1);
        Self {
            corner: size.map(|s| s * (parts - 1) / (2 * parts)),
            size: size.map(|s| (s / parts).max(1)),
        }
    }
}

/// Pixels of a window of the frame that the renderer has just made of this scene at this size, row by
/// row; `row` hears of each. `tables` and `quality` are those the renderer was made with.
pub fn exact_frame(
    renderer: &Renderer,
    scene: &Scene,
    tables: &TableSet,
    quality: &Quality,
    size: [u32; 2],
    window: Window,
    row: &mut dyn FnMut(),
) -> Result<Vec<ExactPixel>> {
    exact_frame_before(None, renderer, scene, tables, quality, size, window, row)
}

/// Refuses a scene that is not composed exactly.
pub fn check_composed(scene: &Scene) -> Result<()> {
    if scene.is_sea() {
        let message = "expected a plain ground, what a sea reflects is not composed exactly";
        return Err(Error::input("ground.kind", message));
    }
    Ok(())
}

/// The same of a frame with opaque things in it.
#[expect(clippy::too_many_arguments, reason = "everything a frame depends on")]
pub fn exact_frame_before(
    opaque: Option<&OpaquePicture>,
    renderer: &Renderer,
    scene: &Scene,
    tables: &TableSet,
    quality: &Quality,
    size: [u32; 2],
    window: Window,
    row: &mut dyn FnMut(),
) -> Result<Vec<ExactPixel>> {
    if !quality.lighting.has_grid() {
        let message =
            format!("expected grid, which is composed exactly, found {}", quality.lighting);
        return Err(Error::input("lighting", message));
    }
    check_composed(scene)?;
    let (particles, lights) = renderer.particles()?;
    let medium = &scene.medium;
    let scattering = tables.scattering_for(&medium.phase, medium.albedo).ok_or_else(|| {
        Error::Failed(format!("the tables hold no scattering of {}", medium.phase))
    })?;
    let truncation = Truncation::new(&medium.phase);
    let halo = Halo::new(&medium.phase, &truncation);
    let field = renderer.field()?;
    let shift = DVec3::ZERO; // the field brings its own
    let camera = &scene.camera;
    let frame = frame_uniforms(scene, camera, size, &truncation, shift, quality, 0, [true; 3]);
    let phase = medium.phase.prepare();
    let (frame, halo, field) = (&frame, &halo, &field);
    let truth = SunTruth::new(tables, &particles, scene.sun.direction)?;
    let sun_depth = &|point: DVec3| truth.depth(point);
    let inputs = ChordInputs { frame, tables, scattering, phase, halo, field, sun_depth };
    let exact = Exact::new(scene, inputs, particles, lights)?;

    let view = View::new(camera, size, None, Filter::Centre);
    let mut pixels: Vec<ExactPixel> = Vec::new();
    for y in 0..window.size[1] {
        let place =
            |x: u32| [x + window.corner[0], y + window.corner[1]].map(|v| f64::from(v) + 0.5);
        let direction = |x: u32| -> DVec3 { view.ray(place(x), [0.0; 2]).dir };
        let surface = |x: u32| {
            let row = (y + window.corner[1]) * size[0];
            opaque.and_then(|o| o.surface((row + x + window.corner[0]) as usize))
        };
        let pixel = |x: u32| exact.pixel_before(direction(x), surface(x));
        pixels.par_extend((0..window.size[0]).into_par_iter().map(pixel));
        row();
    }
    Ok(pixels)
}
