//! Bounds of a shape's density in parts of it: minima and maxima of the density volume over blocks
//! of 1, 2, 4, ... cells a side. Filtering never leaves the range of a cell's corners.

use glam::DVec3;

use crate::medium::Shape;

/// Least and greatest density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// At least.
    pub low: f32,
    /// At most.
    pub high: f32,
}

impl Range {
    const NONE: Self = Self { low: f32::INFINITY, high: 0.0 };

    fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }
}

/// Bounds of one shape's density.
#[derive(Clone, Debug)]
pub struct DensityBounds {
    /// From single cells of the volume to the whole; none for a uniform shape.
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    /// Blocks a side.
    side: usize,
    blocks: Vec<Range>,
}

/// Most blocks a side that a question looks at.
const MOST_BLOCKS: f64 = 3.0;

impl Level {
    fn new(side: usize, range: impl Fn(usize, usize, usize) -> Range) -> Self {
        let blocks = (0..side * side * side)
            .map(|i| range(i % side, i / side % side, i / (side * side)))
            .collect();
        Self { side, blocks }
    }

    fn at(&self, x: usize, y: usize, z: usize) -> Range {
        self.blocks[x + self.side * (y + self.side * z)]
    }

    /// Blocks of twice the size; the last ones may be cut off.
    fn halved(&self) -> Self {
        Self::new(self.side.div_ceil(2), |x, y, z| {
            let mut range = Range::NONE;
            for (dx, dy, dz) in corners() {
                let [x, y, z] = [2 * x + dx, 2 * y + dy, 2 * z + dz];
                if x.max(y).max(z) < self.side {
                    range = range.with(self.at(x, y, z));
                }
            }
            range
        })
    }
}

fn corners() -> impl Iterator<Item = (usize, usize, usize)> {
    (0..8).map(|i| (i & 1, i >> 1 & 1, i >> 2))
}

impl DensityBounds {
    /// Looks at all of a shape's volume.
    pub fn new(shape: &Shape) -> Self {
        let volume = shape.volume();
        let nodes = (volume.len() as f64).cbrt().round() as usize;
        if nodes < 2 {
            return Self { levels: Vec::new() };
        }
        let mut levels = vec![Level::new(nodes - 1, |x, y, z| {
            corners().fold(Range::NONE, |range, (dx, dy, dz)| {
                let value = volume[x + dx + nodes * (y + dy + nodes * (z + dz))];
                range.with(Range { low: value, high: value })
            })
        })];
        while let Some(last) = levels.last().filter(|l| l.side > 1) {
            let next = last.halved();
            levels.push(next);
        }
        Self { levels }
    }

    /// Bounds in the ball around a point, both in radii of the particle; there is nothing outside
    /// the unit sphere.
    pub fn within(&self, centre: DVec3, reach: f64) -> Range {
        let distance = centre.length();
        if distance - reach >= 1.0 {
            return Range { low: 0.0, high: 0.0 };
        }
        let pokes_out = distance + reach > 1.0;
        let Some(finest) = self.levels.first() else {
            return Range { low: if pokes_out { 0.0 } else { 1.0 }, high: 1.0 };
        };
        let cells = finest.side as f64;
        let across = reach * cells;
        let log = (across / MOST_BLOCKS).max(1.0).log2().ceil() as usize;
        let log = log.min(self.levels.len() - 1);
        let (level, scale) = (&self.levels[log], 0.5 * cells / (1u64 << log) as f64);
        let place = |v: f64| (((v + 1.0) * scale).max(0.0) as usize).min(level.side - 1);
        let (low, high) = (centre - reach, centre + reach);
        let mut range = Range::NONE;
        for z in place(low.z)..=place(high.z) {
            for y in place(low.y)..=place(high.y) {
                for x in place(low.x)..=place(high.x) {
                    range = range.with(level.at(x, y, z));
                }
            }
        }
        Range { low: if pokes_out { 0.0 } else { range.low }, high: range.high }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::Random;

    #[test]
    fn no_density_lies_outside_its_bounds() {
        let mut random = Random::new(3, 0, 0);
        for name in ["uniform", "soft-1", "pyroclastic-1"] {
            let shape = Shape::new(name.parse().expect("a shape"));
            let bounds = DensityBounds::new(&shape);
            let (mut tight, mut empty, mut balls) = (0.0, 0, 0);
            for _ in 0..4000 {
                let mut vector =
                    || 2.0 * DVec3::new(random.unit(), random.unit(), random.unit()) - DVec3::ONE;
                let (centre, way) = (1.3 * vector(), vector());
                let reach = 0.3 * way.x.abs() + 1e-3;
                let range = bounds.within(centre, reach);
                assert!(range.low <= range.high, "{range:?}");
                balls += 1;
                empty += usize::from(range.high == 0.0);
                tight += f64::from(range.high - range.low);
                for _ in 0..20 {
                    let offset = vector();
                    if offset.length() > 1.0 {
                        continue;
                    }
                    let density = shape.density(centre + reach * offset) as f32;
                    // Filtering rounds.
                    let (low, high) = (range.low - 1e-6, range.high + 1e-6);
                    assert!((low..=high).contains(&density), "{name} {centre} {range:?} {density}");
                }
            }
            // They are worth something: balls of 0.15 radii see half the range at most, and many
            // nothing at all.
            assert!(tight / f64::from(balls) < 0.5 && empty > 400, "{name}: {tight} {empty}");
        }
    }
}
