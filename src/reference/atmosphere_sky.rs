//! Surroundings with air: the frame's own sky, marched ray by ray instead of read from its tables.
//!
//! The air acts where it matters: on sunlight and skylight before they reach the clouds, by
//! altitude, on what comes to them from the ground and from the air above it, and on what the eye
//! sees. Between one cloud and another it is left out: a kilometre or two of clear air takes 1 to 3 % of
//! the light. What clouds change of the light of the air before the eye is in `air_light.rs`; the air that
//! scattered paths meet on their way to the ground is lit as if there were no clouds.

use std::f64::consts::PI;

use glam::DVec3;

use super::geometry::Ray;
use super::random::Random;
use super::sea::Waves;
use super::sky_map::SkyMaps;
use super::transport::{AirHere, Surroundings};
use super::uniform_sky::{SunDisc, distance_to_ground, ground_normal};
use crate::frame::cpu::atmosphere::air_span;
use crate::frame::cpu::sky::Sky;
use crate::frame::cpu::sky_march::AirRay;
use crate::frame::sky::SkyInputs;
use crate::frame::sky::spectrum::to_rgb;
use crate::medium::Sea;

/// Steps of rays of the eye: the air's radiance is then within 1e-3 of its limit.
const EYE_STEPS: u32 = 64;
/// Steps of rays of the eye up to a distance (m), where the clouds of a picture are: within 1e-3 too (a
/// test), and 64 everywhere took a sixth of a picture's time, 16 up to 20 km a fourteenth.
const NEAR: [(f64, u32); 2] = [(3000.0, 6), (20_000.0, 16)];
/// Highest altitude (m) at which sunlight is tabulated, and the number of nodes: linear between them, and
/// even in the square root of the altitude, it is within 1e-4 (a test). Evaluated anew for every
/// collision, it was a twelfth of a path's time.
const SUN_TOP: f64 = 20_000.0;
const SUN_NODES: usize = 1024;
/// Steps of rays of the sky that the sea reflects: as many as those of the frame's table.
const SEA_STEPS: u32 = 32;

/// The atmosphere around a scene.
pub struct AtmosphereSky {
    eye: Sky,
    near: [Sky; NEAR.len()],
    sunlight: Vec<DVec3>,
    maps: SkyMaps,
    sun: SunDisc,
    ground: DVec3,
}

impl AtmosphereSky {
    /// The sky whose rays take steps enough for a distance, m.
    fn for_distance(&self, distance: f64) -> &Sky {
        let within = NEAR.iter().position(|(reach, _)| distance < *reach);
        within.map_or(&self.eye, |i| &self.near[i])
    }

    /// The atmosphere of a frame with these inputs.
    pub fn new(inputs: &SkyInputs) -> Self {
        let sun = SunDisc::new(
            inputs.sun_direction.as_dvec3().normalize(),
            DVec3::splat(f64::from(inputs.sun_irradiance)),
            f64::from(inputs.angular_diameter),
        );
        let maps = SkyMaps::new(inputs, sun.towards);
        let ground = inputs.ground_albedo.as_dvec3();
        let eye = Sky::new(inputs, EYE_STEPS);
        let near = NEAR.map(|(_, steps)| Sky::with_air(inputs, steps, eye.air().clone()));
        let node = |i: usize| SUN_TOP * (i as f64 / (SUN_NODES - 1) as f64).powi(2);
        let sunlight = (0..SUN_NODES).map(|i| eye.sun_irradiance_at(node(i))).collect();
        Self { eye, near, sunlight, maps, sun, ground }
    }

    /// A ray that leaves the sea, as the air has it.
    fn over_sea(&self, ray: &Ray, normal: DVec3) -> AirRay {
        AirRay {
            altitude: 0.0,
            mu: ray.dir.dot(normal),
            sun_mu: self.sun.towards.dot(normal),
            cos_sun: ray.dir.dot(self.sun.towards).clamp(-1.0, 1.0),
        }
    }

    /// Radiance of the sea at a distance (m) of a ray where there are no clouds.
    fn clear_sea(&self, sea: &Sea, ray: &Ray, distance: f64) -> DVec3 {
        let origin = ray.at(distance);
        let waves = Waves::new(sea, self.ground, ground_normal(origin), -ray.dir);
        let sky = waves.facets().map(|(dir, weight)| weight * self.sky(&Ray { origin, dir }));
        let sun = self.sun.towards;
        let by_sun = waves.glitter(sun) + self.ground * waves.below(sun);
        let sun_mu = waves.level(sun);
        let by_sky = self.eye.ground_irradiance(sun_mu) - self.sunlight(0.0) * sun_mu.max(0.0);
        sky.sum::<DVec3>()
            + by_sun * self.sunlight(0.0)
            + self.ground / PI * waves.below_sky() * by_sky
    }

    fn sunlight(&self, altitude: f64) -> DVec3 {
        let place = (altitude.max(0.0) / SUN_TOP).sqrt() * (SUN_NODES - 1) as f64;
        let node = place as usize;
        match self.sunlight.get(node..).unwrap_or_default() {
            [below, above, ..] => below.lerp(*above, place - node as f64),
            _ => self.eye.sun_irradiance_at(altitude),
        }
    }
}

impl Surroundings for AtmosphereSky {
    fn sky(&self, ray: &Ray) -> DVec3 {
        self.maps.sky(ray)
    }

    fn sky_of_eye(&self, ray: &Ray) -> DVec3 {
        self.eye.sky_radiance(ray.dir) + self.eye.sun_disc_radiance(ray.dir)
    }

    fn air(&self, ray: &Ray, distance: f64) -> (DVec3, DVec3) {
        let air = self.for_distance(distance).air_between(ray.dir, distance);
        (air.inscatter, air.transmittance)
    }

    fn air_span(&self, ray: &Ray, distance: f64) -> [f64; 2] {
        self.eye.air_span(ray.dir, distance)
    }

    fn air_at(&self, ray: &Ray, distance: f64) -> Option<AirHere> {
        let [scattering, sunlit] = self.for_distance(distance).air_at(ray.dir, distance);
        Some(AirHere { scattering, sunlit })
    }

    fn clear(&self, ray: &Ray) -> DVec3 {
        let Some(distance) = self.ground(ray) else { return self.sky(ray) };
        let (added, passed) = self.air_below(ray);
        if let Some(sea) = self.sea() {
            return added + passed * self.clear_sea(sea, ray, distance);
        }
        let sun_mu = ground_normal(ray.at(distance)).dot(self.sun.towards);
        added + passed * self.ground / PI * self.eye.ground_irradiance(sun_mu)
    }

    fn air_below(&self, ray: &Ray) -> (DVec3, DVec3) {
        self.maps.below(ray)
    }

    fn sun(&self, point: DVec3, random: &mut Random) -> Option<(DVec3, DVec3)> {
        let irradiance = self.sunlight(point.y);
        (irradiance.max_element() > 0.0).then(|| (self.sun.sample(random), irradiance))
    }

    fn ground(&self, ray: &Ray) -> Option<f64> {
        distance_to_ground(ray)
    }

    fn ground_at(&self, point: DVec3) -> (DVec3, DVec3) {
        (self.ground, ground_normal(point))
    }

    fn sea(&self) -> Option<&Sea> {
        self.eye.air().sea.as_deref()
    }

    fn sky_over_sea(&self, ray: &Ray, normal: DVec3) -> DVec3 {
        let gathered = self.eye.air().gather_all(self.over_sea(ray, normal), false, SEA_STEPS);
        self.eye.colour_of(gathered.radiance).max(DVec3::ZERO)
    }

    fn air_over_sea(&self, ray: &Ray, normal: DVec3, distance: f64) -> (DVec3, DVec3) {
        let ray = self.over_sea(ray, normal);
        let end = distance.min(air_span(ray.altitude, ray.mu).1);
        let gathered = self.eye.air().gather_between(&ray, 0.0, end, NEAR[1].1);
        let added = self.eye.colour_of(gathered.radiance).max(DVec3::ZERO);
        (added, to_rgb((-gathered.optical_depth).exp()).max(DVec3::ZERO))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::Vec3;

    use super::super::transport::turned;
    use super::*;
    use crate::frame::sky::SkyKind;

    const NEAR_ERROR: f64 = 1e-3;
    const SUNLIGHT_ERROR: f64 = 1e-4;

    /// Of what the eye sees of the air before clouds, and of what they lose by it.
    #[test]
    fn few_steps_are_enough_for_near_clouds() {
        let inputs = SkyInputs {
            kind: SkyKind::Atmosphere,
            sun_direction: Vec3::new(0.25, 0.07, -0.97).normalize(),
            sun_irradiance: 1.0,
            angular_diameter: 0.0093,
            camera_altitude: 30.0,
            ground_albedo: Vec3::splat(0.1),
            has_ground: true,
            sea_wind: None,
        };
        for camera_altitude in [2.0, 30.0, 1480.0, 9000.0] {
            let surroundings = AtmosphereSky::new(&SkyInputs { camera_altitude, ..inputs });
            let exact = Sky::new(&SkyInputs { camera_altitude, ..inputs }, 2048);
            let mut random = Random::new(4, 0, 0);
            for _ in 0..200 {
                let dir = turned(DVec3::Y, 1.0 - 1.1 * random.unit(), TAU * random.unit());
                let distance = 20_000.0 * random.unit().powi(2);
                let distance = match exact.ground_distance(dir) {
                    ground if ground > 0.0 => distance.min(ground),
                    _ => distance,
                };
                let origin = DVec3::new(0.0, camera_altitude, 0.0);
                let (added, passed) = surroundings.air(&Ray { origin, dir }, distance);
                let expected = exact.air_between(dir, distance);
                // Three digits are what a picture in half floats holds.
                let off = (added - expected.inscatter).length() / expected.inscatter.length();
                assert!(off < NEAR_ERROR, "{camera_altitude} {dir} {distance}: {off}");
                let off = (passed - expected.transmittance).abs().max_element();
                assert!(off < NEAR_ERROR, "{camera_altitude} {dir} {distance}: {off}");
                let altitude = 20_000.0 * random.unit().powi(2);
                let (table, exact) =
                    (surroundings.sunlight(altitude), exact.sun_irradiance_at(altitude));
                let off = (table - exact).abs().max_element() / exact.max_element();
                assert!(off < SUNLIGHT_ERROR, "{altitude}: {off}");
            }
        }
    }
}
