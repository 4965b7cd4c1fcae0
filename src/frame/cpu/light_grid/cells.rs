//! Cells, and how directions cross them; twin of `shaders/shared/light_grid_data.wgsl`.

use glam::DVec3;

use crate::frame::gpu_data::GridLevel;

pub(super) fn low(level: &GridLevel) -> DVec3 {
    DVec3::new(level.low[0].into(), level.low[1].into(), level.low[2].into())
}

pub(super) fn side(level: &GridLevel) -> DVec3 {
    DVec3::new(level.cell[0].into(), level.cell[1].into(), level.cell[2].into())
}

pub(super) fn index(level: &GridLevel, [x, y, z]: [usize; 3]) -> usize {
    let [nx, ny, _, first] = level.size.map(|n| n as usize);
    first + (z * ny + y) * nx + x
}

pub(super) fn cells(level: &GridLevel) -> impl Iterator<Item = [usize; 3]> + use<> {
    let [nx, ny, nz, _] = level.size.map(|n| n as usize);
    (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])))
}

pub(super) fn centre(level: &GridLevel, cell: [f64; 3]) -> DVec3 {
    low(level) + (DVec3::from_array(cell) + 0.5) * side(level)
}

/// Cells within the border of a level where it counts as outside; as in the shader.
const BORDER: f64 = 1e-3;

/// The eight cells around a point and their weights; none outside of the level.
pub(super) fn corners(level: &GridLevel, point: DVec3) -> Option<[([usize; 3], f64); 8]> {
    let at = (point - low(level)) / side(level);
    let size = [0, 1, 2].map(|i| f64::from(level.size[i]));
    if (0..3).any(|i| at[i] < BORDER || at[i] > size[i] - BORDER) {
        return None;
    }
    let placed = [0, 1, 2].map(|i| (at[i] - 0.5).clamp(0.0, size[i] - 1.0));
    let mut result = [([0; 3], 0.0); 8];
    for (corner, (cell, weight)) in result.iter_mut().enumerate() {
        *weight = 1.0;
        for axis in 0..3 {
            let whole = placed[axis].floor();
            let upper = corner >> axis & 1 == 1;
            let fraction = placed[axis] - whole;
            *weight *= if upper { fraction } else { 1.0 - fraction };
            cell[axis] = (whole as usize + usize::from(upper)).min(level.size[axis] as usize - 1);
        }
    }
    Some(result)
}

/// How a direction crosses the planes of cells.
pub(super) struct Crossing {
    /// Across the planes, and the two in a plane.
    pub axes: [usize; 3],
    pub forward: bool,
    /// Cells upstream in the plane per plane.
    pub slope: [f64; 2],
    /// m between planes.
    pub path: f64,
}

impl Crossing {
    pub fn new(direction: DVec3, cell: DVec3) -> Self {
        let rate = direction / cell;
        let steep = rate.abs();
        let main = if steep.x >= steep.y && steep.x >= steep.z {
            0
        } else if steep.y >= steep.z {
            1
        } else {
            2
        };
        let axes = [main, (main + 1) % 3, (main + 2) % 3];
        Self {
            axes,
            forward: rate[main] > 0.0,
            slope: [-rate[axes[1]] / steep[main], -rate[axes[2]] / steep[main]],
            path: 1.0 / steep[main],
        }
    }
}

/// How a direction crosses a level in slanted planes: by linear shares along the rows of a plane, by
/// whole cells between planes, where it changes least.
pub(super) struct Slant {
    pub crossing: Crossing,
    /// Of `crossing.axes`: along a row, and between planes.
    axes: [usize; 2],
    /// Share of light that goes to the cell beside.
    share: f64,
    /// Where along a row upstream is: -1, 0, 1.
    beside: i64,
    /// Planes a row, downstream.
    drift: f64,
    size: [i64; 3],
}

/// A neighbour of a cell: place, index if it is in the level, share of the light.
pub(super) type Tap = ([f64; 3], Option<usize>, f64);

impl Slant {
    pub fn new(direction: DVec3, level: &GridLevel) -> Self {
        let crossing = Crossing::new(direction, side(level));
        let turned = crossing.slope[0].abs() < crossing.slope[1].abs();
        let (row, plane) = if turned { (1, 0) } else { (0, 1) };
        let slope = crossing.slope[row];
        Self {
            axes: [row + 1, plane + 1],
            share: slope.abs(),
            beside: if slope > 0.0 { 1 } else { -1 },
            drift: -crossing.slope[plane],
            size: crossing.axes.map(|a| i64::from(level.size[a])),
            crossing,
        }
    }

    /// Planes moved by in a row of cells.
    fn moved(&self, row: i64) -> i64 {
        let planes = (self.drift.abs() * (row as f64 + 0.5)).floor() as i64;
        if self.drift < 0.0 { -planes } else { planes }
    }

    /// Cells in order downstream: their number along `crossing.axes`, the first counted downstream.
    pub fn cells(&self) -> impl Iterator<Item = [i64; 3]> + use<> {
        let [rows, second, third] = self.size;
        (0..rows)
            .flat_map(move |r| (0..third).flat_map(move |t| (0..second).map(move |s| [r, s, t])))
    }

    /// Place of a cell in the level.
    fn place(&self, [row, second, third]: [f64; 3]) -> [f64; 3] {
        let main = if self.crossing.forward { row } else { self.size[0] as f64 - 1.0 - row };
        let mut place = [0.0; 3];
        for (axis, at) in self.crossing.axes.into_iter().zip([main, second, third]) {
            place[axis] = at;
        }
        place
    }

    /// Index of a cell, if it is in the level.
    pub fn index(&self, level: &GridLevel, cell: [i64; 3]) -> Option<usize> {
        let inside = (0..3).all(|i| cell[i] >= 0 && cell[i] < self.size[i]);
        inside.then(|| index(level, self.place(cell.map(|v| v as f64)).map(|v| v as usize)))
    }

    fn taps(&self, level: &GridLevel, cell: [i64; 3], rows: i64, beside: i64) -> [Tap; 2] {
        let [row, plane] = self.axes;
        let mut to = cell;
        to[0] += rows;
        to[plane] += self.moved(to[0]) - self.moved(cell[0]);
        let mut next = to;
        next[row] += beside;
        [(to, 1.0 - self.share), (next, self.share)].map(|(at, share)| {
            let mut place = at.map(|v| v as f64);
            if at[0] < 0 {
                // Into the first row by the direction itself, not by whole cells.
                place[plane] = cell[plane] as f64 - self.drift;
            }
            (self.place(place), self.index(level, at), share)
        })
    }

    /// The two cells that light comes from.
    pub fn before(&self, level: &GridLevel, cell: [i64; 3]) -> [Tap; 2] {
        self.taps(level, cell, -1, self.beside)
    }

    /// The two cells that light goes to.
    pub fn after(&self, level: &GridLevel, cell: [i64; 3]) -> [Tap; 2] {
        self.taps(level, cell, 1, -self.beside)
    }
}
