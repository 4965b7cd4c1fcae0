//! What a bake says about its own accuracy.

use super::bake::Convergence;
use serde::{Deserialize, Serialize};

/// Figures of a bake.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScatteringReport {
    /// One entry for each optical radius.
    pub radii: Vec<RadiusReport>,
}

/// Figures of a bake at one optical radius.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RadiusReport {
    /// Extinction times radius.
    pub optical_radius: f64,
    /// Steps of the iteration over scattering orders.
    pub steps: usize,
    /// Change by the last step, as a share of the mean light at each place, root mean square.
    pub residual: f64,
    /// Light out over light in before each chord was scaled to conserve energy, albedo 1 only:
    /// least and greatest over the chords up to an impact parameter of 0.95.
    pub conservation: Option<[f64; 2]>,
}

impl RadiusReport {
    /// From the iteration and the factors that conserve energy.
    pub(super) fn new(optical_radius: f64, convergence: &Convergence, scales: &[f64]) -> Self {
        let fold =
            |start: f64, f: fn(f64, f64) -> f64| scales.iter().map(|s| 1.0 / s).fold(start, f);
        Self {
            optical_radius,
            steps: convergence.steps,
            residual: convergence.residual,
            conservation: (!scales.is_empty())
                .then(|| [fold(f64::INFINITY, f64::min), fold(0.0, f64::max)]),
        }
    }
}
