//! Particles in a grid of two levels: cells, and where there are particles smaller than these, a
//! finer grid in each. A fine cell knows the particles with matter in it, a lower and an upper
//! bound of their summed extinction, and the part of that which is the same all over the cell.

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::Arc;

use glam::{DVec3, IVec3};
use rayon::prelude::*;

use super::bounds::{DensityBounds, Range};
use super::geometry::{Medium, Piece, Ray};
use super::particles::WorldParticle;
use super::walk::Cells;
use crate::medium::Shape;

/// Cells per particle that are aimed at.
const CELLS_PER_PARTICLE: f64 = 32.0;
/// Most cells in all, and most fine cells: their lists then fill a few hundred megabytes.
const MOST_CELLS: f64 = (1 << 22) as f64;
/// Most cells along one axis.
const MOST_ALONG: f64 = 1024.0;
/// Size of a fine cell over the radius of the smallest particle in it, if there is room.
const FINE_SIZE: f64 = 0.5;
/// Most fine cells along one axis of a cell.
const MOST_FINE: i32 = 16;
/// Particles sorted into cells at a time.
const BATCH: usize = 1 << 12;
/// Rounding to f32 must not lower an upper bound or raise a lower one.
const ROUNDING: f64 = 1e-6;

/// Where the fine cells of a cell are.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    first: u32,
    /// Along each axis; 0 where there is nothing.
    side: i32,
}

/// What of a particle is needed first, close together.
#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: DVec3,
    radius_squared: f64,
}

/// A particle's part in a fine cell.
struct Part {
    cell: u32,
    range: Range,
}

/// The particles of a scene, ready for light.
pub struct ParticleGrid {
    particles: Vec<WorldParticle>,
    balls: Vec<Ball>,
    cells: Cells,
    blocks: Vec<Block>,
    /// Where a fine cell's list begins; one more than there are cells.
    begins: Vec<u32>,
    /// Where those on the list begin that fill the whole cell evenly.
    evens: Vec<u32>,
    members: Vec<u32>,
    minorants: Vec<f32>,
    majorants: Vec<f32>,
    /// 1/m, of particles that fill the whole fine cell evenly.
    constants: Vec<f64>,
}

impl ParticleGrid {
    /// Sorts the particles into cells. Those without matter are left out.
    pub fn new(mut particles: Vec<WorldParticle>) -> Self {
        particles.retain(WorldParticle::has_matter);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in &particles {
            low = low.min(p.centre - p.radius);
            high = high.max(p.centre + p.radius);
        }
        if particles.is_empty() {
            (low, high) = (DVec3::ZERO, DVec3::ONE);
        }
        let size = (high - low).max(DVec3::splat(1e-6));
        let wanted = (particles.len() as f64 * CELLS_PER_PARTICLE).clamp(1.0, MOST_CELLS);
        let side = (size.x * size.y * size.z / wanted).cbrt();
        let count = (size / side).ceil().clamp(DVec3::ONE, DVec3::splat(MOST_ALONG)).as_ivec3();
        let cells = Cells::new(low, size, count);
        let balls = particles
            .iter()
            .map(|p| Ball { centre: p.centre, radius_squared: p.radius * p.radius })
            .collect();
        let mut grid = Self {
            blocks: vec![Block::default(); (count.x * count.y * count.z) as usize],
            particles,
            balls,
            cells,
            begins: Vec::new(),
            evens: Vec::new(),
            members: Vec::new(),
            minorants: Vec::new(),
            majorants: Vec::new(),
            constants: Vec::new(),
        };
        let fine = grid.divide();
        grid.fill(fine);
        grid
    }

    /// The particles.
    pub fn particles(&self) -> &[WorldParticle] {
        &self.particles
    }

    /// Indices of the particles whose matter a ray may meet before `limit` (m), each once.
    pub fn along(&self, ray: &Ray, limit: f64, found: &mut Vec<u32>) {
        found.clear();
        self.pieces(ray, limit, &mut |piece| {
            let list = self.begins[piece.cell] as usize..self.begins[piece.cell + 1] as usize;
            found.extend_from_slice(&self.members[list]);
            ControlFlow::Continue(())
        });
        found.sort_unstable();
        found.dedup();
    }

    /// The fine cells of a cell.
    fn fine(&self, c: IVec3, side: i32) -> Cells {
        let split = f64::from(side);
        Cells {
            low: self.cells.corner(c),
            cell: self.cells.cell / split,
            inverse: self.cells.inverse * split,
            count: IVec3::splat(side),
        }
    }

    /// Calls `f` with every cell of a box that a particle's ball reaches into.
    fn touched(cells: &Cells, particle: &WorldParticle, mut f: impl FnMut(IVec3)) {
        let first = cells.at(particle.centre - particle.radius);
        let end = cells.at(particle.centre + particle.radius);
        for z in first.z..=end.z {
            for y in first.y..=end.y {
                for x in first.x..=end.x {
                    let c = IVec3::new(x, y, z);
                    let low = cells.corner(c);
                    let nearest = particle.centre.clamp(low, low + cells.cell);
                    if nearest.distance_squared(particle.centre) <= particle.radius.powi(2) {
                        f(c);
                    }
                }
            }
        }
    }

    /// Decides how finely each cell is divided; returns the number of fine cells.
    fn divide(&mut self) -> usize {
        let mut smallest = vec![f64::INFINITY; self.blocks.len()];
        for particle in &self.particles {
            Self::touched(&self.cells, particle, |c| {
                let least = &mut smallest[self.cells.index(c)];
                *least = least.min(particle.radius);
            });
        }
        let size = self.cells.cell.max_element();
        let side = |least: f64, fine: f64| match least.is_finite() {
            true => ((size / (fine * least)).ceil() as i32).clamp(1, MOST_FINE),
            false => 0,
        };
        let count = |fine: f64| -> f64 {
            smallest.iter().map(|least| f64::from(side(*least, fine)).powi(3)).sum()
        };
        let mut fine = FINE_SIZE;
        // Ends with one fine cell a cell, of which there are not too many.
        while count(fine) > MOST_CELLS {
            fine *= 1.25;
        }
        let mut first = 0;
        for (block, least) in self.blocks.iter_mut().zip(&smallest) {
            let side = side(*least, fine);
            *block = Block { first, side };
            first += (side * side * side) as u32;
        }
        first as usize
    }

    /// The fine cells that hold matter of a particle.
    fn parts(&self, particle: &WorldParticle, bounds: &DensityBounds) -> Vec<Part> {
        let mut parts = Vec::new();
        Self::touched(&self.cells, particle, |c| {
            let block = self.blocks[self.cells.index(c)];
            let fine = self.fine(c, block.side);
            // Of the ball around a fine cell, in radii of the particle.
            let reach = 0.5 * fine.cell.length() / particle.radius;
            Self::touched(&fine, particle, |f| {
                let middle = fine.corner(f) + 0.5 * fine.cell;
                let own = particle.to_own * ((middle - particle.centre) / particle.radius);
                let range = bounds.within(own, reach);
                if range.high > 0.0 {
                    parts.push(Part { cell: block.first + fine.index(f) as u32, range });
                }
            });
        });
        parts
    }

    /// Makes the lists and the bounds.
    fn fill(&mut self, count: usize) {
        let mut bounds: HashMap<*const Shape, Arc<DensityBounds>> = HashMap::new();
        let of: Vec<_> = self
            .particles
            .iter()
            .map(|p| {
                let made = || Arc::new(DensityBounds::new(&p.shape));
                bounds.entry(Arc::as_ptr(&p.shape)).or_insert_with(made).clone()
            })
            .collect();
        let (mut low, mut high) = (vec![0.0f64; count], vec![0.0f64; count]);
        self.constants = vec![0.0; count];
        let mut lists = [vec![0u32; count], vec![0u32; count]];
        // Cell, particle, and whether it fills the cell evenly, in the order of the particles.
        let mut entries: Vec<(u32, u32, bool)> = Vec::new();
        for first in (0..self.particles.len()).step_by(BATCH) {
            let batch = first..(first + BATCH).min(self.particles.len());
            let parts: Vec<_> = batch
                .clone()
                .into_par_iter()
                .map(|i| self.parts(&self.particles[i], &of[i]))
                .collect();
            for (i, part) in batch.zip(&parts).flat_map(|(i, p)| p.iter().map(move |p| (i, p))) {
                let (cell, extinction) = (part.cell as usize, self.particles[i].extinction);
                let even = part.range.low == part.range.high;
                low[cell] += extinction * f64::from(part.range.low);
                high[cell] += extinction * f64::from(part.range.high);
                if even {
                    self.constants[cell] += extinction * f64::from(part.range.low);
                }
                lists[usize::from(even)][cell] += 1;
                entries.push((part.cell, i as u32, even));
            }
        }
        self.minorants = low.iter().map(|m| (m * (1.0 - ROUNDING)) as f32).collect();
        self.majorants = high.iter().map(|m| (m * (1.0 + ROUNDING)) as f32).collect();
        let [uneven, even] = lists;
        let mut begin = 0;
        for (uneven, even) in uneven.iter().zip(&even) {
            self.begins.push(begin);
            self.evens.push(begin + uneven);
            begin += uneven + even;
        }
        self.begins.push(begin);
        let mut next = [self.begins.clone(), self.evens.clone()];
        self.members = vec![0; begin as usize];
        for (cell, particle, even) in entries {
            let place = &mut next[usize::from(even)][cell as usize];
            self.members[*place as usize] = particle;
            *place += 1;
        }
    }

    fn piece(&self, cell: usize, begin: f64, end: f64) -> Option<Piece> {
        let majorant = f64::from(self.majorants[cell]);
        let minorant = f64::from(self.minorants[cell]);
        (majorant > 0.0).then_some(Piece { begin, end, minorant, majorant, cell })
    }
}

impl Medium for ParticleGrid {
    fn pieces(&self, ray: &Ray, limit: f64, visit: &mut impl FnMut(Piece) -> ControlFlow<()>) {
        let inverse = ray.dir.recip();
        let Some(span) = self.cells.span(ray, inverse, limit) else { return };
        // Whether it breaks does not matter: there is nothing after it.
        let _ = self.cells.walk(ray, inverse, span, |c, begin, end| {
            let block = self.blocks[self.cells.index(c)];
            let first = block.first as usize;
            match block.side {
                0 => ControlFlow::Continue(()),
                1 => self.piece(first, begin, end).map_or(ControlFlow::Continue(()), &mut *visit),
                side => {
                    let fine = self.fine(c, side);
                    fine.walk(ray, inverse, (begin, end), |f, begin, end| {
                        let piece = self.piece(first + fine.index(f), begin, end);
                        piece.map_or(ControlFlow::Continue(()), &mut *visit)
                    })
                }
            }
        });
    }

    fn extinction(&self, cell: usize, point: DVec3) -> f64 {
        let mut sum = self.constants[cell];
        for &i in &self.members[self.begins[cell] as usize..self.evens[cell] as usize] {
            let ball = &self.balls[i as usize];
            if (point - ball.centre).length_squared() < ball.radius_squared {
                sum += self.particles[i as usize].extinction_at(point);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests;
