//! Copies of a table for distant particles, filtered along all four axes.
//!
//! A pixel that is wider than the distance of nodes shows the mean of several. Each copy has half
//! the nodes of the one before along each axis; a node of it is the mean of the finer nodes around
//! it, weighted by a tent that reaches to the next coarse node, and by the length of their chords:
//! it is the matter before the pixel that is averaged.

use glam::Vec4;

use super::encoding::{pack, unpack};
use super::grid::{Grid, filtered};
use super::lookup::ChordStep;
use super::mapping::{ChordMapping, HemisphereDisc};

/// Copies, with the full table. A third one would hold particles of less than 2 pixels' radius:
/// such a particle has no shape any more.
pub const LEVELS: usize = 3;
/// Fewest nodes along an axis of a copy.
const LEAST_NODES: usize = 4;
/// A copy is read where its nodes are at most this many pixels apart. Measured by
/// `copies_come_closer_to_a_supersampled_picture`.
pub const SPACING_PIXELS: f32 = 1.0;

/// A table of packed texels.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Nodes along the axes.
    pub grid: Grid,
    /// Texels of `encoding`, the first axis fastest.
    pub texels: Vec<u32>,
}

impl Level {
    /// Answers for the chord between two points of the unit sphere, as the shader does.
    pub fn step(&self, entry: glam::DVec3, exit: glam::DVec3) -> ChordStep {
        let place = HemisphereDisc.place(entry, exit);
        let channels = filtered(&self.grid, place.at, |node| {
            unpack(self.texels.get(node).copied().unwrap_or_default())
        });
        ChordStep::decode(channels, place.reversed)
    }

    /// The largest radius of a particle, in pixels, at which this copy is read.
    pub fn most_pixels(&self) -> f32 {
        // The disc is two radii wide.
        SPACING_PIXELS * 0.5 * (self.grid.nodes[0] - 1) as f32
    }

    /// The next copy.
    pub(super) fn filtered(&self) -> Self {
        let nodes = self.grid.nodes.map(|n| ((n - 1).div_ceil(2) + 1).max(LEAST_NODES).min(n));
        // Matter, matter times start and end, length.
        let mut grid = self.grid;
        let mut values: Vec<Vec4> = self
            .texels
            .iter()
            .enumerate()
            .map(|(node, texel)| {
                let [root, start, end, _] = unpack(*texel).to_array();
                let length = half_length(&self.grid, node);
                let matter = root * root * length;
                Vec4::new(matter, matter * start, matter * end, length)
            })
            .collect();
        for (axis, n) in nodes.into_iter().enumerate() {
            (grid, values) = tents(&grid, &values, axis, n);
        }
        let texels = values
            .into_iter()
            .map(|v| {
                let [matter, start, end, length] = v.to_array();
                let share = |a: f32, b: f32| if b > 0.0 { a / b } else { 0.0 };
                let root = share(matter, length).sqrt();
                pack(Vec4::new(root, share(start, matter), share(end, matter), 0.0))
            })
            .collect();
        Self { grid, texels }
    }
}

/// Half the length of the chord of a node; 0 outside the disc.
fn half_length(grid: &Grid, node: usize) -> f32 {
    let [x, y, ..] = grid.place(node).map(|c| 2.0 * c - 1.0);
    (1.0 - x * x - y * y).max(0.0).sqrt() as f32
}

/// Means along one axis, which gets `n` nodes.
fn tents(grid: &Grid, values: &[Vec4], axis: usize, n: usize) -> (Grid, Vec<Vec4>) {
    let fine = grid.nodes[axis];
    let stride: usize = grid.nodes[..axis].iter().product();
    let mut coarse = *grid;
    coarse.nodes[axis] = n;
    let ratio = (fine - 1) as f32 / (n - 1) as f32;
    let value = |node: usize| {
        let (low, rest) = (node % stride, node / stride);
        let (i, high) = (rest % n, rest / n);
        let middle = i as f32 * ratio;
        let (from, to) = ((middle - ratio).ceil().max(0.0), (middle + ratio).floor());
        let (mut sum, mut weight) = (Vec4::ZERO, 0.0);
        for k in from as usize..=(to as usize).min(fine - 1) {
            let w = 1.0 - (k as f32 - middle).abs() / ratio;
            sum += w * values[low + stride * (k + fine * high)];
            weight += w;
        }
        sum / weight
    };
    (coarse, (0..coarse.len()).map(value).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_keep_what_is_even() {
        let grid = Grid { nodes: [13, 13, 6, 6] };
        let texel = pack(Vec4::new(0.5, 0.25, 0.75, 0.0));
        let level = Level { grid, texels: vec![texel; grid.len()] };
        let copy = level.filtered();
        assert_eq!(copy.grid.nodes, [7, 7, 4, 4]);
        for (node, t) in copy.texels.iter().enumerate() {
            // Only nodes near the disc see any chord.
            let [x, y, ..] = copy.grid.place(node).map(|c| 2.0 * c - 1.0);
            if x * x + y * y < 1.0 {
                assert_eq!(*t, texel, "{node}");
            }
        }
    }

    #[test]
    fn neighbours_of_other_slices_do_not_mix() {
        // One direction is full, all others are empty.
        let grid = Grid { nodes: [9, 9, 9, 9] };
        let plane = 81;
        let full = pack(Vec4::new(1.0, 0.0, 1.0, 0.0));
        let (u, v) = (4, 4);
        let texels: Vec<u32> =
            (0..grid.len()).map(|i| if i / plane == u + 9 * v { full } else { 0 }).collect();
        let copy = Level { grid, texels }.filtered();
        let [a, b, c, _] = copy.grid.nodes;
        for (node, texel) in copy.texels.iter().enumerate() {
            let place = copy.grid.place(node);
            let near = (2..4).all(|axis| (place[axis] - 0.5).abs() < 1.0 / (c - 1) as f64);
            let inside = [0, 1].iter().all(|axis| (place[*axis] - 0.5).abs() < 0.3);
            assert!(a * b > 0 && (unpack(*texel).x > 0.0) == near || !inside, "{node} {place:?}");
        }
    }
}
