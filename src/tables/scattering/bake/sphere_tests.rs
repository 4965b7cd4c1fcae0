//! The solver's own operators against published spheres.

use super::sweep::mean_opacity;
use super::*;

/// Optical radius, number of secondaries c for which the sphere is critical, and mean intensity at
/// a quarter, half and three quarters of the radius relative to the centre (Sood, Forster and
/// Parsons, LA-13511; from Kaper, Lindeman and Leaf 1974).
const CRITICAL: [(f64, f64, [f64; 3]); 2] = [
    (1.985_343_432_4, 1.40, [0.935_380_06, 0.755_753_52, 0.498_843_64]),
    (2.424_824_980_2, 1.30, [0.932_449_07, 0.745_533_32, 0.480_954_13]),
];

#[test]
fn orders_fall_as_in_critical_spheres() {
    let phase = Phase::hg(0.0).expect("in range");
    let solver = Solver::new(&phase, 1.0, vec![0.0], 1e-3);
    for (optical_radius, secondaries, profile) in CRITICAL {
        let size = FieldSize::for_radius(optical_radius, 1.0);
        let grid = FieldGrid::new(size, solver.map, optical_radius);
        let flights = Flights::new(&grid, optical_radius, &solver.solid_angles);
        let outputs = solver.further.within.outputs();
        let mut light = vec![1.0f32; size.radius * size.zenith * outputs];
        let mut ratio = 0.0;
        // The second-slowest mode falls more than twice as quickly: 40 orders leave 1e-12 of it.
        for _ in 0..40 {
            let emission = Emission::new(&grid, &light, size.view_sun);
            let next = solver.scatter(&solver.further.within, &flights.arriving(&grid, &emission));
            let total = |v: &[f32]| v.iter().map(|v| f64::from(*v)).sum::<f64>();
            ratio = total(&next) / total(&light);
            let scale = (1.0 / ratio) as f32;
            light = next.into_iter().map(|v| v * scale).collect();
        }
        // Twenty radii, 28 x 11 directions.
        assert!((ratio * secondaries - 1.0).abs() < 2e-3, "{ratio} {}", 1.0 / secondaries);
        // Isotropic scattering emits the mean intensity.
        let emission = Emission::new(&grid, &light, size.view_sun);
        let at = |r: f64| f64::from(emission.at(14, sweep::Point::new(&grid, r, 0.0, 0.0)));
        // Even in the radius: from two small radii, outside the core that is taken as uniform.
        let (a, b) = (0.15f64, 0.3f64);
        let centre = (at(a) * b * b - at(b) * a * a) / (b * b - a * a);
        for (r, want) in [0.25, 0.5, 0.75].into_iter().zip(profile) {
            let got = at(r) / centre;
            assert!((got - want).abs() < 2e-3, "{r}: {got} {want}");
        }
    }
}

#[test]
fn uniform_light_escapes_as_in_the_closed_form() {
    let escape = |t: f64| {
        let rule = GaussRule::new(64);
        rule.integrate(0.0, 1.0, |q| {
            // Graded towards the surface, where escape changes quickly.
            let r = 1.0 - (1.0 - q).powi(3);
            9.0 * (1.0 - q).powi(2) * r * r * (1.0 - mean_opacity(r, t))
        })
    };
    let published = [
        (0.5, 0.707_276_65),
        (1.0, 0.527_252_19),
        (2.0, 0.332_417_73),
        (5.0, 0.147_001_5),
        (14.0, 0.053_434_77),
    ];
    for (t, want) in published {
        assert!((escape(t) - want).abs() < 1e-5 * want, "{t}: {} {want}", escape(t));
    }
    // The closed form loses its digits there; its series begins with 1 - 3 t / 4.
    for t in [1e-3, 1e-6] {
        assert!(((1.0 - escape(t)) / (0.75 * t) - 1.0).abs() < t, "{t}");
    }
}
