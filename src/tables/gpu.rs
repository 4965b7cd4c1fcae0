//! The tables on the device: one bind group for all passes that look anything up.

use bytemuck::{Pod, Zeroable};

use super::TableSet;
use super::optical_depth::OpticalDepthTable;
use crate::error::{Error, Result};
use crate::gpu::{Gpu, buffers};
use crate::medium::{Phase, PhaseParams};

/// Bytes of a texel of the optical depth texture.
const TEXEL_BYTES: u32 = 4;
/// Its format: three numbers of 10 bits, see `optical_depth::encoding`.
const OPTICAL_DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgb10a2Unorm;

/// `OpticalDepthParams` of `shaders/tables/optical_depth.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct OpticalDepthParams {
    /// Nodes along each axis of the disc.
    pub disc_nodes: f32,
    /// Nodes along each axis of the direction.
    pub direction_nodes: f32,
    /// One over the texture's width in texels.
    pub inverse_width: f32,
    /// One over the texture's height in texels.
    pub inverse_height: f32,
}

/// Textures, sampler and parameters of the tables of one medium, bind group 1 of the passes.
pub struct TablesGpu {
    layout: wgpu::BindGroupLayout,
    bind_group: wgpu::BindGroup,
    phase: PhaseParams,
    bytes: u64,
}

impl TablesGpu {
    /// Uploads the tables of all shapes and of one medium.
    pub fn new(gpu: &Gpu, tables: &TableSet, phase: &Phase, albedo: f64) -> Result<Self> {
        let scattering = tables.scattering_for(phase, albedo).ok_or_else(|| {
            Error::input(
                format!("medium {phase}, albedo {albedo}"),
                format!("expected one that the tables hold: {}", tables.media()),
            )
        })?;
        let layout = layout(gpu);
        let (texture, params, bytes) = optical_depth_texture(gpu, tables.optical_depth())?;
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("tables"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let params = buffers::uniform(gpu, "optical depth", &params);
        let view = texture.create_view(&Default::default());
        let scattering_params = buffers::uniform(gpu, "scattering", &scattering.params());
        let scattering_view = scattering.texture(gpu).create_view(&Default::default());
        let bytes = bytes + size_of_val(scattering.values()) as u64;
        let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("tables"),
            layout: &layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&view),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&scattering_view),
                },
                wgpu::BindGroupEntry {
                    binding: 2,
                    resource: wgpu::BindingResource::Sampler(&sampler),
                },
                wgpu::BindGroupEntry { binding: 3, resource: params.as_entire_binding() },
                wgpu::BindGroupEntry {
                    binding: 4,
                    resource: scattering_params.as_entire_binding(),
                },
            ],
        });
        Ok(Self { layout, bind_group, phase: phase.gpu_params(), bytes })
    }

    /// Layout of the bind group.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// The bind group.
    pub fn bind_group(&self) -> &wgpu::BindGroup {
        &self.bind_group
    }

    /// The medium's phase function for `cumuli::phase`.
    pub fn phase_params(&self) -> PhaseParams {
        self.phase
    }

    /// Memory on the device.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D3,
        multisampled: false,
    };
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("tables"),
        entries: &[
            entry(0, texture),
            entry(1, texture),
            entry(2, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
            entry(3, uniform),
            entry(4, uniform),
        ],
    })
}

/// Places the tables of all shapes in one texture as the shader expects them.
fn optical_depth_texture(
    gpu: &Gpu,
    tables: &[OpticalDepthTable],
) -> Result<(wgpu::Texture, OpticalDepthParams, u64)> {
    // Without any noise shape the binding still wants a texture: the smallest grid, never read.
    let [disc, _, direction, _] = tables.first().map_or([2; 4], |t| t.grid().nodes);
    let size = wgpu::Extent3d {
        width: (disc * direction) as u32,
        height: (disc * tables.len().max(1)) as u32,
        depth_or_array_layers: direction as u32,
    };
    let most = gpu.device.limits().max_texture_dimension_3d;
    if size.width > most || size.height > most {
        return Err(Error::input(
            "optical depth tables",
            format!(
                "expected at most {most} texels along a side of the texture, found {} x {}",
                size.width, size.height
            ),
        ));
    }
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("optical depth"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: OPTICAL_DEPTH_FORMAT,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (shape, table) in tables.iter().enumerate() {
        let tile_texels = disc * disc * direction;
        for (tile, texels) in table.texels().chunks_exact(tile_texels).enumerate() {
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d {
                        x: (disc * tile) as u32,
                        y: (disc * shape) as u32,
                        z: 0,
                    },
                    aspect: wgpu::TextureAspect::All,
                },
                bytemuck::cast_slice(texels),
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(disc as u32 * TEXEL_BYTES),
                    rows_per_image: Some(disc as u32),
                },
                wgpu::Extent3d {
                    width: disc as u32,
                    height: disc as u32,
                    depth_or_array_layers: direction as u32,
                },
            );
        }
    }
    let params = OpticalDepthParams {
        disc_nodes: disc as f32,
        direction_nodes: direction as f32,
        inverse_width: 1.0 / size.width as f32,
        inverse_height: 1.0 / size.height as f32,
    };
    let texels =
        u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers);
    Ok((texture, params, texels * u64::from(TEXEL_BYTES)))
}
