//! Conservation of energy, chord by chord.
//!
//! Followed backwards, light that left the sphere along a chord comes from the sun's directions in
//! the proportions of the source; with albedo 1 nothing is lost, so the source integrates to 1
//! over all sun directions.

use super::super::mapping::{ViewSunMap, azimuth_angle, azimuth_coordinate, node};
use super::GaussRule;
use crate::medium::Phase;

/// Points of the rule in each cell of the table, along the view-sun angle and the azimuth: within a cell
/// nothing but the lobe bends.
const VIEW_POINTS: usize = 4;
const AZIMUTH_POINTS: usize = 2;

/// One place of the rule on an axis.
pub struct Place {
    /// Sine of the angle.
    pub sine: f64,
    /// Its cosine.
    pub cosine: f64,
    /// Node below.
    pub index: usize,
    /// Share of the next node.
    pub share: f64,
    measure: f64,
    phase: f64,
}

/// Quadrature over the sun's directions as the table interpolates them.
pub struct Furnace {
    views: Vec<Place>,
    azimuths: Vec<Place>,
}

impl Furnace {
    /// For a table of this resolution.
    pub fn new(phase: &Phase, map: &ViewSunMap, resolution: [usize; 4]) -> Self {
        let [_, _, azimuths, views] = resolution;
        let prepared = phase.prepare();
        Self {
            views: places(
                &GaussRule::new(VIEW_POINTS),
                views,
                |u| map.angle(u),
                |a| map.coordinate((0.5 * a).sin()),
                |a| (a.sin(), prepared.eval(a.cos())),
            ),
            // Both halves of the circle.
            azimuths: places(
                &GaussRule::new(AZIMUTH_POINTS),
                azimuths,
                azimuth_angle,
                |a| azimuth_coordinate(a.cos()),
                |_| (2.0, 1.0),
            ),
        }
    }

    /// Integrals over the sun's directions of order 1 and of the higher orders for one chord, whose
    /// two sources are told for an azimuth and a view-sun angle.
    pub fn integrals(&self, sources: impl Fn(&Place, &Place) -> [f64; 2]) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for a in &self.azimuths {
            for v in &self.views {
                let [single, multiple] = sources(a, v);
                let measure = a.measure * v.measure;
                sums[0] += measure * v.phase * single;
                sums[1] += measure * multiple;
            }
        }
        sums
    }
}

fn places(
    rule: &GaussRule,
    count: usize,
    angle: impl Fn(f64) -> f64,
    coordinate: impl Fn(f64) -> f64,
    density: impl Fn(f64) -> (f64, f64),
) -> Vec<Place> {
    let mut out = Vec::new();
    for cell in 0..count - 1 {
        let (from, to) = (angle(node(cell, count)), angle(node(cell + 1, count)));
        for &(u, w) in &rule.points {
            let a = from + (to - from) * u;
            let share = (coordinate(a) * (count - 1) as f64 - cell as f64).clamp(0.0, 1.0);
            let (measure, phase) = density(a);
            let measure = measure * w * (to - from);
            let (sine, cosine) = a.sin_cos();
            out.push(Place { sine, cosine, index: cell, share, measure, phase });
        }
    }
    out
}
