//! Sunlight at a place where a path scatters, with a narrow lobe of the phase function apart.
//!
//! Droplets scatter half of the light within a degree. A path that looks straight at the sun from
//! its collisions then finds most of the sunlight by rare chance: it has to travel within a degree of
//! the sun itself. So the phase function is taken for what it is, a sum of two lobes: every
//! scattering is by the narrow or by the broad one, and every path from the eye to the sun has a last
//! broad scattering, or none. From there on only narrow ones follow, and these are made from the
//! sun's end: as many directions as there are scatterings, each turned from the one before by the
//! narrow lobe, the first one the sun's; then a walk along them from the last to the first. The lobe
//! is sampled exactly, so its peak never appears in a weight.

use std::f64::consts::PI;

use glam::DVec3;

use super::geometry::{Medium, Ray, transmittance};
use super::random::Random;
use super::transport::{Flight, Matter, Surroundings, fly, scatter};
use crate::medium::PreparedPhase;

/// Mean cosine from which on a lobe is narrow.
const NARROW: f64 = 0.9;
/// Most narrow scatterings on the way to the sun: of two lobes the narrow one has at most 0.56, so
/// that 1e-16 of the light is beyond.
const LONGEST: usize = 64;
/// Rays towards the sun from a collision that scatters alike in all directions. Measured in the
/// scenes, as time times squared error of the median pixel: 0.5 and 1 are alike, 0.24 is 1.1 to 1.5
/// times as much, and one ray from every collision whatever its angle 1.7 to 2 times.
const RAYS: f64 = 0.7;
/// Most rays from one collision.
const MOST_RAYS: f64 = 8.0;

/// The phase function's lobes.
#[derive(Clone, Copy, Debug)]
pub struct Lobes {
    narrow: Option<PreparedPhase>,
    broad: Option<PreparedPhase>,
    /// Share of the scatterings that are by the narrow lobe.
    share: f64,
    albedo: f64,
}

impl Lobes {
    /// Of a medium's matter.
    pub fn new(matter: &Matter) -> Self {
        let Matter { phase, albedo } = *matter;
        match (phase.narrow_lobe(NARROW), phase.broad_lobe()) {
            (None, _) => Self { narrow: None, broad: Some(phase), share: 0.0, albedo },
            (Some(narrow), broad) => {
                Self { narrow: Some(narrow), broad, share: phase.narrow_share(), albedo }
            }
        }
    }

    /// The narrow lobe, if there is one.
    pub fn narrow(&self) -> Option<&PreparedPhase> {
        self.narrow.as_ref()
    }

    /// Whether narrow scatterings after a broad one are gathered from there: not where there is
    /// nothing but a narrow lobe.
    pub fn are_apart(&self) -> bool {
        self.narrow.is_some() && self.broad.is_some()
    }

    /// Density of the scatterings by the narrow lobe alone, 1/sr.
    pub fn narrow_density(&self, cosine: f64) -> f64 {
        self.narrow.map_or(0.0, |lobe| self.share * lobe.eval(cosine))
    }

    /// Density of those by the broad lobe alone, 1/sr.
    pub fn broad_density(&self, cosine: f64) -> f64 {
        self.broad.map_or(0.0, |lobe| (1.0 - self.share) * lobe.eval(cosine))
    }

    /// A new direction of travel, and whether the broad lobe made it.
    pub fn scatter(&self, dir: DVec3, random: &mut Random) -> (DVec3, bool) {
        match (&self.narrow, &self.broad) {
            (Some(narrow), _) if random.unit() < self.share => {
                (scatter(narrow, dir, random), false)
            }
            (_, Some(broad)) => (scatter(broad, dir, random), true),
            (_, None) => (dir, false),
        }
    }

    /// Of a path's next scattering, 1/sr: by the lobe whose sunlight is gathered there, and while
    /// the path is `straight`, by the narrow one too.
    pub fn density(&self, cosine: f64, straight: bool) -> f64 {
        self.broad_density(cosine) + if straight { self.narrow_density(cosine) } else { 0.0 }
    }
}

/// Everything on the way to the sun.
pub struct Towards<'a, M, S> {
    /// Between.
    pub medium: &'a M,
    /// The sun, and the ground that hides it.
    pub surroundings: &'a S,
    /// Of the medium's phase function.
    pub lobes: &'a Lobes,
    /// Towards a point of the sun's disc.
    pub sun: DVec3,
}

impl<M: Medium, S: Surroundings> Towards<'_, M, S> {
    /// Light that is scattered once by `density` (1/sr, of the direction towards where the light
    /// comes from), at a place, after any number of narrow scatterings on the way; per unit of
    /// irradiance. `strength` (1/sr) says how much there is to find: so many rays look for it.
    pub fn gather(
        &self,
        point: DVec3,
        density: impl Fn(DVec3) -> f64,
        strength: f64,
        random: &mut Random,
    ) -> f64 {
        rays(strength, random, |random| self.one_ray(point, &density, random))
    }

    fn one_ray(&self, point: DVec3, density: impl Fn(DVec3) -> f64, random: &mut Random) -> f64 {
        let Some(narrow) = self.apart() else {
            return density(self.sun) * self.reached(point, random);
        };
        self.turned_ray(point, density, narrow, 0, random)
    }

    /// The same after one narrow scattering or more: what clouds hardly turn aside of the light that
    /// they take from the beam.
    pub fn forward(
        &self,
        point: DVec3,
        density: impl Fn(DVec3) -> f64,
        random: &mut Random,
    ) -> f64 {
        let Some(narrow) = self.apart() else { return 0.0 };
        let again = self.lobes.share * self.lobes.albedo;
        again * self.turned_ray(point, density, narrow, 1, random)
    }

    /// The narrow lobe where its scatterings are made from the sun's end.
    fn apart(&self) -> Option<&PreparedPhase> {
        self.lobes.narrow.as_ref().filter(|_| self.lobes.are_apart())
    }

    /// Light after `least` narrow scatterings or more, whose first ones have no weight yet.
    fn turned_ray(
        &self,
        point: DVec3,
        density: impl Fn(DVec3) -> f64,
        narrow: &PreparedPhase,
        least: usize,
        random: &mut Random,
    ) -> f64 {
        // The n-th power of this is what n narrow scatterings leave: drawn with it, n has no weight.
        let again = self.lobes.share * self.lobes.albedo;
        let mut turns = [self.sun; LONGEST];
        let mut last = 0;
        while last < least || (last + 1 < LONGEST && random.unit() < again) {
            turns[last + 1] = scatter(narrow, turns[last], random);
            last += 1;
        }
        let weight = density(turns[last]) / (1.0 - again);
        let mut place = point;
        for turn in turns[1..=last].iter().rev() {
            let ray = Ray { origin: place, dir: *turn };
            match fly(self.medium, self.surroundings, &ray, random) {
                Flight::Collision(t) => place = ray.at(t),
                Flight::Ground(_) | Flight::Escape => return 0.0,
            }
        }
        weight * self.reached(place, random)
    }

    /// Light that one narrow scattering turns into a direction of travel: what paths find that
    /// have met nothing but the narrow lobe.
    pub fn straight(&self, point: DVec3, dir: DVec3, throughput: f64, random: &mut Random) -> f64 {
        let density = self.lobes.narrow_density(dir.dot(self.sun));
        rays(density * throughput, random, |random| density * self.reached(point, random))
    }

    /// What clouds add to the share of the sunlight that reaches a point: 0 or less, and none where the ground
    /// hides the sun.
    pub fn change(&self, point: DVec3, random: &mut Random) -> f64 {
        let ray = Ray { origin: point, dir: self.sun };
        if self.surroundings.ground(&ray).is_some() {
            return 0.0;
        }
        transmittance(self.medium, &ray, f64::INFINITY, random) - 1.0
    }

    /// Share of the sunlight that reaches a point, by an unbiased estimate.
    fn reached(&self, point: DVec3, random: &mut Random) -> f64 {
        let ray = Ray { origin: point, dir: self.sun };
        if self.surroundings.ground(&ray).is_some() {
            return 0.0;
        }
        transmittance(self.medium, &ray, f64::INFINITY, random)
    }
}

/// Mean of an estimate by a random number of tries, in proportion to how much there is to find, 1/sr.
/// Unbiased, as their sum is divided by the mean of that number.
fn rays(strength: f64, random: &mut Random, mut one: impl FnMut(&mut Random) -> f64) -> f64 {
    let wanted = (RAYS * 4.0 * PI * strength).min(MOST_RAYS);
    let count = (wanted + random.unit()) as u32;
    if count == 0 {
        return 0.0;
    }
    (0..count).map(|_| one(random)).sum::<f64>() / wanted
}

#[cfg(test)]
mod tests {
    use super::super::slab::Slab;
    use super::super::statistics::{Estimate, Moments};
    use super::super::transport::radiance;
    use super::super::uniform_sky::SunDisc;
    use super::*;

    /// A layer over a pale ground under a wide sun, which is either looked for, or met by chance.
    struct Wide {
        sun: SunDisc,
        looked_for: bool,
    }

    /// Of the ground, below the layer.
    const GROUND: f64 = -1.0;

    impl Surroundings for Wide {
        fn sky(&self, ray: &Ray) -> DVec3 {
            if self.looked_for { DVec3::ZERO } else { self.sun.radiance(ray.dir) }
        }

        fn sky_of_eye(&self, ray: &Ray) -> DVec3 {
            self.sky(ray)
        }

        fn sun(&self, _point: DVec3, random: &mut Random) -> Option<(DVec3, DVec3)> {
            self.looked_for.then(|| (self.sun.sample(random), self.sun.irradiance))
        }

        fn ground(&self, ray: &Ray) -> Option<f64> {
            (ray.dir.y < 0.0).then(|| (GROUND - ray.origin.y) / ray.dir.y)
        }

        fn ground_at(&self, _point: DVec3) -> (DVec3, DVec3) {
            (DVec3::splat(0.6), DVec3::Y)
        }
    }

    fn mean(phase: &str, albedo: f64, view: Ray, looked_for: bool) -> Estimate {
        const PATHS: u64 = 150_000;
        let phase = phase.parse::<crate::medium::Phase>().expect("a phase function").prepare();
        let matter = Matter { phase, albedo };
        let towards = DVec3::new(0.6, 0.8, 0.0);
        let surroundings = Wide { sun: SunDisc::new(towards, DVec3::ONE, 0.6), looked_for };
        let medium = Slab::new(3.0, 1.3);
        let mut random = Random::new(8, u64::from(looked_for), 0);
        let mut light = Moments::default();
        for _ in 0..PATHS {
            // What has met nothing sees the sun by chance only.
            let flight = fly(&medium, &surroundings, &view, &mut random);
            light.add(match flight {
                Flight::Escape => 0.0,
                _ => radiance(&medium, &surroundings, &matter, view, flight, &mut random).x,
            });
        }
        light.estimate()
    }

    /// However the sunlight is found, it is as much as paths find that know nothing of the sun.
    #[test]
    fn sunlight_is_as_much_as_is_met_by_chance() {
        let views = [
            // From above, with the sun behind the eye; from below, past the sun and next to it.
            Ray { origin: DVec3::new(0.0, 9.0, 0.0), dir: DVec3::new(-0.36, -0.8, 0.48) },
            Ray { origin: DVec3::new(0.0, -0.5, 0.0), dir: DVec3::new(-0.6, 0.64, 0.48) },
            Ray { origin: DVec3::new(0.0, -0.5, 0.0), dir: DVec3::new(0.28, 0.96, 0.0) },
        ];
        let cases = [("mie:20um", 1.0), ("mie:5um", 0.8), ("hg:0.95", 1.0), ("hg:0.5", 0.9)];
        for (phase, albedo) in cases {
            for (i, view) in views.into_iter().enumerate() {
                let [found, met] = [true, false].map(|how| mean(phase, albedo, view, how));
                let error = found.standard_error.hypot(met.standard_error);
                let z = (found.value - met.value) / error;
                println!("{phase} {i}: {found:?} {met:?} {z:.2}");
                // 12 comparisons: chance passes 4 once in 1300 runs of other seeds.
                assert!(z.abs() < 4.0, "{phase} {i}: {found:?} {met:?}");
                // The comparison is worth something.
                assert!(error < 0.05 * met.value, "{phase} {i}: {met:?}");
            }
        }
    }
}
