//! Light along a direction, downstream from cell to cell.

use glam::DVec3;

use super::cells::{Slant, Tap, centre};
use super::{CellLight, GridLight};

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
    /// Source on the face towards two neighbours.
    fn face_source(&self, d: usize, here: usize, taps: &[Tap; 2]) -> CellLight {
        let source_of =
            |cell: usize| self.light_at(d, cell).map_or(DVec3::ZERO, |at| self.sources[at]);
        let own = self.extinction[here];
        let (mut source, mut other) = (DVec3::ZERO, 0.0);
        for (_, at, share) in taps {
            if let Some(at) = at {
                source += share * self.extinction[*at] * source_of(*at);
                other += share * self.extinction[*at];
            }
        }
        if other <= 0.0 {
            return source_of(here);
        }
        (source_of(here) * other + source / other * own) / (own + other)
    }

    /// Carries light along a direction through a level. Returns what leaves it, as the sum over the
    /// faces, each as large as all others.
    pub(super) fn sweep(&mut self, inner: usize, d: usize) -> CellLight {
        let level = self.level(inner);
        let first = level.size[3] as usize;
        let slant = Slant::new(self.direction(d), &level);
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
                let source = self.light_at(d, here).map_or(DVec3::ZERO, |at| self.sources[at]);
                let change = self.face_source(d, here, &after) - self.face_source(d, here, &before);
                let change = change.clamp(-2.0 * source.abs(), 2.0 * source.abs());
                let opaque = -(-tau).exp_m1();
                let clear = mean_transmittance(tau);
                flows_out = flows_in * (1.0 - opaque) + source * opaque + change * skew(tau);
                mean = flows_in * clear + source * (1.0 - clear) - change * (skew(tau) / tau);
            }
            if let Some(at) = self.light_at(d, here) {
                self.lights[at] = mean;
            }
            flows[here - first] = flows_out;
            let outside = after.iter().filter(|(_, at, _)| at.is_none());
            leaves += outside.map(|(_, _, share)| share).sum::<f64>() * flows_out;
        }
        leaves
    }
}
