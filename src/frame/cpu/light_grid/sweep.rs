//! Sunlight and light along a direction, downstream from cell to cell.

use glam::DVec3;

use super::cells::{Crossing, Slant, Tap, centre, index, side};
use super::{CellLight, GridLight, direction};
use crate::frame::gpu_data::GridLevel;

/// Optical depth below which differences of exponentials are series.
const SERIES_BELOW: f64 = 1e-2;

/// (1 - exp(-tau)) / tau.
pub(super) fn mean_transmittance(tau: f64) -> f64 {
    if tau > 0.0 { -(-tau).exp_m1() / tau } else { 1.0 }
}

/// What a source that grows downstream by 1 about its mean adds to the light at the end.
fn skew(tau: f64) -> f64 {
    if tau < SERIES_BELOW {
        return tau * tau / 12.0 * (1.0 - tau * (0.5 - tau * (0.15 - tau / 30.0)));
    }
    1.0 + 0.5 * (-tau).exp_m1() - mean_transmittance(tau)
}

impl GridLight {
    /// Calls `f` for every cell in order downstream, with the cells upstream of it and their weights
    /// (a position outside of the level has no index).
    fn downstream(
        level: &GridLevel,
        crossing: &Crossing,
        mut f: impl FnMut(usize, &[([i64; 3], Option<usize>, f64)]),
    ) {
        let size = crossing.axes.map(|a| i64::from(level.size[a]));
        let whole = crossing.slope.map(f64::floor);
        for p in 0..size[0] {
            let (main, before) =
                if crossing.forward { (p, p - 1) } else { (size[0] - 1 - p, size[0] - p) };
            for third in 0..size[2] {
                for second in 0..size[1] {
                    let mut taps = Vec::with_capacity(4);
                    for tap in 0..4i64 {
                        let up = [tap & 1, tap >> 1];
                        let mut weight = 1.0;
                        for axis in 0..2 {
                            let part = crossing.slope[axis] - whole[axis];
                            weight *= if up[axis] == 1 { part } else { 1.0 - part };
                        }
                        if weight > 0.0 {
                            let cell = crossing.cell(
                                before,
                                second + whole[0] as i64 + up[0],
                                third + whole[1] as i64 + up[1],
                            );
                            let inside =
                                (0..3).all(|i| cell[i] >= 0 && cell[i] < i64::from(level.size[i]));
                            let at = inside.then(|| index(level, cell.map(|v| v as usize)));
                            taps.push((cell, at, weight));
                        }
                    }
                    let here = crossing.cell(main, second, third).map(|v| v as usize);
                    f(index(level, here), &taps);
                }
            }
        }
    }

    pub(super) fn sunlight(&mut self, inner: usize) {
        let level = self.level(inner);
        let crossing = Crossing::new(-self.sun_direction(), side(&level));
        Self::downstream(&level, &crossing, |here, taps| {
            let mut light = 0.0;
            for (cell, at, weight) in taps {
                light += weight
                    * match at {
                        Some(at) => self.sun[*at] * (-self.extinction[*at] * crossing.path).exp(),
                        None => {
                            let upstream = centre(&level, cell.map(|v| v as f64));
                            let face = upstream - 0.5 * crossing.path * self.sun_direction();
                            self.sun_inflow(inner, face)
                        }
                    };
            }
            self.sun[here] = light;
        });
    }

    /// Source on the face towards two neighbours.
    fn face_source(&self, d: usize, here: usize, taps: &[Tap; 2]) -> CellLight {
        let base = d * self.uniforms.cells as usize;
        let own = self.extinction[here];
        let (mut source, mut other) = (DVec3::ZERO, 0.0);
        for (_, at, share) in taps {
            if let Some(at) = at {
                source += share * self.extinction[*at] * self.sources[base + at];
                other += share * self.extinction[*at];
            }
        }
        if other <= 0.0 {
            return self.sources[base + here];
        }
        (self.sources[base + here] * other + source / other * own) / (own + other)
    }

    /// Carries light along a direction through a level. Returns what leaves it, as the sum over the
    /// faces, each as large as all others.
    pub(super) fn sweep(&mut self, inner: usize, d: usize) -> CellLight {
        let level = self.level(inner);
        let base = d * self.uniforms.cells as usize;
        let first = level.size[3] as usize;
        let slant = Slant::new(direction(d), &level);
        let mut flows = vec![DVec3::ZERO; level.size[..3].iter().product::<u32>() as usize];
        let mut leaves = DVec3::ZERO;
        for cell in slant.cells() {
            let Some(here) = slant.index(&level, cell) else { continue };
            let (before, after) = (slant.before(&level, cell), slant.after(&level, cell));
            let mut flows_in = DVec3::ZERO;
            for (place, at, share) in &before {
                flows_in += *share
                    * match at {
                        Some(at) => flows[at - first],
                        None => self.inflow(inner, d, centre(&level, *place)),
                    };
            }
            let (mut flows_out, mut mean) = (flows_in, flows_in);
            let tau = self.extinction[here] * slant.crossing.path;
            if tau > 0.0 {
                let source = self.sources[base + here];
                let change = self.face_source(d, here, &after) - self.face_source(d, here, &before);
                let change = change.clamp(-2.0 * source.abs(), 2.0 * source.abs());
                let opaque = -(-tau).exp_m1();
                let clear = mean_transmittance(tau);
                flows_out = flows_in * (1.0 - opaque) + source * opaque + change * skew(tau);
                mean = flows_in * clear + source * (1.0 - clear) - change * (skew(tau) / tau);
            }
            self.lights[base + here] = mean;
            flows[here - first] = flows_out;
            let outside = after.iter().filter(|(_, at, _)| at.is_none());
            leaves += outside.map(|(_, _, share)| share).sum::<f64>() * flows_out;
        }
        leaves
    }
}
