//! `sea_light.wgsl`: the radiance of the sea, against the same in f64 with the very tables that the device has.

use std::f64::consts::PI;

use cumuli::frame::air_shadow::corners;
use cumuli::frame::cpu::atmosphere::distance_to_ground;
use cumuli::frame::cpu::sea::surface_normal;
use cumuli::frame::sky::{SkyInputs, SkyKind};
use cumuli::gpu::buffers;
use glam::{DVec3, DVec4};

use super::sky::{Made, Twin, air_inputs};
use super::{Function, many, one};
use crate::common::{Random, gpu};

/// Of a picture: width, height, pixels between rays.
const PICTURES: [[u32; 3]; 3] = [[37, 23, 8], [5, 3, 1], [1, 1, 8]];
/// Two axes of the textures.
const SHIFTS: usize = 2;
/// Of sky and clouds, in the call below.
const MIRRORED: DVec3 = DVec3::new(0.125, 0.25, 0.5);

/// Down to the sea from this altitude, with the way there.
fn way(random: &mut Random, altitude: f64) -> [f32; 4] {
    loop {
        let d = match random.bits() % 8 {
            0 => DVec3::NEG_Y,
            // Most of what is seen lies next to the horizon.
            1..=4 => {
                let d = random.direction();
                DVec3::new(d.x, -0.1 * d.y.abs(), d.z).normalize()
            }
            _ => random.direction(),
        };
        let [x, y, z] = d.as_vec3().to_array();
        let distance = distance_to_ground(altitude, y.into());
        if distance > 0.0 {
            return [x, y, z, distance as f32];
        }
    }
}

fn compare(inputs: &SkyInputs) {
    let sea = inputs.sea().expect("a sea");
    let made = Made::new(inputs);
    let (twin, groups) = (Twin::new(&made, inputs), made.groups());
    let cosines = many(220, |r| {
        [match r.bits() % 8 {
            0 => 0.0,
            1 => 1.0,
            2 => -r.uniform(),
            _ => r.uniform(),
        } as f32]
    });
    // The table ends a thousandth of a step before its last height: that is allowed besides.
    let last = 1e-3 * (sea.reflectance(1.0) - sea.reflectance((30.0 / 31.0f64).powi(2)));
    Function::new(
        "sea_light::entering",
        "#import cumuli::sea_light::entering",
        "vec4(entering(x[0]), 0.0, 0.0, 0.0)",
    )
    .reading(&groups)
    .agrees_filtered(&cosines, 16.0, 1, |i, [mu]| one(1.0 - sea.reflectance(mu) + i as f64 * last));
    let ways = many(221, |r| {
        let [x, y, z, distance] = way(r, twin.altitude());
        let mut share = || r.uniform() as f32;
        [x, y, z, distance, share(), share(), share()]
    });
    // Glitter is an exponential of what is rounded in a direction: its peak is what counts.
    let peak = 0.25 / (PI * sea.slope() * sea.slope()) * twin.irradiance();
    Function::new(
            "sea_light::sea_radiance",
            "#import cumuli::sea_light::sea_radiance",
            "vec4(sea_radiance(vec3(x[0], x[1], x[2]), x[3], vec3(x[4], x[5], x[6]), vec3(0.125, 0.25, 0.5)), 0.0)",
        )
    .reading(&groups)
    .of_terms(peak)
    .agrees_filtered(&ways, 256.0, SHIFTS, |i, x| {
        let (dir, distance) = (DVec3::new(x[0], x[1], x[2]), x[3]);
        let ([mut direct, mut diffuse], sun_mu) = twin.ground_light(dir, distance, i);
        let mut facing = twin.light_at(0.0, 0.0, i);
        if inputs.kind != SkyKind::Atmosphere {
            direct = DVec3::splat(twin.irradiance() * sun_mu.max(0.0));
            diffuse = DVec3::splat(PI * f64::from(twin.sky.uniform_radiance));
            facing = DVec3::splat(twin.irradiance());
        }
        let normal = surface_normal(dir * distance, twin.altitude());
        let even = 1.0 - sea.mean_reflectance();
        let water = twin.colour() / PI * (1.0 - sea.reflectance(-dir.dot(normal))) / even;
        let below = direct * x[4] * (1.0 - sea.reflectance(sun_mu))
            + even * (diffuse * x[6] + facing * x[5]);
        let glitter = sea.glitter(normal, -dir, twin.sun()) * x[4] * direct;
        (MIRRORED + glitter + water * below).extend(0.0).to_array()
    });
}

#[test]
fn radiance_of_the_sea() {
    compare(&SkyInputs { sea_wind: Some(7.0), ..air_inputs(12.0, 700.0) });
    compare(&SkyInputs { sea_wind: Some(1.0), ..air_inputs(50.0, 9000.0) });
    let kind = SkyKind::Uniform { radiance: 0.37 };
    compare(&SkyInputs { kind, sea_wind: Some(20.0), ..air_inputs(3.0, 5.0) });
}

#[test]
fn what_the_sea_reflects_between_rays() {
    let made = Made::new(&SkyInputs { sea_wind: Some(7.0), ..air_inputs(12.0, 700.0) });
    let groups = made.groups();
    for [width, height, block] in PICTURES {
        let [across, up] = corners([width, height], block);
        let mut random = Random(222);
        let rays: Vec<[f32; 4]> = (0..across * up)
            .map(|_| std::array::from_fn(|_| random.between(0.0, 1.0) as f32))
            .collect();
        let on_device = buffers::storage_with(gpu(), "reflected", &rays);
        let ray = |i: usize| DVec4::from_array(rays[i].map(f64::from));
        let pixels = many(223, |r| {
            [width, height].map(|size| match r.bits() % 4 {
                0 => size - 1,
                _ => (r.bits() % u64::from(size)) as u32,
            } as f32)
        });
        let name = format!("sea_light::reflected_in, {width}x{height}");
        let size = format!("vec2({width}u, {height}u), {block}u");
        Function {
            more: &[on_device.as_entire_binding()],
            ..Function::new(
                &name,
                "#import cumuli::sea_light::reflected_in",
                &format!("vec4(reflected_in(vec2<u32>(vec2(x[0], x[1])), {size}), 0.0)"),
            )
        }
        .reading(&groups)
        .agrees(&pixels, 16.0, |[x, y]| {
            let middle = if block == 1 { 0.5 } else { 0.0 };
            let place = |pixel: f64, size: u32| {
                let block = f64::from(block);
                let low = (pixel / block).floor();
                let first = low * block + middle;
                (low as usize, (pixel + 0.5 - first) / ((first + block).min(size.into()) - first))
            };
            let ((i, s), (j, t)) = (place(x.round(), width), place(y.round(), height));
            let (above, below) = (j * across as usize + i, (j + 1) * across as usize + i);
            let upper = ray(above).lerp(ray(above + 1), s);
            let found = upper.lerp(ray(below).lerp(ray(below + 1), s), t);
            [found.x, found.y, found.z, 0.0]
        });
    }
}
