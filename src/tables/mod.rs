//! stub
pub mod progress;
pub mod scattering;
use crate::{Result, gpu::Gpu, medium::Phase};
pub use progress::{Progress, Silent};
pub struct TableSet;
impl TableSet {
    pub fn embedded() -> Result<Self> {
        Ok(Self)
    }
    pub fn shape_names(&self) -> impl Iterator<Item = &str> {
        ["uniform", "a"].into_iter()
    }
    pub fn mean_density(&self, i: u32) -> f64 {
        if i == 0 { 1.0 } else { 0.4 }
    }
}
pub struct TablesGpu {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    p: crate::medium::PhaseParams,
}
impl TablesGpu {
    pub fn new(gpu: &Gpu, _t: &TableSet, phase: &Phase, _a: f64) -> Result<Self> {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[],
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[],
        });
        Ok(Self { layout, group, p: phase.gpu_params() })
    }
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }
    pub fn bind_group(&self) -> &wgpu::BindGroup {
        &self.group
    }
    pub fn phase_params(&self) -> crate::medium::PhaseParams {
        self.p
    }
    pub fn bytes(&self) -> u64 {
        0
    }
}
