//! `ray_blocks.wgsl`, and what `air_shadow_place.wgsl` computes without shadow maps.

use cumuli::frame::air_shadow::{NODES, corners};
use cumuli::frame::cpu::air_shadow::{node_distance, within};

use super::parts::{constants, item};
use super::{Function, magnitude, many, one};

#[test]
fn rays_of_blocks() {
    // Pictures up to the largest, and a pixel of each; all are whole numbers below 2^24.
    let pixels = many(190, |r| {
        let size: [u64; 2] = std::array::from_fn(|_| match r.bits() % 8 {
            0 => 1,
            1 => 8192,
            _ => 1 + r.bits() % 8192,
        });
        let block = 1u64 << (r.bits() % 4);
        let pixel = size.map(|s| if r.bits().is_multiple_of(8) { s - 1 } else { r.bits() % s });
        [size[0], size[1], block, pixel[0], pixel[1]].map(|v| v as f32)
    });
    let size = "vec2<u32>(vec2(x[0], x[1]))";
    let pixel = "vec2<u32>(vec2(x[3], x[4]))";
    Function::new(
        "ray_blocks::corners_of, ray_place",
        "#import cumuli::ray_blocks::{corners_of, ray_place}",
        &format!(
            "vec4(vec2<f32>(corners_of({size}, u32(x[2]))),
                ray_place({pixel} / u32(x[2]) + 1u, {size}, u32(x[2])))"
        ),
    )
    .agrees(&pixels, 0.0, |counts| {
        let [w, h, block, x, y] = counts.map(f64::round);
        let rays = corners([w as u32, h as u32], block as u32).map(f64::from);
        let middle = if block < 1.5 { 0.5 } else { 0.0 };
        let ray =
            |pixel: f64, size: f64| (((pixel / block).floor() + 1.0) * block + middle).min(size);
        [rays[0], rays[1], ray(x, w), ray(y, h)]
    });
    // By the places of the rays on both sides: a pixel's middle is so far from the first to the second.
    Function::new(
        "ray_blocks::share_of_rays",
        "#import cumuli::ray_blocks::share_of_rays",
        &format!("vec4(share_of_rays({pixel}, {pixel} / u32(x[2]), {size}, u32(x[2])), 0.0, 0.0)"),
    )
    .agrees(&pixels, 1.0, |counts| {
        let [w, h, block, x, y] = counts.map(f64::round);
        let middle = if block < 1.5 { 0.5 } else { 0.0 };
        let share = |pixel: f64, size: f64| {
            let first = (pixel / block).floor() * block + middle;
            (pixel + 0.5 - first) / ((first + block).min(size) - first)
        };
        [share(x, w), share(y, h), 0.0, 0.0]
    });
}

#[test]
fn places_along_rays_under_clouds() {
    // Their text alone: the file reads shadow maps besides.
    let source = include_str!("../../../shaders/shared/air_shadow_place.wgsl");
    let text = |head: &str| format!("{}{}", constants(source), item(source, head));
    let spans = many(191, |r| {
        let slope = match r.bits() % 8 {
            0 => 0.0,
            1 => magnitude(r, 1e-12, 1e-6) * if r.bits().is_multiple_of(2) { 1.0 } else { -1.0 },
            _ => r.between(-1.0, 1.0) as f32,
        };
        let low = r.between(-1e6, 1e6) as f32;
        [magnitude(r, 1.0, 1e4), magnitude(r, 1e4, 1e8), low, low + magnitude(r, 1.0, 1e6), slope]
    });
    Function::new(
        "air_shadow_place::within",
        &text("fn within("),
        "vec4(within(vec2(x[0], x[1]), x[2], x[3], x[4]), 0.0, 0.0)",
    )
    .agrees(&spans, 8.0, |[begin, end, low, high, slope]| {
        let [begin, end] = within([begin, end], low, high, slope);
        [begin, end, 0.0, 0.0]
    });
    let nodes = many(192, |r| {
        let begin = if r.bits().is_multiple_of(4) { 0.0 } else { magnitude(r, 1.0, 1e7) };
        let end = begin + if r.bits().is_multiple_of(16) { 0.0 } else { magnitude(r, 1.0, 1e7) };
        let node = match r.bits() % 8 {
            0 => 0.0,
            1 => NODES as f32,
            _ => r.between(0.0, f64::from(NODES)) as f32,
        };
        [begin, end, node]
    });
    Function::new(
        "air_shadow_place::node_distance",
        &text("fn node_distance("),
        "vec4(node_distance(vec2(x[0], x[1]), x[2]), 0.0, 0.0, 0.0)",
    )
    .agrees(&nodes, 8.0, |[begin, end, node]| one(node_distance([begin, end], node)));
    // Before the first node, between, and behind the last.
    let distances = many(193, |r| {
        let begin = if r.bits().is_multiple_of(4) { 0.0 } else { magnitude(r, 1.0, 1e7) };
        [begin, begin + magnitude(r, 1.0, 1e7), magnitude(r, 1e-3, 1e8)]
    });
    Function::new(
        "air_shadow_place::node_at",
        &text("fn node_at("),
        "vec4(node_at(vec2(x[0], x[1]), x[2]), 0.0, 0.0, 0.0)",
    )
    .agrees(&distances, 8.0, |[begin, end, distance]| {
        let share = ((distance - begin) / (end - begin).max(1e-9)).clamp(0.0, 1.0);
        one(f64::from(NODES) * share.sqrt())
    });
}
