//! Depth as hosts have it, and what is none.

use cumuli::frame::{DepthKind, Opaque, OpaquePicture, Preset};
use cumuli::scene::Scene;
use wgpu::util::DeviceExt;

use super::{GREY, SIZE, balls, bits, clump, frame, surface, things, upload};
use crate::{GPU, alone, renderer, settings};

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
    // 24 bits in steps of 6e-8, 0.06 m at 1000 m between these planes.
    let with_stencil = wgpu::TextureFormat::Depth24PlusStencil8;
    for (kind, format, most) in [
        (DepthKind::Distance, floats, 0.0),
        (DepthKind::AlongAxis, floats, 1e-4),
        (DepthKind::infinite_reversed(0.1), floats, 1e-4),
        (DepthKind::infinite_reversed(0.1), depth, 1e-4),
        (DepthKind::reversed(1.0, 1e4), depth, 1e-4),
        (DepthKind::standard(1.0, 1e4), depth, 1e-2),
        (DepthKind::reversed(1.0, 1e4), with_stencil, 1e-2),
    ] {
        renderer.set_opaque(Some(of_kind(&surfaces, &scene, kind, format)));
        let found = frame(&mut renderer, &scene, 0.0);
        let pairs = found.radiance.iter().flatten().zip(wanted.radiance.iter().flatten());
        let off = pairs.map(|(a, b)| (a - b).abs() / b.max(0.05)).fold(0.0, f32::max);
        println!("{kind:?} {format:?}: {off:.2e}");
        assert!(off <= most, "{kind:?} {format:?}: {off}");
    }
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
    let stencil = wgpu::TextureFormat::Depth24PlusStencil8;
    let stencil = texture(stencil, wgpu::TextureUsages::TEXTURE_BINDING);
    let unread = texture(wgpu::TextureFormat::R32Float, wgpu::TextureUsages::STORAGE_BINDING);
    let layers = |layers, levels| {
        let texture = GPU.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: layers },
            mip_level_count: levels,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        texture.create_view(&Default::default())
    };
    let projection = |scale, offset| DepthKind::Projected { scale, offset, empty: 0.0 };
    for (bad, field) in [
        (Opaque { sunlit: Some(integers.clone()), ..good.clone() }, "opaque.sunlit"),
        (Opaque { depth: integers, ..good.clone() }, "opaque.depth"),
        (Opaque { radiance: stencil, ..good.clone() }, "opaque.radiance"),
        (Opaque { radiance: unread, ..good.clone() }, "TEXTURE_BINDING"),
        (Opaque { kind: DepthKind::infinite_reversed(0.0), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: DepthKind::infinite_reversed(-1.0), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: DepthKind::reversed(5.0, 5.0), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: DepthKind::standard(1.0, f32::INFINITY), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: projection(f32::NAN, 0.0), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: DepthKind::standard(100.0, 1.0), ..good.clone() }, "opaque.kind"),
        (Opaque { kind: DepthKind::reversed(100.0, 1.0), ..good.clone() }, "opaque.kind"),
        (Opaque { depth: layers(3, 1), ..good.clone() }, "opaque.depth"),
        (Opaque { radiance: layers(1, 2), ..good.clone() }, "opaque.radiance"),
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
