//! The table on the device.

use bytemuck::{Pod, Zeroable};
use wgpu::util::DeviceExt;

use super::ScatteringTable;
use crate::gpu::Gpu;

/// Constants of the lookup; `ScatteringParams` in `shaders/tables/scattering.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ScatteringParams {
    /// Texture size along the view-sun axis.
    pub view_nodes: f32,
    /// Texture size along the azimuth axis.
    pub azimuth_nodes: f32,
    /// Slices of one optical radius.
    pub incidence_nodes: f32,
    /// Nodes of the optical radius.
    pub radius_nodes: f32,
    /// Least optical radius.
    pub radius_least: f32,
    /// Greatest optical radius.
    pub radius_greatest: f32,
    /// Nodes per unit of the natural logarithm of the optical radius plus 1.
    pub radius_scale: f32,
    /// 1 / sine of half the angle where logarithmic spacing begins.
    pub lobe_inverse: f32,
    /// Factor of the logarithmic part of the view-sun coordinate.
    pub lobe_factor: f32,
    /// Factor of its even part.
    pub even_factor: f32,
    /// Single-scattering albedo.
    pub albedo: f32,
    /// Transport extinction over extinction.
    pub transport: f32,
}

#[cfg(test)]
impl ScatteringParams {
    /// Name and offset in bytes of every field.
    pub const FIELDS: &'static [(&'static str, usize)] = &[
        ("view_nodes", std::mem::offset_of!(ScatteringParams, view_nodes)),
        ("azimuth_nodes", std::mem::offset_of!(ScatteringParams, azimuth_nodes)),
        ("incidence_nodes", std::mem::offset_of!(ScatteringParams, incidence_nodes)),
        ("radius_nodes", std::mem::offset_of!(ScatteringParams, radius_nodes)),
        ("radius_least", std::mem::offset_of!(ScatteringParams, radius_least)),
        ("radius_greatest", std::mem::offset_of!(ScatteringParams, radius_greatest)),
        ("radius_scale", std::mem::offset_of!(ScatteringParams, radius_scale)),
        ("lobe_inverse", std::mem::offset_of!(ScatteringParams, lobe_inverse)),
        ("lobe_factor", std::mem::offset_of!(ScatteringParams, lobe_factor)),
        ("even_factor", std::mem::offset_of!(ScatteringParams, even_factor)),
        ("albedo", std::mem::offset_of!(ScatteringParams, albedo)),
        ("transport", std::mem::offset_of!(ScatteringParams, transport)),
    ];
}

impl ScatteringTable {
    /// What the shader needs beside the texture.
    pub fn params(&self) -> ScatteringParams {
        let [radii, incidences, azimuths, views] = self.resolution.map(|n| n as f32);
        let [low, high] = self.optical_radius;
        ScatteringParams {
            view_nodes: views,
            azimuth_nodes: azimuths,
            incidence_nodes: incidences,
            radius_nodes: radii,
            radius_least: low as f32,
            radius_greatest: high as f32,
            radius_scale: ((self.resolution[0] - 1) as f64 / ((high + 1.0) / (low + 1.0)).ln())
                as f32,
            lobe_inverse: (1.0 / self.map.lobe_scale) as f32,
            lobe_factor: self.map.lobe_factor() as f32,
            even_factor: self.map.even_factor() as f32,
            albedo: self.albedo as f32,
            transport: self.terminator.transport as f32,
        }
    }

    /// The table as a texture: view-sun angle, azimuth, and slices by optical radius, then
    /// incidence. A lookup never filters from one optical radius to the next: it stays within
    /// the slices of one.
    pub fn texture(&self, gpu: &Gpu) -> wgpu::Texture {
        let [radii, incidences, azimuths, views] = self.resolution.map(|n| n as u32);
        gpu.device.create_texture_with_data(
            &gpu.queue,
            &wgpu::TextureDescriptor {
                label: Some("scattering table"),
                size: wgpu::Extent3d {
                    width: views,
                    height: azimuths,
                    depth_or_array_layers: radii * incidences,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D3,
                format: wgpu::TextureFormat::R16Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
            wgpu::util::TextureDataOrder::LayerMajor,
            bytemuck::cast_slice(&self.values),
        )
    }
}
