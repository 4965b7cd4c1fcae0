//! The light grid of one renderer: when it has to be made, and what it holds.

use glam::DVec3;

use super::inputs::GridInputs;
use super::job::{GridSize, Job};
use crate::frame::cpu::light_grid::{FieldSeen, GridLight};
use crate::frame::passes::Passes;
use crate::gpu::Gpu;
use crate::{Error, Result};

/// The grid of one renderer.
#[derive(Default)]
pub struct LightGrid {
    pub(super) job: Option<Job>,
    made: Option<GridInputs>,
    seen_from: Option<[f32; 3]>,
}

/// What of the grid a frame has to make.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GridWork {
    /// The light itself.
    pub solve: bool,
    /// What the eye sees of it.
    pub field: bool,
}

impl LightGrid {
    /// Makes the buffers fit and says what has changed since they were filled. `shift` is the anchor
    /// relative to the camera, m.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        passes: &Passes,
        size: GridSize,
        inputs: &GridInputs,
        shift: DVec3,
    ) -> GridWork {
        let fits = self.job.as_ref().is_some_and(|j| {
            j.sizes == inputs.levels.sizes() && j.grid_size == size && j.turns == inputs.turns
        });
        if !fits {
            gpu.begin_part("light grid");
            self.job = Some(Job::new(gpu, passes, &passes.light_grid, size, inputs));
            self.made = None;
        }
        let eye = (-shift).as_vec3().to_array();
        let solve = self.made.as_ref() != Some(inputs);
        GridWork { solve, field: solve || self.seen_from != Some(eye) }
    }

    /// Notes what has been made.
    pub fn done(&mut self, inputs: &GridInputs, shift: DVec3) {
        self.made = Some(inputs.clone());
        self.seen_from = Some((-shift).as_vec3().to_array());
    }

    /// Bind group 3 of passes that read the field.
    pub fn bind_group(&self) -> Option<&wgpu::BindGroup> {
        self.job.as_ref().map(|j| &j.read)
    }

    /// `ParticleCount` of the grid's own particles.
    pub fn particle_count(&self) -> Option<&wgpu::Buffer> {
        self.job.as_ref().map(|j| &j.count)
    }

    /// What the last eye sees of it, read back.
    pub fn seen(&self, gpu: &Gpu) -> Result<FieldSeen> {
        let (Some(job), Some(made), Some(eye)) = (&self.job, &self.made, self.seen_from) else {
            return Err(Error::Gpu("the light grid was not made".to_owned()));
        };
        let lights = gpu.read_buffer::<u32>(&job.lights, job.lights.size() as usize / 4)?;
        let sun = gpu.read_buffer::<f32>(&job.sun, job.cells as usize)?;
        let extinction = gpu.read_buffer::<f32>(&job.extinction, job.cells as usize)?;
        let light =
            GridLight::from_device(&made.uniforms, &lights, job.light_words, &sun, &extinction);
        Ok(light.seen_from(DVec3::from_array(eye.map(f64::from))))
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.job.as_ref().map_or(0, |j| j.bytes)
    }
}
