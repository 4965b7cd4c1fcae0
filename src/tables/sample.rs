//! Single rays through the tables: what the lookups of the frame answer for one particle alone in
//! parallel sunlight. Twin of `shaders/tables/sample.wgsl`.
//!
//! A ray may ask for a part of its chord. Its optical depth and transmittance are then those of
//! the part alone; its radiance is what the part adds to the radiance at the entry, dimmed by the
//! matter of the chord before it. So the radiances of the parts of a chord add up to that of the
//! whole, their optical depths too, and their transmittances multiply: as the frame composes the
//! pieces of a chord.
//!
//! The matter is that of the shape. The light scattered in it is that of the uniform sphere of the
//! same mean density, which is what the frame takes for every shape.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::scattering::single::opacity;
use super::{ScatteringTable, TableSet, TablesGpu};
use crate::error::{Error, Result};
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::medium::{Phase, PreparedPhase};

/// Rays of one dispatch: their buffer is an eighth of the largest binding of WebGPU.
const RAYS_AT_ONCE: usize = 1 << 18;
/// `workgroup_size` of the shader.
const WORKGROUP: usize = 64;

/// A ray through the unit sphere. Vectors have length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleRay {
    /// Where it enters the sphere.
    pub entry: DVec3,
    /// Its direction of travel, away from the eye. Out of the sphere it meets no matter.
    pub dir: DVec3,
    /// Towards the sun.
    pub sun: DVec3,
    /// Extinction at density 1 times radius.
    pub optical_radius: f64,
    /// The part of the chord that is asked for, as fractions of its length from the entry on.
    pub part: [f64; 2],
}

/// What the tables say of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Of the part of the chord.
    pub optical_depth: f64,
    /// Of the part of the chord.
    pub transmittance: f64,
    /// Radiance of order 1 at the entry, phase function included, per unit of sun irradiance, 1/sr.
    pub single: f64,
    /// Radiance of all orders from 2 on, 1/sr.
    pub multiple: f64,
}

impl Sample {
    /// Radiance of all orders, 1/sr, without directly transmitted sunlight.
    pub fn total(&self) -> f64 {
        self.single + self.multiple
    }
}

/// A shape and a medium of a set of tables, ready for rays.
pub struct Sampler<'a> {
    tables: &'a TableSet,
    scattering: &'a ScatteringTable,
    phase: PreparedPhase,
    shape: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct GpuRay {
    entry: [f32; 3],
    optical_radius: f32,
    dir: [f32; 3],
    begin: f32,
    sun: [f32; 3],
    end: f32,
    shape: u32,
    source_radius: f32,
    padding: [u32; 2],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct GpuSample {
    optical_depth: f32,
    transmittance: f32,
    single: f32,
    multiple: f32,
}

impl<'a> Sampler<'a> {
    /// For a shape by its name and a medium; refused where the tables lack them.
    pub fn new(tables: &'a TableSet, shape: &str, phase: &Phase, albedo: f64) -> Result<Self> {
        let index = tables.shape_index(shape).ok_or_else(|| {
            let names: Vec<_> = tables.shape_names().collect();
            let message = format!("expected one that the tables hold: {}", names.join(", "));
            Error::input(format!("shape {shape}"), message)
        })?;
        let scattering = tables.scattering_for(phase, albedo).ok_or_else(|| {
            Error::input(
                format!("medium {phase} with albedo {albedo}"),
                format!("expected one that the tables hold: {}", tables.media()),
            )
        })?;
        Ok(Self { tables, scattering, phase: phase.prepare(), shape: index })
    }

    /// Optical radius of the uniform sphere whose scattered light a ray gets.
    pub fn source_radius(&self, ray: &SampleRay) -> f64 {
        ray.optical_radius * self.tables.mean_density(self.shape)
    }

    /// Answers by the host's lookups.
    pub fn sample(&self, ray: &SampleRay) -> Sample {
        let chord = (-2.0 * ray.entry.dot(ray.dir)).max(0.0);
        let exit = ray.entry + chord * ray.dir;
        let profile = self.tables.chord_profile(self.shape, ray.entry, exit);
        let whole = ray.optical_radius * chord * f64::from(profile.mean_density);
        let [before, end] = ray.part.map(|t| f64::from(profile.fraction(t as f32)));
        let optical_depth = whole * (end - before).max(0.0);
        let opaque = opacity(optical_depth) * (-whole * before).exp();
        let [once, more] =
            self.scattering.lookup(ray.entry, ray.dir, ray.sun, self.source_radius(ray));
        Sample {
            optical_depth,
            transmittance: (-optical_depth).exp(),
            single: self.phase.eval(ray.dir.dot(ray.sun)) * once * opaque,
            multiple: more * opaque,
        }
    }

    /// Answers by the shader's lookups, in the order of the rays.
    pub fn sample_on(&self, gpu: &Gpu, rays: &[SampleRay]) -> Result<Vec<Sample>> {
        let (phase, albedo) = (self.scattering.phase(), self.scattering.albedo());
        let tables = TablesGpu::new(gpu, self.tables, phase, albedo)?;
        let library = ShaderLibrary::new()?;
        let file = crate::shader_file!("tables/sample.wgsl");
        let kernel = Kernel::new(gpu, &library, file, &[], &[tables.layout()])?;
        let phase = buffers::uniform(gpu, "phase", &tables.phase_params());
        let mut samples = Vec::with_capacity(rays.len());
        for rays in rays.chunks(RAYS_AT_ONCE) {
            let inputs: Vec<GpuRay> = rays.iter().map(|ray| self.gpu_ray(ray)).collect();
            let input = buffers::storage_with(gpu, "rays", &inputs);
            let output = buffers::storage(gpu, "answers", rays.len(), size_of::<GpuSample>());
            let own = kernel.bind(
                gpu,
                &[input.as_entire_binding(), output.as_entire_binding(), phase.as_entire_binding()],
            );
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(kernel.pipeline("sample"));
                pass.set_bind_group(0, &own, &[]);
                pass.set_bind_group(1, tables.bind_group(), &[]);
                pass.dispatch_workgroups(rays.len().div_ceil(WORKGROUP) as u32, 1, 1);
            }
            gpu.queue.submit([encoder.finish()]);
            let answers: Vec<GpuSample> = gpu.read_buffer(&output, rays.len())?;
            samples.extend(answers.into_iter().map(|a| Sample {
                optical_depth: a.optical_depth.into(),
                transmittance: a.transmittance.into(),
                single: a.single.into(),
                multiple: a.multiple.into(),
            }));
        }
        Ok(samples)
    }

    fn gpu_ray(&self, ray: &SampleRay) -> GpuRay {
        let [begin, end] = ray.part.map(|t| t as f32);
        GpuRay {
            entry: ray.entry.as_vec3().to_array(),
            optical_radius: ray.optical_radius as f32,
            dir: ray.dir.as_vec3().to_array(),
            begin,
            sun: ray.sun.as_vec3().to_array(),
            end,
            shape: self.shape,
            source_radius: self.source_radius(ray) as f32,
            padding: [0; 2],
        }
    }
}
