//! The source function of a particle: twin of `shaders/shared/lighting.wgsl`, where the model is
//! told.

use glam::DVec3;

use crate::frame::gpu_data::ParticleLight;
use crate::medium::Halo;

/// Share of a particle in the matter on the sun's ray through its middle from which on its own table
/// counts, and from which on it counts alone; as in the shader.
const ALONE: [f64; 2] = [0.5, 0.95];
/// Matter around it over its own, up to which it is alone and from which on it is not.
const CROWD: [f64; 2] = [1.5, 2.5];

/// Affine optical depth at a place in the particle, in radii from its centre; never negative.
pub fn depth_at(affine: [f32; 4], place: DVec3) -> f64 {
    let [constant, x, y, z] = affine.map(f64::from);
    (constant + DVec3::new(x, y, z).dot(place)).max(0.0)
}

/// Distance, in radii, from a place in the unit sphere to its surface along a direction.
pub fn way_out(place: DVec3, direction: DVec3) -> f64 {
    let along = place.dot(direction);
    ((along * along + 1.0 - place.length_squared()).max(0.0).sqrt() - along).max(0.0)
}

/// How much of a particle's sunlight its own table tells: 0 among others, 1 alone. `others`: optical
/// depth of the others on the sun's ray through its middle; `crowd`: matter around it over its own.
pub fn aloneness(optical_radius: f64, others: f64, crowd: f64) -> f64 {
    let own = 4.0 / 3.0 * optical_radius;
    let smooth = |x: f64, [begin, end]: [f64; 2]| {
        let t = ((x - begin) / (end - begin)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    smooth(own / (own + others).max(1e-20), ALONE) * (1.0 - smooth(crowd, CROWD))
}

/// What the source function depends on besides the light.
#[derive(Clone, Copy, Debug)]
pub struct SourceInputs {
    /// Radii from the centre: where light is scattered in the mean.
    pub place: DVec3,
    /// Radii from the centre: where the chord becomes visible.
    pub begin: DVec3,
    /// And where it ends.
    pub end: DVec3,
    /// Towards the sun.
    pub sun: DVec3,
    /// Light grid there: per sun irradiance, per radiance from above, per radiance all around.
    pub field: DVec3,
    /// Of [`aloneness`].
    pub alone: f64,
    /// Of the particle's table: order 1 without phase function, orders >= 2.
    pub scattered: [f64; 2],
    /// Phase function from sun to eye, 1/sr.
    pub phase: f64,
    /// Scaled, of the particle.
    pub optical_radius: f64,
    /// Scaled, of the chord's visible part.
    pub visible_depth: f64,
    /// Extinction over the true one.
    pub delta_scale: f64,
    /// Single-scattering albedo.
    pub albedo: f64,
}

/// Radiance towards the eye per unit of a particle's opacity. Sunlight of order 1 fades along the
/// chord with the depth to the sun, which counts as linear between the chord's ends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Source {
    /// Order 1 where the sun is not dimmed, without the halo's factor.
    pub first: DVec3,
    /// Everything else.
    pub rest: DVec3,
    /// Scaled optical depth to the sun: where the chord becomes visible, in the mean, at its end.
    pub sun_depth: [f64; 3],
}

/// Mean of `exp(-depth)` over the light that leaves a piece of optical depth `tau`, where the depth
/// goes from `front` by `change`, linear along the piece.
pub fn mean_sunlight(front: f64, change: f64, tau: f64) -> f64 {
    let both = tau + change;
    let peak = (-(if both < 0.0 { front + both } else { front }).max(0.0)).exp();
    peak * mean_transmittance(both.abs()) / mean_transmittance(tau)
}

/// The halo for one direction of view.
#[derive(Clone, Copy, Debug)]
pub struct HaloView<'a> {
    /// Its table.
    pub halo: &'a Halo,
    /// Sine of half the angle between view and sun.
    pub half_sine: f64,
    /// Optical depth of peak scatterings per scaled one.
    pub share: f64,
}

impl Source {
    /// The source with the halo of a chord that is seen through the scaled optical depth
    /// `view_depth`.
    pub fn with_halo(&self, halo: &HaloView<'_>, view_depth: f64) -> Self {
        let depth = halo.share * (self.sun_depth[1] + view_depth);
        Self { first: self.first * halo.halo.factor(halo.half_sine, depth), ..*self }
    }

    /// Mean over the light that leaves a piece of the chord, from `begin` to `end` as shares of its
    /// visible length, of optical depth `tau`.
    pub fn over(&self, begin: f64, end: f64, tau: f64) -> DVec3 {
        let [from, _, to] = self.sun_depth;
        let at = |share: f64| (from + (to - from) * share).max(0.0);
        self.rest + mean_sunlight(at(begin), at(end) - at(begin), tau) * self.first
    }
}

fn colour([r, g, b, _]: [f32; 4]) -> DVec3 {
    DVec3::new(r.into(), g.into(), b.into())
}

fn mean_transmittance(tau: f64) -> f64 {
    if tau > 0.0 { -(-tau).exp_m1() / tau } else { 1.0 }
}

/// Radiance towards the eye per unit of the particle's opacity.
pub fn source_function(light: &ParticleLight, inputs: &SourceInputs) -> Source {
    let front = depth_at(light.sun_front, inputs.place);
    let sun_depth = [inputs.begin, inputs.place, inputs.end].map(|place| {
        depth_at(light.sun_front, place) + inputs.optical_radius * way_out(place, inputs.sun)
    });
    let scale = inputs.delta_scale;
    let first = inputs.albedo / scale * inputs.phase;
    let [once, more] = inputs.scattered;
    let visible = inputs.visible_depth;
    // The table is that of the unscaled medium: opacity of the chord there over that here.
    let denser = mean_transmittance(visible / scale) / (mean_transmittance(visible) * scale);
    let own = (once * inputs.phase + more) * denser * (-front).exp();
    let sun = colour(light.sun_irradiance);
    let (above, below) = (colour(light.ambient_above), colour(light.ambient_below));
    let field = inputs.field;
    Source {
        first: (1.0 - inputs.alone) * first * sun,
        rest: (field.x + (own - field.x) * inputs.alone) * sun
            + field.y * above
            + (field.z - field.y) * below,
        sun_depth,
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    fn inputs() -> SourceInputs {
        SourceInputs {
            place: DVec3::new(0.2, -0.3, 0.1),
            begin: DVec3::new(0.2, -0.3, -0.4),
            end: DVec3::new(0.2, -0.3, 0.4),
            sun: DVec3::Y,
            field: DVec3::new(0.0, 0.4, 1.0),
            alone: 0.0,
            scattered: [0.8, 0.1],
            phase: 0.07,
            optical_radius: 2.0,
            visible_depth: 1.3,
            delta_scale: 0.4,
            albedo: 1.0,
        }
    }

    #[test]
    fn uniform_light_is_handed_on() {
        let mut light = ParticleLight::zeroed();
        light.ambient_above = [0.3, 0.2, 0.1, 0.0];
        light.ambient_below = light.ambient_above;
        for alone in [0.0, 0.5, 1.0] {
            let source = source_function(&light, &SourceInputs { alone, ..inputs() });
            assert!((source.rest - colour(light.ambient_above)).length() < 1e-15);
            assert_eq!(source.first, DVec3::ZERO);
        }
    }

    #[test]
    fn a_particle_alone_shines_as_its_table_says() {
        let mut light = ParticleLight::zeroed();
        light.sun_irradiance = [1.0; 4];
        let i = SourceInputs { alone: 1.0, field: DVec3::ZERO, ..inputs() };
        let source = source_function(&light, &i);
        // What leaves the scaled chord is what leaves the true one.
        let seen = source.rest.x * -(-i.visible_depth).exp_m1();
        let expected = (0.8 * 0.07 + 0.1) * -(-i.visible_depth / i.delta_scale).exp_m1();
        assert!((seen - expected).abs() < 1e-14, "{seen} {expected}");
        assert_eq!(source.first, DVec3::ZERO);
    }

    #[test]
    fn mean_sunlight_is_the_integral() {
        for (front, change, tau) in
            [(0.0, 0.0, 1.0), (2.0, 3.0, 0.5), (5.0, -4.0, 4.0), (6.0, -6.0, 2.0), (3.0, -2.0, 9.0)]
        {
            let steps = 20_000;
            let (mut light, mut all) = (0.0, 0.0);
            for i in 0..steps {
                let t = (f64::from(i) + 0.5) / f64::from(steps);
                light += (-tau * t - front - change * t).exp();
                all += (-tau * t).exp();
            }
            let found = mean_sunlight(front, change, tau);
            // The midpoint rule is off by (tau + change)^2 / (24 steps^2).
            assert!((found / (light / all) - 1.0).abs() < 1e-7, "{front} {change} {tau}: {found}");
        }
    }

    #[test]
    fn the_way_out_ends_on_the_sphere() {
        for place in [DVec3::ZERO, DVec3::new(0.5, 0.2, -0.7), DVec3::new(0.0, 1.0, 0.0)] {
            for direction in [DVec3::Y, DVec3::new(0.6, 0.0, 0.8)] {
                let end = place + way_out(place, direction) * direction;
                assert!((end.length() - 1.0).abs() < 1e-12 || way_out(place, direction) == 0.0);
            }
        }
    }

    #[test]
    fn others_on_the_ray_of_the_sun_or_around_end_being_alone() {
        assert_eq!(aloneness(1.0, 0.0, 1.0), 1.0);
        assert_eq!(aloneness(1.0, 2.0, 1.0), 0.0);
        assert_eq!(aloneness(1.0, 0.0, 3.0), 0.0);
    }
}
