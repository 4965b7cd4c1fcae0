//! Look-ups in deep shadow maps and weather maps.

use std::sync::Arc;

use cumuli::frame::cpu;
use cumuli::frame::cpu::shadow::{Maps, Nodes};
use cumuli::frame::cpu::weather::{map_excess, map_place, weather_at};
use cumuli::frame::gpu_data::ShadowUniforms;
use cumuli::frame::rings::PlacedField;
use cumuli::frame::weather::WeatherBuffer;
use cumuli::gpu::buffers;
use cumuli::scene::{CloudField, Outside, WeatherImage, WeatherMap};
use glam::{DVec2, DVec3, UVec2, Vec2};

use super::{Function, STEP, many, one};
use crate::common::{Random, Snippet, gpu, map};
use crate::rings::{FIRST_SLOT, SHAPES, small_field};

/// Texels a side of the maps.
const SIDE: u32 = 24;

#[test]
fn depth_to_the_sun_at_a_place() {
    let four = |v: DVec3| v.as_vec3().extend(0.0).to_array();
    let towards = DVec3::new(0.48, 0.64, 0.6);
    let axis_u = DVec3::new(0.8, 0.0, -0.64).normalize();
    let axis_v = towards.cross(axis_u).normalize();
    let mut maps: ShadowUniforms = bytemuck::Zeroable::zeroed();
    (maps.axis_u, maps.axis_v, maps.towards) = (four(axis_u), four(axis_v), four(towards));
    (maps.maps, maps.resolution) = (2, SIDE);
    maps.corner[0] = [-100.0, -130.0, 10.0, 0.0];
    maps.corner[1] = [-420.0, -380.0, 40.0, 0.0];
    // The finer one ends before the matter does.
    maps.range[0] = [-150.0, 300.0, -150.0, 150.0];
    maps.range[1] = [-500.0, 1000.0, -1e30, 1e30];
    let mut random = Random(181);
    let texels: Vec<[u32; 4]> = (0..2 * SIDE * SIDE)
        .map(|i| {
            let mut nodes: Vec<u32> = (0..7).map(|_| (random.bits() >> 48) as u32).collect();
            nodes.sort_unstable();
            // Empty, shallow and deep columns.
            let rest = match i % 4 {
                0 => 0xffff,
                1 => (random.bits() >> 49) as u32 & 0x7fff,
                _ => 0x8000 | (random.bits() >> 49) as u32,
            };
            nodes.push(rest);
            std::array::from_fn(|word| nodes[2 * word] | nodes[2 * word + 1] << 16)
        })
        .collect();
    let uniforms = buffers::uniform(gpu(), "maps", &maps);
    let on_device = buffers::storage_with(gpu(), "texels", &texels);
    let points = many(182, |r| {
        let p = (r.direction() * r.between(0.0, 600.0)).as_vec3();
        [p.x, p.y, p.z]
    });
    let function = Function {
        name: "sun_depth::sun_depth, texel_depth",
        declarations: "#import cumuli::sun_depth::sun_depth",
        call: "vec4(sun_depth(vec3(x[0], x[1], x[2])), 0.0, 0.0, 0.0)",
        groups: &[],
        more: &[uniforms.as_entire_binding(), on_device.as_entire_binding()],
        least: 0.0,
    };
    let twin = Maps { uniforms: &maps, texels: &texels };
    function.agrees(&points, 64.0, |point| one(twin.depth(DVec3::from_array(point))));
    let places = many(183, |r| std::array::from_fn::<f32, 8, _>(|_| r.uniform() as f32));
    // A step of 16 bits: f32 may round the product of 65535 to the other side of its half.
    Function::new(
        "shadow_maps::pack_nodes, unpack_nodes",
        "#import cumuli::shadow_maps::{ShadowNodes, pack_nodes, unpack_nodes}
        fn asked(x: array<f32, 8>) -> vec4<f32> {
            let n = unpack_nodes(pack_nodes(ShadowNodes(vec4(x[0], x[1], x[2], x[3]), vec4(x[4], x[5], x[6], x[7]))));
            return vec4(n.low.x, n.low.w, n.high.y, n.high.w);
        }",
        "asked(x)",
    )
    .of_terms(1.0)
    .agrees(&places, 1.0 / 65_535.0 / STEP, |v| {
        let at = std::array::from_fn(|i| v[i]);
        let rounded = Nodes { at, rest: v[7] }.rounded();
        [rounded.at[0], rounded.at[3], rounded.at[5], rounded.rest]
    });
}

/// Fields of a ring that places on a map follow from, as a function in WGSL.
fn ring_text(ring: &cumuli::frame::gpu_data::Ring) -> String {
    let ([a, b], [c, d]) = (ring.map_first, ring.map_step);
    let ([e, f], [g, h]) = (ring.map_first_share, ring.map_step_share);
    format!(
        "fn the_ring() -> Ring {{
            var ring: Ring;
            ring.map_first = vec2({a}, {b});
            ring.map_step = vec2({c}, {d});
            ring.map_first_share = vec2({e}u, {f}u);
            ring.map_step_share = vec2({g}u, {h}u);
            return ring;
        }}\n"
    )
}

#[test]
fn what_a_weather_map_says() {
    let size = [37, 23];
    let texels: Vec<u32> = (0..size[0] * size[1]).map(cpu::noise::hash).collect();
    for (outside, number) in [(Outside::Repeat, 0), (Outside::Edge, 1), (Outside::Clear, 2)] {
        let weather = WeatherMap {
            file: "map.png".into(),
            extent: DVec2::new(5000.0, 3100.0),
            centre: DVec2::new(-333.0, 77.7),
            outside,
            channels: Vec::new(),
            noise: 0.7,
            image: Arc::new(WeatherImage::new(size, texels.clone())),
        };
        let field = CloudField { coverage: 0.9, weather: Some(weather), ..small_field() };
        let camera = DVec3::new(12_000.0, 900.0, -34_000.0);
        let placed = PlacedField::new(&field, camera, 12.5, &SHAPES, FIRST_SLOT, 1 << 14);
        let (ring, uniforms) = (placed.uniforms.ring[1], placed.uniforms.map);
        assert_eq!(uniforms.outside, number);
        let held = placed.weather.as_ref().expect("a map");
        let mut buffer = WeatherBuffer::new(gpu());
        buffer.hold(gpu(), Some(held));
        let groups = [(buffer.layout(), buffer.bind_group())];
        let [width, depth] = uniforms.size;
        let [across, along] = uniforms.texels;
        let declarations = format!(
            "#import cumuli::gpu_data::{{MapUniforms, Ring}}
            #import cumuli::weather::{{has_map, map_excess, map_place, weather_at}}
            {}
            fn the_map() -> MapUniforms {{
                var map: MapUniforms;
                map.size = vec2({width}u, {depth}u);
                map.texels = vec2({across:?}, {along:?});
                map.coverage = {:?};
                map.noise = {:?};
                map.outside = {}u;
                return map;
            }}
            fn weather_of(x: array<f32, 4>) -> vec4<f32> {{
                let at = weather_at(the_map(), the_ring(), vec2(u32(x[0]), u32(x[1])), vec2(x[2], x[3]));
                return vec4(at.coverage, at.height, at.extinction, select(0.0, 1.0, has_map()));
            }}",
            ring_text(&ring),
            uniforms.coverage,
            uniforms.noise,
            uniforms.outside,
        );
        let mut random = Random(184);
        let cells: Vec<[u32; 2]> =
            (0..4096).map(|_| std::array::from_fn(|_| random.bits() as u32 % 512)).collect();
        let snippet = Snippet {
            declarations: &declarations,
            input: "vec2<u32>",
            output: "vec4<u32>",
            result: "vec4(bitcast<vec2<u32>>(map_place(the_ring(), x).texel), map_place(the_ring(), x).share)",
        };
        // Integers: every bit.
        for (cell, found) in cells.iter().zip(map::<_, [u32; 4]>(snippet, &groups, &cells)) {
            let (texel, share) = map_place(&ring, UVec2::from_array(*cell));
            assert_eq!(found, [texel.x as u32, texel.y as u32, share.x, share.y], "{cell:?}");
        }
        let places = many(185, |r| {
            let mut cell = || (r.bits() % 512) as f32;
            [cell(), cell(), r.between(0.0, 2.0) as f32, r.between(0.0, 2.0) as f32]
        });
        let function = |name, call| Function {
            name,
            declarations: &declarations,
            call,
            groups: &groups,
            more: &[],
            least: 0.0,
        };
        // The twin is in f32 as well. Its places on the map are as wide as a cell over a texel; neighbours of the
        // motley map differ by 1: a step of f32 in a place counts so many times.
        function("weather::weather_at, map_texel, has_map", "weather_of(x)").agrees(
            &places,
            64.0,
            |[x, y, u, v]| {
                let cell = UVec2::new(x.round() as u32, y.round() as u32);
                let offset = Vec2::new(u as f32, v as f32);
                let at = weather_at(&uniforms, held, &ring, cell, offset);
                [at.coverage.into(), at.height.into(), at.extinction.into(), 1.0]
            },
        );
        let noises = many(186, |r| [r.between(-1.5, 1.5) as f32, r.between(-0.1, 1.1) as f32]);
        function("weather::map_excess", "vec4(map_excess(the_map(), x[0], x[1]), 0.0, 0.0, 0.0)")
            .agrees(&noises, 1e-5 / STEP, |[noise, coverage]| {
                one(map_excess(&uniforms, held, noise as f32, coverage as f32).into())
            });
    }
}
