//! Light scattered once in a uniform sphere: a quadrature without noise.

use std::sync::LazyLock;

use super::bake::GaussRule;
use super::mapping::Geometry;

/// Panels in each half of the chord and points in each panel: the worst error seen against twice
/// as many is 2e-7 of the value, at optical radius 100.
const PANELS: usize = 10;
const POINTS: usize = 8;

/// The same for the many flights inside the solver, which need three digits.
const FEW_PANELS: usize = 3;
const FEW_POINTS: usize = 4;

static FEW_RULE: LazyLock<GaussRule> = LazyLock::new(|| GaussRule::new(FEW_POINTS));
static RULE: LazyLock<GaussRule> = LazyLock::new(|| GaussRule::new(POINTS));

/// `1 - exp(-tau)` with all its digits.
pub fn opacity(tau: f64) -> f64 {
    -(-tau).exp_m1()
}

/// Single-scattered source without phase function and albedo: the mean of the sun's transmittance
/// over the chord, weighted with that of the view.
pub fn single_source(geometry: &Geometry, optical_radius: f64) -> f64 {
    let (entry, dir, sun) = geometry.ray();
    let flight = Flight {
        length: 2.0 * geometry.incidence,
        height: entry.dot(sun),
        climb: dir.dot(sun),
        // A chord begins on the surface.
        depth: 0.0,
        outward: -geometry.incidence,
    };
    flight.mean_transmittance(optical_radius, PANELS, &RULE)
}

/// A straight line from a place in the sphere to its surface.
struct Flight {
    length: f64,
    /// Of the place over the plane through the centre that faces the sun.
    height: f64,
    /// Cosine between line and sun.
    climb: f64,
    /// 1 minus the square of the place's distance from the centre.
    depth: f64,
    /// Place times direction.
    outward: f64,
}

impl Flight {
    /// Length of the sun's way to the point at `t`.
    fn sun_path(&self, t: f64) -> f64 {
        let along = self.height + t * self.climb;
        // 1 - |x|^2 falls to 0 at the end of the line.
        let inside = (self.depth - t * (2.0 * self.outward + t)).max(0.0);
        // Rationalised where the difference would cancel.
        let root = (along * along + inside).sqrt();
        if along > 0.0 { inside / (root + along).max(f64::MIN_POSITIVE) } else { root - along }
    }

    /// Mean of the sun's transmittance over the line, weighted with that of the view.
    fn mean_transmittance(&self, optical_radius: f64, panels: usize, rule: &GaussRule) -> f64 {
        if self.length <= 0.0 {
            return (-optical_radius * self.sun_path(0.0)).exp();
        }
        let mut bright = 0.0;
        self.along(optical_radius, panels, rule, |t, measure| {
            bright += measure * (-optical_radius * (t + self.sun_path(t))).exp();
        });
        bright * optical_radius / opacity(optical_radius * self.length)
    }

    /// Quadrature along the line: `f` gets places and measures.
    fn along(
        &self,
        optical_radius: f64,
        panels: usize,
        rule: &GaussRule,
        mut f: impl FnMut(f64, f64),
    ) {
        // Panels crowd at both ends, where the path has square-root ends and the view is clear.
        let half = 0.5 * self.length;
        let stretch = ((optical_radius * half).max(1.0) * 4.0).asinh();
        let scale = half / stretch.sinh();
        // Squares at the ends take the square root out of the first panel.
        let place = |k: usize| (scale * (stretch * k as f64 / panels as f64).sinh()).sqrt();
        let mut a = 0.0;
        for k in 1..=panels {
            let b = place(k);
            for &(u, w) in &rule.points {
                let root = a + (b - a) * u;
                let measure = w * (b - a) * 2.0 * root;
                f(root * root, measure);
                f(self.length - root * root, measure);
            }
            a = b;
        }
    }
}

/// Source of order 1 without phase function and albedo for the line from a place within the
/// sphere, given by its distance from the centre and its angle from the sun axis, in a direction
/// given by its angle from the sun and its azimuth relative to the place's; angles as sine and cosine.
pub fn source_from_within(
    radius: f64,
    zenith: (f64, f64),
    view_sun: (f64, f64),
    azimuth_cosine: f64,
    optical_radius: f64,
) -> f64 {
    let outward = radius * (zenith.0 * view_sun.0 * azimuth_cosine + zenith.1 * view_sun.1);
    let depth = ((1.0 - radius) * (1.0 + radius)).max(0.0);
    let root = (outward * outward + depth).sqrt();
    let length = if outward > 0.0 { depth / (root + outward) } else { root - outward };
    let flight = Flight { length, height: radius * zenith.1, climb: view_sun.1, depth, outward };
    flight.mean_transmittance(optical_radius, FEW_PANELS, &FEW_RULE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plain midpoint rule with many points.
    fn brute(geometry: &Geometry, r: f64) -> f64 {
        const N: usize = 400_000;
        let (entry, dir, sun) = geometry.ray();
        let chord = 2.0 * geometry.incidence;
        let sum: f64 = (0..N)
            .map(|i| {
                let u = (i as f64 + 0.5) / N as f64;
                let t = -(1.0 - u * opacity(r * chord)).ln() / r;
                let x = entry + t * dir;
                let a = x.dot(sun);
                (-r * ((a * a + 1.0 - x.length_squared()).max(0.0).sqrt() - a)).exp()
            })
            .sum();
        sum / N as f64
    }

    #[test]
    fn agrees_with_a_plain_sum() {
        for r in [0.05, 1.0, 8.0, 100.0] {
            for incidence in [0.05, 0.4, 1.0] {
                for azimuth in [0.1, 1.6, 3.0] {
                    for view_sun in [0.0, 0.01, 0.8, 1.6, 2.5, 3.1] {
                        let g = Geometry { incidence, azimuth, view_sun };
                        let (got, want) = (single_source(&g, r), brute(&g, r));
                        // The midpoint sum itself is good to about 1e-6 of the brightest ray.
                        assert!((got - want).abs() < 2e-6 + 1e-4 * want, "{r} {g:?}: {got} {want}");
                    }
                }
            }
        }
    }

    #[test]
    fn towards_the_sun_it_is_the_closed_form() {
        for r in [1e-4, 0.3, 4.0, 20.0] {
            for incidence in [0.1, 0.7, 1.0] {
                let g = Geometry { incidence, azimuth: 1.0, view_sun: 0.0 };
                let tau = 2.0 * incidence * r;
                let want = tau * (-tau).exp() / opacity(tau);
                assert!((single_source(&g, r) / want - 1.0).abs() < 1e-6, "{r} {incidence}");
            }
        }
    }
}
