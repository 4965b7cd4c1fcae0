//! The table of one shape.

use glam::DVec3;

use super::encoding::{UNUSED, pack, unpack};
use super::grid::{Grid, filtered};
use super::lookup::{ChordProfile, ChordStep};
use super::mapping::{ChordMapping, HemisphereDisc};
use super::measure::OpticalDepthErrors;
use super::volume::DensityVolume;
use crate::error::{Error, Result};
use crate::medium::ShapeSpec;

/// Fewest and most nodes along an axis: fewer is no table, more do not fit into a texture.
pub const NODES: std::ops::RangeInclusive<usize> = 4..=64;

/// What is known of the chords of one noise shape.
#[derive(Clone, Debug, PartialEq)]
pub struct OpticalDepthTable {
    spec: ShapeSpec,
    mean_density: f64,
    volumes: Vec<DensityVolume>,
    grid: Grid,
    texels: Vec<u32>,
    errors: OpticalDepthErrors,
}

impl OpticalDepthTable {
    /// A table from its parts; refused where they do not fit together.
    pub fn from_parts(
        spec: ShapeSpec,
        mean_density: f64,
        volume: DensityVolume,
        grid: Grid,
        texels: Vec<u32>,
        errors: OpticalDepthErrors,
    ) -> Result<Self> {
        let refuse =
            |message: String| Err(Error::input(format!("optical depth of {spec}"), message));
        if !grid.nodes.iter().all(|n| NODES.contains(n)) {
            return refuse(format!(
                "expected {} to {} nodes along each axis, found {:?}",
                NODES.start(),
                NODES.end(),
                grid.nodes
            ));
        }
        if texels.len() != grid.len() {
            return refuse(format!("expected {} values, found {}", grid.len(), texels.len()));
        }
        if texels.iter().any(|t| t & UNUSED != 0) {
            return refuse("the values are not three numbers of 10 bits each".to_owned());
        }
        if !(mean_density > 0.0 && mean_density <= 1.0) {
            return refuse(format!("expected a mean density in 0..1, found {mean_density}"));
        }
        Ok(Self { spec, mean_density, volumes: volume.with_copies(), grid, texels, errors })
    }

    /// The same with half as many nodes along each axis of the 4D table; the volume stays.
    pub(in crate::tables) fn thinned(&self) -> Result<Self> {
        let grid = Grid { nodes: self.grid.nodes.map(|n| n.div_ceil(2).max(*NODES.start())) };
        let texel = |node| unpack(self.texels.get(node).copied().unwrap_or_default());
        let texels = (0..grid.len()).map(|node| {
            let at = grid.place(node);
            pack(filtered(&self.grid, at, texel))
        });
        let table = Self { grid, texels: texels.collect(), ..self.clone() };
        let Self { spec, mean_density, texels, errors, .. } = table;
        let volume =
            self.volumes.first().cloned().ok_or_else(|| {
                Error::Failed(format!("the table of {spec} has no density volume"))
            })?;
        Self::from_parts(spec, mean_density, volume, grid, texels, errors)
    }

    /// Kind and seed of the shape.
    pub fn spec(&self) -> ShapeSpec {
        self.spec
    }

    /// Mean density over the volume of the unit sphere.
    pub fn mean_density(&self) -> f64 {
        self.mean_density
    }

    /// The density, and its filtered copies, each of half the nodes of the one before along each
    /// edge.
    pub fn volumes(&self) -> &[DensityVolume] {
        &self.volumes
    }

    /// Nodes along the axes of the 4D table: two of the place on the disc, two of the direction.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// The packed values of the 4D table, the first axis of the grid fastest.
    pub fn texels(&self) -> &[u32] {
        &self.texels
    }

    /// Errors against direct integration, measured when the table was baked.
    pub fn errors(&self) -> &OpticalDepthErrors {
        &self.errors
    }

    pub(super) fn set_errors(&mut self, errors: OpticalDepthErrors) {
        self.errors = errors;
    }

    /// The good answer for the chord between two points of the unit sphere, or that of a filtered
    /// copy of the density; 0 is the density itself.
    pub fn profile(&self, entry: DVec3, exit: DVec3, copy: usize) -> ChordProfile {
        let copy = copy.min(self.volumes.len() - 1);
        ChordProfile::march(&self.volumes[copy], entry.as_vec3(), exit.as_vec3())
    }

    /// Density at a place, or in a filtered copy.
    pub fn density(&self, place: DVec3, copy: usize) -> f64 {
        let copy = copy.min(self.volumes.len() - 1);
        self.volumes[copy].density(place.as_vec3()).into()
    }

    /// The quick answer, from the 4D table.
    pub fn step(&self, entry: DVec3, exit: DVec3) -> ChordStep {
        let place = HemisphereDisc.place(entry, exit);
        let channels = filtered(&self.grid, place.at, |node| {
            unpack(self.texels.get(node).copied().unwrap_or_default())
        });
        ChordStep::decode(channels, place.reversed)
    }
}
