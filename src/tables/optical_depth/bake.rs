//! Computing a table: random chords in every cell, then least squares.

use glam::Vec4;
use serde::{Deserialize, Serialize};

use super::encoding::{encode, pack};
use super::fit::Target;
use super::grid::Grid;
use super::lookup::LEAST_EXTENT;
use super::mapping::HemisphereDisc;
use super::measure::{
    Answer, CENTRAL_DEPTHS, OpticalDepthErrors, central_matter, errors, test_chords,
};
use super::rays::{Draws, Ray, gather};
use super::table::OpticalDepthTable;
use super::volume::DensityVolume;
use crate::error::{Error, Result};
use crate::medium::{Shape, ShapeKind, ShapeSpec};
use crate::tables::progress::Progress;

/// How a table is computed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpticalDepthOptions {
    /// Nodes along each of the two axes of the disc (where the line passes the centre).
    pub disc: usize,
    /// Nodes along each of the two axes of the direction.
    pub direction: usize,
    /// Random chords in each cell.
    pub rays_per_cell: usize,
    /// Steps of conjugate gradients.
    pub iterations: usize,
    /// Seed of the random chords.
    pub seed: u64,
}

impl Default for OpticalDepthOptions {
    /// 0.9 MiB a shape; the ratio of the two resolutions is the best of five at equal bytes, and
    /// twice the rays would gain 2 %.
    fn default() -> Self {
        Self { disc: 30, direction: 16, rays_per_cell: 12, iterations: 10, seed: 1 }
    }
}

/// Chords on which a finished table is measured. The RMS error is then known to 1 %.
const TEST_CHORDS: usize = 40_000;
/// Seed of those chords, apart from all seeds of bakes.
const TEST_SEED: u64 = 0x7465_7374;
/// Weight of a chord that is opaque or empty at every depth of interest: keeps the solution
/// defined where nothing else does.
const LEAST_WEIGHT: f32 = 1e-4;
/// Chords are integrated in 1.3 s where ten steps of the solution take 0.7 s.
const ROWS_SHARE: usize = 20;
/// Rays per cell that are worth it, and that fit into memory.
const RAYS: std::ops::RangeInclusive<usize> = 1..=256;

impl OpticalDepthOptions {
    /// How long a table takes, in seconds of two cores, roughly: 0.37 microseconds a chord and 0.02
    /// for each step of its solution.
    pub(crate) fn work(&self) -> f64 {
        let chords = (self.disc * self.direction).pow(2) * self.rays_per_cell;
        chords as f64 * (3.7e-7 + 2e-8 * self.iterations as f64)
    }

    /// Whether a table can be baked so; its grid.
    pub(crate) fn check(&self) -> Result<Grid> {
        let nodes = super::table::NODES;
        let fields = [
            ("nodes of the disc", self.disc, nodes.clone()),
            ("nodes of the direction", self.direction, nodes),
            ("rays per cell", self.rays_per_cell, RAYS),
            ("iterations", self.iterations, 0..=1000),
        ];
        for (what, value, range) in fields {
            if !range.contains(&value) {
                let (least, most) = (range.start(), range.end());
                return Err(Error::input(
                    what,
                    format!("expected a number from {least} to {most}, found {value}"),
                ));
            }
        }
        Ok(Grid { nodes: [self.disc, self.disc, self.direction, self.direction] })
    }
}

/// Whether a shape has a table.
pub(crate) fn check_shape(spec: ShapeSpec) -> Result<()> {
    if spec.kind == ShapeKind::Uniform {
        return Err(Error::input(
            "shape uniform",
            "expected a noise shape: the uniform one is exact without a table",
        ));
    }
    Ok(())
}

/// How much errors of a chord's channels matter: the squared derivative of transmittance by each,
/// summed over the optical depths of interest. Each is divided by its depth^3/4, which keeps the
/// deep ones from outweighing the others.
pub(super) fn weight(ray: &Ray, value: Vec4, central_matter: f32) -> Vec4 {
    let mean = ray.density.mean;
    let (mut whole, mut parts) = (0.0, 0.0);
    for depth in CENTRAL_DEPTHS {
        let (depth, length) = (depth as f32, ray.length);
        let scale = depth / central_matter * length;
        let share = depth.powf(-0.75);
        whole += (share * scale * (-scale * mean).exp()).powi(2);
        // Moving a chord's matter by its extent moves it into a part or out of it.
        parts += (share * scale * mean * (-0.5 * scale * mean).exp()).powi(2);
    }
    whole += LEAST_WEIGHT * ray.length * ray.length;
    let extent = (value.z - value.y).max(LEAST_EXTENT);
    let moved = parts / (extent * extent);
    Vec4::new(whole, moved, moved, 0.0) * ray.measure
}

/// The channels of the nodes before they are rounded to texels.
pub(super) fn fitted(
    shape: &Shape,
    central_matter: f64,
    grid: Grid,
    options: &OpticalDepthOptions,
    progress: &dyn Progress,
) -> Vec<Vec4> {
    let encode_ray = |ray: &Ray| {
        let value = encode(&ray.density);
        Target { value, weight: weight(ray, value, central_matter as f32) }
    };
    let draws = Draws { grid, per_cell: options.rays_per_cell, seed: options.seed };
    // A step of the solution takes about as long as this many rows of chords.
    let rows = (draws.rows() / ROWS_SHARE) as u64;
    let steps = draws.rows() as u64 + rows * options.iterations as u64;
    progress.start(steps, &format!("optical depth of {}", shape.spec()));
    let samples = gather(shape, &HemisphereDisc, &draws, encode_ray, progress);
    samples.fit(options.iterations, || progress.advance(rows))
}

impl OpticalDepthTable {
    /// Computes the table of a shape and measures its errors. The bytes depend on shape and
    /// options only, not on the number of threads.
    pub fn bake(
        spec: ShapeSpec,
        options: &OpticalDepthOptions,
        progress: &dyn Progress,
    ) -> Result<Self> {
        check_shape(spec)?;
        let grid = options.check()?;
        let shape = Shape::new(spec);
        let central = central_matter(&shape);
        let channels = fitted(&shape, central, grid, options, progress);
        let texels = channels.into_iter().map(pack).collect();
        let (mean, volume) = (shape.mean_density(), DensityVolume::of(&shape));
        let mut table = Self::from_parts(spec, mean, volume, grid, texels, Default::default())?;
        let chords = test_chords(&shape, TEST_CHORDS, TEST_SEED);
        table.set_errors(OpticalDepthErrors {
            rays: TEST_CHORDS as u64,
            depths: errors(&chords, central, |c| Answer::of(&table.profile(c.entry, c.exit, 0), c)),
            table: errors(&chords, central, |c| Answer::of_step(&table.step(c.entry, c.exit), c)),
        });
        Ok(table)
    }
}
