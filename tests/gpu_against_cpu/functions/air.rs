//! `atmosphere.wgsl`, and what `sky_march.wgsl` computes without tables.

use std::f32::consts::FRAC_PI_2;

use cumuli::frame::cpu::atmosphere;
use cumuli::frame::cpu::sky_march::{AirRay, sun_mu_along};
use cumuli::frame::sky::gpu_data::{PLANET_RADIUS, SkyUniforms};
use cumuli::frame::sky::spectrum::{Coefficients, TO_RGB};
use cumuli::frame::sky::{SkyInputs, SkyKind};
use glam::{DVec2, DVec4, Vec3};

use super::{Four, Function, magnitude, many, one};
use crate::common::Random;

/// Texels of the view's table.
const VIEW: DVec2 = DVec2::new(64.0, 192.0);

/// A height: by magnitude from a millimetre to beyond the air, and the ends of it.
fn altitude(random: &mut Random) -> f32 {
    match random.bits() % 16 {
        0 => 0.0,
        1 => 1e5,
        2 => 1e5_f32.next_up(),
        3 => 1e9,
        _ => magnitude(random, 1e-3, 1e9),
    }
}

/// A cosine, and its ends.
fn cosine(random: &mut Random) -> f32 {
    match random.bits() % 16 {
        0 => 0.0,
        1 => 1.0,
        2 => -1.0,
        3 => random.between(-1e-7, 1e-7) as f32,
        _ => random.between(-1.0, 1.0) as f32,
    }
}

fn two(v: DVec2) -> Four {
    [v.x, v.y, 0.0, 0.0]
}

#[test]
fn what_the_air_is_made_of() {
    let inputs = SkyInputs {
        kind: SkyKind::Atmosphere,
        sun_direction: Vec3::Y,
        sun_irradiance: 1.0,
        angular_diameter: 0.0093,
        camera_altitude: 0.0,
        ground_albedo: Vec3::ZERO,
        has_ground: true,
        sea_wind: None,
    };
    let u = SkyUniforms::new(&inputs);
    let four = |v: [f32; 4]| format!("vec4<f32>({:?}, {:?}, {:?}, {:?})", v[0], v[1], v[2], v[3]);
    let declarations = format!(
        "#import cumuli::atmosphere::{{SkyUniforms, medium_at, to_rgb}}
        fn earth() -> SkyUniforms {{
            var sky: SkyUniforms;
            sky.rayleigh = {};
            sky.aerosol_scattering = {};
            sky.aerosol_extinction = {};
            sky.ozone = {};
            sky.to_red = {};
            sky.to_green = {};
            sky.to_blue = {};
            return sky;
        }}",
        four(u.rayleigh),
        four(u.aerosol_scattering),
        four(u.aerosol_extinction),
        four(u.ozone),
        four(u.to_red),
        four(u.to_green),
        four(u.to_blue),
    );
    let c = Coefficients::earth();
    // Below the ground it is as on it.
    let heights =
        many(101, |r| [if r.bits().is_multiple_of(8) { -10.0 } else { altitude(r).min(3e5) }]);
    let part = |field: &str, of: fn(&atmosphere::Medium) -> DVec4| {
        let call = format!("medium_at(earth(), x[0]).{field}");
        Function::new("atmosphere::medium_at", &declarations, &call).agrees(
            &heights,
            8.0,
            |[h]| of(&atmosphere::medium_at(&c, h)).to_array(),
        );
    };
    part("rayleigh", |m| m.rayleigh);
    part("aerosol", |m| m.aerosol);
    part("extinction", |m| m.extinction);
    // Colours are differences of wavelengths: a step is that of the largest.
    let light = many(102, |r| std::array::from_fn::<f32, 4, _>(|_| magnitude(r, 1e-6, 1e3)));
    let call = "vec4(to_rgb(earth(), vec4(x[0], x[1], x[2], x[3])), 0.0)";
    Function::new("atmosphere::to_rgb", &declarations, call).agrees(&light, 8.0, |light| {
        let [r, g, b] = TO_RGB.map(|row| DVec4::from_array(row).dot(DVec4::from_array(light)));
        [r, g, b, 0.0]
    });
    let cosines = many(103, |r| [cosine(r)]);
    Function::new(
        "atmosphere::rayleigh_phase, aerosol_phase",
        "#import cumuli::atmosphere::{aerosol_phase, rayleigh_phase}",
        "vec4(rayleigh_phase(x[0]), aerosol_phase(x[0]), 0.0, 0.0)",
    )
    .agrees(&cosines, 8.0, |[c]| {
        [atmosphere::rayleigh_phase(c), atmosphere::aerosol_phase(c), 0.0, 0.0]
    });
}

fn atmosphere_function<'a>(name: &'a str, import: &'a str, call: &'a str) -> Function<'a> {
    Function::new(name, import, call)
}

#[test]
fn rays_around_the_planet() {
    let heights = many(104, |r| [altitude(r)]);
    let rays = many(105, |r| [altitude(r), cosine(r)]);
    atmosphere_function(
        "atmosphere::horizon_squared",
        "#import cumuli::atmosphere::horizon_squared",
        "vec4(horizon_squared(x[0]), 0.0, 0.0, 0.0)",
    )
    .agrees(&heights, 4.0, |[h]| one(atmosphere::horizon_squared(h)));
    let squares = many(106, |r| [magnitude(r, 1e-3, 1e18)]);
    atmosphere_function(
        "atmosphere::altitude_of",
        "#import cumuli::atmosphere::altitude_of",
        "vec4(altitude_of(x[0]), 0.0, 0.0, 0.0)",
    )
    .agrees(&squares, 4.0, |[x]| one(atmosphere::altitude_of(x)));
    let ways = many(107, |r| [altitude(r).min(2e5), cosine(r), magnitude(r, 1e-2, 1e7)]);
    atmosphere_function(
        "atmosphere::altitude_along",
        "#import cumuli::atmosphere::altitude_along",
        "vec4(altitude_along(x[0], x[1], x[2]), 0.0, 0.0, 0.0)",
    )
    .agrees(&ways, 8.0, |[h, mu, d]| one(atmosphere::altitude_along(h, mu, d)));
    atmosphere_function(
        "atmosphere::distance_to_ground",
        "#import cumuli::atmosphere::distance_to_ground",
        "vec4(distance_to_ground(x[0], x[1]), 0.0, 0.0, 0.0)",
    )
    .agrees(&rays, 16.0, |[h, mu]| one(atmosphere::distance_to_ground(h, mu)));
    atmosphere_function(
        "atmosphere::ground_reach",
        "#import cumuli::atmosphere::ground_reach",
        "vec4(ground_reach(x[0], x[1]), 0.0, 0.0, 0.0)",
    )
    .agrees(&rays, 16.0, |[h, mu]| one(atmosphere::ground_reach(h, mu)));
    atmosphere_function(
        "atmosphere::air_span",
        "#import cumuli::atmosphere::air_span",
        "vec4(air_span(x[0], x[1]), 0.0, 0.0)",
    )
    .agrees(&rays, 16.0, |[h, mu]| {
        let (enters, leaves) = atmosphere::air_span(h, mu);
        [enters, leaves, 0.0, 0.0]
    });
    // The sun within a degree of the horizon, and anywhere.
    let suns = many(108, |r| {
        let h = altitude(r);
        let horizon = -(f64::from(h) * (2.0 * PLANET_RADIUS + f64::from(h))).sqrt()
            / (PLANET_RADIUS + f64::from(h));
        let near = (horizon + r.between(-0.01, 0.01)).clamp(-1.0, 1.0) as f32;
        [h, if r.bits().is_multiple_of(2) { near } else { cosine(r) }]
    });
    atmosphere_function(
        "atmosphere::sun_visible",
        "#import cumuli::atmosphere::sun_visible",
        "vec4(sun_visible(x[0], x[1]), 0.0, 0.0, 0.0)",
    )
    .agrees(&suns, 16.0, |[h, mu]| one(atmosphere::sun_visible(h, mu)));
    let along = many(109, |r| {
        let [h, end] = [altitude(r), altitude(r)];
        [h, cosine(r), cosine(r), end, magnitude(r, 1e-2, 1e7)]
    });
    Function::new(
        "sky_march::sun_mu_along",
        "#import cumuli::sky_march::{AirRay, sun_mu_along}",
        "vec4(sun_mu_along(AirRay(x[0], 0.0, x[1], x[2]), x[3], x[4]), 0.0, 0.0, 0.0)",
    )
    .agrees(&along, 8.0, |[altitude, sun_mu, cos_sun, end, distance]| {
        one(sun_mu_along(&AirRay { altitude, mu: 0.0, sun_mu, cos_sun }, end, distance))
    });
    let depths = many(110, |r| std::array::from_fn::<f32, 4, _>(|_| magnitude(r, 1e-12, 1e3)));
    Function::new(
        "sky_march::mean_transmittance",
        "#import cumuli::sky_march::mean_transmittance",
        "mean_transmittance(vec4(x[0], x[1], x[2], x[3]))",
    )
    .agrees(&depths, 160.0, |taus| taus.map(|tau| -(-tau).exp_m1() / tau));
}

#[test]
fn places_in_the_tables_of_the_air() {
    let unit = many(111, |r| [r.uniform() as f32, 2.0 + (r.bits() % 255) as f32]);
    Function::new(
        "atmosphere::texel_centre",
        "#import cumuli::atmosphere::texel_centre",
        "vec4(texel_centre(x[0], x[1]), texel_centre(-x[0], x[1]), texel_centre(1.0 + x[0], x[1]), 0.0)",
    )
    .agrees(&unit, 4.0, |[x, n]| {
        let at = |x| atmosphere::texel_centre(x, n);
        [at(x), at(-x), at(1.0 + x), 0.0]
    });
    let rays = many(112, |r| [altitude(r).min(1.2e5), cosine(r)]);
    Function::new(
        "atmosphere::depth_place",
        "#import cumuli::atmosphere::depth_place",
        "vec4(depth_place(x[0], x[1]), 0.0, 0.0)",
    )
    .agrees(&rays, 16.0, |[h, mu]| two(atmosphere::depth_place(h, mu)));
    let places = many(113, |r| {
        let mut end = || match r.bits() % 16 {
            0 => 0.0,
            1 => 1.0,
            _ => r.uniform() as f32,
        };
        [end(), end()]
    });
    Function::new(
        "atmosphere::depth_ray",
        "#import cumuli::atmosphere::depth_ray",
        "vec4(depth_ray(vec2(x[0], x[1])), 0.0, 0.0)",
    )
    .agrees(&places, 32.0, |[x, y]| {
        let (h, mu) = atmosphere::depth_ray(DVec2::new(x, y));
        [h, mu, 0.0, 0.0]
    });
    Function::new(
        "atmosphere::sun_place, sun_at_place, altitude_place, altitude_at_place",
        "#import cumuli::atmosphere::{sun_place, sun_at_place, altitude_place, altitude_at_place}",
        "vec4(sun_place(x[1]), sun_at_place(saturate(x[1])), altitude_place(x[0]), altitude_at_place(saturate(x[1])))",
    )
    .agrees(&rays, 8.0, |[h, mu]| {
        let y = mu.clamp(0.0, 1.0);
        [
            // `sign` of the shader is 0 at 0, and the root with it.
            if mu == 0.0 { 0.5 } else { atmosphere::sun_place(mu) },
            atmosphere::sun_at_place(y),
            atmosphere::altitude_place(h),
            atmosphere::altitude_at_place(y),
        ]
    });
    // Half of them from within the air, half from outside, where its rim is thin.
    let spans = |r: &mut Random| {
        let dip = magnitude(r, 1e-4, 1.5);
        let from_outside = r.bits().is_multiple_of(2);
        let up = if from_outside { magnitude(r, 1e-6, 1.0) } else { FRAC_PI_2 + dip };
        [FRAC_PI_2 - dip, up]
    };
    let directions = many(114, |r| {
        let [below, up] = spans(r);
        let above = r.between(-1.05 * f64::from(below), 1.05 * f64::from(up)) as f32;
        [cosine(r), above, below, up]
    });
    Function::new(
        "atmosphere::direction_place",
        "#import cumuli::atmosphere::{VIEW_SIZE, direction_place}",
        "vec4(direction_place(x[0], x[1], vec2(x[2], x[3]), VIEW_SIZE), 0.0, 0.0)",
    )
    .agrees(&directions, 16.0, |[azimuth, above, below, up]| {
        two(atmosphere::direction_place(azimuth, above, [below, up], VIEW))
    });
    let texels = many(115, |r| {
        let [below, up] = spans(r);
        [(r.bits() % 64) as f32, (r.bits() % 192) as f32, below, up]
    });
    Function::new(
        "atmosphere::direction_of",
        "#import cumuli::atmosphere::{VIEW_SIZE, direction_of}",
        "vec4(direction_of(vec2(x[0], x[1]), vec2(x[2], x[3]), VIEW_SIZE), 0.0, 0.0)",
    )
    .agrees(&texels, 16.0, |[x, y, below, up]| {
        two(atmosphere::direction_of(DVec2::new(x, y), [below, up], VIEW))
    });
    let reaches = many(116, |r| {
        let far = r.bits().is_multiple_of(4);
        let reach = if far { 1e30 } else { magnitude(r, 1e-3, 1e9) };
        let dense = if far { 2e25 } else { magnitude(r, 0.1, 1e4) };
        [magnitude(r, 1e-3, 1e9), reach, dense, r.uniform() as f32]
    });
    Function::new(
        "atmosphere::air_place, air_distance",
        "#import cumuli::atmosphere::{air_place, air_distance}",
        "vec4(air_place(x[0], vec2(x[1], x[2])), air_distance(x[3], vec2(x[1], x[2])), 0.0, 0.0)",
    )
    .agrees(&reaches, 16.0, |[distance, reach, dense, w]| {
        let spread = [reach, dense];
        [atmosphere::air_place(distance, spread), atmosphere::air_distance(w, spread), 0.0, 0.0]
    });
    // From up to where the air ends; from beyond, what is left of the digits of the way to the ground. Rays along the
    // horizon lose half of theirs.
    let downwards = many(117, |r| {
        let altitude = altitude(r).clamp(1.0, 1e5);
        let dip = (f64::from(altitude) / PLANET_RADIUS).sqrt() * 1.5;
        [altitude, r.between(-1.0, -dip.min(0.9)) as f32]
    });
    Function::new(
        "atmosphere::air_spread",
        "#import cumuli::atmosphere::air_spread",
        "vec4(air_spread(x[0], x[1], 0.0, true), air_spread(x[0], x[1], 0.0, false))",
    )
    .agrees(&downwards, 32.0, |[altitude, mu]| {
        let [reach, dense] = atmosphere::air_spread(altitude, mu, 0.0, true);
        let [far, up] = atmosphere::air_spread(altitude, mu, 0.0, false);
        [reach, dense, far, up]
    });
}
