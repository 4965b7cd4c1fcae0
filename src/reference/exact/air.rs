//! The air before the clouds of a ray.

use glam::{DVec2, DVec3};

use crate::frame::cpu::air_shadow::{ABOVE, CloudLight, change_along, within};
use crate::frame::cpu::sky::Sky;
use crate::frame::view::picture_axes;
use crate::reference::particles::WorldParticle;

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
    /// Of a part of a ray, m, with what clouds change of it.
    pub(super) fn new(sky: &Sky, dir: DVec3, begin: f64, end: f64, change: &AirChange) -> Self {
        let step = (end - begin).max(1e-9) / (AIR_KNOTS - 1) as f64;
        let knots = (0..AIR_KNOTS)
            .map(|i| {
                let distance = begin + step * i as f64;
                let air = sky.air_between(dir, distance);
                (change.of(air.inscatter, distance), air.transmittance)
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

/// Steps of a ray through the air around clouds.
const CLOUDED_STEPS: usize = 192;

/// Where clouds change the light of the air: a box across the sun's rays, not much higher than the highest
/// particle.
pub(super) struct Clouded {
    axes: [DVec3; 2],
    low: DVec2,
    high: DVec2,
    highest: f64,
}

impl Clouded {
    /// By particles relative to the eye.
    pub(super) fn new(particles: &[WorldParticle], sun: DVec3) -> Self {
        let axes = picture_axes(sun);
        let none = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (low, high) = particles.iter().fold(none, |(low, high), p| {
            let place = DVec2::from(axes.map(|axis| p.centre.dot(axis)));
            (low.min(place - p.radius), high.max(place + p.radius))
        });
        let top = |p: &WorldParticle| p.centre.y + p.radius + ABOVE;
        let highest = particles.iter().map(top).fold(f64::NEG_INFINITY, f64::max);
        Self { axes, low, high, highest }
    }

    /// Part of a ray from the eye up to a distance, m.
    fn span(&self, dir: DVec3, far: f64) -> [f64; 2] {
        let [u, v] = self.axes.map(|axis| dir.dot(axis));
        let span = within([0.0, far], self.low.x, self.high.x, u);
        let span = within(span, self.low.y, self.high.y, v);
        within(span, f64::NEG_INFINITY, self.highest, dir.y)
    }
}

/// What clouds change of the light of the air of a ray, by distance.
pub(super) struct AirChange {
    distances: Vec<f64>,
    changes: Vec<DVec3>,
}

impl AirChange {
    /// Of a ray up to a distance, m.
    pub(super) fn new(
        sky: &Sky,
        clouded: &Clouded,
        dir: DVec3,
        far: f64,
        light: &CloudLight<'_>,
    ) -> Self {
        let [begin, end] = clouded.span(dir, far);
        // Also false where there are no particles.
        if !(begin < end && end.is_finite()) {
            return Self { distances: Vec::new(), changes: Vec::new() };
        }
        let share = |i: usize| i as f64 / CLOUDED_STEPS as f64;
        let distances: Vec<f64> =
            (0..=CLOUDED_STEPS).map(|i| begin + (end - begin) * share(i).powi(2)).collect();
        let changes = change_along(sky, dir, &distances, 1, light);
        Self { distances, changes }
    }

    /// The light of the air before a distance (m) as clouds leave it.
    pub(super) fn of(&self, light: DVec3, distance: f64) -> DVec3 {
        let next = self.distances.partition_point(|d| *d < distance);
        let at = |i: usize| self.distances.get(i).zip(self.changes.get(i));
        let change = match (at(next.wrapping_sub(1)), at(next)) {
            (Some((a, before)), Some((b, after))) => before.lerp(*after, (distance - a) / (b - a)),
            (Some((_, all)), None) => *all,
            _ => DVec3::ZERO,
        };
        (light + change).max(DVec3::ZERO)
    }
}
