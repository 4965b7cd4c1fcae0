//! `sea.wgsl`: the surface of the sea.

use cumuli::frame::cpu::sea::surface_normal;
use cumuli::medium::{Sea, fresnel, sea::erfc};
use glam::DVec3;

use super::{Function, magnitude, many, one};
use crate::common::Random;

/// A direction by height and azimuth, as in the calls below.
fn direction(mu: f64, azimuth: f64) -> DVec3 {
    let across = (1.0 - mu * mu).max(0.0).sqrt();
    DVec3::new(across * azimuth.cos(), mu, across * azimuth.sin())
}

/// Height of a direction, and its ends.
fn height(random: &mut Random) -> f32 {
    match random.bits() % 8 {
        0 => 0.0,
        1 => 1.0,
        2 => magnitude(random, 1e-6, 1e-2),
        _ => random.uniform() as f32,
    }
}

#[test]
fn waves() {
    let numbers = many(161, |r| [if r.bits() % 8 == 0 { 0.0 } else { magnitude(r, 1e-4, 8.0) }]);
    // Terms of the fit are of the order of 1 and leave what is rounded of them.
    Function::new("sea::erfc", "#import cumuli::sea::erfc", "vec4(erfc(x[0]), 0.0, 0.0, 0.0)")
        .of_terms(1.0)
        .agrees(&numbers, 8.0, |[x]| one(erfc(x)));
    let cosines = many(162, |r| [height(r)]);
    Function::new(
        "sea::fresnel",
        "#import cumuli::sea::fresnel",
        "vec4(fresnel(x[0]), 0.0, 0.0, 0.0)",
    )
    .agrees(&cosines, 24.0, |[c]| one(fresnel(c)));
    for wind in [0.0, 5.0, 60.0] {
        let sea = Sea::new(wind);
        let slope = sea.slope() as f32;
        let call = format!("vec4(seen_area(x[0], {slope:?}), 0.0, 0.0, 0.0)");
        Function::new("sea::seen_area", "#import cumuli::sea::seen_area", &call)
            .of_terms(0.1)
            .agrees(&cosines, 16.0, |[mu]| one(sea.seen_area(mu)));
        let pairs = many(163, |r| {
            [height(r), height(r), r.between(-3.1, 3.1) as f32, r.between(-3.1, 3.1) as f32]
        });
        let declarations = "#import cumuli::sea::glitter
            fn towards(mu: f32, azimuth: f32) -> vec3<f32> {
                let across = sqrt(max(1.0 - mu * mu, 0.0));
                return vec3(across * cos(azimuth), mu, across * sin(azimuth));
            }";
        let call = format!(
            "vec4(glitter(vec3(0.0, 1.0, 0.0), towards(x[0], x[2]), towards(x[1], x[3]), {slope:?}), 0.0, 0.0, 0.0)"
        );
        // The density of slopes is an exponential of what is rounded in a direction: its peak is what counts.
        let peak = 0.25 / (std::f64::consts::PI * sea.slope() * sea.slope());
        Function::new("sea::glitter", declarations, &call).of_terms(peak).agrees(
            &pairs,
            40.0,
            |[v, l, a, b]| one(sea.glitter(DVec3::Y, direction(v, a), direction(l, b))),
        );
    }
    let facets =
        many(164, |r| [height(r), r.between(-1.5, 1.5) as f32, r.between(-1.5, 1.5) as f32]);
    Function::new(
        "sea::mirrored",
        "#import cumuli::sea::mirrored",
        "vec4(mirrored(x[0], vec2(x[1], x[2])), 0.0)",
    )
    .of_terms(1.0)
    .agrees(&facets, 8.0, |[mu, along, across]| {
        Sea::mirrored(mu, [along, across]).0.extend(0.0).to_array()
    });
    let points = many(165, |r| {
        let mut far = || magnitude(r, 1.0, 1e6) * if r.bits() % 2 == 0 { 1.0 } else { -1.0 };
        [far(), far(), 2.0]
    });
    Function::new(
        "sea::surface_normal",
        "#import cumuli::sea::surface_normal",
        "vec4(surface_normal(vec3(x[0], -x[2], x[1]), x[2]), 0.0)",
    )
    .of_terms(1.0)
    .agrees(&points, 4.0, |[x, z, height]| {
        surface_normal(DVec3::new(x, -height, z), height).extend(0.0).to_array()
    });
}
