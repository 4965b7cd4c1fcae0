//! Light of the sky and of the air above the ground as paths meet it that come from clouds: marched once
//! for some altitudes and many directions, interpolated between them.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use rayon::prelude::*;

use super::geometry::Ray;
use crate::frame::cpu::sky::Sky;
use crate::frame::sky::SkyInputs;
use crate::frame::sky::gpu_data::PLANET_RADIUS;

/// Steps of the rays that fill the maps.
pub const MAP_STEPS: u32 = 32;
/// Altitudes (m) of the maps of the sky; between them radiance is interpolated in the square root of
/// the altitude, above the last it stays.
const SKY_ALTITUDES: [f64; 5] = [0.0, 1000.0, 3000.0, 8000.0, 20_000.0];
/// Altitudes (m) of the maps of the air above the ground; linear, since from low down there is as
/// little of it as there are metres.
const GROUND_ALTITUDES: [f64; 7] = [0.0, 300.0, 1000.0, 2000.0, 4000.0, 8000.0, 20_000.0];
/// Texels of a map: azimuth from the sun, height over the horizon. Sky and aureole are smooth
/// except near the sun, where clouds blur them by their own phase function.
const SIZE: [usize; 2] = [48, 64];
/// Lowest direction of the sky's maps, rad below the horizontal: the horizon's dip from 20 km is 0.08.
/// Below the horizon paths end on the ground.
const LOWEST: f64 = 0.1;
/// Nearest to the horizon that the air above the ground is looked at, in the share of the way
/// from there to the nadir: at the horizon itself rounding decides whether there is a ground.
const GRAZING: f64 = 1e-6;

/// Colours over azimuth and height, both as places from 0 to 1.
struct Map(Vec<DVec3>);

/// The sun's azimuth as a horizontal unit vector; any where the sun is straight up.
fn azimuth_of(sun: DVec3) -> DVec3 {
    DVec3::new(sun.x, 0.0, sun.z).try_normalize().unwrap_or(DVec3::X)
}

/// Place of a direction's azimuth from the sun's; denser next to the sun's.
fn azimuth_place(dir: DVec3, sun: DVec3) -> f64 {
    let level = DVec3::new(dir.x, 0.0, dir.z).try_normalize().unwrap_or(DVec3::X);
    (0.5 - 0.5 * level.dot(azimuth_of(sun))).clamp(0.0, 1.0).sqrt()
}

/// The horizontal direction at a place, its inverse.
fn azimuth_at(place: f64, sun: DVec3) -> DVec3 {
    let front = azimuth_of(sun);
    let cosine = 1.0 - 2.0 * place * place;
    front * cosine + front.cross(DVec3::Y) * (1.0 - cosine * cosine).max(0.0).sqrt()
}

/// The direction at a height (rad) over the horizontal.
fn raised(level: DVec3, height: f64) -> DVec3 {
    level * height.cos() + DVec3::Y * height.sin()
}

/// How far the horizon lies below the horizontal, rad.
fn dip(altitude: f64) -> f64 {
    (PLANET_RADIUS / (PLANET_RADIUS + altitude)).acos()
}

impl Map {
    /// Fills it; `value` gets azimuth and height as places.
    fn new(value: impl Fn(f64, f64) -> DVec3 + Sync) -> Self {
        let texel = |i: usize| {
            let x = (i % SIZE[0]) as f64 / (SIZE[0] - 1) as f64;
            let y = (i / SIZE[0]) as f64 / (SIZE[1] - 1) as f64;
            value(x, y)
        };
        Self((0..SIZE[0] * SIZE[1]).into_par_iter().map(texel).collect())
    }

    /// Bilinear.
    fn at(&self, x: f64, y: f64) -> DVec3 {
        let axis = |place: f64, n: usize| {
            let texel = place * (n - 1) as f64;
            let low = (texel as usize).min(n - 2);
            (low, texel - low as f64)
        };
        let ((x, fx), (y, fy)) = (axis(x, SIZE[0]), axis(y, SIZE[1]));
        let row = |y: usize| {
            let at = y * SIZE[0] + x;
            self.0[at].lerp(self.0[at + 1], fx)
        };
        row(y).lerp(row(y + 1), fy)
    }
}

/// The maps between which an altitude lies, and its share of the upper one.
fn between(altitudes: &[f64], altitude: f64, scale: fn(f64) -> f64) -> (usize, usize, f64) {
    let here = scale(altitude.max(0.0));
    let above = altitudes.partition_point(|a| scale(*a) <= here);
    let (low, high) = (above.saturating_sub(1), above.min(altitudes.len() - 1));
    let span = scale(altitudes[high]) - scale(altitudes[low]);
    (low, high, if span > 0.0 { (here - scale(altitudes[low])) / span } else { 0.0 })
}

/// Light of the air between a place and the ground, and what the air lets through.
struct Below {
    added: Map,
    passed: Map,
}

/// The maps of one atmosphere.
pub struct SkyMaps {
    sun: DVec3,
    sky: Vec<Map>,
    below: Vec<Below>,
}

impl SkyMaps {
    /// Marches what they hold; `sun` is the unit vector towards it.
    pub fn new(inputs: &SkyInputs, sun: DVec3) -> Self {
        let first = Sky::new(inputs, MAP_STEPS);
        let from = |camera_altitude: f64| {
            let inputs = SkyInputs { camera_altitude, ..*inputs };
            Sky::with_air(&inputs, MAP_STEPS, first.air().clone())
        };
        let sky = SKY_ALTITUDES.map(|altitude| {
            let sky = from(altitude);
            Map::new(|x, y| {
                let height = y * y * (FRAC_PI_2 + LOWEST) - LOWEST;
                sky.sky_radiance(raised(azimuth_at(x, sun), height))
            })
        });
        let below = GROUND_ALTITUDES.map(|altitude| {
            let (sky, dip) = (from(altitude), dip(altitude));
            let air = |x: f64, y: f64| {
                let depth = dip + (y * y).max(GRAZING) * (FRAC_PI_2 - dip);
                let dir = raised(azimuth_at(x, sun), -depth);
                sky.air_between(dir, sky.ground_distance(dir).max(0.0))
            };
            Below {
                added: Map::new(|x, y| air(x, y).inscatter),
                passed: Map::new(|x, y| air(x, y).transmittance),
            }
        });
        Self { sun, sky: sky.into(), below: below.into() }
    }

    /// Radiance of the sky along a ray that meets nothing.
    pub fn sky(&self, ray: &Ray) -> DVec3 {
        let (low, high, share) = between(&SKY_ALTITUDES, ray.origin.y, f64::sqrt);
        let height = ray.dir.y.clamp(-1.0, 1.0).asin();
        let y = ((height + LOWEST) / (FRAC_PI_2 + LOWEST)).clamp(0.0, 1.0).sqrt();
        let x = azimuth_place(ray.dir, self.sun);
        self.sky[low].at(x, y).lerp(self.sky[high].at(x, y), share)
    }

    /// Light of the air along a ray to the ground, and its transmittance.
    pub fn below(&self, ray: &Ray) -> (DVec3, DVec3) {
        let altitude = ray.origin.y.max(0.0);
        let (low, high, share) = between(&GROUND_ALTITUDES, altitude, |altitude| altitude);
        let dip = dip(altitude);
        let depth = -ray.dir.y.clamp(-1.0, 1.0).asin();
        let y = ((depth - dip) / (FRAC_PI_2 - dip)).clamp(0.0, 1.0).sqrt();
        let x = azimuth_place(ray.dir, self.sun);
        let of = |map: fn(&Below) -> &Map| {
            let at = |i: usize| map(&self.below[i]).at(x, y);
            at(low).lerp(at(high), share)
        };
        (of(|below| &below.added), of(|below| &below.passed))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::Vec3;

    use super::super::random::Random;
    use super::super::transport::turned;
    use super::*;
    use crate::frame::sky::SkyKind;

    fn inputs(height: f32) -> SkyInputs {
        SkyInputs {
            kind: SkyKind::Atmosphere,
            sun_direction: Vec3::new(0.4, height, -0.3).normalize(),
            sun_irradiance: 1.0,
            angular_diameter: 0.0093,
            camera_altitude: 10.0,
            ground_albedo: Vec3::splat(0.1),
            has_ground: true,
            sea_wind: None,
        }
    }

    #[test]
    fn maps_agree_with_marched_rays() {
        let inputs = inputs(0.6);
        let maps = SkyMaps::new(&inputs, inputs.sun_direction.as_dvec3());
        let mut random = Random::new(3, 0, 0);
        for altitude in [10.0, 1400.0] {
            let sky = Sky::new(&SkyInputs { camera_altitude: altitude, ..inputs }, MAP_STEPS);
            let (mut total, mut off) = (0.0, 0.0);
            for _ in 0..100 {
                let cosine = 0.03 + 0.97 * random.unit();
                let dir = turned(DVec3::Y, cosine, TAU * random.unit());
                let exact = sky.sky_radiance(dir);
                let origin = DVec3::new(0.0, altitude, 0.0);
                off += (maps.sky(&Ray { origin, dir }) - exact).length();
                total += exact.length();
            }
            // The aureole is sharper than the map within 10 degrees of the sun, where clouds blur
            // it by their own phase function; elsewhere the map's texels of 3 degrees do.
            assert!(off / total < 0.02, "{altitude} m: {}", off / total);
        }
    }

    /// What a path finds that leaves a cloud downwards, in the mean over directions, is the sky's own
    /// light from below: ground, and the air in front of it.
    #[test]
    fn light_from_below_is_the_skys() {
        // The air's part of it at least: more from higher up and with a lower sun.
        for (height, altitude, air) in
            [(0.6, 500.0, 0.1), (0.6, 1500.0, 0.3), (0.035, 500.0, 0.5), (0.035, 1500.0, 0.7)]
        {
            let inputs = inputs(height);
            let maps = SkyMaps::new(&inputs, inputs.sun_direction.as_dvec3());
            let sky = Sky::new(&SkyInputs { camera_altitude: altitude, ..inputs }, 64);
            const COUNT: u32 = 20_000;
            let (mut found, mut added_light, mut exact) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
            for i in 0..COUNT {
                // Evenly over the lower hemisphere: a lattice of the golden ratio.
                let cosine = -(f64::from(i) + 0.5) / f64::from(COUNT);
                let azimuth = TAU * (f64::from(i) * 0.618_033_988_75).fract();
                let dir = turned(DVec3::Y, cosine, azimuth);
                let distance = sky.ground_distance(dir);
                if distance < 0.0 {
                    continue;
                }
                let ray = Ray { origin: DVec3::new(0.0, altitude, 0.0), dir };
                let (added, passed) = maps.below(&ray);
                found += sky.ground_radiance(dir, distance, [1.0, 0.0, 1.0]) * passed + added;
                added_light += added;
                exact += sky.sky_radiance(dir);
            }
            let (ratio, share) = (found / exact, added_light / found);
            println!("{height} {altitude}: {ratio}, of which air {share}");
            // Next to the horizon, with the sun above it, texels are as wide as the glow.
            assert!((ratio - 1.0).abs().max_element() < 0.03, "{height} {altitude}: {ratio}");
            assert!(share.element_sum() > 3.0 * air, "{height} {altitude}: {share}");
        }
    }
}
