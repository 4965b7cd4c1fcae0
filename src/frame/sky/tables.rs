//! The sky's textures and how passes bind them.

use crate::gpu::Gpu;

/// All tables hold four half floats.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const TEXEL_BYTES: u64 = 8;

/// Sizes in texels, as in `shaders/shared/atmosphere.wgsl`.
pub const DEPTH_SIZE: [u32; 2] = [256, 64];
/// Sun's height, altitude.
pub const MULTIPLE_SIZE: [u32; 2] = [32, 32];
/// Sun's height; irradiance of the sky at the four wavelengths, of the sun in rgb, of the sky in rgb.
pub const GROUND_SIZE: [u32; 2] = [128, 3];
/// Altitude; sun, above, below: air, ground lit by the sun, by the sky.
pub const ALTITUDE_SIZE: [u32; 2] = [64, 5];
/// Azimuth, elevation.
pub const VIEW_SIZE: [u32; 2] = [64, 192];
/// Azimuth, elevation, distance.
pub const AIR_SIZE: [u32; 3] = [32, 96, 40];

/// The tables in the order they are made.
pub struct SkyTables {
    /// Optical depth to space, by altitude and zenith angle.
    pub depth: wgpu::Texture,
    /// Mean radiance of light scattered twice and more, by the sun's height and altitude.
    pub multiple: wgpu::Texture,
    /// Irradiance of sky and sun on the ground, by the sun's height.
    pub ground: wgpu::Texture,
    /// Light of the sun and of both hemispheres, by altitude.
    pub altitude: wgpu::Texture,
    /// Radiance by direction.
    pub view: wgpu::Texture,
    /// Source function of the air before a place, by direction and distance.
    pub air_sources: wgpu::Texture,
    /// Optical depth of the air before a place, by elevation and distance.
    pub air_depths: wgpu::Texture,
    /// Stands for tables that are not made yet; zero.
    pub nothing: wgpu::Texture,
}

fn texture(gpu: &Gpu, label: &str, size: [u32; 3]) -> wgpu::Texture {
    let [width, height, depth_or_array_layers] = size;
    let dimension = if depth_or_array_layers > 1 {
        wgpu::TextureDimension::D3
    } else {
        wgpu::TextureDimension::D2
    };
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension,
        format: FORMAT,
        usage: wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

impl SkyTables {
    /// Empty tables.
    pub fn new(gpu: &Gpu) -> Self {
        let flat = |label, [w, h]: [u32; 2]| texture(gpu, label, [w, h, 1]);
        Self {
            depth: flat("sky depth", DEPTH_SIZE),
            multiple: flat("sky multiple", MULTIPLE_SIZE),
            ground: flat("sky ground", GROUND_SIZE),
            altitude: flat("sky altitude", ALTITUDE_SIZE),
            view: flat("sky view", VIEW_SIZE),
            air_sources: texture(gpu, "sky air sources", AIR_SIZE),
            air_depths: flat("sky air depths", [AIR_SIZE[1], AIR_SIZE[2]]),
            nothing: flat("sky nothing", [1, 1]),
        }
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        [
            &self.depth,
            &self.multiple,
            &self.ground,
            &self.altitude,
            &self.view,
            &self.air_sources,
            &self.air_depths,
            &self.nothing,
        ]
        .iter()
        .map(|t| bytes_of(t))
        .sum()
    }
}

/// The sky as the surface of a sea sees it: as the view.
pub fn sky_over_sea(gpu: &Gpu) -> wgpu::Texture {
    texture(gpu, "sky over sea", [VIEW_SIZE[0], VIEW_SIZE[1], 1])
}

/// Device memory of a table, bytes.
pub fn bytes_of(table: &wgpu::Texture) -> u64 {
    let s = table.size();
    u64::from(s.width) * u64::from(s.height) * u64::from(s.depth_or_array_layers) * TEXEL_BYTES
}

/// Layout of a group: the uniforms, a filtering sampler, then textures of these dimensions.
pub fn layout(
    gpu: &Gpu,
    label: &str,
    textures: &[wgpu::TextureViewDimension],
) -> wgpu::BindGroupLayout {
    let uniforms = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let views = textures.iter().map(|&view_dimension| wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension,
        multisampled: false,
    });
    let entries: Vec<_> = [uniforms, sampler]
        .into_iter()
        .chain(views)
        .zip(0..)
        .map(|(ty, binding)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        })
        .collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &entries,
    })
}

/// Binds a group of that layout.
pub fn bind(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    uniforms: &wgpu::Buffer,
    sampler: &wgpu::Sampler,
    textures: &[&wgpu::Texture],
) -> wgpu::BindGroup {
    let views: Vec<_> = textures.iter().map(|t| t.create_view(&Default::default())).collect();
    let entries: Vec<_> = [uniforms.as_entire_binding(), wgpu::BindingResource::Sampler(sampler)]
        .into_iter()
        .chain(views.iter().map(wgpu::BindingResource::TextureView))
        .zip(0..)
        .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("sky"),
        layout,
        entries: &entries,
    })
}
