//! The last flight: the source along a view ray, weighted with the ray's transmittance.

use super::super::mapping::Geometry;
use super::super::single::opacity;
use super::grid::FieldGrid;
use super::sweep::{Emission, Point, flight_rule};

/// Points along a ray.
const POINTS: usize = 24;

/// The rule along the rays.
pub fn rule() -> Vec<(f64, f64)> {
    flight_rule(POINTS)
}

/// Mean of the emission over the chord weighted with the view's transmittance: radiance divided
/// by the chord's opacity. `view` is the emission's node of the geometry's view-sun angle.
pub fn gather(
    emission: &Emission,
    grid: &FieldGrid,
    rule: &[(f64, f64)],
    geometry: &Geometry,
    view: usize,
    optical_radius: f64,
) -> f64 {
    let (entry, dir, _) = geometry.ray();
    let chord = 2.0 * geometry.incidence;
    let opaque = opacity(optical_radius * chord);
    rule.iter()
        .map(|&(u, w)| {
            // Even steps in the share of light that comes from before t.
            let t = -(-u * opaque).ln_1p() / optical_radius;
            let x = entry + t.min(chord) * dir;
            let radius = x.length().max(1e-12);
            let off_axis = x.x.hypot(x.y).max(1e-12);
            let point = Point::new(grid, radius, x.z / radius, x.x / off_axis);
            w * f64::from(emission.at(view, point))
        })
        .sum()
}
