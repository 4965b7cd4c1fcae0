//! One more scattering: from light collected on the direction grid to light scattered towards the
//! table's view directions.

use std::f64::consts::PI;

use super::super::mapping::{ViewSunMap, node};
use super::sweep::fine;
use crate::medium::Phase;

/// Points of a cell's integration are no further apart than this share of their distance from the
/// peak of the phase function, or of its width where they are nearer.
const STEP_SHARE: f64 = 0.3;
/// Fewest and most points along one side of a cell.
const POINTS: [usize; 2] = [3, 160];

/// Angular shape of the collected light within a cell: cells are wider than the lobes far from
/// the sun, so flat cells would smear them.
pub struct Shape<'a>(pub &'a (dyn Fn(f64) -> f64 + Sync));

/// Mean of the phase function between the table's view angles and the cells of the grid, as a
/// cosine series in azimuth.
pub struct Rescatter {
    views: usize,
    angles: usize,
    azimuths: usize,
    /// By view angle, mode, grid angle.
    modes: Vec<f64>,
    /// By mode and azimuth node: cosine series of the grid's azimuths.
    cosines: Vec<f64>,
    /// The same for azimuths twice as fine.
    fine_cosines: Vec<f64>,
}

impl Rescatter {
    /// For `views` view-sun nodes and a direction grid of `angles` by `azimuths`. Where the views
    /// are the grid's own angles, their solid angles (azimuths together) may be given: then
    /// exactly all light is scattered.
    pub fn new(
        phase: &Phase,
        map: &ViewSunMap,
        views: usize,
        angles: usize,
        azimuths: usize,
        shape: &Shape<'_>,
        conserve: Option<&[f64]>,
    ) -> Self {
        let kernel =
            Kernel { phase: phase.prepare(), width: phase.peak_angle(), map, angles, azimuths };
        let last = azimuths - 1;
        let series = |nodes: usize| -> Vec<f64> {
            let step = PI / (nodes - 1) as f64;
            (0..azimuths * nodes)
                .map(|i| (((i / nodes) * (i % nodes)) as f64 * step).cos())
                .collect()
        };
        let (cosines, fine_cosines) = (series(azimuths), series(fine(azimuths)));
        use rayon::prelude::*;
        let rows: Vec<Vec<f64>> = (0..views)
            .into_par_iter()
            .map(|view| {
                let angle = map.angle(node(view, views));
                let mut row = vec![0.0; azimuths * angles];
                for cell in 0..angles {
                    let means: Vec<f64> = (0..azimuths)
                        .map(|turn| kernel.cell_mean(angle, cell, turn, shape))
                        .collect();
                    for mode in 0..azimuths {
                        row[mode * angles + cell] = (0..azimuths)
                            .map(|turn| {
                                let twice = if turn == 0 || turn == last { 1.0 } else { 2.0 };
                                twice * means[turn] * cosines[mode * azimuths + turn]
                            })
                            .sum();
                    }
                }
                row
            })
            .collect();
        let mut modes = rows.concat();
        if let Some(solid_angles) = conserve {
            // What the cells' means lose or gain goes straight on: into the same direction.
            for cell in 0..angles {
                // Mode 0 sums the full circle of azimuths: the mean is over its 2 (n - 1) steps.
                let scattered: f64 = (0..views)
                    .map(|view| modes[view * azimuths * angles + cell] * solid_angles[view])
                    .sum::<f64>()
                    / (2 * last) as f64;
                let lost = (1.0 - scattered) * (2 * last) as f64 / solid_angles[cell];
                for mode in 0..azimuths {
                    modes[(cell * azimuths + mode) * angles + cell] += lost;
                }
            }
        }
        Self { views, angles, azimuths, modes, cosines, fine_cosines }
    }

    /// View angles times azimuths of the result, which are twice as fine as the grid's: the
    /// series is known everywhere.
    pub fn outputs(&self) -> usize {
        self.views * fine(self.azimuths)
    }

    /// Adds to `out` (by view angle and fine azimuth) what the weights of the cells (by grid angle
    /// and azimuth) scatter there.
    pub fn add(&self, weights: &[f64], out: &mut [f64]) {
        let (n, last) = (self.azimuths, self.azimuths - 1);
        let mut series = vec![0.0; n * self.angles];
        for (cell, of_cell) in weights.chunks_exact(n).enumerate() {
            // Weights of inner azimuths stand for both halves of the circle already.
            for mode in 0..n {
                series[mode * self.angles + cell] =
                    of_cell.iter().zip(&self.cosines[mode * n..]).map(|(w, c)| w * c).sum();
            }
        }
        for view in 0..self.views {
            for mode in 0..n {
                let row = &self.modes[(view * n + mode) * self.angles..][..self.angles];
                let product: f64 =
                    row.iter().zip(&series[mode * self.angles..]).map(|(a, b)| a * b).sum();
                let twice = if mode == 0 || mode == last { 1.0 } else { 2.0 };
                let value = twice * product / (2 * last) as f64;
                let turns = fine(n);
                let cosines = &self.fine_cosines[mode * turns..][..turns];
                for (o, c) in out[view * turns..][..turns].iter_mut().zip(cosines) {
                    *o += value * c;
                }
            }
        }
    }
}

struct Kernel<'a> {
    phase: crate::medium::PreparedPhase,
    width: f64,
    map: &'a ViewSunMap,
    angles: usize,
    azimuths: usize,
}

impl Kernel<'_> {
    /// Mean of the phase function between a direction at `angle` from the sun and the cell around
    /// a grid node `turn` azimuth steps away, over the cell's hats times the shape.
    fn cell_mean(&self, angle: f64, cell: usize, turn: usize, shape: &Shape<'_>) -> f64 {
        let step = PI / (self.azimuths - 1) as f64;
        let at = |index: f64| self.map.angle((index / (self.angles - 1) as f64).clamp(0.0, 1.0));
        let mut sum = 0.0;
        let mut norm = 0.0;
        for side in [-1.0, 1.0] {
            let outer = cell as f64 + side;
            if outer < 0.0 || outer > (self.angles - 1) as f64 {
                continue;
            }
            let (from, to) = (at(cell as f64), at(outer));
            let (low, high) = (from.min(to), from.max(to));
            // The table's angles are uneven in the cell: place the hats by the coordinate.
            for half in [-1.0, 1.0] {
                let centre = (turn as f64 + 0.5 * half) * step;
                let near = nearest(angle, low, high, centre, 0.5 * step).max(self.width);
                let wide = |length: f64| {
                    ((length / (STEP_SHARE * near)).ceil() as usize).clamp(POINTS[0], POINTS[1])
                };
                let rows = wide(high - low);
                let columns = wide(step * low.sin().max(high.sin()));
                for i in 0..rows {
                    let share = (i as f64 + 0.5) / rows as f64;
                    let theta = low + (high - low) * share;
                    let index = self.map.coordinate((0.5 * theta).sin()) * (self.angles - 1) as f64;
                    let hat = (1.0 - (index - cell as f64).abs()).max(0.0);
                    let measure = hat * theta.sin() * (high - low) / rows as f64 * (shape.0)(theta);
                    for j in 0..columns {
                        let away = (j as f64 + 0.5) / columns as f64;
                        let azimuth = (turn as f64 + half * away) * step;
                        let weight = measure * (1.0 - away) / columns as f64;
                        sum += weight * self.phase.eval(cosine_between(angle, theta, azimuth));
                        norm += weight;
                    }
                }
            }
        }
        if norm > 0.0 {
            sum / norm
        } else {
            self.phase.eval(cosine_between(angle, at(cell as f64), turn as f64 * step))
        }
    }
}

/// Cosine of the angle between directions at these angles from the axis, an azimuth apart; written
/// as 1 - 2 sin^2 to keep the digits of small angles.
pub fn cosine_between(a: f64, b: f64, azimuth: f64) -> f64 {
    let polar = (0.5 * (a - b)).sin();
    let turn = (0.5 * azimuth).sin();
    1.0 - 2.0 * (polar * polar + a.sin() * b.sin() * turn * turn)
}

/// About the least angle between a direction and a cell of the grid.
fn nearest(angle: f64, low: f64, high: f64, centre: f64, half_width: f64) -> f64 {
    let theta = angle.clamp(low, high);
    let wrapped = (centre + PI).rem_euclid(2.0 * PI) - PI;
    let azimuth = (wrapped.abs() - half_width).max(0.0);
    cosine_between(angle, theta, azimuth).clamp(-1.0, 1.0).acos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_light_stays_uniform() {
        // Light 1 from everywhere: the weight of a cell is its solid angle.
        for name in ["hg:0", "hg:0.85", "mie:20um"] {
            let phase: Phase = name.parse().expect(name);
            let map = ViewSunMap::for_phase(&phase);
            let (views, angles, azimuths) = (12, 32, 10);
            let shape = Shape(&|_| 1.0);
            let rescatter = Rescatter::new(&phase, &map, views, angles, azimuths, &shape, None);
            let rule = crate::tables::scattering::bake::GaussRule::new(8);
            let hats =
                crate::tables::scattering::bake::grid::hat_integrals(angles, &rule, |index| {
                    let (a, e) = (index / (angles - 1) as f64, 1e-6);
                    let (low, high) = ((a - e).max(0.0), (a + e).min(1.0));
                    let slope =
                        (map.angle(high) - map.angle(low)) / (high - low) / (angles - 1) as f64;
                    map.angle(a).sin() * slope
                });
            let weights: Vec<f64> = (0..angles * azimuths)
                .map(|i| {
                    let k = i % azimuths;
                    let ends = if k == 0 || k == azimuths - 1 { 0.5 } else { 1.0 };
                    hats[i / azimuths] * ends * 2.0 * PI / (azimuths - 1) as f64
                })
                .collect();
            let mut out = vec![0.0; rescatter.outputs()];
            rescatter.add(&weights, &mut out);
            for (i, o) in out.iter().enumerate() {
                // The rule's steps of a third of the peak's width leave half a per cent.
                assert!(
                    (o - 1.0).abs() < 5e-3,
                    "{name} view {} azimuth {}: {o}",
                    i / fine(azimuths),
                    i % fine(azimuths)
                );
            }
        }
    }
}
