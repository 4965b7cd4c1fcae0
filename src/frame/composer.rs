//! What composes particles to clouds in place of the blend: for comparisons of methods within the
//! same frame.

use super::plan::Pass;
use super::resources::Resources;
use super::shadow::ShadowJob;
use crate::gpu::Gpu;

/// What a composer reads and writes.
pub struct ComposeInputs<'a> {
    /// Particles, lists, targets of this frame.
    pub resources: &'a Resources,
    /// Deep shadow maps.
    pub shadow: &'a ShadowJob,
    /// `PhaseParams`.
    pub phase: &'a wgpu::Buffer,
}

/// A pass that takes the place of the blend: it fills the targets `clouds` and `distance`, and the
/// blend's counts.
pub trait Composer {
    /// Passes that its pictures do without.
    fn unneeded(&self) -> &'static [Pass];

    /// Records its work. `groups`: tables, sky, light field.
    fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        inputs: &ComposeInputs<'_>,
        groups: [&wgpu::BindGroup; 3],
    );
}
