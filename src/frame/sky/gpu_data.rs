//! What the sky's shaders get: `SkyUniforms` of `shaders/shared/atmosphere.wgsl`, where the fields
//! are explained.

use bytemuck::{Pod, Zeroable};
use glam::DVec4;

use super::spectrum::{self, Coefficients};
use super::{SkyInputs, SkyKind};
use crate::frame::cpu::atmosphere::sky_spans;
use crate::frame::gpu_data::gpu_struct;
use crate::medium::sea::HEIGHTS;

gpu_struct! {
    /// Everything the sky depends on.
    SkyUniforms {
        /// 1/m, at the four wavelengths, as all of this kind.
        rayleigh: [f32; 4],
        /// 1/m.
        aerosol_scattering: [f32; 4],
        /// 1/m.
        aerosol_extinction: [f32; 4],
        /// 1/m.
        ozone: [f32; 4],
        /// Row of the matrix to linear sRGB.
        to_red: [f32; 4],
        /// Row of the matrix to linear sRGB.
        to_green: [f32; 4],
        /// Row of the matrix to linear sRGB.
        to_blue: [f32; 4],
        /// At the four wavelengths.
        ground_albedo: [f32; 4],
        /// rgb.
        ground_colour: [f32; 4],
        /// Towards the sun, and its irradiance.
        sun: [f32; 4],
        /// x: radius, rad; y: radiance of the middle per irradiance, 1/sr; z, w: rad, angles from the horizon straight
        /// down, and up to where there is air.
        disc: [f32; 4],
        /// m.
        camera_altitude: f32,
        /// rad.
        horizon_dip: f32,
        /// Of a uniform sky.
        uniform_radiance: f32,
        /// 1: a uniform sky and no air.
        is_uniform: u32,
        /// Of a sea. x: root mean square slope, y: reflected share of an even sky, z: of this sun's light; 0 where there is none.
        sea: [f32; 4],
        /// Share of the light that it reflects, by the cosine of its zenith angle.
        sea_reflectances: [[f32; 4]; HEIGHTS / 4],
    }
}

/// As in the shader, m.
pub const PLANET_RADIUS: f64 = 6.36e6;
/// Farther up the planet is a point: 1e9 m away it is 0.7 degrees wide, and an f32 still tells
/// its rim from its middle.
const MOST_ALTITUDE: f64 = 1e9;
/// Half the width of the disc's rim, in radii; as in the shader.
pub const DISC_RIM: f64 = 0.3;
/// As in the shader.
const LIMB_DARKENING: f64 = 0.6;

/// Altitude the sky is seen from, m: from below the ground it is seen as from the ground.
pub fn seen_from(camera_altitude: f64) -> f64 {
    camera_altitude.clamp(0.0, MOST_ALTITUDE)
}

/// The disc's brightness across, relative to its middle; `x` from 0 to 1 + rim.
pub fn disc_profile(x: f64) -> f64 {
    let limb = 1.0 - LIMB_DARKENING * (1.0 - (1.0 - x * x).max(0.0).sqrt());
    let t = ((x - (1.0 - DISC_RIM)) / (2.0 * DISC_RIM)).clamp(0.0, 1.0);
    limb * (1.0 - t * t * (3.0 - 2.0 * t))
}

/// Radiance of the middle of a disc of this radius (rad) that gives unit irradiance, 1/sr.
pub fn disc_peak(radius: f64) -> f64 {
    // In the chord c = 2 sin(angle / 2) the solid angle is exactly 2 pi c dc; the midpoint rule
    // with this many rings is within 1e-5.
    const RINGS: usize = 1024;
    let width = (1.0 + DISC_RIM) / RINGS as f64;
    let rings = (0..RINGS).map(|i| (i as f64 + 0.5) * width);
    let sum: f64 = rings.map(|x| disc_profile(x) * x).sum();
    1.0 / (std::f64::consts::TAU * radius * radius * sum * width)
}

impl SkyUniforms {
    /// What the shaders need of these inputs.
    pub fn new(inputs: &SkyInputs) -> Self {
        let c = Coefficients::earth();
        let four = |v: DVec4| v.as_vec4().to_array();
        let rows = spectrum::TO_RGB.map(|row| row.map(|x| x as f32));
        let altitude = seen_from(inputs.camera_altitude);
        let horizon = (altitude * (2.0 * PLANET_RADIUS + altitude)).sqrt();
        let [below, above] = sky_spans(altitude);
        let radius = f64::from(inputs.angular_diameter) / 2.0;
        let colour = inputs.ground_albedo;
        let (mut sea, mut sea_reflectances) = ([0.0; 4], [[0.0; 4]; HEIGHTS / 4]);
        if let Some(waves) = inputs.sea() {
            let of_sun = waves.reflectance(f64::from(inputs.sun_direction.y));
            sea = [waves.slope(), waves.mean_reflectance(), of_sun, 0.0].map(|v| v as f32);
            for (to, rule) in sea_reflectances.as_flattened_mut().iter_mut().zip(waves.rules()) {
                *to = rule.iter().map(|[_, weight]| weight).sum::<f64>() as f32;
            }
        }
        let (uniform_radiance, is_uniform) = match inputs.kind {
            SkyKind::Uniform { radiance } => (radiance, 1),
            SkyKind::Atmosphere => (0.0, 0),
        };
        Self {
            rayleigh: four(c.rayleigh),
            aerosol_scattering: four(c.aerosol_scattering),
            aerosol_extinction: four(c.aerosol_extinction),
            ozone: four(c.ozone),
            to_red: rows[0],
            to_green: rows[1],
            to_blue: rows[2],
            ground_albedo: four(spectrum::reflectance(colour.as_dvec3())),
            ground_colour: colour.extend(f32::from(inputs.has_ground)).to_array(),
            sun: inputs.sun_direction.extend(inputs.sun_irradiance).to_array(),
            disc: [radius, disc_peak(radius), below, above].map(|v| v as f32),
            camera_altitude: altitude as f32,
            horizon_dip: horizon.atan2(PLANET_RADIUS) as f32,
            uniform_radiance,
            is_uniform,
            sea,
            sea_reflectances,
        }
    }
}
