//! Where the levels of the light grid lie.

use glam::DVec3;

use super::pass::DIRECTIONS;
use crate::frame::gpu_data::{GRID_LEVELS, GridLevel};
use crate::frame::rings;
use crate::scene::{CloudField, ParticleSpec};

/// Radius of a typical listed particle over the side of a cell. With 3 the error against the path
/// tracer is 0.4 % (relMSE) in a clump of optical thickness 30, with 2 it is 0.6, with 1 2.5.
const CELLS_PER_RADIUS: f64 = 2.5;
/// Cells along the longest axis of listed particles, at least: a few large particles have light and dark sides,
/// too.
const LEAST_ALONG: f64 = 32.0;
/// Most cells along an axis of a level.
const MOST_ALONG: f64 = 192.0;
/// Most cells of the finest level over listed particles.
const MOST_CELLS: f64 = 450_000.0;
/// Cells of the coarsest level over listed particles, along its longest axis: few enough for light
/// to cross it in a few steps.
const COARSEST_ALONG: f64 = 9.0;
/// Least number of cells of a field's level between base and top.
const LEAST_LAYERS: f64 = 6.0;

/// Words that a buffer of all lights may have: what WebGPU lets every device bind, 128 MiB.
const MOST_WORDS: u64 = (128 << 20) / 4;
/// By this the fineness goes down until the lights fit.
const COARSER: f64 = 0.93;

/// The levels of a grid, fine to coarse, and the point in the world that they are relative to.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    /// m.
    pub anchor: DVec3,
    /// The levels.
    pub levels: Vec<GridLevel>,
}

impl Levels {
    /// Lights that the solution keeps: of all cells, and what flows along the rows of slanted planes, of
    /// which there are up to twice as many as cells along a level.
    pub fn lights(&self) -> u32 {
        DIRECTIONS * (self.cells() + 2 * self.longest() * self.longest())
    }

    /// Columns of cells of all levels.
    pub fn columns(&self) -> u32 {
        self.levels.iter().map(|l| l.size[0] * l.size[2]).sum()
    }

    /// Cells of all levels.
    pub fn cells(&self) -> u32 {
        self.levels.last().map_or(0, |l| l.size[3] + l.size[0] * l.size[1] * l.size[2])
    }

    /// Cells along the axes of the levels, and the index of each one's first.
    pub fn sizes(&self) -> Vec<[u32; 4]> {
        self.levels.iter().map(|l| l.size).collect()
    }

    /// Most cells along an axis of a level.
    pub fn longest(&self) -> u32 {
        self.levels.iter().flat_map(|l| &l.size[..3]).copied().max().unwrap_or(0)
    }

    /// Size of the texture that holds all levels, one above the other.
    pub fn texture_size(&self) -> [u32; 3] {
        let most = |axis: usize| self.levels.iter().map(|l| l.size[axis]).max().unwrap_or(1);
        [most(0), most(1), self.levels.iter().map(|l| l.size[2]).sum::<u32>().max(1)]
    }

    fn push(&mut self, low: DVec3, cell: DVec3, cells: DVec3) {
        let first = self.cells();
        let slice: u32 = self.levels.iter().map(|l| l.size[2]).sum();
        let [x, y, z] = low.as_vec3().to_array();
        let [u, v, w] = cell.as_vec3().to_array();
        let [nx, ny, nz] = cells.to_array().map(|n| n as u32);
        self.levels.push(GridLevel {
            low: [x, y, z, slice as f32],
            cell: [u, v, w, 0.0],
            size: [nx, ny, nz, first],
        });
    }
}

/// Levels as fine as this, or less fine where their lights, of so many words each, are more than a
/// device must be able to bind.
/// In a medium that absorbs, lights have two words: there preset ultra gets the cells of high.
pub fn fitting(fineness: f64, words: u32, make: impl Fn(f64) -> Levels) -> Levels {
    let mut fineness = fineness;
    loop {
        let levels = make(fineness);
        if u64::from(words) * u64::from(levels.lights()) <= MOST_WORDS {
            return levels;
        }
        fineness *= COARSER;
    }
}

/// Levels for a cloud field: one for each ring, over all of it. `anchor` is the point of the ground
/// below the middle of the rings; `fineness` the side of a ring's cell over that of the grid's.
pub fn of_field(field: &CloudField, anchor: DVec3, fineness: f64) -> Levels {
    let mut result = Levels { anchor, levels: Vec::new() };
    for ring in 0..field.rings.min(GRID_LEVELS as u32) {
        let ring_cell = field.cell_size * f64::from(1u32 << ring);
        let reach = rings::reach(&CloudField { rings: ring + 1, ..field.clone() });
        let side = (ring_cell / fineness).max(2.0 * reach / MOST_ALONG);
        let half = (reach / side).ceil() + 1.0;
        let largest = field.particle_size * ring_cell;
        // Lowest and highest matter: particles may reach below the base by a quarter radius.
        let low = field.base - 0.5 * largest.min(field.thickness);
        let high = field.base + field.thickness + largest.min(field.thickness);
        let height = side.min(field.thickness / LEAST_LAYERS).max((high - low) / MOST_ALONG);
        let layers = ((high - low) / height).ceil().max(2.0);
        result.push(
            DVec3::new(-half * side, low, -half * side),
            DVec3::new(side, height, side),
            DVec3::new(2.0 * half, layers, 2.0 * half),
        );
    }
    result
}

/// Levels for listed particles: a box around all of them at finer and finer cells. None for no
/// particles.
pub fn of_list(particles: &[ParticleSpec], fineness: f64) -> Option<Levels> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (mut radii, mut weights) = (0.0, 0.0);
    for p in particles {
        low = low.min(p.centre - p.radius);
        high = high.max(p.centre + p.radius);
        // By cross-section: a few large ones among small ones are what is seen.
        radii += p.radius.powi(3);
        weights += p.radius.powi(2);
    }
    if particles.is_empty() {
        return None;
    }
    let size = (high - low).max(DVec3::splat(1e-3));
    let of_particle = radii / weights / CELLS_PER_RADIUS;
    let wanted = of_particle.min(size.max_element() / LEAST_ALONG) / fineness;
    let side = wanted
        .max(size.max_element() / MOST_ALONG)
        .max((size.x * size.y * size.z / MOST_CELLS).cbrt());
    let middle = 0.5 * (low + high);
    let mut result = Levels { anchor: middle, levels: Vec::new() };
    let mut cell = side;
    for _ in 0..GRID_LEVELS {
        // Half a cell around, so that matter does not touch the border.
        let cells = (size / cell).ceil() + 1.0;
        result.push(-0.5 * cell * cells, DVec3::splat(cell), cells);
        if cells.max_element() <= COARSEST_ALONG {
            break;
        }
        cell *= 2.0;
    }
    Some(result)
}
