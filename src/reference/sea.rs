//! The sea as a path meets it: sunlight that it sends back along the path, and where the path goes on.

use std::f64::consts::PI;

use glam::DVec3;

use super::random::Random;
use super::transport::cosine_direction;
use crate::medium::{Sea, fresnel};

/// Least cosine of a path's angle to the normal: rounding may put a path that grazes the sea below it.
const LEAST_COSINE: f64 = 1e-7;

/// A place of the sea, seen along a path.
pub struct Waves<'a> {
    sea: &'a Sea,
    /// Of the water below.
    pub albedo: DVec3,
    normal: DVec3,
    view: DVec3,
    mu: f64,
}

/// Where a path goes on.
#[derive(Clone, Copy, Debug)]
pub struct Bounce {
    /// Direction of travel.
    pub dir: DVec3,
    /// What is left of its throughput.
    pub weight: DVec3,
    /// By a facet; else by the water below.
    pub is_reflected: bool,
}

impl<'a> Waves<'a> {
    /// Of albedo and normal; `view` points to where the path comes from.
    pub fn new(sea: &'a Sea, albedo: DVec3, normal: DVec3, view: DVec3) -> Self {
        let mu = normal.dot(view).clamp(LEAST_COSINE, 1.0);
        Self { sea, albedo, normal, view, mu }
    }

    /// Radiance that facets send along the path, per irradiance on a surface that faces a direction, 1/sr.
    pub fn glitter(&self, towards: DVec3) -> f64 {
        let level = self.normal.dot(towards).max(0.0);
        level * self.sea.glitter(self.normal, self.view, towards)
    }

    /// The same of the water below with albedo 1.
    pub fn below(&self, towards: DVec3) -> f64 {
        let level = self.normal.dot(towards);
        if level <= 0.0 {
            return 0.0;
        }
        level / PI * self.sea.below(self.mu, 1.0 - self.sea.reflectance(level))
    }

    /// Cosine of a direction's angle to the normal.
    pub fn level(&self, towards: DVec3) -> f64 {
        self.normal.dot(towards)
    }

    /// Radiance of the water below in a sky that is alike everywhere, over that of a Lambertian surface.
    pub fn below_sky(&self) -> f64 {
        self.sea.below(self.mu, 1.0 - self.sea.mean_reflectance())
    }

    /// Directions from which few facets send light along the path, and shares of it.
    pub fn facets(&self) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        self.sea.facets(self.mu).map(|facet| {
            let mut local = Sea::mirrored(self.mu, facet.slope).0;
            local.z = local.z.max(0.0);
            (self.turned(local).normalize_or(self.normal), facet.weight)
        })
    }

    /// From the plane of the view, across it, and up.
    fn turned(&self, local: DVec3) -> DVec3 {
        let ahead = (self.view - self.normal * self.normal.dot(self.view)).try_normalize();
        let ahead = ahead.unwrap_or_else(|| self.normal.any_orthonormal_vector());
        ahead * local.x + self.normal.cross(ahead) * local.y + self.normal * local.z
    }

    /// Draws the way on: by a facet as often as its share of the light asks.
    pub fn bounce(&self, random: &mut Random) -> Bounce {
        let reflected = self.sea.reflectance(self.mu);
        let water = (1.0 - reflected) * self.albedo.max_element();
        let chance = reflected / (reflected + water);
        if random.unit() < chance {
            let slope = self.sea.draw_facet(self.mu, || random.unit());
            let (local, cosine) = Sea::mirrored(self.mu, slope);
            let dir = self.turned(local).normalize();
            let weight = fresnel(cosine) * self.sea.free_share(self.mu, local.z) / chance;
            return Bounce { dir, weight: DVec3::splat(weight), is_reflected: true };
        }
        let dir = cosine_direction(self.normal, random);
        let entering = 1.0 - self.sea.reflectance(self.normal.dot(dir));
        let weight = self.albedo * self.sea.below(self.mu, entering) / (1.0 - chance);
        Bounce { dir, weight, is_reflected: false }
    }
}

#[cfg(test)]
mod tests {
    use super::super::statistics::Moments;
    use super::*;

    /// Under an even sky the sea is as bright as what it reflects and, with an albedo of 1, as the sky: drawn paths and
    /// sunlight looked for agree with the tables, for every view.
    #[test]
    fn an_even_sky_over_white_water_is_even() {
        for wind in [0.0, 5.0, 60.0] {
            let sea = Sea::new(wind);
            for mu in [0.02f64, 0.1, 0.5, 1.0] {
                let view = DVec3::new((1.0 - mu * mu).sqrt(), mu, 0.0);
                let waves = Waves::new(&sea, DVec3::ONE, DVec3::Y, view);
                let (mut drawn, mut looked) = (Moments::default(), Moments::default());
                let mut random = Random::new(7, 0, 0);
                for _ in 0..60_000 {
                    let bounce = waves.bounce(&mut random);
                    assert!(bounce.weight.max_element() < 12.0, "{wind} {mu}: {bounce:?}");
                    drawn.add(bounce.weight.x);
                    let dir = cosine_direction(DVec3::Y, &mut random);
                    looked.add(PI * (waves.glitter(dir) + waves.below(dir)) / dir.y);
                }
                for (name, estimate) in [("drawn", drawn.estimate()), ("looked", looked.estimate())]
                {
                    let off = (estimate.value - 1.0).abs();
                    println!("{wind} {mu} {name}: {estimate:?}");
                    // 24 comparisons; the tables are within 6e-4.
                    assert!(off < 4.5 * estimate.standard_error + 1.5e-3, "{wind} {mu} {name}");
                }
            }
        }
    }
}
