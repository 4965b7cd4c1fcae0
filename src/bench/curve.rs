//! Run time against error: presets, knobs and ray marchers in one scene.

use super::cases::{Case, FPS, Motion};
use super::errors::{
    OPACITY_OF_ALGORITHM, OPACITY_OF_MODEL, cut_picture, error, measured, of_exact, resized,
};
use super::front::{front, time_at};
use super::march::{March, MarchLight, MarchSettings};
use super::record::{Cost, Curve, PictureError, Point, PointKind, Spread};
use super::run::{Subject, frame};
use super::variants::Variant;
use crate::compare::Measured;
use crate::frame::composer::Composer;
use crate::frame::{Picture, Preset, RenderSettings};
use crate::gpu::{Gpu, ShaderLibrary};
use crate::medium::Truncation;
use crate::reference::{Window, exact_frame};
use crate::scene::Scene;
use crate::tables::TableSet;
use crate::{Error, Result};

/// Steps of the march that stands for infinitely many: what marches with sun rays are measured by
/// as algorithms.
const MARCH_LIMIT: u32 = 512;

/// What a curve is measured with.
pub struct Setup<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// The tables, with the scene's medium.
    pub tables: &'a TableSet,
    /// Those of variants that name others.
    pub more_tables: &'a [TableSet],
    /// Pixels.
    pub size: [u32; 2],
    /// Where errors of algorithms are measured: the exact compositor takes long.
    pub window: Window,
    /// Frames whose times are taken.
    pub frames: u32,
    /// Whether marches with sun rays are measured by their limit, which takes as long as many
    /// frames.
    pub march_limit: bool,
}

impl<'a> Setup<'a> {
    /// The tables of a variant.
    fn tables_of(&self, variant: &Variant) -> &'a TableSet {
        variant.tables.and_then(|index| self.more_tables.get(index)).unwrap_or(self.tables)
    }
}

/// A scene with what is known of its true picture at time 0.
pub struct Subjects<'a> {
    /// Name of the scene.
    pub name: &'a str,
    /// The scene.
    pub scene: &'a Scene,
    /// The path-traced picture, and how it was made.
    pub reference: Option<(String, Measured)>,
}

/// Measures all variants in one scene; `step` hears of each.
pub fn curve(
    setup: &Setup<'_>,
    subject: &Subjects<'_>,
    variants: &[Variant],
    step: &mut dyn FnMut(),
) -> Result<Curve> {
    let case = Case {
        name: subject.name.to_owned(),
        scene: subject.scene.clone(),
        motion: Motion::Animated,
    };
    let mut exacts: Vec<(Variant, Measured)> = Vec::new();
    let mut renderers: Vec<(Variant, Subject)> = Vec::new();
    let limit = match setup.march_limit {
        true => Some(march_limit(setup, &case, &mut renderers)?),
        false => None,
    };
    let mut points = Vec::new();
    for variant in variants {
        let renderer = renderer_for(setup, &case.scene, variant, &mut renderers)?;
        let size = variant.size(setup.size);
        let shown = shown(renderer, &case.scene, variant, size)?;
        let shown = resized(&shown, setup.size);
        let exposure = case.scene.exposure;
        let model = match &subject.reference {
            Some((_, truth)) => error(&shown, truth, OPACITY_OF_MODEL, exposure)?,
            None => None,
        };
        let by = match variant.kind {
            PointKind::March => limit.as_ref(),
            _ => Some(exact_for(setup, &case.scene, variant, renderer, &mut exacts)?),
        };
        let algorithm = match by {
            Some(by) => {
                error(&cut_picture(&shown, setup.window), by, OPACITY_OF_ALGORITHM, exposure)?
            }
            None => None,
        };
        let (wall_ms, cpu_ms) = times(renderer, &case, size, setup.frames)?;
        points.push(Point {
            name: variant.name.clone(),
            kind: variant.kind,
            wall_ms,
            cpu_ms,
            model,
            algorithm,
            on_model_front: false,
            on_algorithm_front: false,
        });
        step();
    }
    let cost = if setup.gpu.is_software() { Cost::Processor } else { Cost::Wall };
    let at = |of: fn(&Point) -> Option<PictureError>| {
        let place = |p: &Point| of(p).map(|e| [p.ms(cost), e.without_noise()]);
        front(&points.iter().map(place).collect::<Vec<_>>())
    };
    let (model, algorithm) = (at(|p| p.model), at(|p| p.algorithm));
    for ((point, model), algorithm) in points.iter_mut().zip(model).zip(algorithm) {
        (point.on_model_front, point.on_algorithm_front) = (model, algorithm);
    }
    let reference = subject.reference.as_ref().map(|(made, _)| made.clone());
    Ok(Curve { scene: subject.name.to_owned(), reference, cost, points })
}

/// The frame at time 0. What takes pixels over from frames before it has had those: its error is that of
/// a frame on its way.
fn shown(
    subject: &mut Subject,
    scene: &Scene,
    variant: &Variant,
    size: [u32; 2],
) -> Result<Picture> {
    let stride = variant.quality.pixel_stride;
    if stride > 1 {
        // Each pixel of a block was shaded once.
        for before in (1..=stride * stride).rev() {
            subject.renderer.frame(scene, -f64::from(before) / FPS, size)?;
        }
    }
    subject.renderer.render(scene, 0.0, size)
}

/// Times of the frames after the first.
fn times(
    subject: &mut Subject,
    case: &Case,
    size: [u32; 2],
    frames: u32,
) -> Result<(Spread, Spread)> {
    let (mut wall, mut cpu) = (Vec::new(), Vec::new());
    for index in 1..=frames.max(1) {
        let (_, times) = frame(&mut subject.renderer, case, size, index)?;
        wall.push(times.wall_ms);
        cpu.push(times.cpu_ms);
    }
    match (Spread::of(&wall), Spread::of(&cpu)) {
        (Some(wall), Some(cpu)) => Ok((wall, cpu)),
        _ => Err(Error::Failed("no frame was timed".to_owned())),
    }
}

/// A renderer for a variant. Those of one quality share it: what they take over from each other is
/// the light grid of time 0, which each would make alike.
fn renderer_for<'r>(
    setup: &Setup<'_>,
    scene: &Scene,
    variant: &Variant,
    renderers: &'r mut Vec<(Variant, Subject)>,
) -> Result<&'r mut Subject> {
    let shared = |made: &Variant| made.quality == variant.quality && made.tables == variant.tables;
    if !renderers.iter().any(|(made, _)| shared(made)) {
        // Each holds a hundred MiB: only that of the marches and knobs is wanted again.
        let high = Preset::High.quality();
        renderers.retain(|(made, _)| made.quality == high && made.tables.is_none());
        let settings = RenderSettings { quality: Some(variant.quality), ..Default::default() };
        let made =
            Subject::new(setup.gpu, setup.tables_of(variant), scene, &settings, &variant.name)?;
        renderers.push((variant.clone(), made));
    }
    let Some((_, subject)) = renderers.iter_mut().find(|(made, _)| shared(made)) else {
        return Err(Error::Failed("no renderer was made".to_owned()));
    };
    let march = variant
        .march
        .map(|march| march_pass(setup.gpu, scene, subject, march, variant.quality.tile));
    let composer = march.transpose()?.map(|march| Box::new(march) as Box<dyn Composer>);
    subject.renderer.compose_with(composer);
    Ok(subject)
}

/// A marcher for a subject's frames of a scene.
pub(super) fn march_pass(
    gpu: &Gpu,
    scene: &Scene,
    subject: &Subject,
    settings: MarchSettings,
    tile: u32,
) -> Result<March> {
    let library = ShaderLibrary::new()?;
    let mean_cosine = Truncation::new(&scene.medium.phase).moments[0];
    March::new(gpu, &library, subject.renderer.layouts(), settings, tile, mean_cosine)
}

/// The exact picture of what a renderer has just made, or one with the same light.
fn exact_for<'e>(
    setup: &Setup<'_>,
    scene: &Scene,
    variant: &Variant,
    subject: &Subject,
    exacts: &'e mut Vec<(Variant, Measured)>,
) -> Result<&'e Measured> {
    let known = exacts.iter().position(|(made, _)| made.lights_like(variant));
    let index = match known {
        Some(index) => index,
        None => {
            let (size, quality) = (setup.size, &variant.quality);
            let (renderer, window) = (&subject.renderer, setup.window);
            let tables = setup.tables_of(variant);
            let pixels = exact_frame(renderer, scene, tables, quality, size, window, &mut || {})?;
            exacts.push((variant.clone(), of_exact(window.size, &pixels)));
            exacts.len() - 1
        }
    };
    Ok(&exacts[index].1)
}

/// What marches with sun rays come to.
fn march_limit(
    setup: &Setup<'_>,
    case: &Case,
    renderers: &mut Vec<(Variant, Subject)>,
) -> Result<Measured> {
    let march = MarchSettings { light: MarchLight::SunRays, steps: MARCH_LIMIT };
    let high = Variant::preset(Preset::High, &[]);
    let variant = Variant { march: Some(march), kind: PointKind::March, ..high };
    let subject = renderer_for(setup, &case.scene, &variant, renderers)?;
    let picture: Picture = subject.renderer.render(&case.scene, case.frame(0).1, setup.size)?;
    let picture = cut_picture(&picture, setup.window);
    Ok(measured("limit of the march", picture.size, &picture.radiance))
}

impl Curve {
    /// How many times quicker a preset is than marching at equal error: the time at which marches
    /// of that kind come to the preset's error, over the preset's. None where no step count measured
    /// comes that far.
    pub fn speed_up(
        &self,
        preset: &str,
        kind: PointKind,
        of: fn(&Point) -> Option<PictureError>,
    ) -> Option<f64> {
        let point = self.points.iter().find(|p| p.kind == PointKind::Preset && p.name == preset)?;
        let place = |p: &Point| of(p).map(|e| [p.ms(self.cost), e.without_noise()]);
        let [time, error] = place(point)?;
        let marches: Vec<_> =
            self.points.iter().filter(|p| p.kind == kind).filter_map(place).collect();
        time_at(&marches, error).map(|marched| marched / time)
    }
}
