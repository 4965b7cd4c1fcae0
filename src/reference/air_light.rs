//! What clouds change of the light of the air before the eye: they take sunlight and skylight from it
//! (shafts of light, and shadows between them), and send it their own.
//!
//! The air's light without clouds is known (`atmosphere_sky.rs`); what is added here is the difference
//! alone, so that where no cloud is about nothing is estimated and nothing is noisy. A place of the ray is
//! drawn, and one of the air's two scatterers. There the beam loses what clouds let not through, narrow
//! scatterings give back some of that, and a path leaves in a direction of the scatterer's phase function:
//! what it finds takes the place of what it would find without clouds. Light that is scattered twice in the air
//! on the way is as if there were no clouds.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::geometry::{Medium, Ray};
use super::random::Random;
use super::sea::Waves;
use super::transport::{
    AirHere, AirLobe, Flight, GROUND_OFFSET, Light, Matter, Surroundings, cosine_direction, fly,
    turned,
};
use crate::frame::cpu::atmosphere::{AEROSOL_MEAN_COSINE, aerosol_phase, rayleigh_phase};

/// Places are drawn as densely as an exponential of the altitude with this height, m: between those of
/// aerosol (2 km) and of air (8.4 km).
const HEIGHT: f64 = 4000.0;
/// And of the distance, m: how far one sees on a clear day.
const SIGHT: f64 = 60_000.0;
/// Below this the exponential of a whole ray is as good as even.
const EVEN: f64 = 1e-6;

impl AirLobe {
    const ALL: [Self; 2] = [Self::Rayleigh, Self::Aerosol];

    /// Phase function, 1/sr.
    pub fn density(self, cosine: f64) -> f64 {
        match self {
            Self::Rayleigh => rayleigh_phase(cosine),
            Self::Aerosol => aerosol_phase(cosine),
        }
    }

    /// A new direction of travel.
    pub fn scatter(self, dir: DVec3, random: &mut Random) -> DVec3 {
        let cosine = match self {
            Self::Rayleigh => loop {
                let cosine = 2.0 * random.unit() - 1.0;
                if 2.0 * random.unit() < 1.0 + cosine * cosine {
                    break cosine;
                }
            },
            Self::Aerosol => {
                let g = AEROSOL_MEAN_COSINE;
                let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * random.unit());
                ((1.0 + g * g - s * s) / (2.0 * g)).clamp(-1.0, 1.0)
            }
        };
        turned(dir, cosine, TAU * random.unit())
    }
}

/// A place of the part of a ray between two distances (m), and the length (m) over which it stands.
fn place(ray: &Ray, [begin, end]: [f64; 2], random: &mut Random) -> (f64, f64) {
    let rate = ray.dir.y / HEIGHT + 1.0 / SIGHT;
    let (length, u) = (end - begin, random.unit());
    let all = -(-rate * length).exp_m1();
    if all.abs() < EVEN {
        return (begin + u * length, length);
    }
    let t = -(-u * all).ln_1p() / rate;
    (begin + t.clamp(0.0, length), all / rate * (rate * t).exp())
}

/// An unbiased estimate of what clouds add to the air's light before a distance (m) of a ray of the
/// camera; mostly below 0.
pub fn air_change(
    medium: &impl Medium,
    surroundings: &impl Surroundings,
    matter: &Matter,
    ray: &Ray,
    distance: f64,
    random: &mut Random,
) -> DVec3 {
    let span = surroundings.air_span(ray, distance);
    if span[1] <= span[0] {
        return DVec3::ZERO;
    }
    let (t, length) = place(ray, span, random);
    let Some(AirHere { scattering, sunlit }) = surroundings.air_at(ray, t) else {
        return DVec3::ZERO;
    };
    let parts = scattering.map(|part| part.element_sum().max(0.0));
    let all = parts[0] + parts[1];
    if all <= 0.0 {
        return DVec3::ZERO;
    }
    let which = usize::from(random.unit() * all >= parts[0]);
    let weight = length * all / parts[which];
    let (lobe, point) = (AirLobe::ALL[which], ray.at(t));
    let light = Light::new(medium, surroundings, matter);
    let mut sum = DVec3::ZERO;
    if let Some((sun, _)) = surroundings.sun(point, random) {
        let density = |towards: DVec3| lobe.density(ray.dir.dot(towards));
        let towards = light.towards(sun);
        let change =
            density(sun) * towards.change(point, random) + towards.forward(point, density, random);
        sum += weight * change * sunlit[which];
    }
    let throughput = weight * scattering[which];
    let survival = throughput.max_element().min(1.0);
    if survival > 0.0 && random.unit() < survival {
        let onward = Ray { origin: point, dir: lobe.scatter(ray.dir, random) };
        sum += path_change(&light, onward, throughput / survival, random);
    }
    sum
}

/// What clouds add to what a path finds that leaves the air or the ground.
fn path_change<M: Medium, S: Surroundings>(
    light: &Light<'_, M, S>,
    ray: Ray,
    throughput: DVec3,
    random: &mut Random,
) -> DVec3 {
    let surroundings = light.surroundings;
    match fly(light.medium, surroundings, &ray, random) {
        // The same sky as without them.
        Flight::Escape => DVec3::ZERO,
        Flight::Collision(t) => {
            let found = light.after_broad(ray, throughput, Flight::Collision(t), random);
            found - throughput * surroundings.clear(&ray)
        }
        Flight::Ground(t) => {
            let (albedo, normal) = surroundings.ground_at(ray.at(t));
            let point = ray.at(t) + normal * (GROUND_OFFSET * t.max(1.0));
            let throughput = throughput * surroundings.air_below(&ray).1;
            if let Some(sea) = surroundings.sea() {
                let waves = Waves::new(sea, albedo, normal, -ray.dir);
                let mut sum = DVec3::ZERO;
                if let Some((sun, irradiance)) = surroundings.sun(point, random) {
                    let towards = light.towards(sun);
                    let change = towards.change(point, random);
                    let mut of = |density: &dyn Fn(DVec3) -> f64| {
                        density(sun) * change + towards.forward(point, density, random)
                    };
                    let change =
                        of(&|dir| waves.glitter(dir)) + albedo * of(&|dir| waves.below(dir));
                    sum += throughput * irradiance * change;
                }
                let bounce = waves.bounce(random);
                let throughput = throughput * bounce.weight;
                if throughput.max_element() <= 0.0 {
                    return sum;
                }
                let onward = Ray { origin: point, dir: bounce.dir };
                return sum + path_change(light, onward, throughput, random);
            }
            let throughput = throughput * albedo;
            let mut sum = DVec3::ZERO;
            if let Some((sun, irradiance)) = surroundings.sun(point, random) {
                let density = |dir: DVec3| normal.dot(dir).max(0.0) / PI;
                let towards = light.towards(sun);
                let change = density(sun) * towards.change(point, random)
                    + towards.forward(point, density, random);
                sum += throughput * irradiance * change;
            }
            let onward = Ray { origin: point, dir: cosine_direction(normal, random) };
            sum + path_change(light, onward, throughput, random)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use glam::Vec3;

    use super::super::atmosphere_sky::AtmosphereSky;
    use super::super::geometry::Piece;
    use super::super::statistics::Moments;
    use super::*;
    use crate::frame::cpu::sky::Sky;
    use crate::frame::sky::{SkyInputs, SkyKind};
    use crate::medium::Phase;

    /// A level layer of cloud, all around.
    struct Layer {
        base: f64,
        top: f64,
        extinction: f64,
    }

    impl Medium for Layer {
        fn pieces(&self, ray: &Ray, limit: f64, visit: &mut impl FnMut(Piece) -> ControlFlow<()>) {
            let [a, b] = [self.base, self.top].map(|height| (height - ray.origin.y) / ray.dir.y);
            let (begin, end) = (a.min(b).max(0.0), a.max(b).min(limit));
            if begin < end {
                let _ =
                    visit(Piece { begin, end, minorant: 0.0, majorant: self.extinction, cell: 0 });
            }
        }

        fn extinction(&self, _cell: usize, _point: DVec3) -> f64 {
            self.extinction
        }
    }

    fn inputs(camera_altitude: f64) -> SkyInputs {
        SkyInputs {
            kind: SkyKind::Atmosphere,
            sun_direction: Vec3::new(0.4, 0.6, -0.3).normalize(),
            sun_irradiance: 1.0,
            angular_diameter: 0.0093,
            camera_altitude,
            ground_albedo: Vec3::splat(0.1),
            has_ground: true,
            sea_wind: None,
        }
    }

    fn matter(albedo: f64) -> Matter {
        Matter { phase: "mie:20um".parse::<Phase>().expect("a phase function").prepare(), albedo }
    }

    /// Mean change of the air's light along a ray, and its standard error, green.
    fn change(layer: &Layer, albedo: f64, camera: f64, dir: DVec3, distance: f64) -> [f64; 2] {
        const PATHS: u64 = 40_000;
        let surroundings = AtmosphereSky::new(&inputs(camera));
        let ray = Ray { origin: DVec3::new(0.0, camera, 0.0), dir };
        let mut random = Random::new(11, 0, 0);
        let mut sum = Moments::default();
        for _ in 0..PATHS {
            let matter = matter(albedo);
            sum.add(air_change(layer, &surroundings, &matter, &ray, distance, &mut random).y);
        }
        let estimate = sum.estimate();
        [estimate.value, estimate.standard_error]
    }

    #[test]
    fn without_clouds_nothing_changes() {
        let none = Layer { base: 1000.0, top: 1000.0, extinction: 1.0 };
        for dir in [DVec3::new(0.8, 0.6, 0.0), DVec3::new(0.8, -0.6, 0.0)] {
            assert_eq!(change(&none, 1.0, 100.0, dir, 5000.0), [0.0; 2]);
        }
    }

    /// Under a black roof there is no light to scatter: what is left is the difference between two accounts
    /// of the clear sky's light.
    #[test]
    fn under_a_black_roof_the_air_is_dark() {
        let roof = Layer { base: 3000.0, top: 3001.0, extinction: 1e3 };
        for (x, y, distance) in [(0.96, 0.28, 8000.0), (-1.0, 0.0, 15_000.0), (0.99, -0.01, 4000.0)]
        {
            let dir = DVec3::new(x, y, 0.0).normalize();
            let air = Sky::new(&inputs(100.0), 64).air_between(dir, distance).inscatter.y;
            let [changed, error] = change(&roof, 0.0, 100.0, dir, distance);
            let left = (air + changed) / air;
            println!("{dir}: {air:.5} {changed:.5} +- {error:.5}, {left:.3} left");
            assert!(error < 0.01 * air, "{dir}: {error}");
            assert!(left.abs() < 0.06, "{dir}: {left} of the air's light is left");
        }
    }

    /// Of a black layer: the sum over the ray of what the beam loses, and what skylight loses besides, less than
    /// twice as much again.
    #[test]
    fn the_beam_loses_what_a_layer_takes() {
        let layer = Layer { base: 3000.0, top: 3100.0, extinction: 1e-3 };
        let (dir, distance) = (DVec3::new(0.6, 0.0, -0.8), 20_000.0);
        let sky = Sky::new(&inputs(100.0), 64);
        let sun = inputs(100.0).sun_direction.as_dvec3();
        let lost = -(-layer.extinction * 100.0 / sun.y).exp_m1();
        const STEPS: u32 = 4000;
        let step = distance / f64::from(STEPS);
        let beam: f64 = (0..STEPS)
            .map(|i| {
                let [_, sunlit] = sky.air_at(dir, (f64::from(i) + 0.5) * step);
                AirLobe::ALL
                    .iter()
                    .zip(sunlit)
                    .map(|(lobe, lit)| lobe.density(dir.dot(sun)) * lit.y * step)
                    .sum::<f64>()
            })
            .sum();
        let [changed, error] = change(&layer, 0.0, 100.0, dir, distance);
        println!("{changed:.3e} +- {error:.1e}, beam alone {:.3e}", -lost * beam);
        assert!(changed < -lost * beam + 4.0 * error && changed > -3.0 * lost * beam);
        assert!(error < 0.05 * lost * beam);
    }
}
