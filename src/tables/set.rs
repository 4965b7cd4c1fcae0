//! All tables that a picture is made with.

use std::path::Path;

use glam::DVec3;

use super::defaults::{default_media, default_shapes};
use super::description::Description;
use super::optical_depth::bake::check_shape;
use super::optical_depth::{ChordProfile, ChordStep, OpticalDepthOptions, OpticalDepthTable};
use super::parts::Parts;
use super::progress::{Progress, Whole};
use super::scattering::{ScatteringOptions, ScatteringTable};
use super::{cache, file};
use crate::error::{Error, Result};
use crate::medium::{Phase, ShapeSpec};

/// The tables that are part of the program: what `precompute bake` makes without options.
const EMBEDDED: &[u8] = include_bytes!("../../assets/default_tables.safetensors");
/// Name of the shape that needs no table; it is always the first.
const UNIFORM: &str = "uniform";
/// How long one optical radius of a scattering table takes, in units of
/// [`OpticalDepthOptions::work`], about a second of two cores. Only the bar's estimate of the
/// remaining time hangs on it.
const WORK_OF_A_RADIUS: f64 = 0.5;

/// The optical depth of noise shapes, and light scattered in uniform spheres of some media.
#[derive(Clone, Debug, PartialEq)]
pub struct TableSet {
    optical_depth: Vec<OpticalDepthTable>,
    names: Vec<String>,
    options: OpticalDepthOptions,
    scattering: Vec<ScatteringTable>,
}

/// What to bake.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// Noise shapes, in the order of their indices from 1 on.
    pub shapes: Vec<ShapeSpec>,
    /// How their optical depth is computed.
    pub optical_depth: OpticalDepthOptions,
    /// Media: phase function and albedo.
    pub media: Vec<(Phase, f64)>,
    /// How light scattered in them is computed.
    pub scattering: ScatteringOptions,
}

impl Default for BakeOptions {
    /// What the built-in tables hold.
    fn default() -> Self {
        Self {
            shapes: default_shapes(),
            optical_depth: OpticalDepthOptions::default(),
            media: default_media(),
            scattering: ScatteringOptions::default(),
        }
    }
}

impl BakeOptions {
    /// Refuses before anything is computed what would be refused afterwards.
    fn check(&self) -> Result<()> {
        distinct(self.shapes.iter().map(ToString::to_string))?;
        distinct(self.media.iter().map(|(phase, albedo)| medium(phase, *albedo)))?;
        self.shapes.iter().try_for_each(|spec| check_shape(*spec))?;
        self.optical_depth.check()?;
        self.media.iter().try_for_each(|(phase, albedo)| {
            phase.check()?;
            self.scattering.check(*albedo)
        })
    }
}

/// A medium for people.
fn medium(phase: &Phase, albedo: f64) -> String {
    format!("{phase} with albedo {albedo}")
}

/// Refuses a name that occurs twice.
fn distinct(names: impl Iterator<Item = String>) -> Result<()> {
    let mut seen = Vec::new();
    for name in names {
        if seen.contains(&name) {
            return Err(Error::input("tables", format!("expected {name} once, found it twice")));
        }
        seen.push(name);
    }
    Ok(())
}

impl TableSet {
    /// The tables that are part of the program.
    pub fn embedded() -> Result<Self> {
        file::read(EMBEDDED, "the built-in tables")
    }

    /// Reads a table file; refused where it is damaged, foreign or of another format version.
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = file::bytes_of(path)?;
        file::read(&bytes, &path.display().to_string())
    }

    /// Reads the bytes of a table file; `place` names it in errors.
    pub fn from_bytes(bytes: &[u8], place: &str) -> Result<Self> {
        file::read(bytes, place)
    }

    /// Writes a table file, whole or not at all.
    pub fn save(&self, path: &Path) -> Result<()> {
        let bytes = file::write(self)?;
        // What cannot be read again is found out now, not when it is needed.
        file::read(&bytes, &path.display().to_string())?;
        crate::output::write_atomically(path, |out| out.write_all(&bytes))
    }

    /// Puts tables together; refused where two are of the same shape or medium, or of different
    /// resolutions.
    pub fn new(
        optical_depth: Vec<OpticalDepthTable>,
        options: OpticalDepthOptions,
        scattering: Vec<ScatteringTable>,
    ) -> Result<Self> {
        distinct(optical_depth.iter().map(|t| t.spec().to_string()))?;
        distinct(scattering.iter().map(|t| medium(t.phase(), t.albedo())))?;
        for table in &optical_depth {
            if table.grid() != optical_depth[0].grid() {
                return Err(Error::input(
                    format!("optical depth of {}", table.spec()),
                    format!(
                        "expected {:?} nodes as the first shape has, found {:?}",
                        optical_depth[0].grid().nodes,
                        table.grid().nodes
                    ),
                ));
            }
        }
        let names = std::iter::once(UNIFORM.to_owned())
            .chain(optical_depth.iter().map(|t| t.spec().to_string()))
            .collect();
        Ok(Self { optical_depth, names, options, scattering })
    }

    /// The same tables with half as many nodes along each of their four axes, taken from these: a sixteenth
    /// of the bytes. For measurements of what the tables' size is worth.
    pub fn thinned(&self) -> Result<Self> {
        let optical_depth: Result<_> = self.optical_depth.iter().map(|t| t.thinned()).collect();
        let scattering: Result<_> = self.scattering.iter().map(ScatteringTable::thinned).collect();
        Self::new(optical_depth?, self.options, scattering?)
    }

    /// Computes tables. The same options give the same bytes, whatever the number of threads.
    pub fn bake(options: &BakeOptions, progress: &dyn Progress) -> Result<Self> {
        Self::bake_parts(options, &Parts::none(options), progress)
    }

    /// Computes tables and writes them to a file, whole or not at all. Each table is kept beside
    /// the file as soon as it is done, until all are: killed at any moment, the same call goes on
    /// with what was done, and comes to the same bytes.
    pub fn bake_to(path: &Path, options: &BakeOptions, progress: &dyn Progress) -> Result<()> {
        let parts = Parts::beside(path, options);
        Self::bake_parts(options, &parts, progress)?.save(path)?;
        parts.remove();
        Ok(())
    }

    fn bake_parts(
        options: &BakeOptions,
        parts: &Parts<'_>,
        progress: &dyn Progress,
    ) -> Result<Self> {
        options.check()?;
        let kept_depth: Vec<_> =
            (0..options.shapes.len()).map(|i| parts.optical_depth(i)).collect();
        let kept_scattering: Vec<_> =
            (0..options.media.len()).map(|i| parts.scattering(i)).collect();
        let depth_work = options.optical_depth.work();
        let scattering_work = options.scattering.resolution[0] as f64 * WORK_OF_A_RADIUS;
        let work = |kept: bool, work: f64| if kept { 0.0 } else { work };
        let works = kept_depth
            .iter()
            .map(|kept| work(kept.is_some(), depth_work))
            .chain(kept_scattering.iter().map(|kept| work(kept.is_some(), scattering_work)));
        let progress = &Whole::new(progress, works.collect());
        let mut optical_depth = Vec::with_capacity(options.shapes.len());
        for (index, (spec, kept)) in options.shapes.iter().zip(kept_depth).enumerate() {
            progress.next();
            optical_depth.push(match kept {
                Some(table) => table,
                None => {
                    let table = OpticalDepthTable::bake(*spec, &options.optical_depth, progress)?;
                    parts.keep_optical_depth(index, &table);
                    table
                }
            });
        }
        let mut scattering = Vec::with_capacity(options.media.len());
        for (index, ((phase, albedo), kept)) in
            options.media.iter().zip(kept_scattering).enumerate()
        {
            progress.next();
            scattering.push(match kept {
                Some(table) => table,
                None => {
                    let table =
                        ScatteringTable::bake(*phase, *albedo, &options.scattering, progress)?;
                    parts.keep_scattering(index, &table);
                    table
                }
            });
        }
        Self::new(optical_depth, options.optical_depth, scattering)
    }

    /// The set with a scattering table of this medium: its own, the cached one of an earlier
    /// run, or one that is computed now, which takes some seconds.
    pub fn with_scattering_for(
        mut self,
        phase: &Phase,
        albedo: f64,
        progress: &dyn Progress,
    ) -> Result<Self> {
        if self.scattering_for(phase, albedo).is_none() {
            self.scattering.push(cache::scattering(phase, albedo, progress)?);
        }
        Ok(self)
    }

    /// The scattering table of a medium.
    pub fn scattering_for(&self, phase: &Phase, albedo: f64) -> Option<&ScatteringTable> {
        self.scattering.iter().find(|t| t.phase() == phase && t.albedo() == albedo)
    }

    /// All scattering tables.
    pub fn scattering(&self) -> &[ScatteringTable] {
        &self.scattering
    }

    /// The set as the device has it: all values rounded to what its textures hold.
    pub fn rounded(&self) -> Self {
        let scattering = self.scattering.iter().map(ScatteringTable::rounded).collect();
        Self { scattering, ..self.clone() }
    }

    /// The media that the set has scattering tables of, for people.
    pub fn media(&self) -> String {
        let media = self.scattering.iter().map(|t| medium(t.phase(), t.albedo()));
        let media: Vec<_> = media.collect();
        if media.is_empty() { "none".to_owned() } else { media.join(", ") }
    }

    /// Names of the shapes; the first is always `uniform`, which needs no table.
    pub fn shape_names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// Index of a shape by name.
    pub fn shape_index(&self, name: &str) -> Option<u32> {
        self.names.iter().position(|n| n == name).map(|i| i as u32)
    }

    /// Mean density of a shape over its unit sphere, 0..1; 0 where there is no such shape.
    pub fn mean_density(&self, shape: u32) -> f64 {
        match shape {
            0 => 1.0,
            _ => self.table(shape).map_or(0.0, OpticalDepthTable::mean_density),
        }
    }

    /// The best that the tables know of the chord between two points of the unit sphere, in the
    /// axes of the particle; the twin of `chord_profile` in the shader.
    pub fn chord_profile(&self, shape: u32, entry: DVec3, exit: DVec3) -> ChordProfile {
        let table = self.table(shape);
        table.map_or(ChordProfile::UNIFORM, |table| table.profile(entry, exit, 0))
    }

    /// The same from a filtered copy of the density: `optical_depth::volume::copy_for` says which.
    pub fn copied_profile(
        &self,
        shape: u32,
        entry: DVec3,
        exit: DVec3,
        copy: usize,
    ) -> ChordProfile {
        let table = self.table(shape);
        table.map_or(ChordProfile::UNIFORM, |table| table.profile(entry, exit, copy))
    }

    /// Density at a place in a shape, or in a filtered copy of it; the twin of `densities` in the
    /// shader.
    pub fn density(&self, shape: u32, place: DVec3, copy: usize) -> f64 {
        self.table(shape).map_or(1.0, |table| table.density(place, copy))
    }

    /// A quick answer for lines of light; the twin of `chord_step` in the shader.
    pub fn chord_step(&self, shape: u32, entry: DVec3, exit: DVec3) -> ChordStep {
        self.table(shape).map_or(ChordStep::UNIFORM, |table| table.step(entry, exit))
    }

    /// The tables of the noise shapes; shape 1 is the first.
    pub fn optical_depth(&self) -> &[OpticalDepthTable] {
        &self.optical_depth
    }

    /// How the tables of the noise shapes were computed.
    pub fn optical_depth_options(&self) -> &OpticalDepthOptions {
        &self.options
    }

    /// What the file says about itself.
    pub fn description(&self) -> Description {
        Description::of(self)
    }

    fn table(&self, shape: u32) -> Option<&OpticalDepthTable> {
        self.optical_depth.get((shape as usize).checked_sub(1)?)
    }
}
