//! The blend pass alone on the device.

use crate::{GPU, TABLES};
use cumuli::frame::Lighting;
use cumuli::frame::cpu::light_grid::FieldSeen;
use cumuli::frame::gpu_data::FrameUniforms;
use cumuli::frame::light_grid::{GridMedium, LightGridPass, Spreads};
use cumuli::frame::opaque::OpaqueJob;
use cumuli::frame::sky::{SkyInputs, SkyKind, SkyPass};
use cumuli::frame::view::SCREEN_TILE;
use cumuli::gpu::{Kernel, ShaderLibrary, buffers};
use cumuli::shader_file;
use cumuli::tables::TablesGpu;
use glam::Vec3;
use half::f16;
use wgpu::util::DeviceExt;

use super::clouds::{Cloud, FIELD_CELLS};
use super::{HALO, PHASE, SIZE};

pub(super) struct Device {
    pub(super) kernels: Vec<Kernel>,
    pub(super) lighting: Lighting,
    pub(super) tables: TablesGpu,
    pub(super) sky: SkyPass,
    pub(super) grid: LightGridPass,
}

impl Device {
    pub(super) fn new(library: &ShaderLibrary, lighting: Lighting, steps: &[u32]) -> Self {
        let tables = TablesGpu::new(&GPU, &TABLES, &PHASE, 1.0).expect("tables");
        let sky = SkyPass::new(&GPU, library).expect("a sky");
        let spreads = Spreads(vec![1.0; 6]);
        let medium =
            GridMedium { spreads: &spreads, tables: tables.layout(), halo: &HALO, albedo: 1.0 };
        let grid = LightGridPass::new(&GPU, library, &medium).expect("a light grid");
        let groups = [tables.layout(), sky.layout(), grid.layout()];
        let kernel = |steps: &u32| {
            let file = shader_file!("frame/blend.wgsl");
            let mut defs = vec![("STEPS", *steps), ("SCREEN_TILE", SCREEN_TILE)];
            let groups = match lighting {
                Lighting::Grid => &groups[..],
                Lighting::Octaves => {
                    defs.push(("OCTAVES", 1));
                    &groups[..2]
                }
                Lighting::Alone => {
                    defs.push(("ALONE", 1));
                    &groups[..2]
                }
            };
            Kernel::new(&GPU, library, file, &defs, groups).expect("a kernel")
        };
        Self { kernels: steps.iter().map(kernel).collect(), lighting, tables, sky, grid }
    }

    /// Radiance and transmittance, and distance, of every pixel.
    pub(super) fn blend(
        &mut self,
        kernel: usize,
        frame: &FrameUniforms,
        cloud: &Cloud,
    ) -> (Vec<[f32; 4]>, Vec<f32>) {
        let gpu = &*GPU;
        let work = self.sky.update(
            gpu,
            &SkyInputs {
                kind: SkyKind::Uniform { radiance: 0.0 },
                sun_direction: Vec3::from_slice(&frame.sun),
                sun_irradiance: 1.0,
                angular_diameter: 0.01,
                camera_altitude: cloud.altitude,
                ground_albedo: Vec3::ZERO,
                has_ground: false,
                sea_wind: None,
            },
        );
        // One list for all tiles: a tile's list may hold particles that none of its pixels see.
        let count = cloud.particles.len() as u32;
        let tiles = frame.tiles[0] * frame.tiles[1];
        let entries: Vec<u32> = (0..tiles).flat_map(|_| 0..count).collect();
        let offsets: Vec<u32> = (0..=tiles).map(|tile| tile * count).collect();
        let texture = |format| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let radiance = texture(wgpu::TextureFormat::Rgba32Float);
        let distance = texture(wgpu::TextureFormat::R32Float);
        let uniforms = [
            buffers::uniform(gpu, "frame", frame),
            buffers::uniform(gpu, "phase", &self.tables.phase_params()),
            buffers::storage_with(gpu, "particles", &cloud.particles),
            buffers::storage_with(gpu, "lights", &cloud.lights),
            buffers::storage_with(gpu, "offsets", &offsets),
            buffers::storage_with(gpu, "entries", &entries),
            buffers::storage(gpu, "counts", 3, 4),
        ];
        let shadow = [
            buffers::uniform(gpu, "shadow maps", &cloud.shadow.maps),
            buffers::storage_with(gpu, "shadow texels", &cloud.shadow.texels),
        ];
        let maps = if self.lighting.has_maps() { &shadow[..] } else { &[] };
        let nothing = OpaqueJob::none(gpu);
        let views = [&radiance, &distance].map(|t| t.create_view(&Default::default()));
        let resources: Vec<_> = uniforms
            .iter()
            .map(|buffer| buffer.as_entire_binding())
            .chain(views.iter().map(wgpu::BindingResource::TextureView))
            .chain([wgpu::BindingResource::TextureView(&nothing.distances)])
            .chain(maps.iter().map(|buffer| buffer.as_entire_binding()))
            .collect();
        let field = field_on_device(&self.grid, &cloud.field);
        let kernel = &self.kernels[kernel];
        let bindings = kernel.bind(gpu, &resources);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.sky.encode(&mut encoder, work);
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(kernel.pipeline("blend"));
            pass.set_bind_group(0, &bindings, &[]);
            pass.set_bind_group(1, self.tables.bind_group(), &[]);
            pass.set_bind_group(2, self.sky.bind_group(), &[]);
            if self.lighting.has_grid() {
                pass.set_bind_group(3, &field, &[]);
            }
            pass.dispatch_workgroups(frame.tiles[0], frame.tiles[1], 1);
        }
        gpu.queue.submit([encoder.finish()]);
        let radiance = gpu.read_texture(&radiance).expect("radiance");
        (radiance, gpu.read_texture(&distance).expect("distance"))
    }
}

pub(super) fn field_on_device(grid: &LightGridPass, field: &FieldSeen) -> wgpu::BindGroup {
    let gpu = &*GPU;
    let texels: Vec<f16> =
        field.cells().iter().flat_map(|cell| cell.to_array().map(f16::from_f64)).collect();
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: FIELD_CELLS,
                height: FIELD_CELLS,
                depth_or_array_layers: FIELD_CELLS,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(&texels),
    );
    let uniforms = buffers::uniform(gpu, "light grid", field.uniforms());
    let cells = buffers::storage_with(gpu, "cells", &vec![u32::MAX; field.cells().len()]);
    grid.bind(gpu, &uniforms, &texture.create_view(&Default::default()), &cells)
}
