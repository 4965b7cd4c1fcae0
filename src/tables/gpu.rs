//! The tables on the device: one bind group for all passes that look anything up.

use bytemuck::{Pod, Zeroable};

use super::TableSet;
use super::optical_depth::OpticalDepthTable;
use crate::error::{Error, Result};
use crate::gpu::{Gpu, buffers};
use crate::medium::shape::{VOLUME_NODES, volume_density};
use crate::medium::{Phase, PhaseParams};

/// Bytes of a texel of the optical depth texture.
const TEXEL_BYTES: u64 = 4;
/// Its format: three numbers of 10 bits, see `optical_depth::encoding`.
const OPTICAL_DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgb10a2Unorm;

/// Format of the density volumes. Drivers may filter bytes in 8 bits: lavapipe does, which costs
/// 0.003 RMS of transmittance at central optical depth 10; and its half floats are quicker.
const DENSITY_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R16Float;
/// Volumes that stand one behind the other; as many as WebGPU's least limit of 2048 texels takes.
const VOLUMES_DEEP: usize = 32;

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
    /// One over the texels of the volumes' texture along x, y, z.
    pub inverse_volumes: [f32; 4],
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
        let (volumes, inverse_volumes, volume_bytes) =
            density_texture(gpu, tables.optical_depth())?;
        let (texture, params, table_bytes) =
            optical_depth_texture(gpu, tables.optical_depth(), inverse_volumes)?;
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
        let volumes_view = volumes.create_view(&Default::default());
        let bytes = table_bytes + volume_bytes + size_of_val(scattering.values()) as u64;
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
                wgpu::BindGroupEntry {
                    binding: 5,
                    resource: wgpu::BindingResource::TextureView(&volumes_view),
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
            entry(5, texture),
        ],
    })
}

/// Writes texels into a box of a texture.
fn write(gpu: &Gpu, texture: &wgpu::Texture, origin: [usize; 3], size: [usize; 3], texels: &[u8]) {
    let [x, y, z] = origin.map(|n| n as u32);
    let [width, height, depth_or_array_layers] = size.map(|n| n as u32);
    let rows = size[1] * size[2];
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x, y, z },
            aspect: wgpu::TextureAspect::All,
        },
        texels,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some((texels.len() / rows) as u32),
            rows_per_image: Some(height),
        },
        wgpu::Extent3d { width, height, depth_or_array_layers },
    );
}

/// An empty texture, one over its texels along each axis, and its texels.
fn texture(
    gpu: &Gpu,
    label: &'static str,
    size: [usize; 3],
    format: wgpu::TextureFormat,
) -> Result<(wgpu::Texture, [f32; 4], u64)> {
    let most = gpu.device.limits().max_texture_dimension_3d as usize;
    if size.iter().any(|n| *n > most) {
        return Err(Error::input(
            label,
            format!("expected at most {most} texels along a side of the texture, found {size:?}"),
        ));
    }
    let [width, height, depth_or_array_layers] = size.map(|n| n as u32);
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let [x, y, z] = size.map(|n| 1.0 / n as f32);
    Ok((texture, [x, y, z, 0.0], size.iter().map(|n| *n as u64).product()))
}

/// Places the 4D tables of all shapes in one texture as the shader expects them.
fn optical_depth_texture(
    gpu: &Gpu,
    tables: &[OpticalDepthTable],
    inverse_volumes: [f32; 4],
) -> Result<(wgpu::Texture, OpticalDepthParams, u64)> {
    // Without any noise shape the binding still wants a texture: the smallest grid, never read.
    let [disc, _, direction, _] = tables.first().map_or([2; 4], |t| t.grid().nodes);
    let size = [disc * direction, disc * tables.len().max(1), direction];
    let (texture, inverse, texels) = texture(gpu, "optical depth", size, OPTICAL_DEPTH_FORMAT)?;
    for (shape, table) in tables.iter().enumerate() {
        let tile_texels = disc * disc * direction;
        for (tile, texels) in table.texels().chunks_exact(tile_texels).enumerate() {
            let origin = [disc * tile, disc * shape, 0];
            write(gpu, &texture, origin, [disc, disc, direction], bytemuck::cast_slice(texels));
        }
    }
    let params = OpticalDepthParams {
        disc_nodes: disc as f32,
        direction_nodes: direction as f32,
        inverse_width: inverse[0],
        inverse_height: inverse[1],
        inverse_volumes,
    };
    Ok((texture, params, texels * TEXEL_BYTES))
}

/// Places the density volumes of all shapes, each with its filtered copies, in one texture as the
/// shader expects them.
fn density_texture(
    gpu: &Gpu,
    tables: &[OpticalDepthTable],
) -> Result<(wgpu::Texture, [f32; 4], u64)> {
    const N: usize = VOLUME_NODES;
    let columns = tables.len().div_ceil(VOLUMES_DEEP);
    let size = match tables.len() {
        0 => [1; 3],
        shapes => [2 * N * columns, N, N * shapes.min(VOLUMES_DEEP)],
    };
    let (texture, inverse, texels) = texture(gpu, "densities", size, DENSITY_FORMAT)?;
    for (shape, table) in tables.iter().enumerate() {
        let [column, row] = [shape / VOLUMES_DEEP, shape % VOLUMES_DEEP];
        for volume in table.volumes() {
            let n = volume.nodes();
            let origin = [2 * N * (column + 1) - 2 * n, 0, N * row];
            let halves: Vec<half::f16> =
                volume.bytes().iter().map(|b| volume_density(*b)).collect();
            write(gpu, &texture, origin, [n; 3], bytemuck::cast_slice(&halves));
        }
    }
    Ok((texture, inverse, texels * size_of::<half::f16>() as u64))
}
