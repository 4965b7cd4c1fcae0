//! The walk of a ray through a regular grid, of Amanatides and Woo (1987).

use std::ops::ControlFlow;

use glam::{DVec3, IVec3};

use super::geometry::Ray;

/// A box of equal cells.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    /// Lowest corner, m.
    pub low: DVec3,
    /// Size of a cell, m.
    pub cell: DVec3,
    /// 1/m.
    pub inverse: DVec3,
    /// Number of cells along each axis.
    pub count: IVec3,
}

impl Cells {
    /// A box of `size` (m) in so many cells.
    pub fn new(low: DVec3, size: DVec3, count: IVec3) -> Self {
        let cell = size / count.as_dvec3();
        Self { low, cell, inverse: cell.recip(), count }
    }

    /// Number of a cell.
    pub fn index(&self, c: IVec3) -> usize {
        ((c.z * self.count.y + c.y) as usize) * self.count.x as usize + c.x as usize
    }

    /// The cell of a point, or the nearest one.
    pub fn at(&self, point: DVec3) -> IVec3 {
        // What lies below the box is clamped, so cutting off is as good as rounding down.
        ((point - self.low) * self.inverse).as_ivec3().clamp(IVec3::ZERO, self.count - 1)
    }

    /// Lowest corner of a cell.
    pub fn corner(&self, c: IVec3) -> DVec3 {
        self.low + c.as_dvec3() * self.cell
    }

    /// Part of a ray, from 0 to `limit`, that lies in the box.
    pub fn span(&self, ray: &Ray, inverse_dir: DVec3, limit: f64) -> Option<(f64, f64)> {
        let high = self.low + self.cell * self.count.as_dvec3();
        let (a, b) = ((self.low - ray.origin) * inverse_dir, (high - ray.origin) * inverse_dir);
        let (mut begin, mut end) = (0.0f64, limit);
        for axis in 0..3 {
            if ray.dir[axis] == 0.0 {
                if ray.origin[axis] < self.low[axis] || ray.origin[axis] > high[axis] {
                    return None;
                }
            } else {
                begin = begin.max(a[axis].min(b[axis]));
                end = end.min(a[axis].max(b[axis]));
            }
        }
        (begin < end).then_some((begin, end))
    }

    /// Where a ray that begins in a cell leaves it, m.
    pub fn leaves(&self, c: IVec3, ray: &Ray, inverse_dir: DVec3) -> f64 {
        let low = self.corner(c);
        let wall = DVec3::select(ray.dir.cmpgt(DVec3::ZERO), low + self.cell, low);
        let at = (wall - ray.origin) * inverse_dir;
        // Along an axis across which it does not move it never does.
        DVec3::select(ray.dir.cmpeq(DVec3::ZERO), DVec3::INFINITY, at).min_element()
    }

    /// Hands every cell that a part of a ray within the box passes to `visit`, in order, with
    /// where the ray enters and leaves it. `inverse_dir` is 1 / direction.
    pub fn walk(
        &self,
        ray: &Ray,
        inverse_dir: DVec3,
        (begin, last): (f64, f64),
        mut visit: impl FnMut(IVec3, f64, f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut t = begin;
        let mut c = self.at(ray.at(t));
        let mut next = DVec3::INFINITY;
        let mut delta = DVec3::INFINITY;
        let mut step = IVec3::ZERO;
        for axis in 0..3 {
            if ray.dir[axis] != 0.0 {
                let forward = ray.dir[axis] > 0.0;
                step[axis] = if forward { 1 } else { -1 };
                let wall = f64::from(c[axis] + i32::from(forward)) * self.cell[axis];
                next[axis] = (self.low[axis] + wall - ray.origin[axis]) * inverse_dir[axis];
                delta[axis] = self.cell[axis] * inverse_dir[axis].abs();
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
            if end > t {
                visit(c, t, end)?;
                t = end;
            }
            c[axis] += step[axis];
            next[axis] += delta[axis];
            if t >= last || c[axis] < 0 || c[axis] >= self.count[axis] {
                return ControlFlow::Continue(());
            }
        }
    }
}
