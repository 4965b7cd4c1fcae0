//! Finished tables of a bake that goes on.
//!
//! They lie in a folder beside the output, one table file each, until the whole is written. A bake
//! that was killed goes on with them when it is started again. The folder's name is made from
//! everything that decides the values, so parts of other options, or of another version of the
//! program, are never mixed in. Parts only save time: one that is damaged is computed anew, and
//! where none can be written or read, things go on without. Two bakes of the same output write the
//! same bytes to the same parts; whichever ends first takes the folder away, and the other one has
//! what it needs in memory.

use std::path::{Path, PathBuf};

use super::description::{FORMAT, SCATTERING_VERSION};
use super::fingerprint::Fingerprint;
use super::optical_depth::{OpticalDepthTable, encoding, mapping};
use super::scattering::ScatteringTable;
use super::{BakeOptions, TableSet};
use crate::error::Result;
use crate::medium::shape::FORMULA_VERSION;

/// Where the parts of a bake are.
pub(super) struct Parts<'a> {
    folder: Option<PathBuf>,
    options: &'a BakeOptions,
}

impl<'a> Parts<'a> {
    /// Nowhere: for bakes that nobody needs to interrupt.
    pub fn none(options: &'a BakeOptions) -> Self {
        Self { folder: None, options }
    }

    /// Beside the output, in `OUTPUT.part-HASH`.
    pub fn beside(output: &Path, options: &'a BakeOptions) -> Self {
        let mut hash = Fingerprint::default();
        let versions = (FORMAT, SCATTERING_VERSION, FORMULA_VERSION, env!("CARGO_PKG_VERSION"));
        let names = (mapping::NAME, encoding::NAME);
        hash.add(format!("{versions:?} {names:?} {options:?}").as_bytes());
        let mut name = output.file_name().unwrap_or_default().to_owned();
        name.push(format!(".part-{hash}"));
        Self { folder: Some(output.with_file_name(name)), options }
    }

    /// The finished optical depth table of the shape with this number.
    pub fn optical_depth(&self, index: usize) -> Option<OpticalDepthTable> {
        let set = self.load(index)?;
        let table = set.optical_depth().first()?;
        let fits = Some(&table.spec()) == self.options.shapes.get(index)
            && *set.optical_depth_options() == self.options.optical_depth;
        fits.then(|| table.clone())
    }

    /// The finished scattering table of the medium with this number.
    pub fn scattering(&self, index: usize) -> Option<ScatteringTable> {
        let set = self.load(self.options.shapes.len() + index)?;
        let (phase, albedo) = self.options.media.get(index)?;
        let table = set.scattering_for(phase, *albedo)?;
        let wanted = &self.options.scattering;
        let fits = table.resolution() == wanted.resolution
            && table.precision() == wanted.precision
            && table.optical_radius_range() == wanted.optical_radius;
        fits.then(|| table.clone())
    }

    /// Keeps a finished optical depth table.
    pub fn keep_optical_depth(&self, index: usize, table: &OpticalDepthTable) {
        let set = || TableSet::new(vec![table.clone()], self.options.optical_depth, Vec::new());
        self.keep(index, set);
    }

    /// Keeps a finished scattering table.
    pub fn keep_scattering(&self, index: usize, table: &ScatteringTable) {
        let set = || TableSet::new(Vec::new(), self.options.optical_depth, vec![table.clone()]);
        self.keep(self.options.shapes.len() + index, set);
    }

    /// Takes the folder away: the whole is written.
    pub fn remove(&self) {
        if let Some(folder) = &self.folder {
            // What another bake puts there meanwhile it takes away itself.
            let _ = std::fs::remove_dir_all(folder);
        }
    }

    fn path(&self, number: usize) -> Option<PathBuf> {
        let of = self.options.shapes.len() + self.options.media.len();
        let name = format!("{}-of-{of}.safetensors", number + 1);
        self.folder.as_ref().map(|folder| folder.join(name))
    }

    fn load(&self, number: usize) -> Option<TableSet> {
        let path = self.path(number).filter(|path| path.exists())?;
        TableSet::load(&path).inspect_err(|e| tracing::warn!("computed anew: {e}")).ok()
    }

    fn keep(&self, number: usize, set: impl FnOnce() -> Result<TableSet>) {
        let Some(path) = self.path(number) else { return };
        if let Err(e) = set().and_then(|set| set.save(&path)) {
            tracing::warn!("the part was not kept: {e}");
        }
    }
}
