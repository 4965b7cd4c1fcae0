//! What a bake says about its own accuracy.

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
    /// Photons traced.
    pub photons: u64,
    /// Mean number of scatterings of a photon that enters.
    pub mean_orders: f64,
    /// Share of all scatterings beyond the 64th; they are in the table like all others.
    pub beyond_64: f64,
    /// Light out over light in before each chord was scaled to conserve energy, albedo 1 only:
    /// least and greatest over the chords.
    pub conservation: Option<[f64; 2]>,
}

impl RadiusReport {
    /// From the weights by order and the factors that conserve energy.
    pub fn new(optical_radius: f64, by_order: &[f64], photons: u64, scales: &[f64]) -> Self {
        let total: f64 = by_order.iter().sum();
        let last = by_order.last().copied().unwrap_or(0.0);
        let fold =
            |start: f64, f: fn(f64, f64) -> f64| scales.iter().map(|s| 1.0 / s).fold(start, f);
        Self {
            optical_radius,
            photons,
            mean_orders: total / photons.max(1) as f64,
            beyond_64: if total > 0.0 { last / total } else { 0.0 },
            conservation: (!scales.is_empty())
                .then(|| [fold(f64::INFINITY, f64::min), fold(0.0, f64::max)]),
        }
    }
}
