//! Surroundings without air: the same radiance from everywhere, a sun, perhaps a ground.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;

use super::geometry::Ray;
use super::random::Random;
use super::transport::{Surroundings, turned};
use crate::frame::sky::gpu_data::{DISC_RIM, PLANET_RADIUS, disc_peak, disc_profile};
use crate::medium::Sea;

/// The sun as the disc that the frame shows: darker towards its limb, with a soft rim.
#[derive(Clone, Copy, Debug)]
pub struct SunDisc {
    /// Towards its middle, unit vector.
    pub towards: DVec3,
    /// On a surface that faces it.
    pub irradiance: DVec3,
    /// Half its angular diameter, rad; 0 is a point.
    radius: f64,
    /// Radiance of its middle at irradiance 1.
    peak: f64,
}

impl SunDisc {
    /// A sun of this angular diameter, rad.
    pub fn new(towards: DVec3, irradiance: DVec3, angular_diameter: f64) -> Self {
        let radius = 0.5 * angular_diameter;
        let peak = if radius > 0.0 { disc_peak(radius) } else { 0.0 };
        Self { towards, irradiance, radius, peak }
    }

    /// Radiance of the disc in a direction; nothing sees a point.
    pub fn radiance(&self, dir: DVec3) -> DVec3 {
        if self.radius <= 0.0 {
            return DVec3::ZERO;
        }
        self.irradiance * (self.peak * disc_profile(dir.distance(self.towards) / self.radius))
    }

    /// A direction towards a random point of the disc, as dense as the disc is bright.
    pub fn sample(&self, random: &mut Random) -> DVec3 {
        if self.radius <= 0.0 {
            return self.towards;
        }
        loop {
            // Even in solid angle: that is 2 pi c dc in the chord c. Nearly half are kept.
            let place = (1.0 + DISC_RIM) * random.unit().sqrt();
            if random.unit() < disc_profile(place) {
                let chord = place * self.radius;
                return turned(self.towards, 1.0 - 0.5 * chord * chord, random.unit() * TAU);
            }
        }
    }
}

/// A uniform sky.
#[derive(Clone, Debug)]
pub struct UniformSky {
    /// From all directions.
    pub radiance: DVec3,
    /// The sun; none where its irradiance is 0.
    pub sun: Option<SunDisc>,
    /// Albedo of the ground, where there is one.
    pub ground: Option<DVec3>,
    /// Its waves, where it is a sea.
    pub sea: Option<Arc<Sea>>,
}

/// Distance along a ray to a planet whose surface is altitude 0, m.
pub fn distance_to_ground(ray: &Ray) -> Option<f64> {
    // |origin + t dir - centre|^2 = R^2 with the centre at -R: t^2 + 2 b t + c = 0. Written with
    // the altitude, c does not cancel.
    let o = ray.origin;
    let b = ray.dir.dot(o) + PLANET_RADIUS * ray.dir.y;
    let c = o.length_squared() + 2.0 * PLANET_RADIUS * o.y;
    let discriminant = b * b - c;
    if c < 0.0 || b >= 0.0 || discriminant <= 0.0 {
        return None;
    }
    Some(c / (-b + discriminant.sqrt()))
}

/// Upwards at a point of the planet.
pub fn ground_normal(point: DVec3) -> DVec3 {
    (point + DVec3::Y * PLANET_RADIUS).normalize()
}

impl Surroundings for UniformSky {
    fn sky(&self, _ray: &Ray) -> DVec3 {
        self.radiance
    }

    fn sky_of_eye(&self, ray: &Ray) -> DVec3 {
        self.radiance + self.sun.map_or(DVec3::ZERO, |sun| sun.radiance(ray.dir))
    }

    fn sun(&self, _point: DVec3, random: &mut Random) -> Option<(DVec3, DVec3)> {
        self.sun.map(|sun| (sun.sample(random), sun.irradiance))
    }

    fn ground(&self, ray: &Ray) -> Option<f64> {
        self.ground.and_then(|_| distance_to_ground(ray))
    }

    fn ground_at(&self, point: DVec3) -> (DVec3, DVec3) {
        (self.ground.unwrap_or(DVec3::ZERO), ground_normal(point))
    }

    fn sea(&self) -> Option<&Sea> {
        self.sea.as_deref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ground_is_where_it_should_be() {
        for altitude in [1e-3, 2.0, 1000.0, 1e7] {
            let origin = DVec3::new(0.0, altitude, 0.0);
            let down = distance_to_ground(&Ray { origin, dir: DVec3::NEG_Y }).expect("below");
            assert!((down / altitude - 1.0).abs() < 1e-12, "{altitude}: {down}");
            assert_eq!(distance_to_ground(&Ray { origin, dir: DVec3::X }), None);
            let horizon = -(2.0 * altitude / PLANET_RADIUS).sqrt().min(1.0);
            for over in [0.98, 1.02] {
                let y = (horizon * over).max(-1.0);
                let dir = DVec3::new((1.0 - y * y).max(0.0).sqrt(), y, 0.0).normalize();
                // The dip of the horizon is sqrt(2 h / R) to first order in h / R.
                if altitude < 1e4 {
                    assert_eq!(distance_to_ground(&Ray { origin, dir }).is_some(), over > 1.0);
                }
            }
        }
    }

    /// Radiance summed over rings of the disc, 2 pi c dc of solid angle each, is the irradiance;
    /// and nothing is sampled where nothing shines.
    #[test]
    fn the_disc_holds_the_irradiance() {
        let sun = SunDisc::new(DVec3::Y, DVec3::splat(2.0), 0.01);
        const RINGS: usize = 4096;
        let width = 2.0 * 0.005 / RINGS as f64;
        let sum: f64 = (0..RINGS)
            .map(|i| {
                let chord = (i as f64 + 0.5) * width;
                let dir = turned(DVec3::Y, 1.0 - 0.5 * chord * chord, 0.3);
                sun.radiance(dir).x * TAU * chord * width
            })
            .sum();
        // The frame's constant is within 1e-5 itself.
        assert!((sum / 2.0 - 1.0).abs() < 3e-5, "{sum}");
        let mut random = Random::new(0, 0, 0);
        for _ in 0..1000 {
            assert!(sun.radiance(sun.sample(&mut random)) != DVec3::ZERO);
        }
    }
}
