//! A density volume packed for single look-ups at scattered places: a byte a value, in bricks of 4 x 4 x 4
//! that fill a line of the processor's cache, so that filtering touches two lines of 256 KiB and not
//! four of 1 MiB. Paths of the reference look up little else.

use glam::DVec3;

use super::shape::{VOLUME_CELL, VOLUME_NODES, volume_byte, volume_density};

/// Nodes a side of a brick.
const SIDE: usize = 4;
/// Where a node lies by its place along each axis; the three are added.
const OFFSETS: [[u32; VOLUME_NODES]; 3] = {
    let bricks = VOLUME_NODES / SIDE;
    let mut offsets = [[0; VOLUME_NODES]; 3];
    // What a step within a brick, and one to the next brick, are along x, y and z.
    let (within, between) = ([1, SIDE, SIDE * SIDE], [1, bricks, bricks * bricks]);
    let mut axis = 0;
    while axis < 3 {
        let mut node = 0;
        while node < VOLUME_NODES {
            let brick = node / SIDE * between[axis] * SIDE * SIDE * SIDE;
            offsets[axis][node] = (brick + node % SIDE * within[axis]) as u32;
            node += 1;
        }
        axis += 1;
    }
    offsets
};

/// The packed volume.
#[derive(Clone, Debug)]
pub struct Bricks {
    bytes: Vec<u8>,
    /// What each byte means.
    levels: [f32; 256],
}

impl Bricks {
    /// Of values as [`volume_density`] makes them, x fastest, then y, then z.
    pub fn new(volume: &[f32]) -> Self {
        let mut bytes = vec![0; volume.len()];
        for (i, value) in volume.iter().enumerate() {
            let n = VOLUME_NODES;
            let place = [i % n, i / n % n, i / (n * n)];
            let at: u32 = (0..3).map(|axis| OFFSETS[axis][place[axis]]).sum();
            bytes[at as usize] = volume_byte(*value);
        }
        let levels = std::array::from_fn(|byte| volume_density(byte as u8).to_f32());
        Self { bytes, levels }
    }

    /// Trilinear filtering at a point of the unit sphere.
    pub fn filtered(&self, x: DVec3) -> f64 {
        let p = (x + 1.0) / VOLUME_CELL;
        // Conversion cuts off fractions, and is quicker than rounding down.
        let cell = |place: f64| (place.max(0.0) as usize).min(VOLUME_NODES - 2);
        let c = [cell(p.x), cell(p.y), cell(p.z)];
        let whole = DVec3::new(c[0] as f64, c[1] as f64, c[2] as f64);
        let f = (p - whole).clamp(DVec3::ZERO, DVec3::ONE);
        let [[x0, x1], [y0, y1], [z0, z1]] =
            [0, 1, 2].map(|axis| [OFFSETS[axis][c[axis]], OFFSETS[axis][c[axis] + 1]]);
        let level = |at: u32| {
            let byte = self.bytes.get(at as usize).copied().unwrap_or(0);
            self.levels[usize::from(byte)]
        };
        let row = |offset: u32| {
            let (a, b) = (level(x0 + offset), level(x1 + offset));
            f64::from(a) + f.x * f64::from(b - a)
        };
        let near = row(y0 + z0) + f.y * (row(y1 + z0) - row(y0 + z0));
        let far = row(y0 + z1) + f.y * (row(y1 + z1) - row(y0 + z1));
        near + f.z * (far - near)
    }
}
