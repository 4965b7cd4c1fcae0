//! Adapter, device and queue, within WebGPU's default limits.

use crate::error::{Error, Result};

/// One graphics device with its queue. Cheap to clone: wgpu's handles are counted references.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The adapter the device was made from.
    pub adapter: wgpu::Adapter,
    /// The device.
    pub device: wgpu::Device,
    /// Its only queue.
    pub queue: wgpu::Queue,
}

impl Gpu {
    /// A device without a surface, for rendering to files and for tests.
    pub fn headless() -> Result<Self> {
        // OpenGL has no compute limits worth the name; looking for it costs start-up time and
        // prints errors where there is no display.
        let descriptor = wgpu::InstanceDescriptor {
            backends: wgpu::Backends::PRIMARY,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        };
        let instance = wgpu::Instance::new(descriptor.with_env());
        Self::from_instance(&instance, None)
    }

    /// A device that can present to `surface`, or any device where there is none.
    pub fn from_instance(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Self> {
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: surface,
            ..Default::default()
        }))
        .map_err(|e| {
            Error::NoAdapter(format!(
                "{e}; on Debian or Ubuntu without a GPU install mesa-vulkan-drivers and libvulkan1"
            ))
        })?;
        // Timestamps are the only optional feature in use: frames are the same without them.
        let wanted =
            wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("cumuli"),
            required_features: adapter.features() & wanted,
            required_limits: wgpu::Limits::default(),
            ..Default::default()
        }))
        .map_err(|e| Error::Gpu(format!("{e}")))?;
        Ok(Self { adapter, device, queue })
    }

    /// Waits until everything submitted so far has run.
    pub fn wait(&self) -> Result<()> {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map(|_| ())
            .map_err(|e| Error::Gpu(format!("{e}")))
    }

    /// Copies a buffer back to the host as plain values. Stalls: for tests, statistics and output.
    pub fn read_buffer<T: bytemuck::Pod>(
        &self,
        buffer: &wgpu::Buffer,
        count: usize,
    ) -> Result<Vec<T>> {
        let bytes = (count * size_of::<T>()) as u64;
        if bytes == 0 {
            return Ok(Vec::new());
        }
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: bytes.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes.next_multiple_of(4));
        self.queue.submit([encoder.finish()]);
        let slice = staging.slice(..);
        let (send, receive) = std::sync::mpsc::channel();
        slice.map_async(wgpu::MapMode::Read, move |r| {
            // The receiver only goes away with this function.
            let _ = send.send(r);
        });
        self.wait()?;
        match receive.recv() {
            Ok(Ok(())) => {}
            Ok(Err(e)) => return Err(Error::Gpu(format!("reading back a buffer: {e}"))),
            Err(e) => return Err(Error::Gpu(format!("reading back a buffer: {e}"))),
        }
        let view = slice
            .get_mapped_range()
            .map_err(|e| Error::Gpu(format!("reading back a buffer: {e}")))?;
        Ok(bytemuck::pod_collect_to_vec(&view[..bytes as usize]))
    }
}
