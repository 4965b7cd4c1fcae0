//! Light among overlapping particles against path tracing: clumps (`layout`) and the scenes that ship, with the light grid,
//! by octaves, and each particle alone, in one run. References are kept (`traced`); `cost` is what the grid takes of a
//! frame, `table` how all of it is written.

mod cost;
mod layout;
pub mod table;
mod traced;

use std::path::PathBuf;

use super::cases::{Case, Motion};
use super::errors::{OPACITY_OF_MODEL, error, measured, of_film};
use super::record::{Clumps, Lit, LitCase, Spread};
use super::run::{Subject, timed};
use super::session::{Listener, Order};
use super::statistics::{Draw, ratio};
use super::variants::Variant;
use crate::compare::{Differences, Measured, compare};
use crate::frame::{Lighting, Picture, Preset, Quality, RenderSettings};
use crate::gpu::Gpu;
use crate::output::{write_atomically, write_picture};
use crate::reference::{Random, picture};
use crate::scene::{Medium, Scene};
use crate::tables::TableSet;
use crate::{Error, Result};
pub use layout::{Clump, PARTICLES, clumps};
use traced::Traced;

/// What of it to measure.
#[derive(Clone, Debug)]
pub struct ClumpOrder {
    /// Another seed is another layout.
    pub seed: u64,
    /// Only cases whose names hold one of these; all where there is none.
    pub only: Vec<String>,
    /// Where references and pictures go.
    pub folder: PathBuf,
    /// What tells this build of the program from others.
    pub program: String,
    /// Paths a pixel of references that are not there.
    pub spp: u32,
    /// Pixels of the frames in which the cost of light is measured, and how many; none: it is not.
    pub cost: Option<([u32; 2], u32)>,
}

/// A scene and where its reference is from.
struct Lightable {
    name: String,
    scene: Scene,
    /// A file that is kept; else it is traced.
    kept: Option<PathBuf>,
}

/// One renderer for each lighting, for scenes of one medium.
type Subjects = Vec<(Lighting, Subject)>;

impl ClumpOrder {
    fn is_asked(&self, name: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|part| name.contains(part))
    }

    fn cases(&self, order: &Order, tables: &TableSet) -> Result<Vec<Lightable>> {
        let clumps = clumps(tables, self.seed)?.into_iter().map(|clump| {
            let Clump { name, scene } = clump;
            Lightable { name, scene, kept: None }
        });
        let scenes = order.curve_scenes()?.into_iter().filter_map(|(name, scene)| {
            let kept = order.references.join(format!("{name}.exr"));
            kept.is_file().then_some(Lightable { name, scene, kept: Some(kept) })
        });
        let all: Vec<_> = clumps.chain(scenes).filter(|case| self.is_asked(&case.name)).collect();
        match all.is_empty() && self.cost.is_none() {
            true => Err(Error::input("--only", "no case has a name with that in it")),
            false => Ok(all),
        }
    }
}

impl Order {
    pub(super) fn clumps(
        &self,
        order: &ClumpOrder,
        gpu: &Gpu,
        tables: &TableSet,
        listener: &mut dyn Listener,
    ) -> Result<Clumps> {
        let traced = Traced {
            folder: &order.folder,
            program: &order.program,
            tables_name: &self.tables,
            tables,
            spp: order.spp,
        };
        let all = order.cases(self, tables)?;
        let mut subjects: Option<(Medium, Preset, Subjects)> = None;
        let mut cases = Vec::new();
        for case in all {
            let reference = match &case.kept {
                Some(file) => Measured::read(file)?,
                None => {
                    let text = case.scene.to_toml()?;
                    let file = order.folder.join(format!("{}.toml", case.name));
                    write_atomically(&file, |out| out.write_all(text.as_bytes()))?;
                    let film = traced.film(&case.name, &case.scene, self.flight.size, listener)?;
                    let file = order.folder.join(format!("{}-reference.exr", case.name));
                    film.layers().write(&file, false)?;
                    let shown = picture(&case.scene, film.size, film.radiance());
                    write_picture(
                        &order.folder.join(format!("{}-reference.png", case.name)),
                        &shown,
                    )?;
                    of_film(&film)
                }
            };
            for &preset in &self.presets {
                let medium = case.scene.medium;
                let (_, _, with) = match subjects.take().filter(|s| (s.0, s.1) == (medium, preset))
                {
                    Some(made) => subjects.insert(made),
                    None => {
                        let made = self.lit_subjects(gpu, tables, &case.scene, preset)?;
                        subjects.insert((medium, preset, made))
                    }
                };
                cases.extend(self.lit(order, &case, &reference, preset, with, listener)?);
            }
        }
        let cost = match order.cost {
            Some(frames) => Some(cost::cost(self, gpu, tables, frames, listener)?),
            None => None,
        };
        Ok(Clumps { seed: order.seed, cases, cost })
    }

    fn lit_subjects(
        &self,
        gpu: &Gpu,
        tables: &TableSet,
        scene: &Scene,
        preset: Preset,
    ) -> Result<Subjects> {
        let subject = |lighting: Lighting| {
            let quality = Variant::preset(preset, &self.set).quality;
            let quality = Some(Quality { lighting, ..quality });
            let settings = RenderSettings { preset, quality, ..Default::default() };
            let subject = Subject::new(gpu, tables, scene, &settings, preset.name())?;
            Ok((lighting, subject))
        };
        Lighting::ALL.into_iter().map(subject).collect()
    }

    /// Pictures and times of one case; none where no pixel has clouds.
    fn lit(
        &self,
        order: &ClumpOrder,
        case: &Lightable,
        reference: &Measured,
        preset: Preset,
        subjects: &mut Subjects,
        listener: &mut dyn Listener,
    ) -> Result<Option<LitCase>> {
        let (scene, size) = (&case.scene, reference.size);
        let still = Case { name: case.name.clone(), scene: scene.clone(), motion: Motion::Paused };
        let mut errors = Vec::new();
        let frames = self.flight.frames.max(1);
        listener.begin(u64::from(frames + 1), "frames in turn");
        for (lighting, subject) in subjects.iter_mut() {
            subject.renderer.forget();
            let shown = subject.renderer.render(scene, 0.0, size)?;
            for format in ["png", "exr"] {
                let file = format!("{}-{preset}-{lighting}.{format}", case.name);
                write_picture(&order.folder.join(file), &shown)?;
            }
            if let Some(found) = error(&shown, reference, OPACITY_OF_MODEL, scene.exposure)? {
                let noisy = with_noise(&shown, reference);
                let of_noise = error(&shown, &noisy, OPACITY_OF_MODEL, scene.exposure)?;
                errors.push((found, of_noise.map_or(0.0, |e| e.flip)));
            }
        }
        listener.step();
        if errors.len() < subjects.len() {
            return Ok(None);
        }
        let mut times = vec![[Vec::new(), Vec::new()]; subjects.len()];
        for _ in 0..frames {
            for ((_, subject), [wall, cpu]) in subjects.iter_mut().zip(&mut times) {
                subject.renderer.forget();
                let (scene, time) = still.frame(0);
                let (_, took) = timed(|| subject.renderer.frame(&scene, time, size))?;
                wall.push(took.wall_ms);
                cpu.push(took.cpu_ms);
            }
            listener.step();
        }
        let mut lit = Vec::new();
        for (((lighting, _), (error, flip_of_noise)), [wall, cpu]) in
            subjects.iter().zip(errors).zip(&times)
        {
            let none = || Error::Failed("no frame was timed".to_owned());
            lit.push(Lit {
                lighting: *lighting,
                error,
                rel_mse_without_noise: error.without_noise(),
                flip_of_noise,
                wall_ms: Spread::of(wall).ok_or_else(none)?,
                cpu_ms: Spread::of(cpu).ok_or_else(none)?,
            });
        }
        let of = |lighting| lit.iter().position(|l: &Lit| l.lighting == lighting);
        let (Some(grid), Some(alone)) = (of(Lighting::Grid), of(Lighting::Alone)) else {
            return Err(Error::Failed("a lighting is missing".to_owned()));
        };
        let others = (0..lit.len()).filter(|other| *other != grid);
        let ratios = others.flat_map(|other| {
            let name = format!("grid over {}", lit[other].lighting);
            ["wall", "cpu"].into_iter().enumerate().filter_map({
                let times = &times;
                move |(i, what)| {
                    ratio(&name, what, &times[other][i], &times[grid][i], Draw::InPairs)
                }
            })
        });
        Ok(Some(LitCase {
            case: case.name.clone(),
            preset: preset.name().to_owned(),
            size,
            reference: match &case.kept {
                Some(file) => file.display().to_string(),
                None => format!("{}.samples", case.name),
            },
            noise: noise(reference)?,
            alone_over_grid: lit[alone].rel_mse_without_noise / lit[grid].rel_mse_without_noise,
            times: ratios.collect(),
            lit,
        }))
    }
}

/// A picture with noise as large as a reference's standard errors, and the same opacity.
fn with_noise(shown: &Picture, reference: &Measured) -> Measured {
    let mut noisy = measured("noise", shown.size, &shown.radiance);
    noisy.opacity.clone_from(&reference.opacity);
    let mut random = Random::new(0, 0, 0);
    for (light, error) in noisy.light.iter_mut().zip(reference.standard_error.iter().flatten()) {
        // Box and Muller; a path's colours vary together.
        let far = (2.0 * random.exponential()).sqrt();
        *light += far * (std::f64::consts::TAU * random.unit()).cos() * *error;
    }
    noisy
}

/// Relative standard error of half of the pixels with clouds at most; none where it is not known.
fn noise(reference: &Measured) -> Result<Option<f64>> {
    let least_opacity = Some(OPACITY_OF_MODEL);
    let how = Differences { least_opacity, exposure: 0.0, most_z: 3.0 };
    Ok(compare(reference, reference, &how)?.noise.map(|noise| noise.median))
}
