//! `sky_march.wgsl`, function by function, against its twin with the very tables that the device has.

use std::f64::consts::PI;

use cumuli::frame::cpu::atmosphere::{
    aerosol_phase, air_span, altitude_place, distance_to_ground, ground_reach, rayleigh_phase,
    sun_place,
};
use cumuli::frame::cpu::sky_march::{Air, AirRay, Gathered, Table, sun_mu_along};
use cumuli::frame::sky::SkyInputs;
use cumuli::frame::sky::spectrum::{Coefficients, reflectance};
use cumuli::frame::sky::tables::{DEPTH_SIZE, GROUND_SIZE, MULTIPLE_SIZE};
use glam::{DVec2, DVec4};

use super::parts::item;
use super::sky::{Made, TABLE_SCALE, air_inputs};
use super::{Four, Function, magnitude, many, one};
use crate::common::Random;

/// Places that a device may filter at beside the right one: two axes.
const SHIFTS: usize = 2;
/// So far, of a texel.
const SHIFT: f64 = 1.0 / 256.0;

/// A table of the device as the twin's; of `shift` 1 and 2 one whose every place has moved along an axis.
fn table(texels: &[DVec4], size: [u32; 2], scale: f64, shift: usize) -> Table {
    let [width, height] = size.map(|s| s as usize);
    Table::new(size, |place| {
        let x = (place.x * (width - 1) as f64).round() as usize;
        let y = (place.y * (height.max(2) - 1) as f64).round() as usize;
        let texel = |x: usize, y: usize| texels[y.min(height - 1) * width + x.min(width - 1)];
        let beside = match shift {
            0 => texel(x, y),
            1 => texel(x + 1, y),
            _ => texel(x, y + 1),
        };
        texel(x, y).lerp(beside, SHIFT) / scale
    })
}

/// The twin's air with the tables of the device.
fn air(made: &Made, inputs: &SkyInputs, shift: usize) -> Air {
    let t = made.pass.tables();
    let of = |texture, size, scale| table(&made.texels(texture), size, scale, shift);
    let sky = [GROUND_SIZE[0], 1];
    Air {
        coefficients: Coefficients::earth(),
        ground_albedo: reflectance(inputs.ground_albedo.as_dvec3()),
        sea: inputs.sea(),
        depth: of(&t.depth, DEPTH_SIZE, 1.0),
        multiple: of(&t.multiple, MULTIPLE_SIZE, TABLE_SCALE),
        ground: of(&t.ground, sky, TABLE_SCALE),
    }
}

/// Altitudes from the ground to beyond the air, and the ends.
fn altitude(random: &mut Random) -> f32 {
    match random.bits() % 16 {
        0 => 0.0,
        1 => 1e5,
        _ => magnitude(random, 1e-3, 1.2e5),
    }
}

/// Cosines, their ends, and those next to level.
fn cosine(random: &mut Random) -> f32 {
    match random.bits() % 16 {
        0 => 0.0,
        1 => 1.0,
        2 => -1.0,
        3..=6 => random.between(-0.01, 0.01) as f32,
        _ => random.between(-1.0, 1.0) as f32,
    }
}

/// Altitude, cosine of the zenith angle, those of the sun's and of the angle between both, 1 where it meets the ground.
fn ray(random: &mut Random) -> [f32; 5] {
    let (altitude, mu, sun_mu) = (altitude(random), cosine(random), cosine(random));
    let across = ((1.0 - mu * mu) * (1.0 - sun_mu * sun_mu)).max(0.0).sqrt();
    let azimuth = match random.bits() % 8 {
        0 => 1.0,
        1 => -1.0,
        _ => random.between(-1.0, 1.0) as f32,
    };
    let cos_sun = (mu * sun_mu + across * azimuth).clamp(-1.0, 1.0);
    let hits = distance_to_ground(altitude.into(), mu.into()) >= 0.0;
    [altitude, mu, sun_mu, cos_sun, f32::from(u8::from(hits))]
}

fn air_ray([altitude, mu, sun_mu, cos_sun]: [f64; 4]) -> AirRay {
    AirRay { altitude, mu, sun_mu, cos_sun }
}

/// The first numbers of some.
fn first<const N: usize>(of: &[f64]) -> [f64; N] {
    std::array::from_fn(|i| of[i])
}

const RAY: &str = "AirRay(x[0], x[1], x[2], x[3])";

#[test]
fn light_in_the_air() {
    let inputs = SkyInputs { sea_wind: Some(7.0), ..air_inputs(12.0, 700.0) };
    let made = Made::new(&inputs);
    let groups = made.march();
    let airs: [Air; 1 + SHIFTS] = std::array::from_fn(|shift| air(&made, &inputs, shift));
    let places = many(200, |r| [altitude(r), cosine(r)]);
    Function::new(
        "sky_march::sunlight",
        "#import cumuli::sky_march::sunlight",
        "sunlight(x[0], x[1])",
    )
    .reading(&groups)
    .agrees_filtered(&places, 256.0, SHIFTS, |i, [h, mu]| airs[i].sunlight(h, mu).to_array());
    Function::new(
        "sky_march::scattered_light",
        "#import cumuli::sky_march::scattered_light",
        "scattered_light(x[0], x[1])",
    )
    .reading(&groups)
    .agrees_filtered(&places, 256.0, SHIFTS, |i, [h, mu]| {
        airs[i].multiple.at(DVec2::new(level_place(mu), altitude_place(h))).to_array()
    });
    let suns = many(201, |r| [cosine(r)]);
    Function::new(
        "sky_march::sky_on_ground",
        "#import cumuli::sky_march::sky_on_ground",
        "sky_on_ground(x[0])",
    )
    .reading(&groups)
    .agrees_filtered(&suns, 256.0, SHIFTS, |i, [mu]| on_ground(&airs[i], mu).to_array());
    // What the sea's table ends short of its last texel for counts as filtering does.
    let sea = |mu: f64| airs[0].reflected(mu)[0];
    Function::new(
        "sky_march::sea_reflectance",
        "#import cumuli::sky_march::sea_reflectance",
        "vec4(sea_reflectance(x[0]), 0.0, 0.0, 0.0)",
    )
    .reading(&groups)
    .agrees_filtered(&suns, 16.0, 1, |i, [mu]| {
        one(sea(mu) + i as f64 * LAST * (sea(1.0) - sea((30.0 / 31.0f64).powi(2))))
    });
    let albedo = |reflected: f64| airs[0].ground_albedo + reflected * (1.0 - airs[0].ground_albedo);
    Function::new(
        "sky_march::ground_albedo",
        "#import cumuli::sky_march::ground_albedo",
        "ground_albedo(saturate(x[0]))",
    )
    .reading(&groups)
    .agrees(&suns, 16.0, |[x]| albedo(x.clamp(0.0, 1.0)).to_array());
    let by_sun = |i: usize, mu: f64| {
        let air: &Air = &airs[i];
        albedo(sea(mu)) / PI * mu.max(0.0) * air.sunlight(0.0, mu)
    };
    let by_sky = |i: usize, mu: f64| {
        let air: &Air = &airs[i];
        albedo(air.reflected(0.0)[1]) / PI * on_ground(air, mu)
    };
    Function::new(
        "sky_march::ground_by_sun",
        "#import cumuli::sky_march::ground_by_sun",
        "ground_by_sun(x[0])",
    )
    .reading(&groups)
    .agrees_filtered(&suns, 256.0, SHIFTS, |i, [mu]| by_sun(i, mu).to_array());
    Function::new(
        "sky_march::ground_by_sky",
        "#import cumuli::sky_march::ground_by_sky",
        "ground_by_sky(x[0])",
    )
    .reading(&groups)
    .agrees_filtered(&suns, 256.0, SHIFTS, |i, [mu]| by_sky(i, mu).to_array());
    Function::new(
        "sky_march::ground_light",
        "#import cumuli::sky_march::ground_light",
        "ground_light(x[0])",
    )
    .reading(&groups)
    .agrees_filtered(&suns, 256.0, SHIFTS, |i, [mu]| (by_sun(i, mu) + by_sky(i, mu)).to_array());
}

/// `sign` of the shader is 0 at 0.
fn level_place(mu: f64) -> f64 {
    if mu == 0.0 { 0.5 } else { sun_place(mu) }
}

fn on_ground(air: &Air, mu: f64) -> DVec4 {
    air.ground.at(DVec2::new(level_place(mu), 0.0))
}

/// Of a step of the sea's table, what it ends before its last height.
const LAST: f64 = 1e-3;

/// What is asked of a ray: radiance, optical depth or response.
type Part = (&'static str, fn(&Gathered) -> DVec4);

const PARTS: [Part; 3] = [
    ("radiance", |g| g.radiance),
    ("optical_depth", |g| g.optical_depth),
    ("response", |g| g.response),
];

#[test]
fn light_along_rays_through_the_air() {
    let inputs = SkyInputs { sea_wind: Some(7.0), ..air_inputs(12.0, 700.0) };
    let made = Made::new(&inputs);
    let groups = made.march();
    let airs: [Air; 1 + SHIFTS] = std::array::from_fn(|shift| air(&made, &inputs, shift));
    let rays = many(202, ray);
    Function::new(
        "sky_march::phases_of, sun_mu_on_ground",
        "#import cumuli::sky_march::{AirRay, phases_of, sun_mu_on_ground}",
        &format!("vec4(phases_of({RAY}), sun_mu_on_ground({RAY}), 0.0)"),
    )
    .reading(&groups)
    .agrees(&rays, 16.0, |x| {
        let ray = air_ray(first(&x));
        let below = sun_mu_along(&ray, 0.0, ground_reach(ray.altitude, ray.mu));
        [rayleigh_phase(ray.cos_sun), aerosol_phase(ray.cos_sun), below, 0.0]
    });
    // A piece of a ray behind air of some depth.
    let pieces: Vec<_> = many(203, |r| {
        let [a, b, c, d, _] = ray(r);
        let begin = if r.bits().is_multiple_of(4) { 0.0 } else { magnitude(r, 1.0, 1e5) };
        let depth = if r.bits().is_multiple_of(4) { 0.0 } else { magnitude(r, 1e-6, 10.0) };
        [a, b, c, d, begin, begin + magnitude(r, 0.1, 1e5), depth]
    });
    let few = |inputs: Vec<[f32; 5]>| inputs.into_iter().take(2048).collect::<Vec<_>>();
    let marched = few(many(204, ray));
    // The pass's own text: the rest of it reads clouds besides.
    let source = include_str!("../../../shaders/frame/air_shadow.wgsl");
    let text = format!(
        "#import cumuli::atmosphere::{{altitude_along, medium_at}}
        #import cumuli::sky_march::{{AirRay, sky}}\n{}",
        item(source, "fn optical_depth(")
    );
    Function::new("air_shadow::optical_depth", &text, &format!("optical_depth({RAY}, x[4], x[5])"))
        .reading(&groups)
        .agrees(&pieces, 16.0, |x| {
            airs[0].depth_between(&air_ray(first(&x)), x[4], x[5], 1).to_array()
        });
    for (part, of) in PARTS {
        Function::new(
            &format!("sky_march::gather, {part}"),
            "#import cumuli::sky_march::{AirRay, Gathered, gather, phases_of}
            fn asked(x: array<f32, 7>) -> Gathered {
                let ray = AirRay(x[0], x[1], x[2], x[3]);
                let before = Gathered(vec4(0.0), vec4(x[6]), vec4(0.0));
                return gather(ray, phases_of(ray), x[4], x[5], before);
            }",
            &format!("asked(x).{part}"),
        )
        .reading(&groups)
        .agrees_filtered(&pieces, 1024.0, SHIFTS, |i, x| {
            let piece = airs[i].gather_between(&air_ray(first(&x)), x[4], x[5], 1);
            let through = (-x[6]).exp();
            of(&Gathered {
                radiance: through * piece.radiance,
                optical_depth: piece.optical_depth + x[6],
                response: through * piece.response,
            })
            .to_array()
        });
        Function::new(
            &format!("sky_march::gather_air, {part}"),
            "#import cumuli::sky_march::{AirRay, gather_air}",
            &format!("gather_air({RAY}, x[4] > 0.5, 8u).{part}"),
        )
        .reading(&groups)
        .agrees_filtered(&marched, 1024.0, SHIFTS, |i, x| {
            let ray = air_ray(first(&x));
            let span = air_span(ray.altitude, ray.mu);
            let end = if x[4] > 0.5 { ground_reach(ray.altitude, ray.mu) } else { span.1 };
            of(&airs[i].gather_between(&ray, span.0, end, 8)).to_array()
        });
        Function::new(
            &format!("sky_march::gather_all, {part}"),
            "#import cumuli::sky_march::{AirRay, gather_all}",
            &format!("gather_all({RAY}, x[4] > 0.5, 8u).{part}"),
        )
        .reading(&groups)
        .agrees_filtered(&marched, 1024.0, SHIFTS, |i, x| -> Four {
            of(&airs[i].gather_all(air_ray(first(&x)), x[4] > 0.5, 8)).to_array()
        });
    }
}
