//! Surroundings with air: the frame's own sky, marched ray by ray instead of read from its tables.
//!
//! The air acts where it matters: on sunlight and skylight before they reach the clouds, by
//! altitude, and on what the eye sees. Between one cloud and another, and between clouds and the
//! ground below them, it is left out: a kilometre or two of clear air takes 1 to 3 % of the light.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use rayon::prelude::*;

use super::geometry::Ray;
use super::random::Random;
use super::transport::Surroundings;
use super::uniform_sky::{SunDisc, distance_to_ground, ground_normal};
use crate::frame::cpu::sky::Sky;
use crate::frame::sky::SkyInputs;

/// Steps of rays of the eye: the air's radiance is then within 1e-3 of its limit.
const EYE_STEPS: u32 = 64;
/// Steps of the rays that fill the maps for scattered light.
const MAP_STEPS: u32 = 32;
/// Altitudes (m) of those maps; between them radiance is interpolated in the square root of the
/// altitude, above the last it stays.
const MAP_ALTITUDES: [f64; 5] = [0.0, 1000.0, 3000.0, 8000.0, 20_000.0];
/// Texels of a map: azimuth from the sun, height over the horizon. Sky and aureole are smooth
/// except near the sun, where clouds blur them by their own phase function.
const MAP_SIZE: [usize; 2] = [48, 64];
/// Lowest direction of the maps, rad below the horizontal: the horizon's dip from 20 km is 0.08.
/// Below the horizon paths end on the ground.
const LOWEST: f64 = 0.1;

/// The sky's radiance from one altitude.
struct SkyMap {
    values: Vec<DVec3>,
}

/// The atmosphere around a scene.
pub struct AtmosphereSky {
    eye: Sky,
    maps: Vec<SkyMap>,
    sun: SunDisc,
    ground: DVec3,
}

impl AtmosphereSky {
    /// The atmosphere of a frame with these inputs.
    pub fn new(inputs: &SkyInputs) -> Self {
        let sun = SunDisc::new(
            inputs.sun_direction.as_dvec3().normalize(),
            DVec3::splat(f64::from(inputs.sun_irradiance)),
            f64::from(inputs.angular_diameter),
        );
        let maps = MAP_ALTITUDES
            .iter()
            .map(|&camera_altitude| {
                SkyMap::new(
                    &Sky::new(&SkyInputs { camera_altitude, ..*inputs }, MAP_STEPS),
                    sun.towards,
                )
            })
            .collect();
        let ground = inputs.ground_albedo.as_dvec3();
        Self { eye: Sky::new(inputs, EYE_STEPS), maps, sun, ground }
    }
}

/// The sun's azimuth as a horizontal unit vector; any where the sun is straight up.
fn azimuth_of(sun: DVec3) -> DVec3 {
    DVec3::new(sun.x, 0.0, sun.z).try_normalize().unwrap_or(DVec3::X)
}

impl SkyMap {
    fn new(sky: &Sky, sun: DVec3) -> Self {
        let front = azimuth_of(sun);
        let side = front.cross(DVec3::Y);
        let values = (0..MAP_SIZE[0] * MAP_SIZE[1])
            .into_par_iter()
            .map(|i| {
                let x = (i % MAP_SIZE[0]) as f64 / (MAP_SIZE[0] - 1) as f64;
                let y = (i / MAP_SIZE[0]) as f64 / (MAP_SIZE[1] - 1) as f64;
                let cosine = 1.0 - 2.0 * x * x;
                let height = y * y * (FRAC_PI_2 + LOWEST) - LOWEST;
                let level = front * cosine + side * (1.0 - cosine * cosine).max(0.0).sqrt();
                sky.sky_radiance(level * height.cos() + DVec3::Y * height.sin())
            })
            .collect();
        Self { values }
    }

    /// Bilinear in the map's coordinates, the inverse of those in `new`.
    fn at(&self, dir: DVec3, sun: DVec3) -> DVec3 {
        let level = DVec3::new(dir.x, 0.0, dir.z).try_normalize().unwrap_or(DVec3::X);
        let x = (0.5 - 0.5 * level.dot(azimuth_of(sun))).clamp(0.0, 1.0).sqrt();
        let height = dir.y.clamp(-1.0, 1.0).asin();
        let y = ((height + LOWEST) / (FRAC_PI_2 + LOWEST)).clamp(0.0, 1.0).sqrt();
        let axis = |place: f64, n: usize| {
            let texel = place * (n - 1) as f64;
            let low = (texel as usize).min(n - 2);
            (low, texel - low as f64)
        };
        let ((x, fx), (y, fy)) = (axis(x, MAP_SIZE[0]), axis(y, MAP_SIZE[1]));
        let row = |y: usize| {
            let at = y * MAP_SIZE[0] + x;
            self.values[at].lerp(self.values[at + 1], fx)
        };
        row(y).lerp(row(y + 1), fy)
    }
}

impl Surroundings for AtmosphereSky {
    fn sky(&self, ray: &Ray) -> DVec3 {
        let place = |altitude: f64| altitude.max(0.0).sqrt();
        let here = place(ray.origin.y);
        let above = MAP_ALTITUDES.partition_point(|a| place(*a) <= here);
        let (low, high) = (above.saturating_sub(1), above.min(MAP_ALTITUDES.len() - 1));
        let span = place(MAP_ALTITUDES[high]) - place(MAP_ALTITUDES[low]);
        let share = if span > 0.0 { (here - place(MAP_ALTITUDES[low])) / span } else { 0.0 };
        let at = |i: usize| self.maps[i].at(ray.dir, self.sun.towards);
        at(low).lerp(at(high), share)
    }

    fn sky_of_eye(&self, ray: &Ray) -> DVec3 {
        self.eye.sky_radiance(ray.dir) + self.eye.sun_disc_radiance(ray.dir)
    }

    fn air(&self, ray: &Ray, distance: f64) -> (DVec3, DVec3) {
        let air = self.eye.air_between(ray.dir, distance);
        (air.inscatter, air.transmittance)
    }

    fn sun(&self, point: DVec3, random: &mut Random) -> Option<(DVec3, DVec3)> {
        let irradiance = self.eye.sun_irradiance_at(point.y.max(0.0));
        (irradiance.max_element() > 0.0).then(|| (self.sun.sample(random), irradiance))
    }

    fn ground(&self, ray: &Ray) -> Option<f64> {
        distance_to_ground(ray)
    }

    fn ground_at(&self, point: DVec3) -> (DVec3, DVec3) {
        (self.ground, ground_normal(point))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::Vec3;

    use super::super::transport::turned;
    use super::*;
    use crate::frame::sky::SkyKind;

    #[test]
    fn maps_agree_with_marched_rays() {
        let inputs = SkyInputs {
            kind: SkyKind::Atmosphere,
            sun_direction: Vec3::new(0.4, 0.6, -0.3).normalize(),
            sun_irradiance: 1.0,
            angular_diameter: 0.0093,
            camera_altitude: 10.0,
            ground_albedo: Vec3::splat(0.1),
        };
        let surroundings = AtmosphereSky::new(&inputs);
        let mut random = Random::new(3, 0, 0);
        for altitude in [10.0, 1400.0] {
            let sky = Sky::new(&SkyInputs { camera_altitude: altitude, ..inputs }, MAP_STEPS);
            let (mut total, mut off) = (0.0, 0.0);
            for _ in 0..100 {
                let cosine = 0.03 + 0.97 * random.unit();
                let dir = turned(DVec3::Y, cosine, TAU * random.unit());
                let exact = sky.sky_radiance(dir);
                let origin = DVec3::new(0.0, altitude, 0.0);
                off += (surroundings.sky(&Ray { origin, dir }) - exact).length();
                total += exact.length();
            }
            // The aureole is sharper than the map within 10 degrees of the sun, where clouds blur
            // it by their own phase function; elsewhere the map's texels of 3 degrees do.
            assert!(off / total < 0.02, "{altitude} m: {}", off / total);
        }
    }
}
