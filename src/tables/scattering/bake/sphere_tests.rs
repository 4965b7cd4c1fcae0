//! The solver's own operators against published spheres.

use super::sweep::mean_opacity;
use super::*;

#[test]
fn orders_fall_as_in_critical_spheres() {
    for case in critical::CRITICAL {
        let (ratio, profile) = critical::order_ratio(case.optical_radius);
        // Twenty radii, 28 x 11 directions.
        assert!(
            (ratio * case.secondaries - 1.0).abs() < 2e-3,
            "{ratio} {}",
            1.0 / case.secondaries
        );
        for (got, want) in profile.into_iter().zip(case.profile) {
            assert!((got - want).abs() < 2e-3, "{got} {want}");
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
