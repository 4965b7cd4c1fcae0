//! The solver's own operators in spheres that others have solved.

use super::sweep::Point;
use super::{Emission, FieldGrid, FieldSize, Flights, Solver};
use crate::medium::Phase;

/// An isotropically scattering sphere that is critical with `secondaries` photons a collision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Critical {
    /// Extinction times radius.
    pub optical_radius: f64,
    /// Photons that come out of each collision; without gain, orders fall by its inverse.
    pub secondaries: f64,
    /// Mean intensity at a quarter, half and three quarters of the radius relative to the centre.
    pub profile: [f64; 3],
}

/// Sood, Forster and Parsons, LA-13511; from Kaper, Lindeman and Leaf 1974.
pub const CRITICAL: [Critical; 2] = [
    Critical {
        optical_radius: 1.985_343_432_4,
        secondaries: 1.40,
        profile: [0.935_380_06, 0.755_753_52, 0.498_843_64],
    },
    Critical {
        optical_radius: 2.424_824_980_2,
        secondaries: 1.30,
        profile: [0.932_449_07, 0.745_533_32, 0.480_954_13],
    },
];

/// Orders followed: the second-slowest mode falls more than twice as quickly, and 40 leave 1e-12 of it.
const ORDERS: usize = 40;

/// Ratio of successive orders of scattering, and the profile of the mean intensity as in
/// [`Critical::profile`], by the grid and the flights that tables are made with.
pub fn order_ratio(optical_radius: f64) -> (f64, [f64; 3]) {
    let solver = Solver::new(&Phase::Hg { g: 0.0 }, 1.0, vec![0.0], 1e-3);
    let size = FieldSize::for_radius(optical_radius, 1.0);
    let grid = FieldGrid::new(size, solver.map, optical_radius);
    let flights = Flights::new(&grid, optical_radius, &solver.solid_angles);
    let outputs = solver.further.within.outputs();
    let mut light = vec![1.0f32; size.radius * size.zenith * outputs];
    let mut ratio = 0.0;
    for _ in 0..ORDERS {
        let emission = Emission::new(&grid, &light, size.view_sun);
        let next = solver.scatter(&solver.further.within, &flights.arriving(&grid, &emission));
        let total = |v: &[f32]| v.iter().map(|v| f64::from(*v)).sum::<f64>();
        ratio = total(&next) / total(&light);
        let scale = (1.0 / ratio) as f32;
        light = next.into_iter().map(|v| v * scale).collect();
    }
    // Isotropic scattering emits the mean intensity.
    let emission = Emission::new(&grid, &light, size.view_sun);
    let view = size.view_sun / 2;
    let at = |r: f64| f64::from(emission.at(view, Point::new(&grid, r, 0.0, 0.0)));
    // Even in the radius: from two small radii, outside the core that is taken as uniform.
    let (a, b) = (0.15f64, 0.3f64);
    let centre = (at(a) * b * b - at(b) * a * a) / (b * b - a * a);
    (ratio, [0.25, 0.5, 0.75].map(|r| at(r) / centre))
}
