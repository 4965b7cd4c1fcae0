//! Twin of `shaders/shared/sea_light.wgsl`, and of `shaders/frame/sea.wgsl` without clouds: radiance of the sea. In f64,
//! with the sky marched where the shader reads a table.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::atmosphere::sun_place;
use super::sky::Sky;
use super::sky_march::{AirRay, sun_mu_along};
use crate::frame::sky::gpu_data::PLANET_RADIUS;
use crate::medium::Sea;

/// Level part of a view below which it is straight down.
const LEAST_LEVEL: f64 = 1e-6;

/// Upwards at a point of the surface, relative to an eye at this altitude, m.
pub fn surface_normal(point: DVec3, altitude: f64) -> DVec3 {
    (point + DVec3::Y * (PLANET_RADIUS + altitude)).normalize()
}

impl Sky {
    /// What the waves reflect of the sky without clouds at a distance (m) along a direction.
    pub fn reflected_sky(&self, sea: &Sea, dir: DVec3, distance: f64) -> DVec3 {
        let normal = surface_normal(dir * distance, self.altitude());
        let mu = (-dir.dot(normal)).clamp(0.0, 1.0);
        let level = -dir - mu * normal;
        let any_level = DVec3::X - normal.x * normal;
        let ahead = if level.length() > LEAST_LEVEL { level } else { any_level }.normalize();
        let aside = normal.cross(ahead);
        let light = |slope: [f64; 2]| {
            let turned = Sea::mirrored(mu, slope).0;
            let up = turned.z.max(0.0);
            let dir = (turned.x * ahead + turned.y * aside + up * normal).normalize();
            self.sky_from_sea(dir, normal)
        };
        sea.facets(mu).map(|facet| facet.weight * light(facet.slope)).sum()
    }

    /// Radiance of the sky over the sea, by direction.
    pub fn sky_from_sea(&self, dir: DVec3, normal: DVec3) -> DVec3 {
        if let Some(radiance) = self.uniform() {
            return radiance;
        }
        let ray = AirRay {
            altitude: 0.0,
            mu: dir.dot(normal),
            sun_mu: self.sun().y,
            cos_sun: dir.dot(self.sun()).clamp(-1.0, 1.0),
        };
        let light = self.air().gather_all(ray, false, self.steps());
        self.colour_of(light.radiance).max(DVec3::ZERO)
    }

    /// Radiance of the sea at a distance (m) along a direction, before the air in front of it. `light` as for
    /// [`Self::ground_radiance`]; `mirrored`: what is reflected of sky and clouds.
    pub fn sea_radiance(
        &self,
        sea: &Sea,
        dir: DVec3,
        distance: f64,
        light: [f64; 3],
        mirrored: DVec3,
    ) -> DVec3 {
        let sun_mu = sun_mu_along(&self.ray(dir), 0.0, distance);
        let facing = self.sun_irradiance_at(0.0);
        let [direct, diffuse] = match self.uniform() {
            Some(radiance) => [facing * sun_mu.max(0.0), radiance * PI],
            None => {
                let place = DVec2::new(sun_place(sun_mu), 0.0);
                let direct = self.air().sunlight(0.0, sun_mu) * sun_mu.max(0.0);
                [direct, self.air().ground.at(place)].map(|l| self.colour_of(l).max(DVec3::ZERO))
            }
        };
        let normal = surface_normal(dir * distance, self.altitude());
        let even = 1.0 - sea.mean_reflectance();
        let water = self.ground_albedo() / PI * sea.below(-dir.dot(normal), 1.0);
        let entering = 1.0 - sea.reflectance(sun_mu);
        let below = entering * light[0] * direct + even * (light[2] * diffuse + light[1] * facing);
        let glitter = sea.glitter(normal, -dir, self.sun());
        mirrored + glitter * light[0] * direct + water * below
    }
}
