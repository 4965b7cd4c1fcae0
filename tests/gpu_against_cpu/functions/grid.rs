//! `light_grid_data.wgsl`, `light_field.wgsl`, `light_view.wgsl` and what `gpu_data.wgsl` computes.

use cumuli::frame::cpu::light_grid::FieldSeen;
use cumuli::frame::gpu_data::{GridLevel, LightGridUniforms, LightView};
use cumuli::frame::view::warped;
use cumuli::gpu::buffers;
use cumuli::medium::{Halo, Phase, Truncation};
use glam::{DVec2, DVec3, DVec4};
use half::f16;

use super::{Function, STEP, magnitude, many, one};
use crate::common::{Group, Random, gpu};

#[test]
fn directions_and_cells() {
    let travels = many(119, |r| {
        let d = r.direction().as_vec3();
        [d.x, d.y, d.z, r.between(0.0, 32.0).floor() as f32]
    });
    Function::new(
        "light_grid_data::grid_direction, light_from_outside",
        "#import cumuli::light_grid_data::{grid_direction, light_from_outside}
        fn asked(x: array<f32, 4>) -> vec4<f32> {
            let d = grid_direction(vec4(x[0], x[1], x[2], 0.1), u32(x[3]));
            return vec4(d, light_from_outside(d).y);
        }",
        "asked(x)",
    )
    .agrees(&travels, 0.0, |[x, y, z, i]| {
        let d = if i % 2.0 == 0.0 { DVec3::new(x, y, z) } else { -DVec3::new(x, y, z) };
        [d.x, d.y, d.z, if d.y < 0.0 { 1.0 } else { 0.0 }]
    });
    let skies = many(120, |r| {
        [r.between(-1.0, 1.0), r.between(-1.0, 0.0), r.between(0.0, 3.0)].map(|x| x as f32)
    });
    Function::new(
        "light_grid_data::light_under_sky, most_from_above",
        "#import cumuli::light_grid_data::{light_under_sky, most_from_above}\n\
         fn sky(a: f32, b: f32) -> array<vec4<f32>, 4> {\n\
             return array(vec4(a, 0.0, b - 2.0, -a), vec4(b - 1.0, a, 0.0, 0.0), vec4(a, 0.0, -b, 1.0 - b), vec4(0.5 * b - 0.2));\n\
         }",
        "vec4(light_under_sky(vec3(0.0, x[0], 0.0), x[2]), most_from_above(sky(x[1], x[2])))",
    )
    .agrees(&skies, 4.0, |[y, a, b]| {
        let most = [0.0, b - 2.0, -a, b - 1.0, 1.0 - b, 0.5 * b - 0.2].into_iter().fold(0.0, f64::max);
        [0.0, if y < 0.0 { 1.0 + b } else { 0.0 }, 1.0, 1.0 + most]
    });
    let moments = many(121, |r| {
        [r.between(-1.0, 1.0) as f32, r.between(-0.2, 1.0) as f32, r.between(-1.0, 1.0) as f32]
    });
    Function::new(
        "light_grid_data::grid_phase",
        "#import cumuli::light_grid_data::grid_phase",
        "vec4(grid_phase(vec2(x[0], x[1]), x[2]), 0.0, 0.0, 0.0)",
    )
    .agrees(&moments, 16.0, |[a, b, c]| one(1.0 + 3.0 * a * c + 5.0 * b * (1.5 * c * c - 0.5)));
    let crossings = many(122, |r| {
        let d = r.direction().as_vec3();
        let mut side = || magnitude(r, 1e-3, 1e5);
        [d.x, d.y, d.z, side(), side(), side()]
    });
    let declarations = "#import cumuli::light_grid_data::crossing";
    Function::new(
        "light_grid_data::crossing",
        declarations,
        "vec4(crossing(vec3(x[0], x[1], x[2]), vec3(x[3], x[4], x[5])).slope,
            crossing(vec3(x[0], x[1], x[2]), vec3(x[3], x[4], x[5])).path,
            f32(crossing(vec3(x[0], x[1], x[2]), vec3(x[3], x[4], x[5])).main))",
    )
    .agrees(&crossings, 8.0, |[x, y, z, a, b, c]| {
        let rate = [x / a, y / b, z / c];
        let steep = rate.map(f64::abs);
        // The first of the steepest.
        let main = (0..3).rev().max_by(|i, j| steep[*i].total_cmp(&steep[*j])).unwrap_or(0);
        let slope = [1, 2].map(|i| -rate[(main + i) % 3] / steep[main]);
        [slope[0], slope[1], 1.0 / steep[main], main as f64]
    });
    let cells = many(123, |r| {
        let size: [f32; 3] = std::array::from_fn(|_| 1.0 + (r.bits() % 80) as f32);
        let at = size.map(|n| (r.bits() % n as u64) as f32);
        [size[0], size[1], size[2], at[0], at[1], at[2], (r.bits() % 100_000) as f32]
    });
    Function::new(
        "light_grid_data::grid_index",
        "#import cumuli::light_grid_data::{GridLevel, grid_index}
        fn asked(x: array<f32, 7>) -> f32 {
            var level: GridLevel;
            level.size = vec4<u32>(vec4(x[0], x[1], x[2], x[6]));
            return f32(grid_index(level, vec3<u32>(vec3(x[3], x[4], x[5]))));
        }",
        "vec4(asked(x), 0.0, 0.0, 0.0)",
    )
    .agrees(&cells, 0.0, |[w, h, _, x, y, z, first]| one(first + (z * h + y) * w + x));
    // In f16, of which a step is 2^-10; a device may round either way.
    let lights = many(124, |r| std::array::from_fn::<f32, 3, _>(|_| magnitude(r, 1e-4, 1.0)));
    let rounded = |v: f64| f16::from_f64(v).to_f64();
    Function::new(
        "light_grid_data::pack_light, unpack_light",
        "#import cumuli::light_grid_data::{pack_light, unpack_light}",
        "vec4(unpack_light(pack_light(vec3(x[0], x[1], x[2]))), 0.0)",
    )
    .agrees(&lights, 1.0 / 1024.0 / STEP, |[x, y, _]| [rounded(x), rounded(y), 1.0, 0.0]);
    let phases: Vec<[f32; 1]> = (0..5).map(|i| [i as f32]).collect();
    // By hand: four pixels of a block, no two in a row neighbours in a row; more begin again.
    let pixels = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]];
    Function::new(
        "gpu_data::block_pixel",
        "#import cumuli::gpu_data::block_pixel",
        "vec4(vec2<f32>(block_pixel(u32(x[0]))), 0.0, 0.0)",
    )
    .agrees(&phases, 0.0, |[i]| {
        let [x, y] = pixels[(i + 0.5) as usize % 5];
        [x, y, 0.0, 0.0]
    });
}

#[test]
fn places_in_a_lights_picture() {
    let places = many(125, |r| {
        let at = |r: &mut Random| {
            let sign = if r.bits().is_multiple_of(2) { 1.0 } else { -1.0 };
            sign * magnitude(r, 1e-3, 1e10)
        };
        let warp = if r.bits().is_multiple_of(4) { 0.0 } else { magnitude(r, 1.0, 1e6) };
        [at(r), at(r), warp]
    });
    Function::new(
        "light_view::warped",
        "#import cumuli::gpu_data::LightView
        #import cumuli::light_view::warped
        fn asked(x: array<f32, 3>) -> vec2<f32> {
            var view: LightView;
            view.warp = x[2];
            return warped(view, vec2(x[0], x[1])) / max(x[2], 1.0);
        }",
        "vec4(asked(x), 0.0, 0.0)",
    )
    .of_terms(1.0)
    // In units of the warp, of which a tile is a twenty-fourth or more: the logarithm of a number next to 1 loses
    // what lies below its last digit.
    .agrees(&places, 8.0, |[x, y, warp]| {
        let at = warped(DVec2::new(x, y), warp) / warp.max(1.0);
        [at.x, at.y, 0.0, 0.0]
    });
    let view = LightView {
        axis_u: [0.8, 0.0, -0.6, 0.0],
        axis_v: [0.36, 0.8, 0.48, 0.0],
        origin: [-300.0, -200.0],
        inverse_tile_size: 0.125,
        tiles: [70, 40],
        warp: 150.0,
        ..bytemuck::Zeroable::zeroed()
    };
    let points = many(126, |r| {
        let p = (r.direction() * r.between(0.0, 900.0)).as_vec3();
        [p.x, p.y, p.z]
    });
    Function::new(
        "light_view::light_tile",
        "#import cumuli::gpu_data::LightView
        #import cumuli::light_view::light_tile
        fn asked(x: array<f32, 3>) -> f32 {
            var view: LightView;
            view.axis_u = vec4(0.8, 0.0, -0.6, 0.0);
            view.axis_v = vec4(0.36, 0.8, 0.48, 0.0);
            view.origin = vec2(-300.0, -200.0);
            view.inverse_tile_size = 0.125;
            view.tiles = vec2(70u, 40u);
            view.warp = 150.0;
            return f32(light_tile(view, vec3(x[0], x[1], x[2])));
        }",
        "vec4(asked(x), 0.0, 0.0, 0.0)",
    )
    .agrees(&points, 8.0, |point| {
        let point = DVec3::from_array(point);
        let axis = |v: [f32; 4]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
        let place = DVec2::new(point.dot(axis(view.axis_u)), point.dot(axis(view.axis_v)));
        let tile = (warped(place, 150.0) - DVec2::new(-300.0, -200.0)) / 8.0;
        let inside = tile.min_element() >= 0.0 && tile.x < 70.0 && tile.y < 40.0;
        one(if inside { tile.y.floor() * 70.0 + tile.x.floor() } else { 2800.0 })
    });
}

/// Levels of a light grid with something in every cell, on host and device.
struct Field {
    seen: FieldSeen,
    uniforms: LightGridUniforms,
    matter: Vec<f32>,
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    empty: [(wgpu::BindGroupLayout, wgpu::BindGroup); 2],
}

fn halo() -> Halo {
    let phase = Phase::Mie { diameter_um: 20.0 };
    Halo::new(&phase, &Truncation::new(&phase))
}

impl Field {
    fn new([of_list, has_above]: [u32; 2]) -> Self {
        let mut uniforms: LightGridUniforms = bytemuck::Zeroable::zeroed();
        let size = [12u32, 8, 10];
        let count = size.iter().product::<u32>();
        uniforms.levels = 3;
        // Light is looked up in two of them.
        uniforms.widest = 1;
        (uniforms.of_list, uniforms.has_above) = (of_list, has_above);
        uniforms.cells = 3 * count;
        for l in 0..3 {
            let side = 20.0 * 2f32.powi(l);
            let low = [-0.5 * 12.0 * side + 7.0, -0.5 * 8.0 * side, -0.5 * 10.0 * side - 5.0];
            uniforms.level[l as usize] = GridLevel {
                low: [low[0], low[1], low[2], (l as u32 * size[2]) as f32],
                cell: [side, side, side, 0.0],
                size: [size[0], size[1], size[2], l as u32 * count],
            };
        }
        let mut random = Random(127);
        // A layer of cells more holds what is left of the ground's light.
        let light: Vec<[f16; 4]> = (0..3 * (count + size[0] * size[2]))
            .map(|_| std::array::from_fn(|_| f16::from_f64(random.between(0.1, 1.0))))
            .collect();
        // Of seven cells one has none, and of those every other keeps light.
        let matter: Vec<f32> = (0..3 * count)
            .map(|i| if i % 7 == 0 { 0.0 } else { magnitude(&mut random, 1e-9, 1.0) })
            .collect();
        let texel = |z: u32, y: u32, x: u32| {
            let at = ((z * (size[1] + 1) + y) * size[0] + x) as usize;
            DVec4::from_array(light[at].map(f16::to_f64))
        };
        let cell = |i: u32| texel(i / size[0] / size[1], i / size[0] % size[1], i % size[0]);
        let held = (0..3 * count).map(cell).collect();
        let share = |z: u32, x: u32| {
            let share = texel(z, size[1], x);
            [share.x, share.y]
        };
        let shares = (0..3u32)
            .map(|l| {
                let rows = l * size[2]..(l + 1) * size[2];
                rows.flat_map(|z| (0..size[0]).map(move |x| (z, x)))
                    .map(|(z, x)| share(z, x))
                    .collect()
            })
            .collect();
        let device = &gpu().device;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: size[0],
                height: size[1] + 1,
                depth_or_array_layers: 3 * size[2],
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let words: Vec<u16> = light.iter().flatten().map(|v| v.to_bits()).collect();
        gpu().queue.write_texture(
            texture.as_image_copy(),
            bytemuck::cast_slice(&words),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(8 * size[0]),
                rows_per_image: Some(size[1] + 1),
            },
            texture.size(),
        );
        let buffer = |ty| wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let read_only = wgpu::BufferBindingType::Storage { read_only: true };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[
                entry(0, buffer(wgpu::BufferBindingType::Uniform)),
                entry(
                    1,
                    wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Float { filterable: true },
                        view_dimension: wgpu::TextureViewDimension::D3,
                        multisampled: false,
                    },
                ),
                entry(2, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
                entry(3, buffer(read_only)),
                entry(4, buffer(read_only)),
            ],
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let view = texture.create_view(&Default::default());
        let on_device = buffers::uniform(gpu(), "levels", &uniforms);
        let factors = buffers::storage_with(gpu(), "halo", &halo().factors);
        // Slots in an order of their own, and extinctions by slot behind all cells.
        let slot = |i: u32| 3 * count - 1 - i;
        let entry = |i: u32| match (i % 7, i % 14) {
            (0, 0) => u32::MAX,
            (0, _) => slot(i) | 1 << 31,
            _ => slot(i),
        };
        let extinctions = matter.iter().rev().map(|extinction| extinction.to_bits());
        let cells: Vec<u32> = (0..3 * count).map(entry).chain(extinctions).collect();
        let cells = buffers::storage_with(gpu(), "cells", &cells);
        let bound = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[
                bound(0, on_device.as_entire_binding()),
                bound(1, wgpu::BindingResource::TextureView(&view)),
                bound(2, wgpu::BindingResource::Sampler(&sampler)),
                bound(3, factors.as_entire_binding()),
                bound(4, cells.as_entire_binding()),
            ],
        });
        let empty = [(); 2].map(|()| {
            let descriptor = wgpu::BindGroupLayoutDescriptor { label: None, entries: &[] };
            let layout = device.create_bind_group_layout(&descriptor);
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &layout,
                entries: &[],
            });
            (layout, group)
        });
        let seen = FieldSeen::new(uniforms, held, DVec3::ZERO).with_shares(shares);
        Self { seen, uniforms, matter, layout, group, empty }
    }

    fn groups(&self) -> [Group<'_>; 3] {
        let [first, second] = &self.empty;
        [(&first.0, &first.1), (&second.0, &second.1), (&self.layout, &self.group)]
    }

    /// How far inside of a level a point is: 1 well inside, 0 at its border.
    fn weight(&self, level: usize, point: DVec3) -> f64 {
        let level = &self.uniforms.level[level];
        let [low, side] =
            [level.low, level.cell].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()));
        let size = DVec3::new(level.size[0].into(), level.size[1].into(), level.size[2].into());
        let at = (point - low) / side;
        let margin = at.min(size - at);
        let of_list = margin.min_element() / 3.0 + 1.0;
        let sides = margin.x.min(margin.z);
        let height = if self.uniforms.has_above == 0 { sides } else { margin.y };
        let of_field = (sides.min(height) - 0.5) / 3.0;
        if self.uniforms.of_list == 0 { of_field } else { of_list }.clamp(0.0, 1.0)
    }

    fn level_of(&self, point: DVec3) -> usize {
        if self.weight(0, point) > 0.0 { 0 } else { 1 }
    }
}

#[test]
fn light_of_the_grid_at_a_place() {
    for flags in [[0, 0], [0, 1], [1, 0]] {
        light_at_a_place(flags);
    }
}

fn light_at_a_place(flags: [u32; 2]) {
    let field = Field::new(flags);
    let groups = field.groups();
    let function = |name, declarations, call| Function {
        name,
        declarations,
        call,
        groups: &groups,
        more: &[],
        least: 0.0,
    };
    // Within all levels, in the borders between them, and outside of all.
    let points = many(128, |r| {
        let p = (r.direction() * r.between(0.0, 700.0)).as_vec3();
        [p.x, p.y, p.z]
    });
    function(
        "light_field::level_weight, level_of",
        "#import cumuli::light_field::{light_grid, level_of, level_weight}",
        "vec4(level_weight(light_grid.level[0], vec3(x[0], x[1], x[2])), level_weight(light_grid.level[2], vec3(x[0], x[1], x[2])), f32(level_of(vec3(x[0], x[1], x[2]))), 0.0)",
    )
    .agrees(&points, 64.0, |point| {
        let point = DVec3::from_array(point);
        [field.weight(0, point), field.weight(2, point), field.level_of(point) as f64, 0.0]
    });
    // Devices filter with places of at least 8 bits between texels: 1/256 of a texel is 0.004 of light here, on each
    // of three axes.
    let filter = 3.0 / 256.0 / STEP;
    function(
        "light_field::scattered_light, level_light, texel_of, texels_at, last_lit",
        "#import cumuli::light_field::scattered_light",
        "vec4(scattered_light(vec3(x[0], x[1], x[2])), 0.0)",
    )
    .agrees(&points, 2.0 * filter, |point| {
        field.seen.at(DVec3::from_array(point)).extend(0.0).to_array()
    });
    function(
        "light_field::light_from_afar, light_at, height_weight",
        "#import cumuli::light_field::light_from_afar",
        "vec4(light_from_afar(vec3(x[0], x[1], x[2])), 0.0)",
    )
    .agrees(&points, 2.0 * filter, |point| {
        field.seen.from_afar(DVec3::from_array(point)).extend(0.0).to_array()
    });
    function(
        "light_field::ground_shares",
        "#import cumuli::light_field::ground_shares",
        "vec4(ground_shares(vec3(x[0], x[1], x[2])), 0.0, 0.0)",
    )
    .agrees(&points, 2.0 * filter, |point| {
        let [sun, sky] = field.seen.ground_shares(DVec3::from_array(point));
        [sun, sky, 0.0, 0.0]
    });
    let balls = many(129, |r| {
        let p = (r.direction() * r.between(0.0, 700.0)).as_vec3();
        [p.x, p.y, p.z, magnitude(r, 1e-6, 1e9), magnitude(r, 1e-3, 1e3)]
    });
    function(
        "light_field::crowding",
        "#import cumuli::light_field::crowding",
        "vec4(crowding(vec3(x[0], x[1], x[2]), x[3], x[4]), 0.0, 0.0, 0.0)",
    )
    .agrees(&balls, 16.0, |[x, y, z, mass, ball]| {
        let point = DVec3::new(x, y, z);
        let of = |l: usize| {
            let level = &field.uniforms.level[l];
            let side = f64::from(level.cell[0]);
            let own = mass / (4.0 / 3.0 * std::f64::consts::PI * ball.powi(3)).max(side.powi(3));
            let cell: [usize; 3] = std::array::from_fn(|i| {
                let at = (point[i] - f64::from(level.low[i])) / side;
                at.clamp(0.0, f64::from(level.size[i]) - 1.0) as usize
            });
            let [nx, ny, _, first] = level.size.map(|n| n as usize);
            let index = first + (cell[2] * ny + cell[1]) * nx + cell[0];
            f64::from(field.matter[index]) / own.max(1e-30)
        };
        let finest = field.level_of(point);
        one((finest..3.min(finest + 3)).map(of).fold(0.0, f64::max))
    });
    let rays = many(130, |r| {
        let (dir, sun) = (r.direction(), r.direction());
        // Half of them next to the sun, some exactly there.
        let near = (sun + r.between(0.0, 0.1) * dir).normalize();
        let dir = match r.bits() % 8 {
            0 => sun,
            1..=4 => near,
            _ => dir,
        };
        let ([a, b, c], [d, e, f]) = (dir.as_vec3().to_array(), sun.as_vec3().to_array());
        [a, b, c, d, e, f, magnitude(r, 1e-9, 1e9)]
    });
    let factors = halo();
    function(
        "light_field::halo_row, halo_factor",
        "#import cumuli::light_field::{halo_factor, halo_row}
        fn asked(x: array<f32, 7>) -> vec2<f32> {
            let row = halo_row(vec3(x[0], x[1], x[2]), vec3(x[3], x[4], x[5]));
            return vec2(row, halo_factor(row, x[6]));
        }",
        "vec4(asked(x), 0.0, 0.0)",
    )
    .agrees(&rays, 64.0, |[a, b, c, d, e, f, depth]| {
        let apart = (DVec3::new(a, b, c) - DVec3::new(d, e, f)).length();
        let half = 0.5 * apart;
        let row = cumuli::medium::halo::halo_row(half);
        [row, factors.factor(half, depth), 0.0, 0.0]
    });
}
