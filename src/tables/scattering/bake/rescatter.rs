//! One scattering: from light that arrives on the direction grid to light scattered towards view
//! directions.
//!
//! Between its nodes the light is a shape times a cubic in the graded angle from the sun and a
//! cosine series in azimuth. The phase function is integrated over that, not sampled: a lobe much
//! narrower than a cell then hands on what it finds there, and no light is smeared over the grid.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::super::mapping::{ViewSunMap, node};
use super::GaussRule;
use super::grid::cubic_basis;
use super::sweep::fine;
use crate::medium::{Phase, PreparedPhase};

/// Panels and steps of the integration are no longer than this share of their distance from the
/// peak of the phase function, or of its width where they are nearer.
const STEP_SHARE: f64 = 0.5;
/// Points in each panel of the angle from the sun.
const PANEL_POINTS: usize = 4;
/// Fewest steps around the circle of azimuths; the rule is exact for series of half as many terms.
const LEAST_TURNS: usize = 48;
/// Most steps: enough for the narrowest lobe of any accepted phase function that matters.
const MOST_TURNS: usize = 4096;

/// Angular shape of the arriving light: what varies quickly in it and is known.
pub type Shape<'a> = &'a (dyn Fn(f64) -> f64 + Sync);

/// The scattering matrix of one phase function, as a cosine series in azimuth.
pub struct Rescatter {
    views: usize,
    angles: usize,
    azimuths: usize,
    /// By view angle, mode, grid angle.
    modes: Vec<f64>,
    /// Cosine transform of the grid's azimuths: by mode and node, with the weights of the rule.
    analysis: Vec<f64>,
    /// Cosines at the fine azimuths, by mode and node.
    synthesis: Vec<f64>,
}

impl Rescatter {
    /// Towards directions at the angles `views` from the sun, from a direction grid of `angles` by `azimuths` nodes, for
    /// light of the given shape. The values that [`Self::add`] takes are light divided by shape.
    pub fn new(
        phase: &Phase,
        map: &ViewSunMap,
        views: &[f64],
        [angles, azimuths]: [usize; 2],
        shape: Shape<'_>,
    ) -> Self {
        let kernel = Kernel {
            phase: phase.prepare(),
            width: phase.peak_angle(),
            map,
            nodes: (0..angles).map(|k| map.angle(node(k, angles))).collect(),
            rule: GaussRule::new(PANEL_POINTS),
            azimuths,
        };
        let rows: Vec<Vec<f64>> = views.par_iter().map(|view| kernel.row(*view, shape)).collect();
        let last = azimuths - 1;
        let cosine =
            |mode: usize, k: usize, steps: usize| (PI * (mode * k) as f64 / steps as f64).cos();
        let half_ends = |k: usize| if k == 0 || k == last { 0.5 } else { 1.0 };
        let analysis = (0..azimuths * azimuths)
            .map(|i| {
                let (mode, k) = (i / azimuths, i % azimuths);
                2.0 / last as f64 * half_ends(mode) * half_ends(k) * cosine(mode, k, last)
            })
            .collect();
        let turns = fine(azimuths);
        let synthesis =
            (0..azimuths * turns).map(|i| cosine(i / turns, i % turns, turns - 1)).collect();
        Self { views: views.len(), angles, azimuths, modes: rows.concat(), analysis, synthesis }
    }

    /// Makes the matrix scatter exactly all light, for one whose views are the grid's own angles
    /// and whose shape is 1: what the integration lost or gained goes straight on. `rings` are the
    /// solid angles of the grid's rings of one angle.
    pub fn conserve(&mut self, rings: &[f64]) {
        let stride = self.azimuths * self.angles;
        for cell in 1..self.angles {
            let scattered: f64 = rings
                .iter()
                .enumerate()
                .map(|(view, r)| r * self.modes[view * stride + cell])
                .sum();
            let lost = 1.0 - scattered / rings[cell];
            for mode in 0..self.azimuths {
                self.modes[cell * stride + mode * self.angles + cell] += lost;
            }
        }
    }

    /// View angles times azimuths of the result, which are twice as fine as the grid's: the
    /// series is known everywhere.
    pub fn outputs(&self) -> usize {
        self.views * fine(self.azimuths)
    }

    /// Adds to `out` (by view angle and fine azimuth) what light divided by shape (by grid angle
    /// and azimuth) scatters there.
    pub fn add(&self, light: &[f32], out: &mut [f32], albedo: f64) {
        let n = self.azimuths;
        let turns = fine(n);
        let mut series = vec![0.0; n * self.angles];
        for (cell, of_cell) in light.chunks_exact(n).enumerate() {
            for mode in 0..n {
                series[mode * self.angles + cell] = of_cell
                    .iter()
                    .zip(&self.analysis[mode * n..])
                    .map(|(l, a)| f64::from(*l) * a)
                    .sum();
            }
        }
        for view in 0..self.views {
            for mode in 0..n {
                let row = &self.modes[(view * n + mode) * self.angles..][..self.angles];
                let product: f64 =
                    row.iter().zip(&series[mode * self.angles..]).map(|(a, b)| a * b).sum();
                let value = albedo * product;
                let cosines = &self.synthesis[mode * turns..][..turns];
                for (o, c) in out[view * turns..][..turns].iter_mut().zip(cosines) {
                    *o += (value * c) as f32;
                }
            }
        }
    }
}

struct Kernel<'a> {
    phase: PreparedPhase,
    width: f64,
    map: &'a ViewSunMap,
    nodes: Vec<f64>,
    rule: GaussRule,
    azimuths: usize,
}

impl Kernel<'_> {
    /// Matrix row of one view angle: by mode and grid angle.
    fn row(&self, view: f64, shape: Shape<'_>) -> Vec<f64> {
        let angles = self.nodes.len();
        let mut row = vec![0.0; self.azimuths * angles];
        let mut ring = vec![0.0; self.azimuths];
        for cell in 0..angles - 1 {
            let mut panels = vec![(self.nodes[cell], self.nodes[cell + 1])];
            while let Some((from, to)) = panels.pop() {
                let away = (from - view).max(view - to).max(self.width);
                if to - from > STEP_SHARE * away {
                    let middle = 0.5 * (from + to);
                    panels.extend([(from, middle), (middle, to)]);
                    continue;
                }
                for &(u, w) in &self.rule.points {
                    let angle = from + (to - from) * u;
                    self.ring(view, angle, &mut ring);
                    let index = self.map.coordinate((0.5 * angle).sin()) * (angles - 1) as f64;
                    let measure = w * (to - from) * angle.sin() * shape(angle);
                    let (first, basis) = cubic_basis(index, angles);
                    for (k, b) in basis.into_iter().enumerate() {
                        for (mode, r) in ring.iter().enumerate() {
                            row[mode * angles + first + k] += measure * b * r;
                        }
                    }
                }
            }
        }
        row
    }

    /// Integrals over the circle at `angle` of the phase function seen from `view` times the
    /// cosine of each mode.
    fn ring(&self, view: f64, angle: f64, out: &mut [f64]) {
        out.fill(0.0);
        let sines = (view.sin() * angle.sin()).max(0.0);
        let near = (view - angle).abs().max(self.width);
        let wanted = (PI * sines.sqrt() / (STEP_SHARE * near)) as usize;
        let turns = wanted.clamp(LEAST_TURNS, MOST_TURNS);
        // Midpoints of half the circle; the other half mirrors it.
        let measure = 2.0 * PI / turns as f64;
        for k in 0..turns {
            let azimuth = PI * (k as f64 + 0.5) / turns as f64;
            let value = measure * self.phase.eval(cosine_between(view, angle, azimuth));
            let step = azimuth.cos();
            let (mut before, mut cosine) = (step, 1.0);
            for o in out.iter_mut() {
                *o += value * cosine;
                (before, cosine) = (cosine, 2.0 * step * cosine - before);
            }
        }
    }
}

/// Cosine of the angle between directions at these angles from the axis, an azimuth apart; written
/// as 1 - 2 sin^2 to keep the digits of small angles.
fn cosine_between(a: f64, b: f64, azimuth: f64) -> f64 {
    let polar = (0.5 * (a - b)).sin();
    let turn = (0.5 * azimuth).sin();
    1.0 - 2.0 * (polar * polar + a.sin() * b.sin() * turn * turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(map: &ViewSunMap, count: usize) -> Vec<f64> {
        (0..count).map(|k| map.angle(node(k, count))).collect()
    }

    fn phases() -> Vec<Phase> {
        ["hg:0", "hg:0.85", "mie:20um"].iter().map(|t| t.parse().expect(t)).collect()
    }

    #[test]
    fn uniform_light_stays_uniform() {
        for phase in phases() {
            let map = ViewSunMap::for_phase(&phase);
            let rescatter = Rescatter::new(&phase, &map, &nodes(&map, 12), [40, 9], &|_| 1.0);
            let mut out = vec![0.0; rescatter.outputs()];
            rescatter.add(&[1.0; 40 * 9], &mut out, 1.0);
            for (i, o) in out.iter().enumerate() {
                // Four points a panel of half the peak's width, and f32.
                assert!((o - 1.0).abs() < 2e-3, "{phase} {i}: {o}");
            }
        }
    }

    #[test]
    fn a_harmonic_is_scaled_by_its_moment() {
        // Light P1(cos) and P1 turned by a right angle: eigenfunctions with the mean cosine.
        for phase in phases() {
            let map = ViewSunMap::for_phase(&phase);
            let (views, angles, azimuths) = (14, 44, 9);
            let rescatter =
                Rescatter::new(&phase, &map, &nodes(&map, views), [angles, azimuths], &|_| 1.0);
            let harmonic = |angle: f64, azimuth: f64| angle.cos() + angle.sin() * azimuth.cos();
            let light: Vec<f32> = (0..angles * azimuths)
                .map(|i| {
                    let azimuth = PI * (i % azimuths) as f64 / (azimuths - 1) as f64;
                    harmonic(map.angle(node(i / azimuths, angles)), azimuth) as f32
                })
                .collect();
            let mut out = vec![0.0; rescatter.outputs()];
            rescatter.add(&light, &mut out, 1.0);
            let turns = fine(azimuths);
            for (i, o) in out.iter().enumerate() {
                let azimuth = PI * (i % turns) as f64 / (turns - 1) as f64;
                let want =
                    phase.mean_cosine() * harmonic(map.angle(node(i / turns, views)), azimuth);
                // The cubic between the nodes adds to what the uniform test allows.
                assert!((f64::from(*o) - want).abs() < 3e-3, "{phase} {i}: {o} {want}");
            }
        }
    }

    #[test]
    fn conserving_matrix_keeps_all_light() {
        let phase = Phase::hg(0.9).expect("in range");
        let map = ViewSunMap::for_phase(&phase);
        let (angles, azimuths) = (24, 7);
        let size = crate::tables::scattering::bake::FieldSize {
            radius: 4,
            zenith: 5,
            view_sun: angles,
            azimuth: azimuths,
        };
        let grid = crate::tables::scattering::bake::grid::FieldGrid::new(size, map, 1.0);
        let rings = grid.ring_measures();
        let mut rescatter =
            Rescatter::new(&phase, &map, &nodes(&map, angles), [angles, azimuths], &|_| 1.0);
        rescatter.conserve(&rings);
        for cell in 1..angles {
            let mut light = vec![0.0; angles * azimuths];
            light[cell * azimuths..][..azimuths].fill(1.0);
            let mut out = vec![0.0; rescatter.outputs()];
            rescatter.add(&light, &mut out, 1.0);
            let turns = fine(azimuths);
            let total: f64 =
                rings.iter().enumerate().map(|(v, r)| r * f64::from(out[v * turns])).sum();
            assert!((total / rings[cell] - 1.0).abs() < 1e-4, "{cell} {total} {}", rings[cell]);
        }
    }
}
