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
use super::random::Random;
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

/// A particle that does not fill a fine cell evenly.
#[derive(Clone, Copy, Debug, Default)]
struct Member {
    particle: u32,
    /// 1/m, nowhere less in the cell.
    low: f32,
    /// 1/m, from `low` to what is nowhere exceeded.
    span: f32,
}

impl Member {
    fn new(particle: u32, extinction: f64, range: Range) -> Self {
        let low = (extinction * f64::from(range.low) * (1.0 - ROUNDING)) as f32;
        let high = extinction * f64::from(range.high) * (1.0 + ROUNDING);
        let span = ((high - f64::from(low)) * (1.0 + ROUNDING)) as f32;
        // Next to nothing may have been rounded to nothing.
        Self { particle, low, span: span.max(f32::MIN_POSITIVE) }
    }
}

/// The particles of a scene, ready for light.
pub struct ParticleGrid {
    particles: Vec<WorldParticle>,
    balls: Vec<Ball>,
    cells: Cells,
    blocks: Vec<Block>,
    /// Where a fine cell's list begins; one more than there are cells.
    begins: Vec<u32>,
    members: Vec<Member>,
    /// The same for those that fill the whole cell evenly.
    even_begins: Vec<u32>,
    evens: Vec<u32>,
    /// 1/m: lower bound of the extinction, and what is between it and the upper one.
    minorants: Vec<f64>,
    spans: Vec<f64>,
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
            members: Vec::new(),
            even_begins: Vec::new(),
            evens: Vec::new(),
            minorants: Vec::new(),
            spans: Vec::new(),
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
            found.extend(self.members(piece.cell).iter().map(|member| member.particle));
            found.extend_from_slice(list(&self.even_begins, &self.evens, piece.cell));
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
        self.constants = vec![0.0; count];
        // Cell and member, in the order of the particles.
        let (mut members, mut evens) = (Vec::new(), Vec::new());
        for first in (0..self.particles.len()).step_by(BATCH) {
            let batch = first..(first + BATCH).min(self.particles.len());
            let parts: Vec<_> = batch
                .clone()
                .into_par_iter()
                .map(|i| self.parts(&self.particles[i], &of[i]))
                .collect();
            for (i, part) in batch.zip(&parts).flat_map(|(i, p)| p.iter().map(move |p| (i, p))) {
                let (extinction, range) = (self.particles[i].extinction, part.range);
                if range.low == range.high {
                    self.constants[part.cell as usize] += extinction * f64::from(range.low);
                    evens.push((part.cell, i as u32));
                } else {
                    members.push((part.cell, Member::new(i as u32, extinction, range)));
                }
            }
        }
        (self.begins, self.members) = by_cell(members, count);
        (self.even_begins, self.evens) = by_cell(evens, count);
        // Of the same numbers that the members have, in the same order: the bounds are theirs exactly.
        let sum = |cell: usize, of: fn(&Member) -> f32| -> f64 {
            self.members(cell).iter().map(|member| f64::from(of(member))).sum()
        };
        let minorant = |cell: usize| self.constants[cell] + sum(cell, |m| m.low);
        let minorants = (0..count).map(minorant).collect();
        let spans = (0..count).map(|cell| sum(cell, |m| m.span)).collect();
        (self.minorants, self.spans) = (minorants, spans);
    }

    /// Those with matter in a fine cell that do not fill it evenly.
    fn members(&self, cell: usize) -> &[Member] {
        list(&self.begins, &self.members, cell)
    }

    /// Extinction of a member at a point above what it has everywhere in the cell, over its span.
    fn share_of(&self, member: &Member, point: DVec3) -> f64 {
        let ball = &self.balls[member.particle as usize];
        let inside = (point - ball.centre).length_squared() < ball.radius_squared;
        let particle = &self.particles[member.particle as usize];
        let extinction = if inside { particle.extinction_at(point) } else { 0.0 };
        (extinction - f64::from(member.low)) / f64::from(member.span)
    }

    /// The fine cell in which a ray begins, and where it leaves it, m; none where there is nothing.
    fn first(&self, ray: &Ray, inverse: DVec3) -> Option<(usize, f64)> {
        let c = self.cells.at(ray.origin);
        let block = self.blocks[self.cells.index(c)];
        if block.side == 0 {
            return None;
        }
        let fine = self.fine(c, block.side);
        let f = fine.at(ray.origin);
        Some((block.first as usize + fine.index(f), fine.leaves(f, ray, inverse)))
    }

    fn piece(&self, cell: usize, begin: f64, end: f64) -> Option<Piece> {
        let minorant = self.minorants[cell];
        let majorant = minorant + self.spans[cell];
        (majorant > 0.0).then_some(Piece { begin, end, minorant, majorant, cell })
    }
}

/// Entries of cells one cell after the other, in the order in which they came, and where each begins.
fn by_cell<T: Copy + Default>(entries: Vec<(u32, T)>, count: usize) -> (Vec<u32>, Vec<T>) {
    let mut begins = vec![0u32; count + 1];
    for (cell, _) in &entries {
        begins[*cell as usize + 1] += 1;
    }
    for i in 0..count {
        begins[i + 1] += begins[i];
    }
    let mut next = begins.clone();
    let mut sorted = vec![T::default(); entries.len()];
    for (cell, entry) in entries {
        let place = &mut next[cell as usize];
        sorted[*place as usize] = entry;
        *place += 1;
    }
    (begins, sorted)
}

fn list<'a, T>(begins: &[u32], entries: &'a [T], cell: usize) -> &'a [T] {
    &entries[begins[cell] as usize..begins[cell + 1] as usize]
}

impl Medium for ParticleGrid {
    fn pieces(&self, ray: &Ray, limit: f64, visit: &mut impl FnMut(Piece) -> ControlFlow<()>) {
        let inverse = ray.dir.recip();
        let Some(mut span) = self.cells.span(ray, inverse, limit) else { return };
        // Most flights of scattered paths end in the cell in which they begin.
        if span.0 == 0.0
            && let Some((cell, end)) = self.first(ray, inverse)
        {
            let end = end.min(span.1);
            if end > 0.0 {
                if let Some(piece) = self.piece(cell, 0.0, end)
                    && visit(piece).is_break()
                {
                    return;
                }
                span.0 = end;
            }
        }
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
        for member in self.members(cell) {
            let ball = &self.balls[member.particle as usize];
            if (point - ball.centre).length_squared() < ball.radius_squared {
                sum += self.particles[member.particle as usize].extinction_at(point);
            }
        }
        sum
    }

    /// Looks at one member, drawn by its span, in place of all: the densities of ten or more that
    /// overlap were half of a path's time, and a collision does not need to know their sum.
    fn share(&self, piece: &Piece, point: DVec3, random: &mut Random) -> f64 {
        let mut left = random.unit() * self.spans[piece.cell];
        let members = self.members(piece.cell);
        for member in members {
            left -= f64::from(member.span);
            if left < 0.0 {
                return self.share_of(member, point);
            }
        }
        // The last digit of the sum.
        members.last().map_or(0.0, |member| self.share_of(member, point))
    }
}

#[cfg(test)]
mod tests;
