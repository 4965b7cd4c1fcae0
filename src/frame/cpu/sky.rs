//! Twin of `shaders/shared/sky.wgsl`: the sky as other code asks for it, with rays marched where the
//! shader reads tables of the view. Radiances are linear sRGB in the unit of the sun's irradiance.

use glam::{DVec3, DVec4};
use std::f64::consts::PI;

use super::atmosphere::{air_span, altitude_along, distance_to_ground, horizon_squared, medium_at};
use super::sky_march::{Air, AirRay, sun_mu_along};
use crate::frame::sky::gpu_data::{PLANET_RADIUS, disc_peak, disc_profile, seen_from};
use crate::frame::sky::spectrum::{Coefficients, reflectance, to_rgb};
use crate::frame::sky::{SkyInputs, SkyKind};

/// Radiance and transmittance of the air before a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirBetween {
    /// rgb.
    pub inscatter: DVec3,
    /// rgb.
    pub transmittance: DVec3,
}

/// A sky as seen by one camera.
#[derive(Clone, Debug)]
pub struct Sky {
    inputs: SkyInputs,
    air: Air,
    altitude: f64,
    sun: DVec3,
    irradiance: f64,
    steps: u32,
}

fn colour(light: DVec4) -> DVec3 {
    to_rgb(light).max(DVec3::ZERO)
}

impl Sky {
    /// Makes the tables of the air; rays will be marched in `steps` steps.
    pub fn new(inputs: &SkyInputs, steps: u32) -> Self {
        let albedo = reflectance(inputs.ground_albedo.as_dvec3());
        Self::with_air(inputs, steps, Air::new(Coefficients::earth(), albedo, inputs.sea()))
    }

    /// The same with tables of the air that are there already: those of another sky over the same
    /// ground.
    pub fn with_air(inputs: &SkyInputs, steps: u32, air: Air) -> Self {
        Self {
            inputs: *inputs,
            air,
            altitude: seen_from(inputs.camera_altitude),
            sun: inputs.sun_direction.as_dvec3(),
            irradiance: f64::from(inputs.sun_irradiance),
            steps,
        }
    }

    /// The tables that do not depend on the view.
    pub fn air(&self) -> &Air {
        &self.air
    }

    pub(super) fn uniform(&self) -> Option<DVec3> {
        match self.inputs.kind {
            SkyKind::Uniform { radiance } => Some(DVec3::splat(f64::from(radiance))),
            SkyKind::Atmosphere => None,
        }
    }

    /// Altitude of the eye, m.
    pub(super) fn altitude(&self) -> f64 {
        self.altitude
    }

    /// Steps of rays.
    pub(super) fn steps(&self) -> u32 {
        self.steps
    }

    /// Of the ground, or of the water below a sea.
    pub(super) fn ground_albedo(&self) -> DVec3 {
        self.inputs.ground_albedo.as_dvec3()
    }

    /// Direction to the sun.
    pub fn sun(&self) -> DVec3 {
        self.sun
    }

    /// A ray from the camera.
    pub fn ray(&self, dir: DVec3) -> AirRay {
        AirRay {
            altitude: self.altitude,
            mu: dir.y,
            sun_mu: self.sun.y,
            cos_sun: dir.dot(self.sun).clamp(-1.0, 1.0),
        }
    }

    /// Radiance of the sky without the sun's disc; below the horizon the bare ground.
    pub fn sky_radiance(&self, dir: DVec3) -> DVec3 {
        self.uniform().unwrap_or_else(|| {
            let hits = distance_to_ground(self.altitude, dir.y) >= 0.0;
            colour(self.air.gather_all(self.ray(dir), hits, self.steps).radiance) * self.irradiance
        })
    }

    /// Radiance of the sun's disc.
    pub fn sun_disc_radiance(&self, dir: DVec3) -> DVec3 {
        let radius = f64::from(self.inputs.angular_diameter) / 2.0;
        let bare = disc_profile(dir.distance(self.sun) / radius) * disc_peak(radius);
        if bare <= 0.0 || self.uniform().is_some() {
            return DVec3::splat(bare * self.irradiance);
        }
        if distance_to_ground(self.altitude, dir.y) >= 0.0 {
            return DVec3::ZERO;
        }
        self.air_between(dir, f64::INFINITY).transmittance * bare * self.irradiance
    }

    /// Irradiance of the sun on a surface that faces it, after the air. Altitude in m.
    pub fn sun_irradiance_at(&self, altitude: f64) -> DVec3 {
        let light = match self.uniform() {
            Some(_) => DVec3::ONE,
            None => colour(self.air.sunlight(altitude, self.sun.y)),
        };
        light * self.irradiance
    }

    /// Mean radiance of the upper hemisphere, without the sun's disc. Altitude in m.
    pub fn sky_ambient_above(&self, altitude: f64) -> DVec3 {
        self.uniform().unwrap_or_else(|| {
            colour(self.air.hemispheres(altitude.max(0.0), self.sun.y)[0]) * self.irradiance
        })
    }

    /// Mean radiance of the lower hemisphere over bare ground. Altitude in m.
    pub fn sky_ambient_below(&self, altitude: f64) -> DVec3 {
        self.sky_below(altitude, [1.0; 2])
    }

    /// Mean radiance of the lower hemisphere over ground of which clouds leave these shares, lit by the
    /// sun and by the sky. Altitude in m.
    pub fn sky_below(&self, altitude: f64, shares: [f64; 2]) -> DVec3 {
        if let Some(radiance) = self.uniform() {
            let by_sun = self.irradiance * self.sun.y.max(0.0) / PI;
            let ground = self.inputs.ground_albedo.as_dvec3();
            let reflected = self.air.reflected(self.sun.y);
            let [by_sun, by_sky] = [(reflected[0], by_sun), (reflected[1], radiance.x)]
                .map(|(share, light)| (ground + share * (1.0 - ground)) * light);
            let lit = shares[0] * by_sun + shares[1] * by_sky;
            return if self.inputs.has_ground { lit } else { radiance };
        }
        let [_, air, by_sun, by_sky] = self.air.hemispheres(altitude.max(0.0), self.sun.y);
        (colour(air) + shares[0] * colour(by_sun) + shares[1] * colour(by_sky)) * self.irradiance
    }

    /// The air between the camera and a place at this distance, m, up to infinity.
    pub fn air_between(&self, dir: DVec3, distance: f64) -> AirBetween {
        if self.uniform().is_some() {
            return AirBetween { inscatter: DVec3::ZERO, transmittance: DVec3::ONE };
        }
        let span = air_span(self.altitude, dir.y);
        let end = distance.clamp(span.0, span.1);
        let gathered = self.air.gather_between(&self.ray(dir), span.0, end, self.steps);
        AirBetween {
            inscatter: colour(gathered.radiance) * self.irradiance,
            transmittance: colour((-gathered.optical_depth).exp()),
        }
    }

    /// Part of a ray up to a distance that lies in the air, m; of no length where there is none.
    pub fn air_span(&self, dir: DVec3, distance: f64) -> [f64; 2] {
        if self.uniform().is_some() {
            return [0.0; 2];
        }
        let span = air_span(self.altitude, dir.y);
        [span.0, distance.clamp(span.0, span.1)]
    }

    /// Air at a distance (m) of a ray, seen through the air before it: scattering by molecules and by
    /// aerosol, rgb (1/m), and the same times the sun's irradiance there.
    pub fn air_at(&self, dir: DVec3, distance: f64) -> [[DVec3; 2]; 2] {
        let ray = self.ray(dir);
        let begin = air_span(self.altitude, dir.y).0;
        let through = (-self.air.depth_between(&ray, begin, distance, self.steps)).exp();
        let altitude = altitude_along(self.altitude, dir.y, distance).max(0.0);
        let medium = medium_at(&self.air.coefficients, altitude);
        let sunlight = self.air.sunlight(altitude, sun_mu_along(&ray, altitude, distance));
        let seen = [through * medium.rayleigh, through * medium.aerosol];
        [seen.map(to_rgb), seen.map(|seen| to_rgb(seen * sunlight) * self.irradiance)]
    }

    /// Light at the four wavelengths per unit of the sun's irradiance as rgb of this sun.
    pub fn colour_of(&self, light: DVec4) -> DVec3 {
        to_rgb(light) * self.irradiance
    }

    /// Irradiance of sun and sky on bare ground, rgb, where this is the cosine of the sun's zenith angle.
    pub fn ground_irradiance(&self, sun_mu: f64) -> DVec3 {
        let diffuse =
            self.air.ground.at(glam::DVec2::new(super::atmosphere::sun_place(sun_mu), 0.0));
        let direct = self.air.sunlight(0.0, sun_mu) * sun_mu.max(0.0);
        colour(direct + diffuse) * self.irradiance
    }

    /// Distance to the ground, m; -1 where there is none.
    pub fn ground_distance(&self, dir: DVec3) -> f64 {
        distance_to_ground(self.altitude, dir.y)
    }

    /// Radiance of the ground at a distance (m), before the air in front of it. `light`: share of the sunlight
    /// that the clouds let through, irradiance that they scatter down per unit of the sun's on a surface that
    /// faces it, share of the skylight that they let through; 1, 0, 1 without them.
    pub fn ground_radiance(&self, dir: DVec3, distance: f64, light: [f64; 3]) -> DVec3 {
        let sun_mu = sun_mu_along(&self.ray(dir), 0.0, distance);
        let albedo = self.inputs.ground_albedo.as_dvec3();
        let level = sun_mu.max(0.0) * light[0];
        let by_clouds = light[1] * self.sun_irradiance_at(0.0);
        let others = match self.uniform() {
            Some(radiance) => DVec3::splat(level * self.irradiance) + radiance * light[2] * PI,
            None => {
                let place = glam::DVec2::new(super::atmosphere::sun_place(sun_mu), 0.0);
                let direct = self.air.sunlight(0.0, sun_mu) * level;
                colour(direct + self.air.ground.at(place) * light[2]) * self.irradiance
            }
        };
        albedo / PI * (others + by_clouds)
    }

    /// Angle from the horizontal down to the horizon, rad.
    pub fn horizon_dip(&self) -> f64 {
        horizon_squared(self.altitude).sqrt().atan2(PLANET_RADIUS)
    }
}
