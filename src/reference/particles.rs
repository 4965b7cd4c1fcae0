//! Particles in a uniform grid of cells, each with the list of particles that reach into it and an
//! upper bound of their summed extinction.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::{DQuat, DVec3, IVec3};

use super::geometry::{Medium, Piece, Ray};
use crate::medium::Shape;

/// One particle in the world.
#[derive(Clone, Debug)]
pub struct WorldParticle {
    /// m.
    pub centre: DVec3,
    /// m.
    pub radius: f64,
    /// 1/m at density 1.
    pub extinction: f64,
    /// From world axes to the particle's own.
    pub to_own: DQuat,
    /// Its density.
    pub shape: Arc<Shape>,
}

impl WorldParticle {
    /// Whether light can meet it.
    pub fn has_matter(&self) -> bool {
        self.radius > 0.0 && self.extinction > 0.0 && self.centre.is_finite()
    }

    /// Optical depth of a part of a ray that lies within the particle, begin and end in m.
    pub fn optical_depth(&self, ray: &Ray, begin: f64, end: f64) -> f64 {
        let own = |t: f64| self.to_own * ((ray.at(t) - self.centre) / self.radius);
        let mut mean = [0.0];
        self.shape.segment_means(own(begin), own(end), &mut mean);
        self.extinction * (end - begin) * mean[0]
    }

    /// Where a ray enters and leaves, m along it; before the origin is negative.
    pub fn span(&self, ray: &Ray) -> Option<(f64, f64)> {
        let to_centre = self.centre - ray.origin;
        let middle = to_centre.dot(ray.dir);
        let half_squared =
            self.radius * self.radius - (to_centre - middle * ray.dir).length_squared();
        (half_squared > 0.0).then(|| {
            let half = half_squared.sqrt();
            (middle - half, middle + half)
        })
    }

    /// Extinction at a point, 1/m.
    pub fn extinction_at(&self, point: DVec3) -> f64 {
        let offset = (point - self.centre) / self.radius;
        if offset.length_squared() >= 1.0 {
            return 0.0;
        }
        self.extinction * self.shape.density(self.to_own * offset)
    }
}

/// Cells per particle that are aimed at; more make the bounds tighter and the steps shorter.
const CELLS_PER_PARTICLE: f64 = 64.0;
/// Most cells in all: their lists then fill about a hundred megabytes.
const MOST_CELLS: f64 = (1 << 23) as f64;
/// Most cells along one axis.
const MOST_ALONG: f64 = 1024.0;

/// The particles of a scene, ready for light.
pub struct ParticleGrid {
    particles: Vec<WorldParticle>,
    low: DVec3,
    cell: DVec3,
    cells: IVec3,
    /// Where a cell's list begins; one more than there are cells.
    begins: Vec<u32>,
    members: Vec<u32>,
    majorants: Vec<f32>,
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
        let cells = (size / side).ceil().clamp(DVec3::ONE, DVec3::splat(MOST_ALONG)).as_ivec3();
        let mut grid = Self {
            low,
            cell: size / cells.as_dvec3(),
            cells,
            begins: Vec::new(),
            members: Vec::new(),
            majorants: Vec::new(),
            particles,
        };
        grid.fill();
        grid
    }

    /// The particles.
    pub fn particles(&self) -> &[WorldParticle] {
        &self.particles
    }

    /// Indices of the particles whose balls a ray may meet before `limit` (m), each once.
    pub fn along(&self, ray: &Ray, limit: f64, found: &mut Vec<u32>) {
        found.clear();
        self.pieces(ray, limit, &mut |piece| {
            found.extend_from_slice(self.members_of(piece.cell));
            ControlFlow::Continue(())
        });
        found.sort_unstable();
        found.dedup();
    }

    fn members_of(&self, cell: usize) -> &[u32] {
        &self.members[self.begins[cell] as usize..self.begins[cell + 1] as usize]
    }

    fn count(&self) -> usize {
        self.cells.x as usize * self.cells.y as usize * self.cells.z as usize
    }

    fn index(&self, c: IVec3) -> usize {
        ((c.z * self.cells.y + c.y) as usize) * self.cells.x as usize + c.x as usize
    }

    /// Calls `f` with every cell that a particle's ball reaches into.
    fn cells_of(&self, particle: &WorldParticle, mut f: impl FnMut(usize)) {
        let last = self.cells - 1;
        let cell_at =
            |p: DVec3| ((p - self.low) / self.cell).floor().as_ivec3().clamp(IVec3::ZERO, last);
        let first = cell_at(particle.centre - particle.radius);
        let end = cell_at(particle.centre + particle.radius);
        for z in first.z..=end.z {
            for y in first.y..=end.y {
                for x in first.x..=end.x {
                    let c = IVec3::new(x, y, z);
                    let low = self.low + c.as_dvec3() * self.cell;
                    let nearest = particle.centre.clamp(low, low + self.cell);
                    if nearest.distance_squared(particle.centre) <= particle.radius.powi(2) {
                        f(self.index(c));
                    }
                }
            }
        }
    }

    fn fill(&mut self) {
        let mut counts = vec![0u32; self.count() + 1];
        let mut majorants = vec![0.0f64; self.count()];
        for particle in &self.particles {
            let most = particle.extinction * particle.shape.majorant();
            self.cells_of(particle, |cell| {
                counts[cell] += 1;
                majorants[cell] += most;
            });
        }
        let mut begin = 0;
        for count in &mut counts {
            begin += std::mem::replace(count, begin);
        }
        let mut next = counts.clone();
        let mut members = vec![0u32; begin as usize];
        for (i, particle) in self.particles.iter().enumerate() {
            self.cells_of(particle, |cell| {
                members[next[cell] as usize] = i as u32;
                next[cell] += 1;
            });
        }
        self.begins = counts;
        self.members = members;
        // Rounding a bound to f32 must not lower it.
        self.majorants = majorants.iter().map(|m| (m * (1.0 + 1e-6)) as f32).collect();
    }
}

impl Medium for ParticleGrid {
    fn pieces(&self, ray: &Ray, limit: f64, visit: &mut impl FnMut(Piece) -> ControlFlow<()>) {
        // The walk through a grid of Amanatides and Woo (1987).
        let inverse = ray.dir.recip();
        let high = self.low + self.cell * self.cells.as_dvec3();
        let (a, b) = ((self.low - ray.origin) * inverse, (high - ray.origin) * inverse);
        let mut t = 0.0f64;
        let mut last = limit;
        for axis in 0..3 {
            if ray.dir[axis] == 0.0 {
                if ray.origin[axis] < self.low[axis] || ray.origin[axis] > high[axis] {
                    return;
                }
            } else {
                t = t.max(a[axis].min(b[axis]));
                last = last.min(a[axis].max(b[axis]));
            }
        }
        if t.is_nan() || t >= last {
            return;
        }
        let mut c = ((ray.at(t) - self.low) / self.cell)
            .floor()
            .as_ivec3()
            .clamp(IVec3::ZERO, self.cells - 1);
        let mut next = DVec3::INFINITY;
        let mut delta = DVec3::INFINITY;
        let mut step = IVec3::ZERO;
        for axis in 0..3 {
            if ray.dir[axis] != 0.0 {
                let forward = ray.dir[axis] > 0.0;
                step[axis] = if forward { 1 } else { -1 };
                let wall = f64::from(c[axis] + i32::from(forward)) * self.cell[axis];
                next[axis] = (self.low[axis] + wall - ray.origin[axis]) * inverse[axis];
                delta[axis] = self.cell[axis] * inverse[axis].abs();
            }
        }
        loop {
            let axis = if next.x <= next.y && next.x <= next.z {
                0
            } else if next.y <= next.z {
                1
            } else {
                2
            };
            let end = next[axis].min(last);
            let cell = self.index(c);
            let majorant = f64::from(self.majorants[cell]);
            if majorant > 0.0 && end > t {
                let piece = Piece { begin: t, end, majorant, cell };
                if visit(piece).is_break() {
                    return;
                }
            }
            t = t.max(end);
            c[axis] += step[axis];
            next[axis] += delta[axis];
            if t >= last || c[axis] < 0 || c[axis] >= self.cells[axis] {
                return;
            }
        }
    }

    fn extinction(&self, cell: usize, point: DVec3) -> f64 {
        self.members_of(cell).iter().map(|&i| self.particles[i as usize].extinction_at(point)).sum()
    }
}
