//! Buffers of plain values.

use bytemuck::Pod;

use super::Gpu;

/// A storage buffer for `count` values of `stride` bytes, readable and writable by copies too.
/// Never empty: an empty binding is not allowed.
pub fn storage(gpu: &Gpu, label: &str, count: usize, stride: usize) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: (count.max(1) * stride).next_multiple_of(4) as u64,
        usage: wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_DST
            | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    })
}

/// A storage buffer with these values.
pub fn storage_with<T: Pod>(gpu: &Gpu, label: &str, values: &[T]) -> wgpu::Buffer {
    let buffer = storage(gpu, label, values.len(), size_of::<T>());
    if !values.is_empty() {
        gpu.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(values));
    }
    buffer
}

/// A uniform buffer with this value. Written by the queue: a buffer that is mapped at its creation cannot
/// be made, and `wgpu::util` panics, where the device is lost.
pub fn uniform<T: Pod>(gpu: &Gpu, label: &str, value: &T) -> wgpu::Buffer {
    let contents = bytemuck::bytes_of(value);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: contents.len() as u64,
        usage: wgpu::BufferUsages::UNIFORM
            | wgpu::BufferUsages::COPY_DST
            | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, contents);
    buffer
}
