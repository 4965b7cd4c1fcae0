//! How far pictures are from each other.

use cumuli::frame::cpu::segments::Composed;
use glam::DVec3;

/// Root mean squares of the errors of transmittance, and of radiance over the mean radiance; the
/// largest error of transmittance; RMS of the distance relative to the distance, where more than
/// a tenth of the light is taken.
#[derive(Debug, Default)]
pub(super) struct Errors {
    pub(super) transmittance: f64,
    pub(super) radiance: f64,
    pub(super) worst: f64,
    pub(super) distance: f64,
}

pub(super) fn errors(found: &(Vec<[f32; 4]>, Vec<f32>), expected: &[Composed]) -> Errors {
    let mut sums = Errors::default();
    let (mut mean, mut seen) = (0.0, 0.0);
    for ((pixel, distance), expected) in found.0.iter().zip(&found.1).zip(expected) {
        let [r, g, b, transmittance] = pixel.map(f64::from);
        let off = transmittance - expected.transmittance;
        sums.transmittance += off * off;
        sums.worst = sums.worst.max(off.abs());
        sums.radiance += (DVec3::new(r, g, b) - expected.radiance).length_squared();
        mean += expected.radiance.length();
        if expected.transmittance < 0.9 {
            sums.distance += (f64::from(*distance) / expected.distance - 1.0).powi(2);
            seen += 1.0;
        }
    }
    let count = expected.len() as f64;
    assert!(mean > 0.0 && seen > 0.02 * count, "nothing to see: {mean} {seen}");
    Errors {
        transmittance: (sums.transmittance / count).sqrt(),
        radiance: (sums.radiance / count).sqrt() / (mean / count),
        worst: sums.worst,
        distance: (sums.distance / seen).sqrt(),
    }
}
