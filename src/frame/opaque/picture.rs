//! Opaque things in a picture on the host: from a program that casts rays, or from a file.

use glam::DVec3;
use wgpu::util::DeviceExt;

use super::{DepthKind, NOTHING, Opaque};
use crate::gpu::Gpu;
use crate::scene::Camera;
use crate::{Error, Result};

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Along the ray, m.
    pub distance: f64,
    /// Linear Rec. 709 radiance without direct sunlight, in the unit of the scene's sun.
    pub radiance: DVec3,
    /// What direct sunlight adds where no cloud dims the sun.
    pub sunlit: DVec3,
}

/// What every pixel's ray meets, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct OpaquePicture {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Along the rays, m; 1e30 and more where there is nothing.
    pub distance: Vec<f32>,
    /// As of [`Surface`].
    pub radiance: Vec<[f32; 3]>,
    /// As of [`Surface`].
    pub sunlit: Vec<[f32; 3]>,
}

impl OpaquePicture {
    /// Asks for what the ray through the middle of every pixel meets, by its direction.
    pub fn cast(
        camera: &Camera,
        size: [u32; 2],
        mut meet: impl FnMut(DVec3) -> Option<Surface>,
    ) -> Self {
        let (distance, radiance, sunlit) = Default::default();
        let mut result = Self { size, distance, radiance, sunlit };
        let nothing =
            Surface { distance: f64::from(NOTHING), radiance: DVec3::ZERO, sunlit: DVec3::ZERO };
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        for pixel in pixels {
            let surface = meet(Self::ray_through(camera, size, pixel)).unwrap_or(nothing);
            result.distance.push(surface.distance as f32);
            result.radiance.push(surface.radiance.as_vec3().to_array());
            result.sunlit.push(surface.sunlit.as_vec3().to_array());
        }
        result
    }

    /// Direction of the ray through the middle of a pixel, counted row by row.
    pub fn ray(camera: &Camera, size: [u32; 2], pixel: u32) -> DVec3 {
        Self::ray_through(camera, size, [pixel % size[0], pixel / size[0]])
    }

    fn ray_through(camera: &Camera, size: [u32; 2], pixel: [u32; 2]) -> DVec3 {
        let [width, height] = size.map(f64::from);
        let [x, y] = pixel.map(|v| f64::from(v) + 0.5);
        camera.ray(x / width, y / height, width / height)
    }

    /// What a pixel's ray meets.
    pub fn surface(&self, pixel: usize) -> Option<Surface> {
        let distance = *self.distance.get(pixel)?;
        let colour = |of: &[[f32; 3]]| {
            DVec3::from_array(of.get(pixel).copied().unwrap_or_default().map(f64::from))
        };
        (0.0..NOTHING).contains(&distance).then(|| Surface {
            distance: f64::from(distance),
            radiance: colour(&self.radiance),
            sunlit: colour(&self.sunlit),
        })
    }

    /// Its textures on a device; see [`Opaque::revision`]. Refused where it does not hold as many pixels as its size says.
    pub fn upload(&self, gpu: &Gpu, revision: u64) -> Result<Opaque> {
        let most = gpu.device.limits().max_texture_dimension_2d;
        let [width, height] = self.size;
        let wanted = width as usize * height as usize;
        let found = [self.distance.len(), self.radiance.len(), self.sunlit.len()];
        let is_right = self.size.iter().all(|side| (1..=most).contains(side));
        if !is_right || found != [wanted; 3] {
            let message = format!(
                "expected 1 to {most} pixels a side and a distance, radiance and sunlit of each, found {width}x{height} \
                 and {found:?}"
            );
            return Err(Error::input("opaque", message));
        }
        let texture = |label, format, bytes: &[u8]| {
            let [width, height] = self.size;
            let descriptor = wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            };
            let order = wgpu::util::TextureDataOrder::LayerMajor;
            let texture =
                gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, bytes);
            texture.create_view(&Default::default())
        };
        let colour = |label, of: &[[f32; 3]]| {
            let texels: Vec<[f32; 4]> = of.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]).collect();
            let format = wgpu::TextureFormat::Rgba32Float;
            texture(label, format, bytemuck::cast_slice(&texels))
        };
        let metres = wgpu::TextureFormat::R32Float;
        Ok(Opaque {
            depth: texture("opaque depth", metres, bytemuck::cast_slice(&self.distance)),
            kind: DepthKind::Distance,
            radiance: colour("opaque radiance", &self.radiance),
            sunlit: Some(colour("opaque in sunlight", &self.sunlit)),
            revision,
        })
    }
}
