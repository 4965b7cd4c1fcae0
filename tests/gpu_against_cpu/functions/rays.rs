//! `ray_blocks.wgsl`, `air_shadow_place.wgsl` and the look-ups of `air_shadow.wgsl`.

use cumuli::frame::air_shadow::{ENTRIES, NODES, corners};
use cumuli::frame::cpu::air_shadow::{clouded_span, node_distance, within};
use cumuli::frame::gpu_data::ShadowUniforms;
use cumuli::gpu::buffers;
use glam::DVec3;
use half::f16;

use super::parts::{constants, item};
use super::{Function, magnitude, many, one};
use crate::common::{Random, gpu};

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

/// Of a picture: width, height, pixels between rays.
const PICTURES: [[u32; 3]; 4] = [[37, 23, 8], [64, 48, 4], [5, 3, 1], [1, 1, 8]];

/// Two maps in a sun that is neither high nor low, and what they shadow.
fn shadow_maps() -> ShadowUniforms {
    let towards = DVec3::new(0.48, 0.64, 0.6);
    let axis_u = DVec3::new(0.8, 0.0, -0.64).normalize();
    let four = |v: DVec3| v.as_vec3().extend(0.0).to_array();
    ShadowUniforms {
        axis_u: four(axis_u),
        axis_v: four(towards.cross(axis_u).normalize()),
        towards: four(towards),
        corner: std::array::from_fn(|i| match i {
            0 => [-1e3, -1.3e3, 10.0, 0.0],
            1 => [-2.1e4, -1.9e4, 160.0, 0.0],
            _ => [0.0; 4],
        }),
        nearest: -2e3,
        reach: 9e3,
        lowest: -700.0,
        highest: 1800.0,
        resolution: 256,
        maps: 2,
        ..bytemuck::Zeroable::zeroed()
    }
}

/// Level, straight up and down, along the axes, or anywhere.
fn direction(random: &mut Random) -> [f32; 3] {
    let any = random.direction();
    let v = match random.bits() % 16 {
        0 => DVec3::Y,
        1 => DVec3::NEG_Y,
        2 => DVec3::X,
        3 => DVec3::new(any.x, 0.0, any.z).normalize(),
        4 | 5 => DVec3::new(any.x, 1e-3 * any.y, any.z).normalize(),
        _ => any,
    };
    v.as_vec3().to_array()
}

#[test]
fn what_clouds_change_between_rays() {
    let maps = shadow_maps();
    let uniforms = buffers::uniform(gpu(), "maps", &maps);
    let spans = many(194, direction);
    Function {
        more: &[uniforms.as_entire_binding()],
        ..Function::new(
            "air_shadow_place::clouded_span",
            "#import cumuli::air_shadow_place::clouded_span",
            "vec4(clouded_span(vec3(x[0], x[1], x[2])), 0.0, 0.0)",
        )
    }
    .agrees(&spans, 16.0, |dir| {
        let [begin, end] = clouded_span(&maps, DVec3::from_array(dir));
        [begin, end, 0.0, 0.0]
    });
    for [width, height, block] in PICTURES {
        let [across, up] = corners([width, height], block);
        let mut random = Random(195);
        let changed: Vec<[f16; 4]> = (0..(across * up) as usize * ENTRIES)
            .map(|_| std::array::from_fn(|_| f16::from_f64(random.between(-1.0, 1.0))))
            .collect();
        let words: Vec<[u16; 4]> = changed.iter().map(|v| v.map(f16::to_bits)).collect();
        let on_device = buffers::storage_with(gpu(), "changed light", &words);
        let entry = |ray: usize, entry: usize| {
            let [r, g, b, _] = changed[ray * ENTRIES + entry].map(f16::to_f64);
            DVec3::new(r, g, b)
        };
        let along = |ray: usize, at: f64| {
            let first = at as usize;
            let second = (first + 1).min(NODES as usize + 1);
            entry(ray, first).lerp(entry(ray, second), at - first as f64)
        };
        let between = |[x, y]: [f64; 2], at: f64| {
            let middle = if block == 1 { 0.5 } else { 0.0 };
            let place = |pixel: f64, size: u32| {
                let block = f64::from(block);
                let low = (pixel / block).floor();
                let first = low * block + middle;
                (low as usize, (pixel + 0.5 - first) / ((first + block).min(size.into()) - first))
            };
            let ((i, s), (j, t)) = (place(x.round(), width), place(y.round(), height));
            let ray = j * across as usize + i;
            let upper = along(ray, at).lerp(along(ray + 1, at), s);
            let below = ray + across as usize;
            upper.lerp(along(below, at).lerp(along(below + 1, at), s), t)
        };
        let size = format!("vec2({width}u, {height}u), {block}u");
        let pixel = |r: &mut Random| {
            [width, height].map(|size| match r.bits() % 4 {
                0 => size - 1,
                _ => (r.bits() % u64::from(size)) as u32,
            } as f32)
        };
        let places = many(196, |r| {
            let [x, y] = pixel(r);
            let at = match r.bits() % 8 {
                0 => 0.0,
                1 => NODES as f32,
                _ => r.between(0.0, f64::from(NODES)) as f32,
            };
            [x, y, at]
        });
        let name = format!("air_shadow::between_rays, between_entries, entry_of, {width}x{height}");
        Function {
            more: &[uniforms.as_entire_binding(), on_device.as_entire_binding()],
            ..Function::new(
                &name,
                "#import cumuli::air_shadow::between_rays",
                &format!("vec4(between_rays(vec2<u32>(vec2(x[0], x[1])), {size}, x[2]), 0.0)"),
            )
        }
        .of_terms(1.0)
        .agrees(&places, 16.0, |[x, y, at]| between([x, y], at).extend(0.0).to_array());
        let name = format!("air_shadow::light_on_ground, {width}x{height}");
        Function {
            more: &[uniforms.as_entire_binding(), on_device.as_entire_binding()],
            ..Function::new(
                &name,
                "#import cumuli::air_shadow::light_on_ground",
                &format!("vec4(light_on_ground(vec2<u32>(vec2(x[0], x[1])), {size}), 0.0, 0.0)"),
            )
        }
        .of_terms(1.0)
        .agrees(&places, 16.0, |[x, y, _]| {
            let light = between([x, y], f64::from(NODES + 1));
            [light.x, light.y, 0.0, 0.0]
        });
        let ways = many(197, |r| {
            let ([x, y], [a, b, c]) = (pixel(r), direction(r));
            [x, y, a, b, c, magnitude(r, 1e-3, 1e8)]
        });
        let name = format!("air_shadow::change_before, {width}x{height}");
        Function {
            more: &[uniforms.as_entire_binding(), on_device.as_entire_binding()],
            ..Function::new(
                &name,
                "#import cumuli::air_shadow::change_before",
                &format!(
                    "vec4(change_before(vec2<u32>(vec2(x[0], x[1])), {size}, vec3(x[2], x[3], x[4]), x[5]), 0.0)"
                ),
            )
        }
        .of_terms(1.0)
        .agrees(&ways, 64.0, |[x, y, a, b, c, distance]| {
            let [begin, end] = clouded_span(&maps, DVec3::new(a, b, c));
            let share = ((distance - begin) / (end - begin).max(1e-9)).clamp(0.0, 1.0);
            between([x, y], f64::from(NODES) * share.sqrt()).extend(0.0).to_array()
        });
    }
}
