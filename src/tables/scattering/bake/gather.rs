//! The last flight: the source along a view ray, weighted with the ray's transmittance.

use super::super::mapping::Geometry;
use super::super::single::opacity;
use super::GaussRule;
use super::grid::FieldGrid;

/// Points along a ray.
const POINTS: usize = 32;

/// Light scattered towards the table's view angles, at the grid's positions: by radius, zenith
/// angle, view-sun node, azimuth.
pub struct Emission {
    pub values: Vec<f64>,
    pub views: usize,
}

/// Mean of the emission over the chord weighted with the view's transmittance: radiance divided
/// by the chord's opacity. `view` is the node of the geometry's view-sun angle.
pub fn gather(
    emission: &Emission,
    grid: &FieldGrid,
    rule: &GaussRule,
    geometry: &Geometry,
    view: usize,
    optical_radius: f64,
) -> f64 {
    let (entry, dir, _) = geometry.ray();
    let chord = 2.0 * geometry.incidence;
    let opaque = opacity(optical_radius * chord);
    rule.points
        .iter()
        .map(|&(u, w)| {
            // Even steps in the share of light that comes from before t.
            let t = if opaque > 0.0 { -(-u * opaque).ln_1p() / optical_radius } else { 0.0 };
            let x = entry + t.min(chord) * dir;
            let radius = x.length();
            let zenith = (x.z / radius.max(1e-12)).clamp(-1.0, 1.0).acos();
            let off_axis = x.x.hypot(x.y);
            let azimuth =
                if off_axis > 1e-12 { (x.x / off_axis).clamp(-1.0, 1.0).acos() } else { 0.0 };
            w * emission.at(grid, grid.radius_index(radius), zenith, azimuth, view)
        })
        .sum()
}

/// The rule along the rays.
pub fn rule() -> GaussRule {
    GaussRule::new(POINTS)
}

impl Emission {
    fn at(&self, grid: &FieldGrid, radius: f64, zenith: f64, azimuth: f64, view: usize) -> f64 {
        let size = grid.size;
        let split = |at: f64, count: usize| {
            let i = (at as usize).min(count - 2);
            (i, (at - i as f64).clamp(0.0, 1.0))
        };
        let pi = std::f64::consts::PI;
        let (i, u) = split(radius, size.radius);
        let (j, v) = split(zenith / pi * (size.zenith - 1) as f64, size.zenith);
        let (k, w) = split(azimuth / pi * (size.azimuth - 1) as f64, size.azimuth);
        let mut sum = 0.0;
        for (i, u) in [(i, 1.0 - u), (i + 1, u)] {
            for (j, v) in [(j, 1.0 - v), (j + 1, v)] {
                let base = ((i * size.zenith + j) * self.views + view) * size.azimuth + k;
                sum += u * v * ((1.0 - w) * self.values[base] + w * self.values[base + 1]);
            }
        }
        sum
    }
}
