//! Light of a piece of a ray: twin of `shaders/shared/lighting.wgsl`, where the model is told.

use glam::DVec3;

use super::light_grid::FieldSeen;
use super::segments::mean_scatter_fraction;
use crate::frame::gpu_data::ParticleLight;
use crate::medium::Halo;

/// Share of a particle in the matter on the sun's ray through its middle from which on its own table
/// counts, and from which on it counts alone; as in the shader.
const ALONE: [f64; 2] = [0.5, 0.95];
/// Matter around it over its own, up to which it is alone and from which on it is not.
const CROWD: [f64; 2] = [1.5, 2.5];

/// Optical depth along a mean chord.
fn mean_depth(optical_radius: f64) -> f64 {
    4.0 / 3.0 * optical_radius
}

/// Optical depth of others on the sun's ray through a particle's middle from which on it is not alone.
pub fn crowding_depth(optical_radius: f64) -> f64 {
    mean_depth(optical_radius) * (1.0 / ALONE[0] - 1.0)
}

/// How much of a particle's sunlight its own table tells: 0 among others, 1 alone. `others`: optical
/// depth of the others on the sun's ray through its middle; `crowd`: matter around it over its own.
pub fn aloneness(optical_radius: f64, others: f64, crowd: f64) -> f64 {
    let own = mean_depth(optical_radius);
    let smooth = |x: f64, [begin, end]: [f64; 2]| {
        let t = ((x - begin) / (end - begin)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    smooth(own / (own + others).max(1e-20), ALONE) * (1.0 - smooth(crowd, CROWD))
}

fn mean_transmittance(tau: f64) -> f64 {
    if tau > 0.0 { -(-tau).exp_m1() / tau } else { 1.0 }
}

/// Opacity of a piece, seen through its particle, over the same in the scaled medium. `before`,
/// `tau`: scaled optical depth from the last gap to the piece, and of it.
pub fn own_share(before: f64, tau: f64, delta_scale: f64) -> f64 {
    let denser = 1.0 / delta_scale;
    denser * (before * (1.0 - denser)).exp() * mean_transmittance(tau * denser)
        / mean_transmittance(tau)
}

/// Mean of `exp(-depth)` over the light that leaves a piece of optical depth `tau`, where the depth
/// goes from `front` to `back`, linear along the piece.
pub fn mean_sunlight(front: f64, back: f64, tau: f64) -> f64 {
    let both = tau + back - front;
    let peak = (-(if both < 0.0 { back + tau } else { front })).exp();
    peak * mean_transmittance(both.abs()) / mean_transmittance(tau)
}

fn colour([r, g, b, _]: [f32; 4]) -> DVec3 {
    DVec3::new(r.into(), g.into(), b.into())
}

/// What lights a chord.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChordLight {
    /// Irradiance of the sun, without the share that is alone.
    pub sun: DVec3,
    /// Radiance from above.
    pub above: DVec3,
    /// Radiance from below.
    pub below: DVec3,
    /// Source of the share that is alone in sunlight, per opacity in the unscaled medium.
    pub own: DVec3,
}

impl ChordLight {
    /// Of a chord; `own`: source of its particle alone in undimmed sunlight.
    pub fn new(light: &ParticleLight, own: f64) -> Self {
        let alone = f64::from(light.ambient_below[3]);
        let sun = colour(light.sun_irradiance);
        Self {
            sun: (1.0 - alone) * sun,
            above: colour(light.ambient_above),
            below: colour(light.ambient_below),
            own: alone * own * (-f64::from(light.ambient_above[3])).exp() * sun,
        }
    }
}

/// Scaled optical depth to the sun at a point, m relative to the eye.
pub type SunDepth<'a> = &'a (dyn Fn(DVec3) -> f64 + Sync);

/// What all chords of one ray share.
pub struct RayLight<'a> {
    /// Light that the clouds scatter among themselves.
    pub field: &'a FieldSeen,
    /// Light around the sun.
    pub halo: &'a Halo,
    /// Optical depth to the sun.
    pub sun_depth: SunDepth<'a>,
    /// Direction of view.
    pub dir: DVec3,
    /// Sine of half the angle between view and sun.
    pub half_sine: f64,
    /// Optical depth of peak scatterings per scaled one.
    pub halo_share: f64,
    /// Source of order 1 in undimmed sunlight, without halo: 1/sr.
    pub first: f64,
    /// Scaled extinction over the true one.
    pub delta_scale: f64,
}

/// Scaled optical depth before a piece.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Before {
    /// From the eye on.
    pub view: f64,
    /// From the last place on where there was no particle.
    pub since_gap: f64,
}

/// The light of the surroundings on a piece.
#[derive(Clone, Copy, Debug)]
pub struct PieceLight {
    seen: DVec3,
    // Source of order 1 per irradiance over the air.
    once: f64,
    // What a particle alone sends counts by this.
    own_share: f64,
}

impl RayLight<'_> {
    /// Of a piece from `cursor` to `next` (m along the ray) of optical depth `tau`, light from the
    /// mean depth `seen` into it (a fraction).
    pub fn piece(&self, cursor: f64, next: f64, tau: f64, seen: f64, before: Before) -> PieceLight {
        let depths = [cursor, next].map(|t| (self.sun_depth)(t * self.dir));
        self.piece_below([cursor, next], tau, seen, before, depths)
    }

    /// The same with the depth to the sun at its two ends.
    pub fn piece_below(
        &self,
        [cursor, next]: [f64; 2],
        tau: f64,
        seen: f64,
        before: Before,
        [front, back]: [f64; 2],
    ) -> PieceLight {
        let at = |t: f64| self.field.at(t * self.dir);
        let seen = at(cursor).lerp(at(next), seen);
        let deep = mean_scatter_fraction(tau);
        let path = self.halo_share * (front + (back - front) * deep + deep * tau + before.view);
        let first = self.first * self.halo.factor(self.half_sine, path);
        let once = first * mean_sunlight(front, back, tau);
        PieceLight { seen, once, own_share: own_share(before.since_gap, tau, self.delta_scale) }
    }
}

impl PieceLight {
    /// Source of a chord on the piece.
    pub fn source(&self, light: &ChordLight) -> DVec3 {
        self.own_share * light.own
            + (self.seen.x + self.once) * light.sun
            + self.seen.y * light.above
            + (self.seen.z - self.seen.y).max(0.0) * light.below
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_light_is_handed_on() {
        let all = DVec3::new(0.3, 0.2, 0.1);
        let light = ChordLight { above: all, below: all, ..ChordLight::default() };
        let piece = PieceLight { seen: DVec3::new(0.1, 0.4, 1.0), once: 0.3, own_share: 1.0 };
        assert!((piece.source(&light) - all).length() < 1e-15);
    }

    #[test]
    fn a_particle_alone_shines_as_its_table_says() {
        for depth in [0.01, 1.3, 20.0] {
            // In pieces of 1, 2 and 3 sixths: their sum is what leaves the true chord.
            let (mut before, mut seen): (f64, f64) = (0.0, 0.0);
            for tau in [depth / 6.0, depth / 3.0, depth / 2.0] {
                seen += own_share(before, tau, 0.4) * (-before).exp() * -(-tau).exp_m1();
                before += tau;
            }
            let expected = -(-depth / 0.4_f64).exp_m1();
            assert!((seen / expected - 1.0).abs() < 1e-12, "{seen} {expected}");
        }
    }

    #[test]
    fn mean_sunlight_is_the_integral() {
        for (front, back, tau) in
            [(0.0, 0.0, 1.0), (2.0, 5.0, 0.5), (5.0, 1.0, 4.0), (6.0, 0.0, 2.0), (3.0, 1.0, 9.0)]
        {
            let steps = 20_000;
            let (mut light, mut all) = (0.0, 0.0);
            for i in 0..steps {
                let t = (f64::from(i) + 0.5) / f64::from(steps);
                light += (-tau * t - front - (back - front) * t).exp();
                all += (-tau * t).exp();
            }
            let found = mean_sunlight(front, back, tau);
            // The midpoint rule is off by (tau + back - front)^2 / (24 steps^2).
            assert!((found / (light / all) - 1.0).abs() < 1e-7, "{front} {back} {tau}: {found}");
        }
    }

    #[test]
    fn others_on_the_ray_of_the_sun_or_around_end_being_alone() {
        assert_eq!(aloneness(1.0, 0.0, 1.0), 1.0);
        assert_eq!(aloneness(1.0, 2.0, 1.0), 0.0);
        assert_eq!(aloneness(1.0, 0.0, 3.0), 0.0);
    }
}
