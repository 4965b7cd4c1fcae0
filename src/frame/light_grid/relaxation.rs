//! How far the sources of the light grid go from turn to turn: Chebyshev's relaxation (Richardson).
//!
//! A turn of scattering and sweeping makes sources `A s + b` of the sources `s`; the error of plain
//! turns shrinks by an eigenvalue of `A` each, the part of light that stays in the cloud for a turn.
//! Eigenvalues are at most 1, and negative only where matter scatters backward: not below the least
//! of the medium's moments. So n steps of lengths `1 / (1 - x_i)`, with `x_i` Chebyshev's points of
//! the interval, leave the least error over all of it; where none is negative `1 / T_n((2 - r) / r)`, for n = 16 and r = 0.95 0.011, where plain turns leave 0.44.

use std::f64::consts::PI;

use crate::frame::gpu_data::LightGridUniforms;

/// End of the interval of eigenvalues that the steps are made for. Those beyond shrink more slowly,
/// but never grow. On a clump of 200 spheres of thickness 30 (isotropic, seen from its dark side) nine
/// turns made for 0.95 come as far as 17 plain ones.
pub const LARGEST_EIGENVALUE: f64 = 0.95;

/// Least eigenvalue of a medium with these Legendre moments and albedo: at most 0.
pub fn least_eigenvalue(uniforms: &LightGridUniforms) -> f64 {
    let moment = uniforms.moment_first.min(uniforms.moment_second).min(0.0);
    f64::from(uniforms.albedo * moment)
}

/// Steps of the turns, at least one, for eigenvalues from `least` (at most 0) on. The first is 1: it
/// starts from the light, not from sources.
pub fn relaxations(turns: u32, least: f64) -> Vec<f32> {
    let steps = turns.saturating_sub(1) as usize;
    let mut result = vec![1.0];
    for point in stable_order(steps) {
        let root = (PI * (point as f64 + 0.5) / steps as f64).cos();
        let eigenvalue = least + 0.5 * (LARGEST_EIGENVALUE - least) * (1.0 + root);
        result.push((1.0 / (1.0 - eigenvalue)) as f32);
    }
    result
}

/// The points in an order in which long steps are followed by short ones that undo what they blow up
/// (Lebedev and Finogenov 1971; for other numbers than powers of 2 that of the next one): in order of
/// size, rounding errors of the first steps would grow by all others.
fn stable_order(count: usize) -> Vec<usize> {
    let mut order = vec![0];
    while order.len() < count {
        let last = 2 * order.len() - 1;
        order = order.iter().flat_map(|i| [*i, last - *i]).collect();
    }
    order.retain(|i| *i < count);
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the turns after the first leave of an error with this eigenvalue, at the end and at most
    /// on the way from some turn to the end.
    fn left(turns: u32, eigenvalue: f64) -> (f64, f64) {
        left_from(0.0, turns, eigenvalue)
    }

    fn left_from(least: f64, turns: u32, eigenvalue: f64) -> (f64, f64) {
        let steps = relaxations(turns, least);
        let factors: Vec<f64> =
            steps[1..].iter().map(|s| (1.0 - f64::from(*s) * (1.0 - eigenvalue)).abs()).collect();
        let ends = (0..=factors.len()).map(|first| factors[first..].iter().product());
        (factors.iter().product(), ends.fold(0.0, f64::max))
    }

    fn interval() -> impl Iterator<Item = f64> {
        (0..=2000).map(|i| LARGEST_EIGENVALUE * f64::from(i) / 2000.0)
    }

    #[test]
    fn the_steps_leave_what_chebyshevs_polynomial_leaves() {
        for turns in [2, 5, 9, 17, 33] {
            let n = f64::from(turns - 1);
            let beyond = (2.0 - LARGEST_EIGENVALUE) / LARGEST_EIGENVALUE;
            let least = 1.0 / (n * beyond.acosh()).cosh();
            let most = interval().map(|e| left(turns, e).0).fold(0.0, f64::max);
            // Steps are rounded to f32, 6e-8 of each; one step off its point by that changes the
            // product by the other factors, up to a few hundred.
            assert!((most / least - 1.0).abs() < 1e-3, "{turns} turns: {most} for {least}");
        }
    }

    #[test]
    fn eigenvalues_beyond_the_interval_do_not_grow() {
        for turns in [1, 2, 5, 9, 17, 33] {
            for i in 0..=100 {
                let e = LARGEST_EIGENVALUE + (1.0 - LARGEST_EIGENVALUE) * f64::from(i) / 100.0;
                assert!(left(turns, e).0 <= 1.0 + 1e-6, "{turns} turns, {e}");
            }
        }
    }

    #[test]
    fn errors_of_rounding_stay_small_on_the_way() {
        // In order of size the short steps would come last and blow up errors by 1e5 for 17 turns.
        for turns in [5, 9, 17, 33] {
            let most = interval().map(|e| left(turns, e).1).fold(0.0, f64::max);
            assert!(most < 40.0, "{turns} turns: {most}");
        }
    }

    #[test]
    fn backward_scattering_does_not_blow_up() {
        // Steps for none below 0 make thousands of an error at -0.5.
        assert!(left(9, -0.5).0 > 1e3);
        for least in [-0.99, -0.5, -0.1] {
            for turns in [5, 9, 17, 33] {
                for i in 0..=500 {
                    let e = least + (LARGEST_EIGENVALUE - least) * f64::from(i) / 500.0;
                    let (end, way) = left_from(least, turns, e);
                    assert!(end < 0.7 && way < 60.0, "{turns} turns, {e}: {end} {way}");
                }
            }
        }
    }

    #[test]
    fn every_point_is_taken_once() {
        for count in [1, 2, 3, 7, 8, 12, 32] {
            let mut order = stable_order(count);
            order.sort_unstable();
            assert_eq!(order, (0..count).collect::<Vec<_>>());
        }
        assert_eq!(relaxations(0, 0.0), [1.0]);
        assert_eq!(relaxations(1, -0.5), [1.0]);
    }
}
