//! A regular grid over the unit 4-cube with nodes on its faces, and linear filtering in it.

use glam::Vec4;

/// Corners of a cell.
pub(super) const CORNERS: usize = 16;

/// Nodes along each axis, the fastest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Nodes along each axis, at least 2.
    pub nodes: [usize; 4],
}

/// Where a place lies in a grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Index of the corner with the smallest coordinates.
    pub base: usize,
    /// Coordinates in the cell, in 0..1.
    pub fraction: Vec4,
}

impl Grid {
    /// Nodes in all.
    pub fn len(&self) -> usize {
        self.nodes.iter().product()
    }

    /// Whether the grid has no nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Distance of neighbours along each axis in the array.
    pub(super) fn strides(&self) -> [usize; 4] {
        let [a, b, c, _] = self.nodes;
        [1, a, a * b, a * b * c]
    }

    /// The cell of a place in 0..1.
    pub(super) fn cell(&self, at: [f64; 4]) -> Cell {
        let strides = self.strides();
        let mut cell = Cell { base: 0, fraction: Vec4::ZERO };
        for axis in 0..4 {
            let x = at[axis] * (self.nodes[axis] - 1) as f64;
            let low = x.floor().clamp(0.0, (self.nodes[axis] - 2) as f64);
            cell.base += low as usize * strides[axis];
            cell.fraction[axis] = (x - low).clamp(0.0, 1.0) as f32;
        }
        cell
    }

    /// Place of a node, in 0..1.
    pub(in crate::tables) fn place(&self, node: usize) -> [f64; 4] {
        let mut rest = node;
        self.nodes.map(|n| {
            let i = rest % n;
            rest /= n;
            i as f64 / (n - 1) as f64
        })
    }

    /// Offsets of a cell's corners from its base, the first axis fastest.
    pub(super) fn corners(&self) -> [usize; CORNERS] {
        let s = self.strides();
        std::array::from_fn(|i| (0..4).map(|axis| (i >> axis & 1) * s[axis]).sum())
    }
}

/// Weights of a cell's corners in linear filtering; their sum is 1.
pub(super) fn weights(fraction: Vec4) -> [f32; CORNERS] {
    let [a, b, c, d] = fraction.to_array();
    let plane = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
    let far = [(1.0 - c) * (1.0 - d), c * (1.0 - d), (1.0 - c) * d, c * d];
    std::array::from_fn(|i| plane[i & 3] * far[i >> 2])
}

/// Linear filtering of the values at the nodes.
pub(in crate::tables) fn filtered(
    grid: &Grid,
    at: [f64; 4],
    value: impl Fn(usize) -> Vec4,
) -> Vec4 {
    let cell = grid.cell(at);
    let corners = grid.corners().into_iter().zip(weights(cell.fraction));
    corners.map(|(offset, weight)| weight * value(cell.base + offset)).sum()
}
