//! The shader's lookup against its twin.

use glam::DVec3;

use super::tests::small_table;
use super::*;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Looks up one ray per invocation.
const PROBE: &str = "
#import cumuli::scattering::scattering_source
struct Ray { entry: vec4<f32>, dir: vec4<f32>, sun: vec4<f32> }
@group(0) @binding(0) var<storage, read> rays: array<Ray>;
@group(0) @binding(1) var<storage, read_write> sources: array<vec2<f32>>;
@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&rays) { return; }
    let ray = rays[id.x];
    sources[id.x] = scattering_source(ray.entry.xyz, ray.dir.xyz, ray.sun.xyz, ray.entry.w);
}
";

fn table_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("scattering table"),
        entries: &[
            entry(
                1,
                wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: true },
                    view_dimension: wgpu::TextureViewDimension::D3,
                    multisampled: false,
                },
            ),
            entry(2, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
            entry(
                4,
                wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
            ),
        ],
    })
}

/// Sources of many rays, by the shader. Each ray: entry with the optical radius, direction, sun.
fn probe(gpu: &Gpu, table: &ScatteringTable, rays: &[[[f32; 4]; 3]]) -> Vec<[f32; 2]> {
    let library = ShaderLibrary::new().expect("modules");
    let layout = table_layout(gpu);
    let kernel = Kernel::new(gpu, &library, ("probe", PROBE), &[], &[&layout]).expect("kernel");
    let input = buffers::storage_with(gpu, "rays", rays);
    let output = buffers::storage(gpu, "sources", rays.len(), size_of::<[f32; 2]>());
    let own = kernel.bind(gpu, &[input.as_entire_binding(), output.as_entire_binding()]);
    let view = table.texture(gpu).create_view(&Default::default());
    let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    });
    let params = buffers::uniform(gpu, "scattering", &table.params());
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout,
        entries: &[
            wgpu::BindGroupEntry {
                binding: 1,
                resource: wgpu::BindingResource::TextureView(&view),
            },
            wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(&sampler) },
            wgpu::BindGroupEntry { binding: 4, resource: params.as_entire_binding() },
        ],
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(kernel.pipeline("probe"));
        pass.set_bind_group(0, &own, &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.dispatch_workgroups((rays.len() as u32).div_ceil(64), 1, 1);
    }
    gpu.queue.submit([encoder.finish()]);
    gpu.read_buffer(&output, rays.len()).expect("read back")
}

/// Points spread over the sphere without a pattern that follows the table's axes.
fn direction(index: usize, salt: f64) -> DVec3 {
    let z = 2.0 * (index as f64 * 0.819_172_5 + salt).fract() - 1.0;
    let (s, c) =
        (std::f64::consts::TAU * (index as f64 * 0.671_043_6 + 0.3 * salt).fract()).sin_cos();
    let across = (1.0 - z * z).sqrt();
    DVec3::new(across * c, across * s, z)
}

#[test]
fn shader_lookup_equals_its_twin() {
    let gpu = Gpu::headless().expect("adapter");
    let table = small_table();
    let rays: Vec<[[f32; 4]; 3]> = (0..6000)
        .map(|i| {
            let entry = direction(i, 0.1);
            let mut dir = direction(i, 0.45);
            if dir.dot(entry) > 0.0 {
                dir = -dir;
            }
            // Some through the centre, some along the surface: the first and last slices of the table.
            match i % 40 {
                5 => dir = -entry,
                6 => dir = dir.cross(entry).normalize(),
                _ => {}
            }
            // A tenth of the rays looks almost into the sun, some exactly, some exactly away.
            let sun = match i % 30 {
                0 | 1 => (dir + 0.01 * direction(i, 0.7)).normalize(),
                2 => dir,
                3 => -dir,
                _ => direction(i, 0.9),
            };
            // Beyond the table at both ends.
            let optical_radius = 0.01 * 40_000f64.powf((i as f64 * 0.577_215_66).fract());
            let pack = |v: DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
            [pack(entry, optical_radius), pack(dir, 0.0), pack(sun, 0.0)]
        })
        .collect();
    let got = probe(&gpu, table, &rays);
    for (ray, got) in rays.iter().zip(&got) {
        let v = |i: usize| DVec3::new(ray[i][0].into(), ray[i][1].into(), ray[i][2].into());
        let want = table.lookup(v(0), v(1), v(2), ray[0][3].into());
        for channel in 0..2 {
            let (got, want) = (f64::from(got[channel]), want[channel]);
            // f32 coordinates and filters that keep at least 8 bits of the weights: neighbours
            // differ by less than 1 in the logarithm, 4 of them are weighted.
            let tolerance = 0.01 * want + 1e-6;
            assert!((got - want).abs() < tolerance, "{ray:?} channel {channel}: {got} {want}");
        }
    }
}

/// In the outermost sliver of a sphere, where all light of an opaque one comes from, f32 has few digits of places.
#[test]
fn order_1_of_opaque_spheres_equals_its_twin() {
    let gpu = Gpu::headless().expect("adapter");
    let table = small_table();
    let rays: Vec<[[f32; 4]; 3]> = (0..4000)
        .map(|i| {
            let entry = direction(i, 0.2);
            let dir = direction(i, 0.55);
            let dir = if dir.dot(entry) > 0.0 { -dir } else { dir };
            let optical_radius = 1e2 * 1e7f64.powf((i as f64 * 0.577_215_66).fract());
            let pack = |v: DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
            [pack(entry, optical_radius), pack(dir, 0.0), pack(direction(i, 0.8), 0.0)]
        })
        .collect();
    let (mut worst, mut lit) = (0.0f64, 0);
    for (ray, got) in rays.iter().zip(&probe(&gpu, table, &rays)) {
        let v = |i: usize| DVec3::new(ray[i][0].into(), ray[i][1].into(), ray[i][2].into());
        let want = table.lookup(v(0), v(1), v(2), ray[0][3].into())[0];
        if want > 1e-3 {
            lit += 1;
            worst = worst.max((f64::from(got[0]) / want - 1.0).abs());
        }
    }
    println!("{lit} lit rays, the worst off by {worst:.1e}");
    assert!(lit > 1500 && worst < 1e-4, "{lit} {worst:e}");
}

#[test]
fn parameters_lie_where_the_shader_reads_them() {
    let library = ShaderLibrary::new().expect("modules");
    let module = library.compose("probe", PROBE, &[]).expect("probe composes");
    let (_, members, span) = module
        .types
        .iter()
        .find_map(|(_, t)| match &t.inner {
            naga::TypeInner::Struct { members, span }
                if t.name.as_ref().is_some_and(|n| n.starts_with("ScatteringParams")) =>
            {
                Some((t, members, *span))
            }
            _ => None,
        })
        .expect("the shader has the struct");
    let host = ScatteringParams::FIELDS;
    assert_eq!(span as usize, size_of::<ScatteringParams>());
    assert_eq!(members.len(), host.len());
    for (member, (name, offset)) in members.iter().zip(host) {
        assert_eq!(member.name.as_deref(), Some(*name));
        assert_eq!(member.offset as usize, *offset);
    }
}
