//! Light scattered once in a uniform sphere: a quadrature without noise.

use std::sync::LazyLock;

use super::bake::GaussRule;
use super::mapping::Geometry;

/// Panels in each half of the chord and points in each panel: the worst error seen against twice
/// as many is 2e-7 of the value, at optical radius 100.
const PANELS: usize = 10;
const POINTS: usize = 8;

static RULE: LazyLock<GaussRule> = LazyLock::new(|| GaussRule::new(POINTS));

/// `1 - exp(-tau)` with all its digits.
pub fn opacity(tau: f64) -> f64 {
    -(-tau).exp_m1()
}

/// Optical depth (in optical radii) that stands for the sun's attenuation in the single-scattered
/// light of a chord: the source is `albedo * exp(-optical_radius * path)`.
///
/// The mean of `exp(-R s)` over the chord, weighted with the view's transmittance, is what the
/// single scattering is; as an effective path `s` it stays between 0 and 2 and tends to the plain
/// mean of the path in the thin limit, which a value that spans forty powers of ten does not.
pub fn effective_sun_path(geometry: &Geometry, optical_radius: f64) -> f64 {
    let (dark, bright) = mean_sun_light(geometry, optical_radius);
    // Both are the same number: take the one that did not cancel. No path is longer than 2.
    let depth = if dark < 0.5 { -(-dark).ln_1p() } else { -bright.max(f64::MIN_POSITIVE).ln() };
    (depth / optical_radius).clamp(0.0, 2.0)
}

/// Means of the sun's opacity and of its transmittance over the chord, weighted with the view's
/// transmittance. They add up to 1; each keeps its digits where it is small.
fn mean_sun_light(geometry: &Geometry, optical_radius: f64) -> (f64, f64) {
    let chord = 2.0 * geometry.incidence;
    let (entry, dir, sun) = geometry.ray();
    let (height, climb) = (entry.dot(sun), dir.dot(sun));
    let path = |t: f64| {
        let along = height + t * climb;
        // 1 - |x|^2 on the chord is t (chord - t).
        let inside = (t * (chord - t)).max(0.0);
        // Rationalised where the difference would cancel.
        let root = (along * along + inside).sqrt();
        if along > 0.0 { inside / (root + along).max(f64::MIN_POSITIVE) } else { root - along }
    };
    if chord <= 0.0 {
        let dark = opacity(optical_radius * path(0.0));
        return (dark, 1.0 - dark);
    }
    // Panels crowd at both ends, where the path has square-root ends and the view is clear.
    let half = 0.5 * chord;
    let scale = (optical_radius * half).max(1.0);
    let stretch = (scale * 4.0).asinh();
    let place = |k: usize| half * (stretch * k as f64 / PANELS as f64).sinh() / stretch.sinh();
    let mut dark = 0.0;
    let mut bright = 0.0;
    for k in 0..PANELS {
        let (near, far) = (place(k), place(k + 1));
        for flip in [false, true] {
            for &(u, w) in &RULE.points {
                // Squares at the ends take the square root out of the first panel.
                let (a, b) = (near.sqrt(), far.sqrt());
                let root = a + (b - a) * u;
                let from_end = root * root;
                let t = if flip { chord - from_end } else { from_end };
                let measure = w * (b - a) * 2.0 * root;
                let sun_depth = optical_radius * path(t);
                let view_depth = optical_radius * t;
                dark += measure * (-view_depth).exp() * opacity(sun_depth);
                bright += measure * (-view_depth - sun_depth).exp();
            }
        }
    }
    let view = opacity(optical_radius * chord) / optical_radius;
    (dark / view, bright / view)
}

/// Single-scattered source without phase function and albedo.
pub fn single_source(geometry: &Geometry, optical_radius: f64) -> f64 {
    (-optical_radius * effective_sun_path(geometry, optical_radius)).exp()
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
