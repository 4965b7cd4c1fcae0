//! A homogeneous layer between two horizontal planes, infinite sideways: the geometry of most
//! published numbers.

use std::ops::ControlFlow;

use glam::DVec3;

use super::geometry::{Medium, Piece, Ray};

/// Matter with extinction 1 between altitudes 0 and `optical_depth`.
#[derive(Clone, Copy, Debug)]
pub struct Slab {
    optical_depth: f64,
    majorant: f64,
}

impl Slab {
    /// A layer of this vertical optical depth. `slack` (1 or more) is how far the majorant lies
    /// above the extinction: results must not depend on it.
    pub fn new(optical_depth: f64, slack: f64) -> Self {
        Self { optical_depth, majorant: slack.max(1.0) }
    }

    /// Altitude of the upper face.
    pub fn top(&self) -> f64 {
        self.optical_depth
    }
}

impl Medium for Slab {
    fn pieces(&self, ray: &Ray, limit: f64, visit: &mut impl FnMut(Piece) -> ControlFlow<()>) {
        let (y, down) = (ray.origin.y, ray.dir.y);
        let (mut begin, mut end) = (0.0, limit);
        if down == 0.0 {
            if !(0.0..=self.optical_depth).contains(&y) {
                return;
            }
        } else {
            let (a, b) = (-y / down, (self.optical_depth - y) / down);
            begin = a.min(b).max(begin);
            end = a.max(b).min(end);
        }
        if begin < end {
            // Whether it breaks does not matter: there is only one piece.
            let _ = visit(Piece { begin, end, minorant: 0.0, majorant: self.majorant, cell: 0 });
        }
    }

    fn extinction(&self, _cell: usize, point: DVec3) -> f64 {
        if (0.0..=self.optical_depth).contains(&point.y) { 1.0 } else { 0.0 }
    }
}
