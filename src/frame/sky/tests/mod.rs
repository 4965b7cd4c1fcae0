//! The sky on the device against its twin, against fine integration, and against numbers from
//! outside.

mod colours;
mod light;
mod made_tables;
mod skipping;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, DVec4, Vec3};
use half::f16;

use super::*;
use crate::gpu::buffers;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Query {
    dir: [f32; 3],
    distance: f32,
    altitude: f32,
    visibility: f32,
    by_clouds: f32,
    sky_share: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Answer {
    sky: [f32; 3],
    to_ground: f32,
    disc: [f32; 4],
    inscatter: [f32; 4],
    transmittance: [f32; 4],
    sun: [f32; 4],
    above: [f32; 4],
    below: [f32; 4],
    ground: [f32; 4],
}

/// A device with the sky's passes and a shader that asks for values.
struct Bench {
    gpu: Gpu,
    sky: SkyPass,
    probe: Kernel,
    nothing: wgpu::BindGroup,
}

impl Bench {
    fn new() -> Self {
        let gpu = Gpu::headless().expect("an adapter");
        let library = ShaderLibrary::new().expect("shaders");
        let sky = SkyPass::new(&gpu, &library).expect("passes");
        let empty = tables::layout(&gpu, "empty", &[]);
        let nothing = {
            let uniforms = buffers::uniform(&gpu, "nothing", &[0u32; 4]);
            let sampler = gpu.device.create_sampler(&Default::default());
            tables::bind(&gpu, &empty, &uniforms, &sampler, &[])
        };
        let file = ("frame/sky/probe.wgsl", include_str!("probe.wgsl"));
        let probe = Kernel::new(&gpu, &library, file, &[], &[&empty, sky.layout()]).expect("probe");
        Self { gpu, sky, probe, nothing }
    }

    fn make(&mut self, inputs: &SkyInputs) -> SkyWork {
        let work = self.sky.update(&self.gpu, inputs);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.sky.encode(&mut encoder, work);
        self.gpu.queue.submit([encoder.finish()]);
        work
    }

    fn ask(&self, queries: &[Query]) -> Vec<Answer> {
        let asked = buffers::storage_with(&self.gpu, "queries", queries);
        let answers = buffers::storage(&self.gpu, "answers", queries.len(), size_of::<Answer>());
        let group =
            self.probe.bind(&self.gpu, &[asked.as_entire_binding(), answers.as_entire_binding()]);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(self.probe.pipeline("probe"));
            pass.set_bind_group(0, &group, &[]);
            pass.set_bind_group(1, &self.nothing, &[]);
            pass.set_bind_group(2, self.sky.bind_group(), &[]);
            pass.dispatch_workgroups(queries.len().div_ceil(64) as u32, 1, 1);
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.read_buffer(&answers, queries.len()).expect("answers")
    }

    fn table(&self, texture: &wgpu::Texture) -> Vec<DVec4> {
        let texels: Vec<[u16; 4]> = self.gpu.read_texture(texture).expect("a table");
        texels
            .into_iter()
            .map(|t| DVec4::from_array(t.map(|bits| f16::from_bits(bits).to_f64())))
            .collect()
    }
}

fn inputs(sun_degrees: f32, camera_altitude: f64) -> SkyInputs {
    let e = sun_degrees.to_radians();
    SkyInputs {
        kind: SkyKind::Atmosphere,
        sun_direction: Vec3::new(e.cos() * 0.6, e.sin(), e.cos() * 0.8),
        sun_irradiance: 1.0,
        angular_diameter: 0.0093,
        camera_altitude,
        ground_albedo: Vec3::new(0.09, 0.11, 0.06),
        has_ground: true,
        sea_wind: None,
    }
}

/// Direction from elevation and azimuth, degrees; azimuth 0 is the sun's.
fn direction(elevation: f64, azimuth: f64) -> DVec3 {
    let (e, a) = (elevation.to_radians(), azimuth.to_radians());
    let (x, z) = (a.cos() * 0.6 - a.sin() * 0.8, a.cos() * 0.8 + a.sin() * 0.6);
    DVec3::new(e.cos() * x, e.sin(), e.cos() * z)
}

fn query(dir: DVec3, distance: f64, altitude: f64) -> Query {
    Query {
        dir: dir.as_vec3().to_array(),
        distance: distance as f32,
        altitude: altitude as f32,
        visibility: 1.0,
        by_clouds: 0.0,
        sky_share: 1.0,
    }
}

fn rgb(v: [f32; 4]) -> DVec3 {
    DVec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]))
}
