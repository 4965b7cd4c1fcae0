//! A whole bench: cases, curves, motion.

mod ratios;

use std::path::{Path, PathBuf};

use super::cases::{self, Case, FPS, Motion};
use super::clumps::ClumpOrder;
use super::compare::of_runs;
use super::curve::{Setup, Subjects, curve};
use super::errors::of_film;
use super::motion::{Instruments, WINDOW, motion};
use super::record::{Bench, Curve, Machine, Ratio, Run, SCHEMA, Settings};
use super::run::{Flight, Subject, fly};
use super::statistics::Draw;
use super::traced_flicker::Tracing;
use super::variants::{Setting, Variant, variants};
use crate::Result;
use crate::compare::Measured;
use crate::frame::{Preset, RenderSettings};
use crate::gpu::Gpu;
use crate::reference::{Exposure, Film, Filter, Window};
use crate::scene::Scene;
use crate::tables::TableSet;

/// The size of the references that are kept, pixels.
pub const REFERENCE_SIZE: [u32; 2] = [256, 144];
/// Name of tables of half as many nodes along each axis.
const THINNED: &str = "half_tables";
/// Frames that are timed for each point of a curve, at most: there are many points.
const MOST_CURVE_FRAMES: u32 = 8;

/// What to measure.
#[derive(Clone, Debug)]
pub struct Order {
    /// Scenes by name; none for the built-in cases.
    pub scenes: Vec<(String, Scene)>,
    /// The presets of the cases.
    pub presets: Vec<Preset>,
    /// A preset that takes turns with the first of `presets`.
    pub against: Option<Preset>,
    /// Numbers in place of the presets'.
    pub set: Vec<Setting>,
    /// Pixels and frames.
    pub flight: Flight,
    /// Only ratios of pairs of cases, and popping.
    pub ratios: bool,
    /// Only light among particles.
    pub clumps: Option<ClumpOrder>,
    /// Fewer points, one scene, and no limits that take long.
    pub quick: bool,
    /// Where path-traced references lie.
    pub references: PathBuf,
    /// Paths a pixel to trace references with that are not there.
    pub spp: Option<u32>,
    /// Pairs of paths a pixel to trace the flicker of references with that are not there.
    pub flicker_pairs: Option<u32>,
    /// The table file, or "embedded".
    pub tables: String,
    /// Further tables by name, each a point of run time against error.
    pub more_tables: Vec<(String, TableSet)>,
}

/// Hears of the work.
pub trait Listener {
    /// There will be so many steps.
    fn begin(&mut self, steps: u64, what: &'static str);
    /// One is done.
    fn step(&mut self);
}

impl Order {
    /// Pixels of what is measured by error: those of the references, or fewer.
    pub fn error_size(&self) -> [u32; 2] {
        let area = |s: [u32; 2]| u64::from(s[0]) * u64::from(s[1]);
        let asked = self.flight.size;
        if area(asked) < area(REFERENCE_SIZE) { asked } else { REFERENCE_SIZE }
    }

    fn cases(&self) -> Result<Vec<Case>> {
        if self.scenes.is_empty() {
            return cases::cases();
        }
        Ok(self.scenes.iter().flat_map(|(stem, scene)| cases::of_scene(scene, stem)).collect())
    }

    pub(super) fn curve_scenes(&self) -> Result<Vec<(String, Scene)>> {
        if !self.scenes.is_empty() {
            return Ok(self.scenes.clone());
        }
        let mut scenes = cases::scenes_with_references()?;
        if self.quick {
            scenes.truncate(1);
        }
        Ok(scenes)
    }

    /// Measures everything. `tables` hold what the scenes need.
    pub fn run(&self, gpu: &Gpu, tables: &TableSet, listener: &mut dyn Listener) -> Result<Bench> {
        let (mut runs, mut curves, mut motion, mut popping) = Default::default();
        let (mut against, mut clumps) = Default::default();
        if let Some(order) = &self.clumps {
            clumps = Some(self.clumps(order, gpu, tables, listener)?);
        } else if self.ratios {
            against = self.pairs(gpu, tables, listener)?;
            popping = self.popping(gpu, tables, listener)?;
        } else {
            (runs, against) = self.fly_cases(gpu, tables, listener)?;
            curves = self.curves(gpu, tables, listener)?;
            motion = self.motion(gpu, tables, listener)?;
        }
        Ok(Bench {
            schema: SCHEMA,
            machine: Machine::of(gpu),
            settings: Settings {
                size: self.flight.size,
                error_size: self.error_size(),
                warmup: self.flight.warmup,
                frames: self.flight.frames,
                fps: FPS,
                tables: self.tables.clone(),
                set: self.set.iter().map(Setting::to_string).collect(),
            },
            runs,
            curves,
            motion,
            against,
            popping,
            clumps,
        })
    }

    pub(super) fn subject(
        &self,
        gpu: &Gpu,
        tables: &TableSet,
        scene: &Scene,
        preset: Preset,
    ) -> Result<Subject> {
        let quality = Some(Variant::preset(preset, &self.set).quality);
        let settings = RenderSettings { preset, quality, ..Default::default() };
        Subject::new(gpu, tables, scene, &settings, preset.name())
    }

    fn fly_cases(
        &self,
        gpu: &Gpu,
        tables: &TableSet,
        listener: &mut dyn Listener,
    ) -> Result<(Vec<Run>, Vec<Ratio>)> {
        let cases = self.cases()?;
        let frames = 2 * (self.flight.frames + self.flight.warmup.max(1));
        let flights = cases.len() as u64 * self.presets.len() as u64;
        listener.begin(flights * u64::from(frames), "frames");
        let (mut runs, mut against) = (Vec::new(), Vec::new());
        for case in &cases {
            for (index, preset) in self.presets.iter().enumerate() {
                // With two of them in turn, each shows what the machine did to the other.
                let other = self.against.filter(|_| index == 0);
                let mut subjects = Vec::new();
                for preset in [Some(*preset), other].into_iter().flatten() {
                    subjects.push(self.subject(gpu, tables, &case.scene, preset)?);
                }
                let same = vec![case; subjects.len()];
                let found = fly(&same, &mut subjects, &self.flight, &mut || listener.step())?;
                if let [first, second] = &found[..] {
                    against.extend(of_runs(first, second, Draw::InPairs));
                }
                runs.extend(found);
            }
        }
        Ok((runs, against))
    }

    fn curves(
        &self,
        gpu: &Gpu,
        tables: &TableSet,
        listener: &mut dyn Listener,
    ) -> Result<Vec<Curve>> {
        let size = self.error_size();
        let scenes = self.curve_scenes()?;
        let (mut names, mut more_tables): (Vec<_>, Vec<_>) =
            self.more_tables.iter().cloned().unzip();
        if !self.quick {
            names.push(THINNED.to_owned());
            more_tables.push(tables.thinned()?);
        }
        let all = variants(self.quick, &self.set, &names);
        listener.begin((scenes.len() * all.len()) as u64, "points");
        let setup = Setup {
            gpu,
            tables,
            more_tables: &more_tables,
            size,
            window: if self.quick { Window::middle(size, WINDOW) } else { Window::whole(size) },
            frames: self.flight.frames.min(MOST_CURVE_FRAMES),
            march_limit: !self.quick,
        };
        let mut curves = Vec::new();
        for (name, scene) in &scenes {
            let reference = self.reference(name, scene, tables)?;
            let subject = Subjects { name, scene, reference };
            curves.push(curve(&setup, &subject, &all, &mut || listener.step())?);
        }
        Ok(curves)
    }

    /// The path-traced picture of a scene at time 0, with a word on where it is from.
    fn reference(
        &self,
        name: &str,
        scene: &Scene,
        tables: &TableSet,
    ) -> Result<Option<(String, Measured)>> {
        let size = self.error_size();
        let kept = self.references.join(format!("{name}.exr"));
        if kept.is_file() {
            let picture = Measured::read(&kept)?;
            if picture.size == size {
                return Ok(Some((file_name(&kept), picture)));
            }
        }
        let Some(spp) = self.spp else { return Ok(None) };
        let exposure = Exposure {
            size,
            time: 0.0,
            shutter: 0.0,
            lens: None,
            filter: Filter::Box,
            seed: 0,
            aim: None,
        };
        let mut film = Film::new(size);
        exposure.expose(scene, tables, &mut film, spp, |_| Ok(()))?;
        Ok(Some((format!("traced with {spp} paths a pixel"), of_film(&film))))
    }

    fn motion(
        &self,
        gpu: &Gpu,
        tables: &TableSet,
        listener: &mut dyn Listener,
    ) -> Result<Vec<super::record::Motion>> {
        let cases = self.cases()?;
        let moving = |case: &&Case| match case.motion {
            Motion::Flight(_) => true,
            Motion::Animated => !self.scenes.is_empty(),
            Motion::Paused => false,
        };
        let moving: Vec<_> = cases.iter().filter(moving).collect();
        listener.begin((moving.len() * self.presets.len()) as u64, "flights compared");
        let mut found = Vec::new();
        for case in moving {
            for preset in &self.presets {
                let mut subject = self.subject(gpu, tables, &case.scene, *preset)?;
                let quality = Variant::preset(*preset, &self.set).quality;
                let (folder, pairs) = (self.references.as_path(), self.flicker_pairs);
                let tracing = Tracing { tables, folder, pairs };
                let with = Instruments { tracing, quality, size: self.error_size() };
                found.extend(motion(case, &mut subject, &with, listener)?);
                listener.step();
            }
        }
        Ok(found)
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The tables with scattering for every scene of an order, and a check of the shapes they name.
pub fn tables_for(
    scenes: &[(String, Scene)],
    tables: TableSet,
    progress: &dyn crate::tables::Progress,
) -> Result<TableSet> {
    let mut tables = tables;
    let built_in = match scenes {
        [] => cases::scenes_with_references()?,
        _ => Vec::new(),
    };
    for (name, scene) in scenes.iter().chain(&built_in) {
        let names: Vec<String> = tables.shape_names().map(str::to_owned).collect();
        scene.check_shapes(name, &names.iter().map(String::as_str).collect::<Vec<_>>())?;
        let medium = &scene.medium;
        tables = tables.with_scattering_for(&medium.phase, medium.albedo, progress)?;
    }
    Ok(tables)
}
