//! The source function of a particle: twin of `shaders/shared/lighting.wgsl`, where the model is
//! told.

use std::f64::consts::PI;

use glam::DVec3;

use crate::frame::gpu_data::ParticleLight;

/// Affine optical depth at a place in the particle, in radii from its centre; never negative.
pub fn depth_at(affine: [f32; 4], place: DVec3) -> f64 {
    let [constant, x, y, z] = affine.map(f64::from);
    (constant + DVec3::new(x, y, z).dot(place)).max(0.0)
}

/// Diffuse mean intensity in a conservative layer at optical depth `front` of `total`, lit
/// perpendicularly by irradiance 1.
pub fn slab_diffuse(front: f64, total: f64) -> f64 {
    let opacity = |tau: f64| -(-tau).exp_m1();
    let net_flux = (4.0 + opacity(total)) / (4.0 + 3.0 * total);
    let j = 2.0 * (1.0 - net_flux) + 3.0 * (opacity(front) - net_flux * front);
    j.max(0.0) / (4.0 * PI)
}

/// Mean intensity in a conservative layer between radiance `above` and `below`, at optical depth
/// `front` from above and `behind` from below.
pub fn slab_between(above: DVec3, below: DVec3, front: f64, behind: f64) -> DVec3 {
    above.lerp(below, (front + 2.0 / 3.0) / (front + behind + 4.0 / 3.0))
}

/// Share of diffuse light that a sphere gives back; 1 at albedo 1.
pub fn diffuse_response(albedo: f64, optical_radius: f64) -> f64 {
    let escape = 1.0 / (1.0 + 4.0 / 3.0 * optical_radius);
    // Absorbed plus escaping: written so that nothing cancels however little escapes.
    albedo * escape / (1.0 - albedo + albedo * escape)
}

/// What the source function depends on besides the light.
#[derive(Clone, Copy, Debug)]
pub struct SourceInputs {
    /// Radii from the centre: where the light is scattered.
    pub place: DVec3,
    /// Of the particle alone: order 1 without phase function, orders >= 2.
    pub scattered: [f64; 2],
    /// Phase function from sun to eye, 1/sr.
    pub phase: f64,
    /// The same after one more forward scattering, 1/sr.
    pub phase_twice: f64,
    /// Extinction times radius times mean density.
    pub optical_radius: f64,
    /// Single-scattering albedo.
    pub albedo: f64,
    /// Of the phase function.
    pub mean_cosine: f64,
}

fn colour([r, g, b, _]: [f32; 4]) -> DVec3 {
    DVec3::new(r.into(), g.into(), b.into())
}

/// Radiance towards the eye per unit of the particle's opacity.
pub fn source_function(light: &ParticleLight, inputs: &SourceInputs) -> DVec3 {
    let place = inputs.place;
    let diffusing = 1.0 - inputs.mean_cosine;
    let front = depth_at(light.sun_front, place);
    let behind = depth_at(light.sun_behind, place);
    let direct = (-front).exp();
    let scaled = (-diffusing * front).exp();
    let response = diffuse_response(inputs.albedo, inputs.optical_radius);
    let [once, more] = inputs.scattered;
    let sun = once * (inputs.phase * direct + inputs.phase_twice * (scaled - direct).max(0.0))
        + more * scaled
        + response * slab_diffuse(diffusing * front, diffusing * (front + behind));
    let own = |share: f64| inputs.optical_radius * share;
    let up = diffusing * (depth_at(light.zenith_front, place) + own(1.0 - place.y));
    let down = diffusing * (depth_at(light.zenith_behind, place) + own(1.0 + place.y));
    let (above, below) = (colour(light.ambient_above), colour(light.ambient_below));
    sun * colour(light.sun_irradiance) + response * slab_between(above, below, up, down)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marshak's conditions on both faces: no diffuse light comes in from outside. At a face the
    /// mean intensity is then 2 / (4 pi) of what flows out through it: the share of the beam that
    /// is reflected above, and the share that arrives diffusely below.
    #[test]
    fn the_layer_keeps_all_light() {
        for total in [0.01, 1.0, 7.0, 100.0] {
            let reflected = slab_diffuse(0.0, total) * 4.0 * PI / 2.0;
            let passed = slab_diffuse(total, total) * 4.0 * PI / 2.0 + (-total).exp();
            assert!((reflected + passed - 1.0).abs() < 1e-9, "{total}: {reflected} {passed}");
        }
        assert_eq!(slab_diffuse(0.0, 0.0), 0.0);
    }

    #[test]
    fn a_layer_between_equal_lights_has_that_light() {
        let light = DVec3::new(0.3, 0.2, 0.1);
        for (front, behind) in [(0.0, 0.0), (3.0, 0.1), (50.0, 80.0)] {
            assert!((slab_between(light, light, front, behind) - light).length() < 1e-12);
        }
        // Deep below an opaque layer only what lies below is seen.
        let deep = slab_between(light, DVec3::ZERO, 1e6, 0.0);
        assert!(deep.length() < 1e-5, "{deep}");
    }

    #[test]
    fn without_absorption_all_diffuse_light_comes_back() {
        for optical_radius in [0.0, 1e-3, 1.0, 1e6] {
            assert_eq!(diffuse_response(1.0, optical_radius), 1.0);
            assert_eq!(diffuse_response(0.0, optical_radius), 0.0);
            let some = diffuse_response(0.9, optical_radius);
            assert!(some > 0.0 && some <= 0.9, "{some}");
        }
    }
}
