//! What is on the device, copied back to the host. Stalls: for tests, statistics and output.

use bytemuck::Pod;

use super::Gpu;
use crate::error::{Error, Result};

/// Largest copy of a texture at a time, bytes: a quarter of the buffer that every device can
/// make, so that pictures of any size fit.
const BAND_BYTES: u64 = 64 << 20;

impl Gpu {
    /// Copies the first `count` values of a buffer back.
    pub fn read_buffer<T: Pod>(&self, buffer: &wgpu::Buffer, count: usize) -> Result<Vec<T>> {
        let bytes = (count * size_of::<T>()) as u64;
        if bytes == 0 {
            return Ok(Vec::new());
        }
        let copied = bytes.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
        let staging = self.staging(copied);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, copied);
        self.queue.submit([encoder.finish()]);
        let mut values = room(count)?;
        self.mapped(&staging, |mapped| {
            let words = mapped[..bytes as usize].chunks_exact(size_of::<T>());
            values.extend(words.map(bytemuck::pod_read_unaligned::<T>));
        })?;
        Ok(values)
    }

    /// Copies a texture back, `T` being one of its texels, layer by layer, row by row from the top.
    pub fn read_texture<T: Pod>(&self, texture: &wgpu::Texture) -> Result<Vec<T>> {
        let (width, height) = (texture.width(), texture.height());
        let row = width as usize * size_of::<T>();
        let padded = (row as u32).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let most_rows = (BAND_BYTES / u64::from(padded)).clamp(1, u64::from(height)) as u32;
        let staging = self.staging(u64::from(padded) * u64::from(most_rows));
        let layers = texture.depth_or_array_layers();
        let mut texels = room(width as usize * height as usize * layers as usize)?;
        let bands = (0..height).step_by(most_rows as usize);
        for (layer, top) in (0..layers).flat_map(|layer| bands.clone().map(move |top| (layer, top)))
        {
            let rows = most_rows.min(height - top);
            let mut from = texture.as_image_copy();
            (from.origin.y, from.origin.z) = (top, layer);
            let to = wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded),
                    rows_per_image: None,
                },
            };
            let size = wgpu::Extent3d { width, height: rows, depth_or_array_layers: 1 };
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encoder.copy_texture_to_buffer(from, to, size);
            self.queue.submit([encoder.finish()]);
            self.mapped(&staging, |mapped| {
                for line in mapped.chunks_exact(padded as usize).take(rows as usize) {
                    let values = line[..row].chunks_exact(size_of::<T>());
                    texels.extend(values.map(bytemuck::pod_read_unaligned::<T>));
                }
            })?;
            staging.unmap();
        }
        Ok(texels)
    }

    fn staging(&self, size: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        })
    }

    /// Waits for the device and lets `read` look at the buffer.
    fn mapped<R>(&self, staging: &wgpu::Buffer, read: impl FnOnce(&[u8]) -> R) -> Result<R> {
        let failed = |e: String| Error::Gpu(format!("reading back a buffer: {e}"));
        let slice = staging.slice(..);
        let (send, receive) = std::sync::mpsc::channel();
        slice.map_async(wgpu::MapMode::Read, move |r| {
            // The receiver only goes away with this function.
            let _ = send.send(r);
        });
        self.wait()?;
        receive.recv().map_err(|e| failed(e.to_string()))?.map_err(|e| failed(e.to_string()))?;
        let view = slice.get_mapped_range().map_err(|e| failed(e.to_string()))?;
        Ok(read(&view))
    }
}

/// Memory for so many values: a picture may have gigabytes, and their lack must not end the program.
fn room<T>(count: usize) -> Result<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).map_err(|_| {
        let bytes = count.saturating_mul(size_of::<T>());
        Error::Failed(format!("not enough memory to read back {bytes} bytes"))
    })?;
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a width that needs padding, more of them than fit into one copy.
    #[test]
    fn a_texture_of_several_bands_comes_back_as_it_was() {
        let gpu = Gpu::headless().expect("an adapter");
        let (width, height) = (2051_u32, 2100_u32);
        assert!(u64::from(width) * u64::from(height) * 16 > BAND_BYTES);
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let texels: Vec<[f32; 4]> =
            (0..width * height).map(|i| [i as f32, (i / width) as f32, 0.5, 1.0]).collect();
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(width * 16),
            rows_per_image: None,
        };
        let bytes = bytemuck::cast_slice(&texels);
        gpu.queue.write_texture(texture.as_image_copy(), bytes, layout, size);
        let read = gpu.read_texture::<[f32; 4]>(&texture).expect("read back");
        assert!(read == texels, "{} texels", read.len());
    }
}
