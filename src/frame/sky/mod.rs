//! stub
use crate::{
    Result,
    gpu::{Gpu, ShaderLibrary},
};
use glam::Vec3;
#[derive(Clone, Copy, PartialEq)]
pub enum SkyKind {
    Uniform { radiance: f32 },
    Atmosphere,
}
#[derive(Clone, Copy, PartialEq)]
pub struct SkyInputs {
    pub kind: SkyKind,
    pub sun_direction: Vec3,
    pub sun_irradiance: f32,
    pub angular_diameter: f32,
    pub camera_altitude: f64,
    pub ground_albedo: Vec3,
}
#[derive(Clone, Copy, PartialEq)]
pub enum SkyWork {
    None,
    All,
}
pub struct SkyPass {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    last: Option<SkyInputs>,
}
impl SkyPass {
    pub fn new(gpu: &Gpu, _l: &ShaderLibrary) -> Result<Self> {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[],
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[],
        });
        Ok(Self { layout, group, last: None })
    }
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }
    pub fn bind_group(&self) -> &wgpu::BindGroup {
        &self.group
    }
    pub fn update(&mut self, _g: &Gpu, i: &SkyInputs) -> SkyWork {
        if self.last == Some(*i) {
            SkyWork::None
        } else {
            self.last = Some(*i);
            SkyWork::All
        }
    }
    pub fn encode(&self, _e: &mut wgpu::CommandEncoder, _w: SkyWork) {}
    pub fn bytes(&self) -> u64 {
        0
    }
}
