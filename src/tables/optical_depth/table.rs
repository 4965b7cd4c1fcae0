//! The table of one shape.

use glam::DVec3;

use super::encoding::UNUSED;
use super::grid::Grid;
use super::levels::{LEVELS, Level};
use super::lookup::{ChordProfile, ChordStep};
use super::measure::OpticalDepthErrors;
use super::volume::DensityVolume;
use crate::error::{Error, Result};
use crate::medium::ShapeSpec;

/// Fewest and most nodes along an axis: fewer is no table, more do not fit into a texture.
pub const NODES: std::ops::RangeInclusive<usize> = 4..=64;

/// Least radius in pixels at which a particle is marched through. Twin of the shader's constant.
pub const MARCH_PIXELS: f32 = 24.0;

/// What is known of the chords of one noise shape.
#[derive(Clone, Debug, PartialEq)]
pub struct OpticalDepthTable {
    spec: ShapeSpec,
    mean_density: f64,
    volume: DensityVolume,
    levels: Vec<Level>,
    errors: OpticalDepthErrors,
}

impl OpticalDepthTable {
    /// A table from its parts; refused where they do not fit together.
    pub fn from_parts(
        spec: ShapeSpec,
        mean_density: f64,
        volume: DensityVolume,
        table: Level,
        errors: OpticalDepthErrors,
    ) -> Result<Self> {
        let refuse =
            |message: String| Err(Error::input(format!("optical depth of {spec}"), message));
        let Level { grid, texels } = &table;
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
        let mut levels = vec![table];
        while levels.len() < LEVELS {
            let next = levels[levels.len() - 1].filtered();
            levels.push(next);
        }
        Ok(Self { spec, mean_density, volume, levels, errors })
    }

    /// Kind and seed of the shape.
    pub fn spec(&self) -> ShapeSpec {
        self.spec
    }

    /// Mean density over the volume of the unit sphere.
    pub fn mean_density(&self) -> f64 {
        self.mean_density
    }

    /// The density.
    pub fn volume(&self) -> &DensityVolume {
        &self.volume
    }

    /// The 4D table, and its filtered copies, each with half the nodes of the one before.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Nodes along the axes of the 4D table: two of the place on the disc, two of the direction.
    pub fn grid(&self) -> Grid {
        self.levels[0].grid
    }

    /// The packed values of the 4D table, the first axis of the grid fastest.
    pub fn texels(&self) -> &[u32] {
        &self.levels[0].texels
    }

    /// Errors against direct integration, measured when the table was baked.
    pub fn errors(&self) -> &OpticalDepthErrors {
        &self.errors
    }

    pub(super) fn set_errors(&mut self, errors: OpticalDepthErrors) {
        self.errors = errors;
    }

    /// The good answer for the chord between two points of the unit sphere.
    pub fn profile(&self, entry: DVec3, exit: DVec3) -> ChordProfile {
        ChordProfile::march(&self.volume, entry.as_vec3(), exit.as_vec3())
    }

    /// The quick answer, from the 4D table.
    pub fn step(&self, entry: DVec3, exit: DVec3) -> ChordStep {
        self.levels[0].step(entry, exit)
    }

    /// The answer for a particle of this radius on screen, in pixels.
    pub fn seen(&self, entry: DVec3, exit: DVec3, radius_pixels: f32) -> ChordProfile {
        if radius_pixels >= MARCH_PIXELS {
            return self.profile(entry, exit);
        }
        let coarse = |level: &&Level| radius_pixels <= level.most_pixels();
        let level = self.levels[1..].iter().rev().find(coarse).unwrap_or(&self.levels[0]);
        ChordProfile::of_step(&level.step(entry, exit))
    }
}
