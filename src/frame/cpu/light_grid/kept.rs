//! Which cells keep light: twin of `shaders/frame/light_grid_slots.wgsl`.

use super::GridLight;
use super::cells::{cells, index, low, side};
use crate::frame::gpu_data::GridLevel;

/// A cell that keeps no light; as in the shader.
pub(super) const NO_SLOT: u32 = u32::MAX;
/// Bit of the entries of cells without matter, on the device.
pub(super) const EMPTY_CELL: u32 = 1 << 31;
const FEED_CELLS: f64 = 2.0;
const LOOK_UP_CELLS: f64 = 1.0;
const ROUNDING: f64 = 1e-3;

impl GridLight {
    /// Gives slots to the cells that keep light. Before that, all do.
    pub(super) fn keep(&mut self) {
        self.slots.fill(NO_SLOT);
        let mut slots = 0;
        for l in 0..self.levels() {
            let level = self.level(l);
            let inner = l.checked_sub(1).map(|inner| self.level(inner));
            for cell in cells(&level) {
                let feeds = inner.is_some_and(|inner| feeds(&level, &inner, cell));
                if cell[1] == 0 || feeds || self.is_beside_matter(&level, cell) {
                    self.slots[index(&level, cell)] = slots;
                    slots += 1;
                }
            }
        }
        self.kept = slots as usize;
    }

    /// Whether the cell or one of those around it has matter.
    fn is_beside_matter(&self, level: &GridLevel, cell: [usize; 3]) -> bool {
        let near = |axis: usize| {
            cell[axis].saturating_sub(1)..=(cell[axis] + 1).min(level.size[axis] as usize - 1)
        };
        near(2).any(|z| {
            near(1).any(|y| near(0).any(|x| self.extinction[index(level, [x, y, z])] > 0.0))
        })
    }
}

/// Whether light of the cell flows into a finer level.
fn feeds(level: &GridLevel, inner: &GridLevel, cell: [usize; 3]) -> bool {
    let ratio = side(inner) / side(level);
    let begin = (low(inner) - low(level)) / side(level) - 0.5;
    let (mut around, mut within) = (true, true);
    for axis in 0..3 {
        let at = cell[axis] as f64;
        let end = begin[axis] + f64::from(inner.size[axis]) * ratio[axis];
        let out = FEED_CELLS * ratio[axis] + LOOK_UP_CELLS + ROUNDING;
        around &= at >= begin[axis] - out && at <= end + out;
        let inset = LOOK_UP_CELLS + ROUNDING;
        within &= at >= begin[axis] + inset && at <= end - inset;
    }
    around && !within
}
