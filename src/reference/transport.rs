//! Light through a medium: the one walk that slabs, spheres and scenes share.
//!
//! What makes a path noisy and slow was measured in the scenes that ship (`examples/path_noise.rs`;
//! squared noise of the median pixel with clouds, of cumulus, flight and sunset). Paths cut off after
//! 4, 16 and 64 collisions: 2.6, 8.0, 0.6; 3.2, 5.0, 0.8; 3.2, 3.5, 1.0; whole ones 3.1, 3.4, 1.2,
//! in 11, 20, 31 and 33 us (cumulus): no stretch of the way is much noisier for its time than the
//! others, so neither splitting early nor roulette later has anything to win. With 30 times the rays
//! to the sun 2.1, 2.4 and 0.8 are left, and time times noise is 5 times as much; with 4 times the
//! rays it is 1.6 times, with half 1.0 to 1.3 times. What did win was time: densities in bricks
//! (`medium/bricks.rs`) and fewer steps of Newton's in Draine's lobe, together 1.3 times; and
//! paths where the noise is (`allotment.rs`). Finer cells (0.35, 0.25 in place of 0.5 radii) are alike.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::air_light::air_change;
use super::geometry::{Medium, Ray, first_collision};
use super::random::Random;
use super::sea::Waves;
use super::sunlight::{Lobes, Towards};
use crate::medium::{PreparedPhase, Sea};

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

    /// The same for a scattered path on its way to the ground.
    fn air_below(&self, _ray: &Ray) -> (DVec3, DVec3) {
        (DVec3::ZERO, DVec3::ONE)
    }

    /// A direction towards a random point of the sun's disc, and the irradiance at a point if
    /// nothing is in the way; none where there is no sun.
    fn sun(&self, point: DVec3, random: &mut Random) -> Option<(DVec3, DVec3)>;

    /// The air at a distance (m) of a ray of the camera; none where there is none.
    fn air_at(&self, _ray: &Ray, _distance: f64) -> Option<AirHere> {
        None
    }

    /// Part of a ray of the camera up to a distance that lies in the air, m.
    fn air_span(&self, _ray: &Ray, distance: f64) -> [f64; 2] {
        [0.0, distance]
    }

    /// Radiance that arrives along a ray where there are no clouds, without the sun's disc.
    fn clear(&self, ray: &Ray) -> DVec3 {
        self.sky(ray)
    }

    /// Distance along a ray to the ground, m.
    fn ground(&self, ray: &Ray) -> Option<f64>;

    /// Albedo of the ground, and its normal at a point.
    fn ground_at(&self, point: DVec3) -> (DVec3, DVec3);

    /// The waves of the ground, where it is a sea.
    fn sea(&self) -> Option<&Sea> {
        None
    }

    /// Radiance of the sky that the sea reflects, where nothing is in the way; `normal` is that of the sea there.
    fn sky_over_sea(&self, ray: &Ray, _normal: DVec3) -> DVec3 {
        self.sky(ray)
    }

    /// Light that the air adds over a distance (m) of what the sea reflects, and its transmittance.
    fn air_over_sea(&self, _ray: &Ray, _normal: DVec3, _distance: f64) -> (DVec3, DVec3) {
        (DVec3::ZERO, DVec3::ONE)
    }
}

/// A scatterer of the air.
#[derive(Clone, Copy, Debug)]
pub enum AirLobe {
    /// Its molecules.
    Rayleigh,
    /// What floats in it.
    Aerosol,
}

/// Air at a place of a ray of the camera, for each of [`AirLobe`].
#[derive(Clone, Copy, Debug)]
pub struct AirHere {
    /// Scattering, seen through the air before it, rgb, 1/m.
    pub scattering: [DVec3; 2],
    /// The same times the sun's irradiance there, if nothing but the air is in the way.
    pub sunlit: [DVec3; 2],
}

/// Collisions before roulette may end a path whose throughput is still high: albedo 1 never ends
/// a path by itself, and a path in an endless medium would run for ever.
const COLLISIONS_BEFORE_ROULETTE: u32 = 1000;
/// Distance from the ground at which a path goes on, m, relative to the distance travelled.
pub(super) const GROUND_OFFSET: f64 = 1e-9;

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

/// Chance of a scattering to send a second path into the lobe around the sun.
const SPLIT_CHANCE: f64 = 0.1;
/// Throughput from which on a path is worth splitting.
const SPLIT_ABOVE: f64 = 0.05;

/// A part of a path that is still to be followed.
struct Branch {
    ray: Ray,
    throughput: DVec3,
    /// Whether it comes from a scattering, not from the eye.
    scattered: bool,
    /// Whether narrow scatterings ahead count as its own.
    straight: bool,
}

/// The directions from which a narrow lobe scatters much sunlight towards the eye.
///
/// A path that has met nothing but a narrow lobe gathers thousands of times what others do once it
/// travels within a degree of the sun: seen against a low sun, most of the noise. So some scatterings
/// send a second path there on purpose, and what both can find is shared by the balance heuristic
/// (Veach and Guibas 1995), for one path and `SPLIT_CHANCE` of another.
struct Lobe {
    phase: PreparedPhase,
    towards: DVec3,
}

impl Lobe {
    /// Share of a direction that is left to the path that found it by itself with this density,
    /// 1/sr; the rest belongs to the path that is sent there, and so does the share of what that
    /// finds.
    fn share(&self, density: f64, dir: DVec3) -> f64 {
        density / (density + SPLIT_CHANCE * self.phase.eval(dir.dot(self.towards)))
    }

    /// Sends a second path, now and then; `density` is that of the scattering.
    fn split(
        &self,
        point: DVec3,
        throughput: DVec3,
        density: impl FnOnce(DVec3) -> f64,
        random: &mut Random,
        branches: &mut Vec<Branch>,
    ) {
        if random.unit() < SPLIT_CHANCE {
            let dir = scatter(&self.phase, self.towards, random);
            let density = density(dir);
            if density > 0.0 {
                let throughput = throughput * self.share(density, dir);
                let ray = Ray { origin: point, dir };
                branches.push(Branch { ray, throughput, scattered: true, straight: true });
            }
        }
    }
}

/// Unbiased estimate of the radiance that arrives at the ray's origin from the medium and all
/// that is behind it, given how the ray's first flight ended. Sunlight is gathered at the
/// collisions; the disc itself is never met.
pub fn radiance(
    medium: &impl Medium,
    surroundings: &impl Surroundings,
    matter: &Matter,
    ray: Ray,
    flight: Flight,
    random: &mut Random,
) -> DVec3 {
    let light = Light::new(medium, surroundings, matter);
    let first = Branch { ray, throughput: DVec3::ONE, scattered: false, straight: true };
    light.gather(first, flight, random)
}

/// What paths lead through.
pub(super) struct Light<'a, M, S> {
    pub(super) medium: &'a M,
    pub(super) surroundings: &'a S,
    matter: &'a Matter,
    lobes: Lobes,
}

impl<'a, M: Medium, S: Surroundings> Light<'a, M, S> {
    pub(super) fn new(medium: &'a M, surroundings: &'a S, matter: &'a Matter) -> Self {
        Self { medium, surroundings, matter, lobes: Lobes::new(matter) }
    }

    /// What a path finds that something other than clouds has scattered, and that carries
    /// `throughput`: without sunlight that reaches it straight, or by narrow scatterings alone.
    pub(super) fn after_broad(
        &self,
        ray: Ray,
        throughput: DVec3,
        flight: Flight,
        random: &mut Random,
    ) -> DVec3 {
        let straight = !self.lobes.are_apart();
        self.gather(Branch { ray, throughput, scattered: true, straight }, flight, random)
    }

    /// Follows a path and all that splits off.
    fn gather(&self, first: Branch, flight: Flight, random: &mut Random) -> DVec3 {
        let mut branches = Vec::new();
        let mut sum = self.follow(first, flight, random, &mut branches);
        while let Some(branch) = branches.pop() {
            let flight = fly(self.medium, self.surroundings, &branch.ray, random);
            sum += self.follow(branch, flight, random, &mut branches);
        }
        sum
    }

    /// Follows one path to its end; those that split off are added to `branches`.
    fn follow(
        &self,
        Branch { mut ray, mut throughput, scattered, mut straight }: Branch,
        mut flight: Flight,
        random: &mut Random,
        branches: &mut Vec<Branch>,
    ) -> DVec3 {
        let Self { surroundings, matter, lobes, .. } = self;
        let mut sum = DVec3::ZERO;
        // As long as nothing is behind that gathers what narrow scatterings beyond it send: only then
        // do the path's own ones count.
        straight &= lobes.narrow().is_some();
        // The sea's normal where the last thing that happened was a reflection there.
        let mut over_sea = None;
        for collision in 0.. {
            let sun;
            if let (Some(normal), Flight::Collision(t)) = (over_sea, flight) {
                let (added, passed) = surroundings.air_over_sea(&ray, normal, t);
                sum += throughput * added;
                throughput *= passed;
            }
            match flight {
                Flight::Escape => {
                    let sky = match over_sea {
                        Some(normal) => surroundings.sky_over_sea(&ray, normal),
                        None => surroundings.sky(&ray),
                    };
                    return sum + throughput * sky;
                }
                Flight::Collision(t) => {
                    over_sea = None;
                    let (point, before) = (ray.at(t), ray.dir);
                    throughput *= matter.albedo;
                    sun = surroundings.sun(point, random);
                    if let Some((sun, irradiance)) = sun {
                        let (towards, carried) = (self.towards(sun), throughput.max_element());
                        let density = |dir: DVec3| lobes.broad_density(before.dot(dir));
                        let strength = density(sun) * carried;
                        let mut light = towards.gather(point, density, strength, random);
                        if straight {
                            light += towards.straight(point, before, carried, random);
                        }
                        sum += throughput * irradiance * light;
                    }
                    let (dir, broad) = lobes.scatter(before, random);
                    ray = Ray { origin: point, dir };
                    if let Some(lobe) = self.lobe(sun, straight, throughput) {
                        // Whichever lobe the path itself took.
                        let density = |dir: DVec3| lobes.narrow_density(before.dot(dir));
                        lobe.split(point, throughput, density, random, branches);
                        if !broad {
                            throughput *= lobe.share(density(dir), dir);
                        }
                    }
                    straight &= !broad;
                }
                Flight::Ground(t) => {
                    if scattered || collision > 0 {
                        let (added, passed) = surroundings.air_below(&ray);
                        sum += throughput * added;
                        throughput *= passed;
                    }
                    let (albedo, normal) = surroundings.ground_at(ray.at(t));
                    let point = ray.at(t) + normal * (GROUND_OFFSET * t.max(1.0));
                    sun = surroundings.sun(point, random);
                    if let Some(sea) = surroundings.sea() {
                        let waves = Waves::new(sea, albedo, normal, -ray.dir);
                        if let Some((sun, irradiance)) = sun {
                            sum += throughput
                                * irradiance
                                * self.sent_by_waves(&waves, sun, point, throughput, random);
                        }
                        let bounce = waves.bounce(random);
                        over_sea = bounce.is_reflected.then_some(normal);
                        throughput *= bounce.weight;
                        ray = Ray { origin: point, dir: bounce.dir };
                        straight &= !lobes.are_apart();
                    } else {
                        throughput *= albedo;
                        let density = |dir: DVec3| normal.dot(dir).max(0.0) / PI;
                        if let Some((sun, irradiance)) = sun {
                            let strength = throughput.max_element() / PI;
                            let light = self.towards(sun).gather(point, density, strength, random);
                            sum += throughput * irradiance * light;
                        }
                        ray = Ray { origin: point, dir: cosine_direction(normal, random) };
                        straight &= !lobes.are_apart();
                        if let Some(lobe) = self.lobe(sun, straight, throughput) {
                            lobe.split(point, throughput, density, random, branches);
                            throughput *= lobe.share(density(ray.dir), ray.dir);
                        }
                    }
                }
            }
            let ahead = sun.map_or(0.0, |(sun, _)| lobes.density(ray.dir.dot(sun), straight));
            let survival = survival(throughput, ahead, collision);
            if survival < 1.0 {
                if random.unit() >= survival {
                    return sum;
                }
                throughput /= survival;
            }
            flight = fly(self.medium, *surroundings, &ray, random);
        }
        sum
    }

    /// Sunlight that the sea sends back along a path, per unit of irradiance.
    fn sent_by_waves(
        &self,
        waves: &Waves<'_>,
        sun: DVec3,
        point: DVec3,
        throughput: DVec3,
        random: &mut Random,
    ) -> DVec3 {
        let (towards, carried) = (self.towards(sun), throughput.max_element());
        let glitter = |dir: DVec3| waves.glitter(dir);
        let of_glitter = towards.gather(point, glitter, glitter(sun) * carried, random);
        let below = |dir: DVec3| waves.below(dir);
        let of_water = towards.gather(point, below, below(sun) * carried, random);
        of_glitter + waves.albedo * of_water
    }

    pub(super) fn towards(&self, sun: DVec3) -> Towards<'_, M, S> {
        let Self { medium, surroundings, lobes, .. } = self;
        Towards { medium, surroundings, lobes, sun }
    }

    /// Where to send a second path; none where there is no sun, no narrow lobe whose scatterings
    /// count, or little left of the path.
    fn lobe(&self, sun: Option<(DVec3, DVec3)>, straight: bool, throughput: DVec3) -> Option<Lobe> {
        let ((towards, _), phase) = (sun?, *self.lobes.narrow()?);
        let worth = straight && throughput.max_element() >= SPLIT_ABOVE;
        worth.then_some(Lobe { phase, towards })
    }
}

/// Chance of a path to go on: by what it still carries, more of it where the next collision may
/// send much of the sun's light along it (`ahead`, 1/sr), and gently after very many collisions.
fn survival(throughput: DVec3, ahead: f64, collision: u32) -> f64 {
    let strength = throughput.max_element() * (4.0 * PI * ahead).max(1.0);
    let most = if collision > COLLISIONS_BEFORE_ROULETTE { 0.99 } else { 1.0 };
    strength.min(most)
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
            let changed = air_change(medium, surroundings, matter, &ray, f64::INFINITY, random);
            let radiance = surroundings.sky_of_eye(&ray) + changed;
            return Seen { radiance, transmittance: 1.0 };
        }
    };
    let transmittance = if matches!(flight, Flight::Collision(_)) { 0.0 } else { 1.0 };
    let light = radiance(medium, surroundings, matter, ray, flight, random);
    let (added, passed) = surroundings.air(&ray, distance);
    let changed = air_change(medium, surroundings, matter, &ray, distance, random);
    let radiance = light * passed + added + changed;
    Seen { radiance, transmittance }
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

/// A direction out of a surface that scatters alike in all directions.
pub fn cosine_direction(normal: DVec3, random: &mut Random) -> DVec3 {
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
