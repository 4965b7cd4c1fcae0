//! Light through a medium: the one walk that slabs, spheres and scenes share.

use std::f64::consts::TAU;

use glam::DVec3;

use super::geometry::{Medium, Ray, first_collision, transmittance};
use super::random::Random;
use crate::medium::PreparedPhase;

/// What the medium's matter does to light that collides.
#[derive(Clone, Copy, Debug)]
pub struct Matter {
    /// Phase function.
    pub phase: PreparedPhase,
    /// Single-scattering albedo.
    pub albedo: f64,
}

/// Where light comes from and where paths end.
pub trait Surroundings: Sync {
    /// Radiance that arrives at a point from beyond the medium against the direction of travel
    /// `ray.dir`, without the sun's disc.
    fn sky(&self, ray: &Ray) -> DVec3;

    /// Radiance behind everything along a ray of the camera, the sun's disc included. Only a
    /// camera sees the disc: scattered light meets it through [`Self::sun`].
    fn sky_of_eye(&self, ray: &Ray) -> DVec3;

    /// Light that the air adds on the way from the eye, and its transmittance, for a ray of the
    /// camera and a distance (m). Scattered paths ignore the air between clouds.
    fn air(&self, _ray: &Ray, _distance: f64) -> (DVec3, DVec3) {
        (DVec3::ZERO, DVec3::ONE)
    }

    /// A direction towards a random point of the sun's disc, and the irradiance at a point if
    /// nothing is in the way; none where there is no sun.
    fn sun(&self, point: DVec3, random: &mut Random) -> Option<(DVec3, DVec3)>;

    /// Distance along a ray to the ground, m.
    fn ground(&self, ray: &Ray) -> Option<f64>;

    /// Albedo of the ground, and its normal at a point.
    fn ground_at(&self, point: DVec3) -> (DVec3, DVec3);
}

/// Collisions before roulette may end a path whose throughput is still high: albedo 1 never ends
/// a path by itself, and a path in an endless medium would run for ever.
const COLLISIONS_BEFORE_ROULETTE: u32 = 1000;
/// Distance from the ground at which a path goes on, m, relative to the distance travelled.
const GROUND_OFFSET: f64 = 1e-9;

/// The end of a free flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Flight {
    /// Collided in the medium at a distance, m.
    Collision(f64),
    /// Met the ground at a distance, m.
    Ground(f64),
    /// Left everything behind.
    Escape,
}

/// Flies along a ray until something happens.
pub fn fly(
    medium: &impl Medium,
    surroundings: &impl Surroundings,
    ray: &Ray,
    random: &mut Random,
) -> Flight {
    let ground = surroundings.ground(ray);
    match (first_collision(medium, ray, ground.unwrap_or(f64::INFINITY), random), ground) {
        (Some(t), _) => Flight::Collision(t),
        (None, Some(t)) => Flight::Ground(t),
        (None, None) => Flight::Escape,
    }
}

/// Unbiased estimate of the radiance that arrives at the ray's origin from the medium and all
/// that is behind it, given how the ray's first flight ended. Sunlight is gathered at every
/// collision; the disc itself is never met.
pub fn radiance(
    medium: &impl Medium,
    surroundings: &impl Surroundings,
    matter: &Matter,
    mut ray: Ray,
    mut flight: Flight,
    random: &mut Random,
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let mut throughput = DVec3::ONE;
    for collision in 0.. {
        let point;
        match flight {
            Flight::Escape => return sum + throughput * surroundings.sky(&ray),
            Flight::Collision(t) => {
                point = ray.at(t);
                throughput *= matter.albedo;
                if let Some((towards, irradiance)) = surroundings.sun(point, random) {
                    let phase = matter.phase.eval(ray.dir.dot(towards));
                    let reached = sunlight(medium, surroundings, point, towards, random);
                    sum += throughput * irradiance * (phase * reached);
                }
                ray = Ray { origin: point, dir: scatter(&matter.phase, ray.dir, random) };
            }
            Flight::Ground(t) => {
                let (albedo, normal) = surroundings.ground_at(ray.at(t));
                point = ray.at(t) + normal * (GROUND_OFFSET * t.max(1.0));
                throughput *= albedo;
                if let Some((towards, irradiance)) = surroundings.sun(point, random) {
                    let cosine = normal.dot(towards);
                    if cosine > 0.0 {
                        let reached = sunlight(medium, surroundings, point, towards, random);
                        sum += throughput * irradiance * (cosine / std::f64::consts::PI * reached);
                    }
                }
                ray = Ray { origin: point, dir: cosine_direction(normal, random) };
            }
        }
        let strength = throughput.max_element();
        if strength <= 0.0 {
            return sum;
        }
        // Roulette by what the path still carries, and gently after very many collisions.
        let late = collision > COLLISIONS_BEFORE_ROULETTE;
        let survival = if late { strength.min(0.99) } else { strength.min(1.0) };
        if survival < 1.0 {
            if random.unit() >= survival {
                return sum;
            }
            throughput /= survival;
        }
        flight = fly(medium, surroundings, &ray, random);
    }
    sum
}

/// What one sample of a picture saw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Radiance at the eye.
    pub radiance: DVec3,
    /// Estimate of the transmittance of the medium along the ray: 0 or 1.
    pub transmittance: f64,
}

/// One sample along a ray of the camera.
pub fn look(
    medium: &impl Medium,
    surroundings: &impl Surroundings,
    matter: &Matter,
    ray: Ray,
    random: &mut Random,
) -> Seen {
    let flight = fly(medium, surroundings, &ray, random);
    let distance = match flight {
        Flight::Collision(t) | Flight::Ground(t) => t,
        Flight::Escape => {
            return Seen { radiance: surroundings.sky_of_eye(&ray), transmittance: 1.0 };
        }
    };
    let transmittance = if matches!(flight, Flight::Collision(_)) { 0.0 } else { 1.0 };
    let light = radiance(medium, surroundings, matter, ray, flight, random);
    let (added, passed) = surroundings.air(&ray, distance);
    let radiance = light * passed + added;
    Seen { radiance, transmittance }
}

/// Share of the sunlight that reaches a point.
fn sunlight(
    medium: &impl Medium,
    surroundings: &impl Surroundings,
    point: DVec3,
    towards: DVec3,
    random: &mut Random,
) -> f64 {
    let ray = Ray { origin: point, dir: towards };
    if surroundings.ground(&ray).is_some() {
        return 0.0;
    }
    transmittance(medium, &ray, f64::INFINITY, random)
}

/// A new direction of travel, drawn from the phase function.
pub fn scatter(phase: &PreparedPhase, dir: DVec3, random: &mut Random) -> DVec3 {
    let cosine = phase.sample(random.unit(), random.unit());
    turned(dir, cosine, random.unit() * TAU)
}

/// The direction at an angle (by its cosine) and an azimuth around another.
pub fn turned(dir: DVec3, cosine: f64, azimuth: f64) -> DVec3 {
    let (x, y) = dir.any_orthonormal_pair();
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    (x * (sine * azimuth.cos()) + y * (sine * azimuth.sin()) + dir * cosine).normalize()
}

fn cosine_direction(normal: DVec3, random: &mut Random) -> DVec3 {
    let cosine = (1.0 - random.unit()).sqrt();
    turned(normal, cosine, random.unit() * TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_unit_and_at_their_angle() {
        let mut random = Random::new(1, 2, 3);
        for dir in [DVec3::X, DVec3::NEG_Z, DVec3::new(0.6, -0.64, 0.48)] {
            for cosine in [-1.0, -0.3, 0.0, 0.999_999, 1.0] {
                let new = turned(dir, cosine, random.unit() * TAU);
                assert!((new.length() - 1.0).abs() < 1e-12);
                // The sine's square root loses half the digits next to the poles.
                assert!((new.dot(dir) - cosine).abs() < 1e-9, "{cosine}");
            }
        }
    }
}
