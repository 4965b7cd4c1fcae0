//! The air before the clouds of a ray.

use glam::DVec3;

use crate::frame::cpu::sky::Sky;

/// Places along the clouds of a ray at which the air is worked out; between them it is
/// interpolated: over 20 km of clouds the error is below 1e-4 of the air's light.
const AIR_KNOTS: usize = 24;

/// Light of the air and its transmittance at some distances of a ray, interpolated.
pub(super) struct AirAlong {
    begin: f64,
    step: f64,
    knots: Vec<(DVec3, DVec3)>,
}

impl AirAlong {
    /// Of a part of a ray, m.
    pub(super) fn new(sky: &Sky, dir: DVec3, begin: f64, end: f64) -> Self {
        let step = (end - begin).max(1e-9) / (AIR_KNOTS - 1) as f64;
        let knots = (0..AIR_KNOTS)
            .map(|i| {
                let air = sky.air_between(dir, begin + step * i as f64);
                (air.inscatter, air.transmittance)
            })
            .collect();
        Self { begin, step, knots }
    }

    /// Light and transmittance of the air before a distance (m).
    pub(super) fn at(&self, distance: f64) -> (DVec3, DVec3) {
        let place = ((distance - self.begin) / self.step).clamp(0.0, (AIR_KNOTS - 1) as f64);
        let low = (place as usize).min(AIR_KNOTS - 2);
        let ((a, b), (c, d)) = (self.knots[low], self.knots[low + 1]);
        let share = place - low as f64;
        (a.lerp(c, share), b.lerp(d, share))
    }
}
