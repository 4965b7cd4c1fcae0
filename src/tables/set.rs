//! All tables that a picture is made with.

use std::path::Path;

use super::description::Description;
use super::file;
use super::optical_depth::{ChordProfile, OpticalDepthOptions, OpticalDepthTable};
use super::progress::Progress;
use crate::error::{Error, Result};
use crate::medium::ShapeSpec;

/// The tables that are part of the program: what `precompute bake` makes without options.
const EMBEDDED: &[u8] = include_bytes!("../../assets/default_tables.safetensors");
/// Name of the shape that needs no table; it is always the first.
const UNIFORM: &str = "uniform";

/// The optical depth of noise shapes, and light scattered in uniform spheres of some media.
#[derive(Clone, Debug, PartialEq)]
pub struct TableSet {
    optical_depth: Vec<OpticalDepthTable>,
    names: Vec<String>,
    options: OpticalDepthOptions,
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

    /// Writes a table file, whole or not at all.
    pub fn save(&self, path: &Path) -> Result<()> {
        let bytes = file::write(self)?;
        crate::output::write_atomically(path, |out| out.write_all(&bytes))
    }

    /// Puts tables together; refused where two are of the same shape, or of different resolutions.
    pub fn new(
        optical_depth: Vec<OpticalDepthTable>,
        options: OpticalDepthOptions,
    ) -> Result<Self> {
        for (i, table) in optical_depth.iter().enumerate() {
            if optical_depth[..i].iter().any(|other| other.spec() == table.spec()) {
                return Err(Error::input(
                    "tables",
                    format!("expected each shape once, found {} twice", table.spec()),
                ));
            }
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
        Ok(Self { optical_depth, names, options })
    }

    /// Computes tables of these noise shapes.
    pub fn bake(
        shapes: &[ShapeSpec],
        options: &OpticalDepthOptions,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let tables: Result<Vec<_>> =
            shapes.iter().map(|spec| OpticalDepthTable::bake(*spec, options, progress)).collect();
        Self::new(tables?, *options)
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

    /// What the tables know of the chord between two points of the unit sphere, in the axes of
    /// the particle; the twin of `chord_profile` in the shader.
    pub fn chord_profile(&self, shape: u32, entry: glam::DVec3, exit: glam::DVec3) -> ChordProfile {
        match self.table(shape) {
            Some(table) => table.profile(entry, exit),
            None => ChordProfile::UNIFORM,
        }
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
