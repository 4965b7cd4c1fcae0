//! Clouds among opaque things of a host: chords end there, shadows fall there, what is hidden is not touched, and
//! pixels of the frame before are not taken over across edges.

use cumuli::frame::{
    DepthKind, Opaque, OpaquePicture, Pass, Picture, Preset, Quality, RenderSettings, Renderer,
    Surface,
};
use cumuli::medium::Truncation;
use cumuli::reference::{Window, exact_frame_before};
use cumuli::scene::{CloudField, Scene, Sky};
use glam::DVec3;
use wgpu::util::DeviceExt;

use crate::{GPU, TABLES, alone, particle, renderer, settings, space};

/// Odd, so that the last tiles and blocks stick out of the picture.
const SIZE: [u32; 2] = [97, 65];
/// Of the pictures whose middle is composed exactly.
const LARGE: [u32; 2] = [384, 258];
const GREY: DVec3 = DVec3::splat(0.03);
const LIT: DVec3 = DVec3::new(0.2, 0.15, 0.1);

fn surface(distance: f64) -> Option<Surface> {
    Some(Surface { distance, radiance: GREY, sunlit: LIT })
}

/// Balls (centre and radius, m, in the world) as the scene's camera sees them.
fn balls(scene: &Scene, size: [u32; 2], balls: &[(DVec3, f64)]) -> OpaquePicture {
    let eye = scene.camera.position;
    OpaquePicture::cast(&scene.camera, size, |dir| {
        let meets = |&(centre, radius): &(DVec3, f64)| {
            let middle = (centre - eye).dot(dir);
            let half = radius * radius - (centre - eye - middle * dir).length_squared();
            (half > 0.0 && middle > half.sqrt()).then(|| middle - half.sqrt())
        };
        surface(balls.iter().filter_map(meets).min_by(f64::total_cmp)?)
    })
}

/// A level floor at an altitude (m) as the scene's camera sees it.
fn floor(scene: &Scene, size: [u32; 2], altitude: f64) -> OpaquePicture {
    let height = scene.camera.position.y - altitude;
    OpaquePicture::cast(&scene.camera, size, |dir| {
        if dir.y < -1e-3 { surface(height / -dir.y) } else { None }
    })
}

fn upload(picture: &OpaquePicture, revision: u64) -> Opaque {
    picture.upload(&GPU, revision).expect("a picture")
}

fn frame(renderer: &mut Renderer, scene: &Scene, time: f64) -> Picture {
    let picture = renderer.render(scene, time, SIZE).expect("a frame");
    assert_eq!([picture.stats.counters.overflowed, picture.stats.counters.cut], [0; 2]);
    picture
}

fn bits(picture: &Picture) -> Vec<u32> {
    picture.radiance.iter().flatten().map(|value| value.to_bits()).collect()
}

/// Noise shapes and even balls that overlap, under an atmosphere, over the ground.
fn clump() -> Scene {
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, 700.0 + y, z);
    let mut scene = Scene {
        particles: vec![
            particle(at(0.0, 0.0, 0.0), 150.0, 0.02, "pyroclastic-1"),
            particle(at(110.0, 30.0, -60.0), 110.0, 0.015, "uniform"),
            particle(at(-120.0, -30.0, 40.0), 120.0, 0.03, "soft-1"),
            particle(at(30.0, 60.0, 120.0), 90.0, 0.01, "soft-4"),
        ],
        ..Scene::default()
    };
    scene.camera.position = at(0.0, 40.0, 600.0);
    scene.camera.target = at(0.0, 0.0, 0.0);
    scene.camera.fov_x = 50.0;
    scene
}

/// Half the balls lie within particles, so that chords are clipped everywhere on their way.
fn things() -> Vec<(DVec3, f64)> {
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, 700.0 + y, z);
    vec![
        (at(-20.0, 20.0, 30.0), 60.0),
        (at(120.0, 20.0, -20.0), 50.0),
        (at(-170.0, -60.0, 90.0), 70.0),
        (at(60.0, -200.0, -500.0), 180.0),
        (at(20.0, 75.0, 300.0), 20.0),
    ]
}

/// The frame against the exact compositor with the same surfaces, in the pixels that show one: from outside, and from
/// within a particle; with the steps of preset high and with six times as many. Bounds: half as much again as was found;
/// chords that are not clipped are printed beside it. Particles are large in these pixels, so that their densities are
/// not the filtered ones of distant particles, which the exact compositor does not know. The surfaces send light of their
/// own alone: of sunlight that they reflect, 1 and 2 % (RMS, radiance) are off here however many steps there are, as the
/// edges of shadows on them are no sharper than the texels of the shadow maps.
#[test]
fn clipped_chords_are_those_of_the_exact_compositor() {
    let _turn = alone();
    let outside = clump();
    let mut inside = outside.clone();
    inside.camera.position = DVec3::new(20.0, 740.0, 110.0);
    let coarse = Preset::High.quality();
    let fine = Quality { steps: 6 * coarse.steps, ..coarse };
    let bounds = [[0.0105, 0.006], [0.0003, 0.0009]];
    for (name, scene) in [("outside", outside), ("inside", inside)] {
        let mut surfaces = balls(&scene, LARGE, &things());
        surfaces.sunlit.fill([0.0; 3]);
        for (quality, most) in [coarse, fine].into_iter().zip(bounds) {
            let settings = RenderSettings { quality: Some(quality), ..Default::default() };
            let mut renderer = renderer(&scene, &settings);
            let unclipped = renderer.render(&scene, 0.0, LARGE).expect("a frame");
            renderer.set_opaque(Some(upload(&surfaces, 1)));
            let found = renderer.render(&scene, 0.0, LARGE).expect("a frame");
            let window = Window::middle(LARGE, 3);
            let mut row = || {};
            let exact = exact_frame_before(
                Some(&surfaces),
                &renderer,
                &scene,
                &TABLES,
                &quality,
                LARGE,
                window,
                &mut row,
            )
            .expect("exact");
            let errors = |picture: &Picture| {
                let (mut opacity, mut radiance, mut mean, mut count) = (0.0, 0.0, 0.0, 0.0);
                for (i, exact) in exact.iter().enumerate() {
                    let [x, y] = [i as u32 % window.size[0], i as u32 / window.size[0]];
                    let pixel = ((y + window.corner[1]) * LARGE[0] + x + window.corner[0]) as usize;
                    if surfaces.surface(pixel).is_none() {
                        continue;
                    }
                    let [r, g, b, a] = picture.radiance[pixel].map(f64::from);
                    opacity += (a - (1.0 - exact.transmittance)).powi(2);
                    radiance += (DVec3::new(r, g, b) - exact.radiance).length_squared();
                    mean += exact.radiance.length();
                    count += 1.0;
                }
                assert!(count > 1000.0, "{count}");
                [(opacity / count).sqrt(), (radiance / count).sqrt() / (mean / count)]
            };
            let (clipped, whole) = (errors(&found), errors(&unclipped));
            println!("{name}, {} steps: {clipped:.5?}, not clipped {whole:.3?}", quality.steps);
            assert!(clipped[0] < most[0] && clipped[1] < most[1], "{name}: {clipped:?}");
            assert!(whole[0] > 0.1, "{name}: {whole:?}");
        }
    }
}

/// Textures as hosts have them of the same surfaces: along the view axis, of projections, of a depth format.
fn of_kind(
    picture: &OpaquePicture,
    scene: &Scene,
    kind: DepthKind,
    format: wgpu::TextureFormat,
) -> Opaque {
    let forward = scene.camera.basis().forward;
    let depth = |i: usize| -> f32 {
        let slant = OpaquePicture::ray(&scene.camera, SIZE, i as u32).dot(forward);
        let along = picture.surface(i).map(|s| s.distance * slant);
        match (kind, along) {
            (DepthKind::Distance, _) => picture.distance[i],
            (DepthKind::AlongAxis, along) => along.map_or(f32::INFINITY, |z| z as f32),
            (DepthKind::Projected { empty, .. }, None) => empty,
            (DepthKind::Projected { scale, offset, .. }, Some(z)) => {
                (f64::from(offset) + f64::from(scale) / z) as f32
            }
        }
    };
    let texels: Vec<f32> = (0..picture.distance.len()).map(depth).collect();
    let descriptor = wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    };
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    let bytes = bytemuck::cast_slice(&texels);
    let given = GPU.device.create_texture_with_data(&GPU.queue, &descriptor, order, bytes);
    let texture =
        if format == wgpu::TextureFormat::R32Float { given } else { drawn(&given, format) };
    let depth = texture.create_view(&Default::default());
    Opaque { depth, kind, ..upload(picture, 1) }
}

/// A depth texture that a render pass has written, from one of floats.
fn drawn(from: &wgpu::Texture, format: wgpu::TextureFormat) -> wgpu::Texture {
    const DRAW: &str = "
        @group(0) @binding(0) var depth: texture_2d<f32>;
        @vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
            return vec4(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
        }
        @fragment fn told(@builtin(position) at: vec4<f32>) -> @builtin(frag_depth) f32 {
            return textureLoad(depth, vec2<i32>(at.xy), 0).r;
        }";
    let device = &GPU.device;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(DRAW.into()),
    });
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        }],
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[],
        }),
        multiview_mask: None,
        cache: None,
    });
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: from.size(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout,
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::TextureView(&from.create_view(&Default::default())),
        }],
    });
    let view = texture.create_view(&Default::default());
    let mut encoder = device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.5),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.draw(0..3, 0..1);
    }
    GPU.queue.submit([encoder.finish()]);
    texture
}

/// All that a host may have shows the same picture. Depth between planes 1 and 10,000 m apart has 2 m for a step of f32
/// at 1000 m where it is not reversed, which changes what lies before a surface within a dense cloud by a percent.
#[test]
fn depths_of_all_kinds_are_the_same() {
    let _turn = alone();
    let scene = clump();
    let surfaces = balls(&scene, SIZE, &things());
    let mut renderer = renderer(&scene, &settings(Preset::Low));
    renderer.set_opaque(Some(upload(&surfaces, 1)));
    let wanted = frame(&mut renderer, &scene, 0.0);
    let floats = wgpu::TextureFormat::R32Float;
    let depth = wgpu::TextureFormat::Depth32Float;
    for (kind, format, most) in [
        (DepthKind::Distance, floats, 0.0),
        (DepthKind::AlongAxis, floats, 1e-4),
        (DepthKind::infinite_reversed(0.1), floats, 1e-4),
        (DepthKind::infinite_reversed(0.1), depth, 1e-4),
        (DepthKind::reversed(1.0, 1e4), depth, 1e-4),
        (DepthKind::standard(1.0, 1e4), depth, 1e-2),
    ] {
        renderer.set_opaque(Some(of_kind(&surfaces, &scene, kind, format)));
        let found = frame(&mut renderer, &scene, 0.0);
        let pairs = found.radiance.iter().flatten().zip(wanted.radiance.iter().flatten());
        let off = pairs.map(|(a, b)| (a - b).abs() / b.max(0.05)).fold(0.0, f32::max);
        println!("{kind:?} {format:?}: {off:.2e}");
        assert!(off <= most, "{kind:?} {format:?}: {off}");
    }
}

/// Particles behind what is opaque in all their tiles are in no list and have no light; the others' pixels are the same
/// to the bit.
#[test]
fn what_is_hidden_is_not_touched() {
    let _turn = alone();
    let clouds = CloudField { cells: 40, rings: 3, coverage: 0.5, ..CloudField::default() };
    let mut scene = Scene { clouds: Some(clouds), ..Scene::default() };
    scene.camera.position = DVec3::new(0.0, 1300.0, 0.0);
    scene.camera.target = scene.camera.position + DVec3::new(100.0, -80.0, -1000.0);
    let basis = scene.camera.basis();
    // A wall across the left half of the view.
    let wall = |distance: f64| {
        OpaquePicture::cast(&scene.camera, SIZE, |dir| {
            if dir.dot(basis.right) < 0.0 {
                surface(distance / dir.dot(basis.forward))
            } else {
                None
            }
        })
    };
    let mut renderer = renderer(&scene, &settings(Preset::Low));
    let open = frame(&mut renderer, &scene, 0.0);
    let all = open.stats.counters;
    let mut last = all;
    for (revision, distance) in [4000.0, 1000.0, 0.01].into_iter().enumerate() {
        let surfaces = wall(distance);
        renderer.set_opaque(Some(upload(&surfaces, revision as u64)));
        let picture = frame(&mut renderer, &scene, 0.0);
        let now = picture.stats.counters;
        println!(
            "wall at {distance} m: {} particles in view, {} entries, {} look-ups",
            now.particles_visible, now.screen_list_entries, now.table_lookups
        );
        assert!(now.particles_visible < last.particles_visible, "{now:?}");
        assert!(now.screen_list_entries < last.screen_list_entries, "{now:?}");
        assert!(now.table_lookups < last.table_lookups, "{now:?}");
        last = now;
        for (i, (found, open)) in picture.radiance.iter().zip(&open.radiance).enumerate() {
            assert!(surfaces.surface(i).is_some() || found == open, "pixel {i} beside the wall");
        }
    }
    // The lists of tiles that a near wall fills are empty: left of the middle, which falls into a tile.
    let [columns, tile] = [SIZE[0].div_ceil(renderer.tile_side()), renderer.tile_side()];
    let lists = renderer.tile_entries().expect("read back");
    let hidden = SIZE[0] / 2 / tile;
    for (i, list) in lists.iter().enumerate() {
        assert!(*list == 0 || i as u32 % columns >= hidden, "tile {i} lists {list}");
    }
    assert!(lists.iter().any(|list| *list > 0));
    assert!(2 * last.screen_list_entries < all.screen_list_entries + all.screen_list_entries / 2);
}

/// A revision says whether anything has to be made anew, and only what the depth has a part in is.
#[test]
fn a_frame_is_made_anew_with_another_revision_only() {
    let _turn = alone();
    let scene = clump();
    let mut lasting = renderer(&scene, &settings(Preset::Low));
    let surfaces = balls(&scene, SIZE, &things());
    let first = upload(&surfaces, 1);
    let ran = |picture: &Picture| -> Vec<String> {
        picture.stats.passes.iter().filter(|p| p.ran).map(|p| p.name.clone()).collect()
    };
    lasting.set_opaque(Some(first.clone()));
    let whole = frame(&mut lasting, &scene, 0.0);
    assert!(ran(&whole).contains(&Pass::Opaque.name().to_owned()));
    assert!(ran(&frame(&mut lasting, &scene, 0.0)).is_empty());
    lasting.set_opaque(Some(first.clone()));
    assert!(ran(&frame(&mut lasting, &scene, 0.0)).is_empty(), "the same again");
    let few = balls(&scene, SIZE, &things()[..2]);
    lasting.set_opaque(Some(upload(&few, 2)));
    let changed = frame(&mut lasting, &scene, 0.0);
    let passes =
        ["opaque", "project", "sort", "tile_lists", "light", "blend", "resolve", "tonemap"];
    assert_eq!(ran(&changed), passes);
    let alone = |opaque: Option<Opaque>| {
        let mut renderer = renderer(&scene, &settings(Preset::Low));
        renderer.set_opaque(opaque);
        frame(&mut renderer, &scene, 0.0)
    };
    assert!(bits(&changed) == bits(&alone(Some(upload(&few, 7)))));
    lasting.set_opaque(Some(first));
    assert!(bits(&frame(&mut lasting, &scene, 0.0)) == bits(&whole), "back");
    lasting.set_opaque(None);
    assert!(bits(&frame(&mut lasting, &scene, 0.0)) == bits(&alone(None)), "none");
}

/// The shadow of an even ball on a floor in empty space, where no ground is: by the picture, and at points of the floor
/// by themselves; with a high sun and one that is nearly level.
#[test]
fn clouds_throw_shadows_on_what_is_opaque() {
    let _turn = alone();
    let (radius, extinction) = (100.0, 0.012);
    let mut scene = space(
        0.0,
        1.0,
        DVec3::new(0.0, 0.0, 900.0),
        vec![particle(DVec3::ZERO, radius, extinction, "uniform")],
    );
    scene.camera.position.y = 250.0;
    let scale = {
        let medium = &scene.medium;
        Truncation::new(&medium.phase).scale(medium.albedo)
    };
    for sun in [DVec3::new(0.3, 1.0, 0.1), DVec3::new(-0.9, 0.35, 0.2)] {
        scene.sun.direction = sun.normalize();
        let surfaces = floor(&scene, SIZE, -260.0);
        let mut renderer = renderer(&scene, &settings(Preset::High));
        renderer.set_opaque(Some(upload(&surfaces, 1)));
        let picture = frame(&mut renderer, &scene, 0.0);
        let mut points = Vec::new();
        let mut pixels = Vec::new();
        for i in 0..surfaces.distance.len() {
            if let Some(surface) = surfaces.surface(i) {
                let dir = OpaquePicture::ray(&scene.camera, SIZE, i as u32);
                points.push(scene.camera.position + dir * surface.distance);
                pixels.push(i);
            }
        }
        let told = renderer.sun_transmittance(&points).expect("lists of the frame");
        let (mut worst, mut off, mut dark) = (0.0_f64, 0.0, 0);
        for ((point, pixel), told) in points.iter().zip(pixels).zip(told) {
            let toward = scene.sun.direction;
            let across = (*point - point.dot(toward) * toward).length_squared();
            let chord = 2.0 * (radius * radius - across).max(0.0).sqrt();
            let wanted = (-extinction * scale * chord).exp();
            worst = worst.max((f64::from(told) - wanted).abs());
            dark += usize::from(wanted < 0.7);
            let [r, .., opacity] = picture.radiance[pixel].map(f64::from);
            if opacity == 0.0 {
                off += ((r - GREY.x) / LIT.x - wanted).powi(2);
            }
        }
        let off = (off / points.len() as f64).sqrt();
        println!(
            "sun {sun}: {dark} pixels in shadow, points off by {worst:.5}, pixels by {off:.5}"
        );
        // The tables of an even ball are exact; maps have texels of a few metres, and interpolate between them.
        assert!(dark > 30 && worst < 1e-3 && off < 0.02, "{dark} {worst} {off}");
    }
}

#[test]
fn shadows_at_points_need_a_frame() {
    let _turn = alone();
    let scene = clump();
    let mut renderer = renderer(&scene, &settings(Preset::Low));
    let error = renderer.sun_transmittance(&[DVec3::ZERO]).expect_err("no lists yet");
    assert!(error.to_string().contains("expected"), "{error}");
    frame(&mut renderer, &scene, 0.0);
    let high = DVec3::new(0.0, 5000.0, 0.0);
    let within = DVec3::new(0.0, 690.0, 0.0);
    let found = renderer.sun_transmittance(&[high, within]).expect("lists");
    assert!(found[0] == 1.0 && found[1] < 0.5, "{found:?}");
}

#[test]
fn textures_of_another_size_or_kind_are_refused() {
    let _turn = alone();
    let scene = clump();
    let mut renderer = renderer(&scene, &settings(Preset::Low));
    let small = upload(&balls(&scene, [96, 65], &things()), 1);
    renderer.set_opaque(Some(small));
    let error = renderer.frame(&scene, 0.0, SIZE).expect_err("another size").to_string();
    assert!(error.contains("opaque.depth") && error.contains("97x65"), "{error}");
    let good = upload(&balls(&scene, SIZE, &things()), 1);
    let texture = |format, usage| {
        let texture = GPU.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        });
        texture.create_view(&Default::default())
    };
    let integers = texture(wgpu::TextureFormat::R32Uint, wgpu::TextureUsages::TEXTURE_BINDING);
    let unread = texture(wgpu::TextureFormat::R32Float, wgpu::TextureUsages::STORAGE_BINDING);
    let projection = |scale, offset| DepthKind::Projected { scale, offset, empty: 0.0 };
    for (bad, field) in [
        (Opaque { sunlit: Some(integers.clone()), ..good.clone() }, "opaque.sunlit"),
        (Opaque { depth: integers, ..good.clone() }, "opaque.depth"),
        (Opaque { radiance: unread, ..good.clone() }, "TEXTURE_BINDING"),
        (Opaque { kind: DepthKind::infinite_reversed(0.0), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: DepthKind::infinite_reversed(-1.0), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: DepthKind::reversed(5.0, 5.0), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: DepthKind::standard(1.0, f32::INFINITY), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: projection(f32::NAN, 0.0), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: projection(1.0, 0.5), ..good.clone() }, "opaque.kind"),
    ] {
        renderer.set_opaque(Some(bad));
        let error = renderer.frame(&scene, 0.0, SIZE).expect_err(field).to_string();
        assert!(error.contains(field) && error.contains("expected"), "{error}");
    }
    renderer.set_opaque(Some(good));
    frame(&mut renderer, &scene, 0.0);
    // Pictures on the host of another length than their size says, or of no texture's size.
    let whole = balls(&scene, SIZE, &things());
    let short = OpaquePicture { sunlit: Vec::new(), ..whole.clone() };
    let empty = OpaquePicture::cast(&scene.camera, [0, 5], |_| None);
    for picture in [short, empty, OpaquePicture { size: [1 << 20, 1], ..whole }] {
        let error = picture.upload(&GPU, 0).expect_err("no picture").to_string();
        assert!(error.contains("expected"), "{error}");
    }
}

/// What is no depth is nothing, to the bits of the frame without; at the eye it hides all.
#[test]
fn what_is_no_depth_is_nothing() {
    let _turn = alone();
    let scene = clump();
    let mut renderer = renderer(&scene, &settings(Preset::Low));
    let without = frame(&mut renderer, &scene, 0.0);
    let (nan, far) = (f32::NAN, f32::INFINITY);
    let projections = [nan, -nan, far, -far];
    let reversed = DepthKind::infinite_reversed(0.1);
    let standard = DepthKind::standard(1.0, 1e4);
    for (kind, nothing, all) in [
        (DepthKind::Distance, vec![nan, -nan, far, -far, -1.0, 1e30, f32::MAX], 0.0),
        (DepthKind::AlongAxis, vec![nan, -nan, far, -far, -1.0, 1e30, f32::MAX], 0.0),
        (reversed, [&projections[..], &[0.0, -0.0, -0.5, 1e-38]].concat(), 1.0),
        (standard, [&projections[..], &[1.0, 1.5]].concat(), 0.0),
    ] {
        let mut of = |depth: f32| {
            let surfaces = OpaquePicture::cast(&scene.camera, SIZE, |_| surface(1.0));
            let mut opaque = upload(&surfaces, 0);
            let depths =
                OpaquePicture { distance: vec![depth; surfaces.distance.len()], ..surfaces };
            opaque.depth = upload(&depths, 0).depth;
            renderer.set_opaque(Some(Opaque { kind, sunlit: None, ..opaque }));
            frame(&mut renderer, &scene, 0.0)
        };
        for depth in nothing {
            assert!(bits(&of(depth)) == bits(&without), "{kind:?} {depth}");
        }
        let hidden = of(all);
        for pixel in &hidden.radiance {
            let off = (pixel[0] - GREY.x as f32).abs().max(pixel[3]);
            assert!(off < 1e-4, "{kind:?}: {pixel:?}");
        }
        assert_eq!(hidden.stats.counters.screen_list_entries, 0, "{kind:?}");
    }
}

/// A flight past a ball before clouds, one pixel of every block a frame: pixels beside its edge are as near to those of
/// the frame alone as all others. Where they were taken over too, they were off by 0.0056, the others by 0.0001.
#[test]
fn pixels_beside_edges_are_new() {
    let _turn = alone();
    let with_stride = |scene: &Scene, pixel_stride: u32| {
        let quality = Some(Quality { pixel_stride, ..Preset::Low.quality() });
        renderer(scene, &RenderSettings { quality, ..Default::default() })
    };
    let thing = [(DVec3::new(0.0, 720.0, 150.0), 60.0)];
    let flight = |time: f64| {
        let mut scene = clump();
        scene.sky = Sky::Uniform { radiance: 0.1 };
        scene.camera.position += DVec3::new(60.0 * time, 0.0, -40.0 * time);
        scene.camera.target += DVec3::new(60.0 * time, 0.0, -40.0 * time);
        scene
    };
    let mut lasting = with_stride(&flight(0.0), 2);
    let mut whole = with_stride(&flight(0.0), 1);
    let (mut at_edges, mut within) = ([0.0, 0.0], [0.0, 0.0]);
    for i in 0..8 {
        let time = 0.1 * f64::from(i);
        let scene = flight(time);
        let surfaces = balls(&scene, SIZE, &thing);
        for renderer in [&mut lasting, &mut whole] {
            renderer.set_opaque(Some(upload(&surfaces, 1 + i as u64)));
        }
        let found = frame(&mut lasting, &scene, time);
        let alone = frame(&mut whole, &scene, time);
        if i == 0 {
            assert!(bits(&found) == bits(&alone), "the first");
            continue;
        }
        for pixel in 0..surfaces.distance.len() {
            let [x, y] = [pixel % SIZE[0] as usize, pixel / SIZE[0] as usize];
            let there = |dx: i32, dy: i32| {
                let x = (x as i32 + dx).clamp(0, SIZE[0] as i32 - 1) as usize;
                let y = (y as i32 + dy).clamp(0, SIZE[1] as i32 - 1) as usize;
                surfaces.surface(y * SIZE[0] as usize + x).is_some()
            };
            let own = there(0, 0);
            // Whatever the block's new pixel is, one of those around lies across the edge.
            let is_edge = (-1..=1).any(|x| (-1..=1).any(|y| there(x, y) != own));
            let off = (found.radiance[pixel][0] - alone.radiance[pixel][0]).abs();
            let sum = if is_edge { &mut at_edges } else { &mut within };
            sum[0] += f64::from(off);
            sum[1] += 1.0;
        }
    }
    let [edges, rest] = [at_edges, within].map(|[sum, count]| sum / count);
    println!("off by {edges:.6} in {} pixels beside edges, {rest:.6} elsewhere", at_edges[1]);
    assert!(at_edges[1] > 300.0);
    assert!(edges < rest && rest < 2e-3, "{edges} {rest}");
    // Standing still, all becomes what it is alone.
    let scene = flight(0.7);
    for _ in 0..4 {
        frame(&mut lasting, &scene, 0.7);
    }
    assert!(bits(&frame(&mut lasting, &scene, 0.7)) == bits(&frame(&mut whole, &scene, 0.7)));
}
