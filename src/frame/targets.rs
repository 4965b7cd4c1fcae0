//! The textures of a frame of one size.

use crate::gpu::Gpu;

/// What the picture passes write.
pub struct Targets {
    /// Pixels.
    pub size: [u32; 2],
    /// Clouds: rgb radiance, a transmittance.
    pub clouds: wgpu::TextureView,
    /// Opacity-weighted distance of the clouds, m.
    pub distance: wgpu::TextureView,
    /// The whole picture: rgb radiance, a opacity of the clouds.
    pub picture: wgpu::Texture,
    /// Tone mapped, sRGB values.
    pub display: wgpu::Texture,
    bytes: u64,
}

impl Targets {
    /// Makes the textures.
    pub fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let mut bytes = 0;
        let mut texture = |label, format: wgpu::TextureFormat| {
            let pixels = u64::from(size[0]) * u64::from(size[1]);
            bytes += pixels * u64::from(format.block_copy_size(None).unwrap_or(0));
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::STORAGE_BINDING
                    | wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let clouds = texture("clouds", wgpu::TextureFormat::Rgba32Float);
        let distance = texture("cloud distance", wgpu::TextureFormat::R32Float);
        let picture = texture("picture", wgpu::TextureFormat::Rgba32Float);
        let display = texture("display", wgpu::TextureFormat::Rgba8Unorm);
        let view = |t: &wgpu::Texture| t.create_view(&Default::default());
        Self { size, clouds: view(&clouds), distance: view(&distance), picture, display, bytes }
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}
