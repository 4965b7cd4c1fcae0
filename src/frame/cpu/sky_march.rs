//! Twin of `shaders/shared/sky_march.wgsl` and of the passes that fill the tables it reads: light
//! gathered along rays through the air, in f64. Step counts are the caller's, so that the same
//! code is the twin of a pass or, with many steps, the reference of its accuracy.

use glam::{DVec2, DVec4};
use std::f64::consts::PI;
use std::sync::Arc;

use super::atmosphere::{
    aerosol_phase, air_span, altitude_along, altitude_at_place, altitude_place, depth_place,
    depth_ray, distance_to_ground, ground_reach, medium_at, rayleigh_phase, sun_at_place,
    sun_place, sun_visible,
};
use crate::frame::sky::gpu_data::PLANET_RADIUS;
use crate::frame::sky::spectrum::Coefficients;
use crate::frame::sky::tables::{DEPTH_SIZE, GROUND_SIZE, MULTIPLE_SIZE};
use crate::medium::Sea;

/// A table of values at the four wavelengths, over the unit square.
#[derive(Clone, Debug)]
pub struct Table {
    size: [usize; 2],
    values: Vec<DVec4>,
}

impl Table {
    /// Fills a table; `value` gets places from 0 to 1, the ends included.
    pub fn new(size: [u32; 2], value: impl Fn(DVec2) -> DVec4) -> Self {
        let size = size.map(|s| s as usize);
        let last = |n: usize| (n as f64 - 1.0).max(1.0);
        let values = (0..size[0] * size[1])
            .map(|i| {
                let (x, y) = ((i % size[0]) as f64, (i / size[0]) as f64);
                value(DVec2::new(x / last(size[0]), y / last(size[1])))
            })
            .collect();
        Self { size, values }
    }

    /// The values, row by row.
    pub fn values(&self) -> &[DVec4] {
        &self.values
    }

    /// Bilinear.
    pub fn at(&self, place: DVec2) -> DVec4 {
        let axis = |x: f64, n: usize| {
            let texel = x.clamp(0.0, 1.0) * (n - 1) as f64;
            let low = (texel as usize).min(n.saturating_sub(2));
            (low, (low + 1).min(n - 1), texel - low as f64)
        };
        let (x0, x1, fx) = axis(place.x, self.size[0]);
        let (y0, y1, fy) = axis(place.y, self.size[1]);
        let row = |y: usize| {
            let of = |x: usize| self.values[y * self.size[0] + x];
            of(x0).lerp(of(x1), fx)
        };
        row(y0).lerp(row(y1), fy)
    }
}

/// A ray with all that its places need of the sun; fields as in the shader.
#[derive(Clone, Copy, Debug)]
pub struct AirRay {
    /// m, of its start.
    pub altitude: f64,
    /// Cosine of its zenith angle.
    pub mu: f64,
    /// Cosine of the sun's zenith angle, at its start.
    pub sun_mu: f64,
    /// Cosine of the angle between ray and sun.
    pub cos_sun: f64,
}

/// What a ray has gathered, per unit of the sun's irradiance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gathered {
    /// 1/sr.
    pub radiance: DVec4,
    /// Of the way so far.
    pub optical_depth: DVec4,
    /// Radiance where unit radiance comes from all sides everywhere.
    pub response: DVec4,
}

/// The air with the tables that do not depend on the view.
#[derive(Clone, Debug)]
pub struct Air {
    /// What it is made of.
    pub coefficients: Coefficients,
    /// Reflectance of the ground, or of the water below a sea.
    pub ground_albedo: DVec4,
    /// Its waves, where it is a sea.
    pub sea: Option<Arc<Sea>>,
    /// Optical depth to space.
    pub depth: Table,
    /// Mean radiance of light scattered twice and more.
    pub multiple: Table,
    /// Irradiance of the sky on the ground.
    pub ground: Table,
}

/// Optical depth of the air from a place to space, by the midpoint rule.
pub fn depth_to_space(c: &Coefficients, altitude: f64, mu: f64, steps: u32) -> DVec4 {
    let length = air_span(altitude, mu).1;
    let place = |i: u32| length * (f64::from(i) / f64::from(steps)).powi(2);
    (0..steps)
        .map(|i| {
            let (a, b) = (place(i), place(i + 1));
            medium_at(c, altitude_along(altitude, mu, 0.5 * (a + b))).extinction * (b - a)
        })
        .sum()
}

/// Of a direction grid, equal in azimuth: cosine of the angle to the sun.
fn cosine_to_sun(mu: f64, sun_mu: f64, azimuth: f64) -> f64 {
    mu * sun_mu + ((1.0 - mu * mu) * (1.0 - sun_mu * sun_mu)).max(0.0).sqrt() * azimuth.cos()
}

/// Mean over half a turn of azimuths, which mirrors the other half.
fn over_azimuths(count: u32, f: impl Fn(f64) -> Gathered) -> Gathered {
    let mut sum = Gathered::default();
    for j in 0..count {
        let one = f(PI * (f64::from(j) + 0.5) / f64::from(count));
        sum.radiance += one.radiance / f64::from(count);
        sum.response += one.response / f64::from(count);
    }
    sum
}

impl Air {
    /// The tables as the passes fill them.
    pub fn new(coefficients: Coefficients, ground_albedo: DVec4, sea: Option<Arc<Sea>>) -> Self {
        let nothing = |size| Table::new(size, |_| DVec4::ZERO);
        let mut air = Self {
            coefficients,
            ground_albedo,
            sea,
            depth: Table::new(DEPTH_SIZE, |place| {
                let (altitude, mu) = depth_ray(place);
                depth_to_space(&coefficients, altitude, mu, 64)
            }),
            multiple: nothing(MULTIPLE_SIZE),
            ground: nothing([GROUND_SIZE[0], 1]),
        };
        let multiple = Table::new(MULTIPLE_SIZE, |place| {
            air.second_and_more(altitude_at_place(place.y), sun_at_place(place.x))
        });
        air.multiple = multiple;
        let ground =
            Table::new([GROUND_SIZE[0], 1], |place| air.sky_irradiance(sun_at_place(place.x)));
        air.ground = ground;
        air
    }

    fn second_and_more(&self, altitude: f64, sun_mu: f64) -> DVec4 {
        const ZENITHS: u32 = 12;
        let (mut second, mut response) = (DVec4::ZERO, DVec4::ZERO);
        for i in 0..ZENITHS {
            let mu = f64::from(2 * i + 1) / f64::from(ZENITHS) - 1.0;
            let hits = distance_to_ground(altitude, mu) >= 0.0;
            let mean = over_azimuths(6, |azimuth| {
                let cos_sun = cosine_to_sun(mu, sun_mu, azimuth);
                self.gather_all(AirRay { altitude, mu, sun_mu, cos_sun }, hits, 20)
            });
            second += mean.radiance / f64::from(ZENITHS);
            response += mean.response / f64::from(ZENITHS);
        }
        second / (DVec4::ONE - response)
    }

    fn sky_irradiance(&self, sun_mu: f64) -> DVec4 {
        const ZENITHS: u32 = 12;
        let ring = |i: u32| {
            let mu = ((f64::from(i) + 0.5) / f64::from(ZENITHS)).sqrt();
            over_azimuths(8, |azimuth| {
                let cos_sun = cosine_to_sun(mu, sun_mu, azimuth);
                self.gather_all(AirRay { altitude: 0.0, mu, sun_mu, cos_sun }, false, 24)
            })
        };
        (0..ZENITHS).map(|i| ring(i).radiance).sum::<DVec4>() * (PI / f64::from(ZENITHS))
    }

    /// Mean radiance of the upper hemisphere, and that of the lower one in parts: of the air, of the
    /// ground as the sun lights it, and as the sky does; 1/sr.
    pub fn hemispheres(&self, altitude: f64, sun_mu: f64) -> [DVec4; 4] {
        const ZENITHS: u32 = 12;
        const AZIMUTHS: u32 = 8;
        let mut sums = [DVec4::ZERO; 4];
        for (up, i, j) in [true, false]
            .into_iter()
            .flat_map(|up| (0..ZENITHS).map(move |i| (up, i)))
            .flat_map(|(up, i)| (0..AZIMUTHS).map(move |j| (up, i, j)))
        {
            let mu = (f64::from(i) + 0.5) / f64::from(ZENITHS) * if up { 1.0 } else { -1.0 };
            let azimuth = PI * (f64::from(j) + 0.5) / f64::from(AZIMUTHS);
            let ray = AirRay { altitude, mu, sun_mu, cos_sun: cosine_to_sun(mu, sun_mu, azimuth) };
            let hits = distance_to_ground(altitude, mu) >= 0.0;
            let air = self.gather_air(&ray, hits, 24);
            sums[usize::from(!up)] += air.radiance;
            if hits {
                let through = (-air.optical_depth).exp();
                let sun_below = sun_mu_along(&ray, 0.0, ground_reach(altitude, mu));
                sums[2] += through * self.ground_by_sun(sun_below);
                sums[3] += through * self.ground_by_sky(sun_below);
            }
        }
        sums.map(|sum| sum / f64::from(ZENITHS * AZIMUTHS))
    }

    /// Irradiance of sunlight that arrives at a place, on a surface that faces it.
    pub fn sunlight(&self, altitude: f64, sun_mu: f64) -> DVec4 {
        let visible = sun_visible(altitude.max(0.0), sun_mu);
        if visible <= 0.0 {
            return DVec4::ZERO;
        }
        (-self.depth.at(depth_place(altitude, sun_mu))).exp() * visible
    }

    /// Radiance of the bare ground, 1/sr.
    pub fn ground_light(&self, sun_mu: f64) -> DVec4 {
        self.ground_by_sun(sun_mu) + self.ground_by_sky(sun_mu)
    }

    /// Shares of sunlight from this height and of skylight that a sea reflects; none where there is none.
    pub fn reflected(&self, sun_mu: f64) -> [f64; 2] {
        self.sea.as_ref().map_or([0.0; 2], |s| [s.reflectance(sun_mu), s.mean_reflectance()])
    }

    fn albedo(&self, reflected: f64) -> DVec4 {
        self.ground_albedo + reflected * (1.0 - self.ground_albedo)
    }

    fn ground_by_sun(&self, sun_mu: f64) -> DVec4 {
        let albedo = self.albedo(self.reflected(sun_mu)[0]);
        albedo / PI * sun_mu.max(0.0) * self.sunlight(0.0, sun_mu)
    }

    fn ground_by_sky(&self, sun_mu: f64) -> DVec4 {
        self.albedo(self.reflected(0.0)[1]) / PI
            * self.ground.at(DVec2::new(sun_place(sun_mu), 0.0))
    }

    fn gather(&self, ray: &AirRay, begin: f64, end: f64, so_far: &Gathered) -> Gathered {
        let middle = 0.5 * (begin + end);
        let altitude = altitude_along(ray.altitude, ray.mu, middle).max(0.0);
        let sun_mu = sun_mu_along(ray, altitude, middle);
        let medium = medium_at(&self.coefficients, altitude);
        let scattering = medium.rayleigh + medium.aerosol;
        let single = medium.rayleigh * rayleigh_phase(ray.cos_sun)
            + medium.aerosol * aerosol_phase(ray.cos_sun);
        let again = self.multiple.at(DVec2::new(sun_place(sun_mu), altitude_place(altitude)));
        let source = single * self.sunlight(altitude, sun_mu) + scattering * again;
        let tau = medium.extinction * (end - begin);
        let weight = (-so_far.optical_depth).exp() * mean_transmittance(tau) * (end - begin);
        Gathered {
            radiance: so_far.radiance + weight * source,
            response: so_far.response + weight * scattering,
            optical_depth: so_far.optical_depth + tau,
        }
    }

    /// Light of a piece of a ray, without what lies behind it.
    pub fn gather_between(&self, ray: &AirRay, begin: f64, end: f64, steps: u32) -> Gathered {
        let place = |i: u32| begin + (end - begin) * (f64::from(i) / f64::from(steps)).powi(2);
        (0..steps)
            .fold(Gathered::default(), |sum, i| self.gather(ray, place(i), place(i + 1), &sum))
    }

    /// Light that a piece of a ray scatters, before the air in front of the piece: of the sun's beam and of what
    /// comes evenly from all sides (1/sr), both per unit of the sunlight there.
    pub fn sunlit(&self, ray: &AirRay, begin: f64, end: f64, [beam, even]: [f64; 2]) -> DVec4 {
        let middle = 0.5 * (begin + end);
        let altitude = altitude_along(ray.altitude, ray.mu, middle).max(0.0);
        let medium = medium_at(&self.coefficients, altitude);
        let scattered = (medium.rayleigh * rayleigh_phase(ray.cos_sun)
            + medium.aerosol * aerosol_phase(ray.cos_sun))
            * beam
            + (medium.rayleigh + medium.aerosol) * even;
        let sunlight = self.sunlight(altitude, sun_mu_along(ray, altitude, middle));
        scattered * sunlight * mean_transmittance(medium.extinction * (end - begin)) * (end - begin)
    }

    /// Optical depth of a piece of a ray.
    pub fn depth_between(&self, ray: &AirRay, begin: f64, end: f64, steps: u32) -> DVec4 {
        let place = |i: u32| begin + (end - begin) * (f64::from(i) / f64::from(steps)).powi(2);
        let part = |i: u32| {
            let (a, b) = (place(i), place(i + 1));
            let altitude = altitude_along(ray.altitude, ray.mu, 0.5 * (a + b)).max(0.0);
            medium_at(&self.coefficients, altitude).extinction * (b - a)
        };
        (0..steps).map(part).sum()
    }

    /// All light along a ray to the ground, which is seen at its end, or to the end of the air.
    pub fn gather_all(&self, ray: AirRay, hits_ground: bool, steps: u32) -> Gathered {
        let mut sum = self.gather_air(&ray, hits_ground, steps);
        if hits_ground {
            let end = ground_reach(ray.altitude, ray.mu);
            let through = (-sum.optical_depth).exp();
            sum.radiance += through * self.ground_light(sun_mu_along(&ray, 0.0, end));
            sum.response += through * self.albedo(self.reflected(0.0)[1]);
        }
        sum
    }

    fn gather_air(&self, ray: &AirRay, hits_ground: bool, steps: u32) -> Gathered {
        let span = air_span(ray.altitude, ray.mu);
        let end = if hits_ground { ground_reach(ray.altitude, ray.mu) } else { span.1 };
        self.gather_between(ray, span.0, end, steps)
    }
}

/// 1 - exp(-tau) over tau; tau is far above the last digits of 1 or so thin that its error is nothing.
fn mean_transmittance(tau: DVec4) -> DVec4 {
    DVec4::from_array(tau.to_array().map(|t| if t < 1e-8 { 1.0 } else { -(-t).exp_m1() / t }))
}

/// Cosine of the sun's zenith angle after a distance along a ray.
pub fn sun_mu_along(ray: &AirRay, altitude: f64, distance: f64) -> f64 {
    let turned = (PLANET_RADIUS + ray.altitude) * ray.sun_mu + distance * ray.cos_sun;
    (turned / (PLANET_RADIUS + altitude)).clamp(-1.0, 1.0)
}
