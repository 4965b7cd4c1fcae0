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
const MOST_TURNS: usize = 1 << 12;

/// Angular shape of the arriving light: what varies quickly in it and is known.
pub type Shape<'a> = &'a (dyn Fn(f64) -> f64 + Sync);

/// The scattering matrix of one phase function, as a cosine series in azimuth.
pub struct Rescatter {
    views: usize,
    angles: usize,
    azimuths: usize,
    /// By mode, grid angle, view angle: sums over grid angles then run in step for all views.
    modes: Vec<f64>,
    /// Cosine transform of the grid's azimuths: by node and mode, with the weights of the rule.
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
            circles: circles(azimuths),
        };
        let rows: Vec<Vec<f64>> = views.par_iter().map(|view| kernel.row(*view, shape)).collect();
        let last = azimuths - 1;
        let cosine =
            |mode: usize, k: usize, steps: usize| (PI * (mode * k) as f64 / steps as f64).cos();
        let half_ends = |k: usize| if k == 0 || k == last { 0.5 } else { 1.0 };
        let analysis = (0..azimuths * azimuths)
            .map(|i| {
                let (k, mode) = (i / azimuths, i % azimuths);
                2.0 / last as f64 * half_ends(mode) * half_ends(k) * cosine(mode, k, last)
            })
            .collect();
        let turns = fine(azimuths);
        let synthesis =
            (0..azimuths * turns).map(|i| cosine(i / turns, i % turns, turns - 1)).collect();
        let modes = (0..azimuths * angles).flat_map(|i| rows.iter().map(move |row| row[i]));
        let modes = modes.collect();
        Self { views: views.len(), angles, azimuths, modes, analysis, synthesis }
    }

    /// Makes the matrix scatter exactly all light, for one whose views are the grid's own angles
    /// and whose shape is 1: what the integration lost or gained goes straight on. `rings` are the
    /// solid angles of the grid's rings of one angle.
    pub fn conserve(&mut self, rings: &[f64]) {
        for cell in 1..self.angles {
            let of_cell = &self.modes[cell * self.views..][..self.views];
            let scattered: f64 = rings.iter().zip(of_cell).map(|(r, m)| r * m).sum();
            let lost = 1.0 - scattered / rings[cell];
            for mode in 0..self.azimuths {
                self.modes[(mode * self.angles + cell) * self.views + cell] += lost;
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
        // By grid angle and mode.
        let mut series = vec![0.0; n * self.angles];
        for (of_cell, series) in light.chunks_exact(n).zip(series.chunks_exact_mut(n)) {
            for (light, analysis) in of_cell.iter().zip(self.analysis.chunks_exact(n)) {
                for (s, a) in series.iter_mut().zip(analysis) {
                    *s += f64::from(*light) * a;
                }
            }
        }
        let mut products = vec![0.0; self.views];
        let of_modes = self.modes.chunks_exact(self.angles * self.views);
        for (mode, (of_mode, cosines)) in
            of_modes.zip(self.synthesis.chunks_exact(turns)).enumerate()
        {
            products.fill(0.0);
            for (of_cell, series) in of_mode.chunks_exact(self.views).zip(series.chunks_exact(n)) {
                for (p, m) in products.iter_mut().zip(of_cell) {
                    *p += m * series[mode];
                }
            }
            for (product, out) in products.iter().zip(out.chunks_exact_mut(turns)) {
                let value = albedo * product;
                for (o, c) in out.iter_mut().zip(cosines) {
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
    /// By growing number of steps.
    circles: Vec<Circle>,
}

/// Places around half a circle of azimuths: midpoints of even steps.
struct Circle {
    /// Sine of half the azimuth, squared.
    half_sines: Vec<f64>,
    /// Cosines of multiples of the azimuth, by place and mode.
    cosines: Vec<f64>,
}

/// Circles of 48, 64, 96, 128, ... steps: what a ring asks for is rounded up to one of them, so that no
/// cosine is computed twice.
fn circles(modes: usize) -> Vec<Circle> {
    let sizes = std::iter::successors(Some([LEAST_TURNS, 4 * LEAST_TURNS / 3]), |[a, b]| {
        Some([2 * a, 2 * b])
    });
    sizes
        .flatten()
        .take_while(|turns| *turns <= MOST_TURNS)
        .map(|turns| {
            let azimuth = |k: usize| PI * (k as f64 + 0.5) / turns as f64;
            let multiples = |k: usize| (0..modes).map(move |mode| (mode as f64 * azimuth(k)).cos());
            Circle {
                half_sines: (0..turns).map(|k| (0.5 * azimuth(k)).sin().powi(2)).collect(),
                cosines: (0..turns).flat_map(multiples).collect(),
            }
        })
        .collect()
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
        let (view_sine, sine) = (view.sin(), angle.sin());
        let near = (view - angle).abs().max(self.width);
        let wanted = (PI * (view_sine * sine).max(0.0).sqrt() / (STEP_SHARE * near)) as usize;
        let enough = self.circles.iter().find(|circle| circle.half_sines.len() >= wanted);
        let Some(circle) = enough.or(self.circles.last()) else { return };
        // The other half of the circle mirrors this one.
        let measure = 2.0 * PI / circle.half_sines.len() as f64;
        // 1 - 2 sin^2 keeps the digits of small angles between the directions.
        let polar = (0.5 * (view - angle)).sin().powi(2);
        let places = circle.half_sines.iter().zip(circle.cosines.chunks_exact(self.azimuths));
        for (turn, cosines) in places {
            let cosine = 1.0 - 2.0 * (polar + view_sine * sine * turn);
            let value = measure * self.phase.eval(cosine);
            for (o, c) in out.iter_mut().zip(cosines) {
                *o += value * c;
            }
        }
    }
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
