//! Adapter, device and queue, within WebGPU's default limits.

use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

use super::pipelines::Pipelines;
use super::watch::Watch;
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
    failure: Failure,
    watch: Option<Watch>,
    compiled: Arc<AtomicU32>,
    pipelines: Option<Pipelines>,
}

/// The first error that wgpu reported outside of a call's result: out of memory, a lost device, a
/// command that it refused.
type Failure = Arc<Mutex<Option<String>>>;

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
            tracing::debug!("{e}");
            Error::NoAdapter(
                "expected a working Vulkan, Metal or Direct3D 12 driver; on Debian or Ubuntu \
                 without a graphics card install mesa-vulkan-drivers and libvulkan1"
                    .to_owned(),
            )
        })?;
        // The only optional features in use: frames are the same without them.
        let wanted = wgpu::Features::TIMESTAMP_QUERY
            | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS
            | wgpu::Features::PIPELINE_CACHE;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("cumuli"),
            required_features: adapter.features() & wanted,
            required_limits: wgpu::Limits::default(),
            ..Default::default()
        }))
        .map_err(|e| Error::Gpu(format!("{e}")))?;
        let failure = Failure::default();
        let note = failure.clone();
        // Without a handler wgpu ends the program.
        device.on_uncaptured_error(Arc::new(move |e| keep_first(&note, one_line(&e))));
        let note = failure.clone();
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                keep_first(&note, format!("the device was lost: {message}"));
            }
        });
        let compiled = Arc::default();
        Ok(Self { adapter, device, queue, failure, watch: None, compiled, pipelines: None })
    }

    /// The same device, but its kernels note what they are bound to, for checks of every value.
    pub fn watched(self) -> Self {
        Self { watch: Some(Watch::default()), ..self }
    }

    /// The same device, but it begins with the pipelines that an earlier run has kept in this folder, where
    /// the adapter can take them.
    pub fn keeping_pipelines(self, folder: &Path) -> Self {
        let pipelines = Pipelines::open(&self, folder);
        Self { pipelines, ..self }
    }

    /// The pipelines of earlier runs.
    pub(super) fn pipelines(&self) -> Option<&Pipelines> {
        self.pipelines.as_ref()
    }

    /// Keeps the pipelines that were made so far for the next run, where that was asked for.
    pub fn keep_pipelines(&self) {
        if let Some(pipelines) = &self.pipelines {
            pipelines.keep();
        }
    }

    /// What the kernels are bound to, where that is noted.
    pub fn watch(&self) -> Option<&Watch> {
        self.watch.as_ref()
    }

    /// What is bound from now on belongs to this part of a renderer, and replaces what the part
    /// bound before.
    pub fn begin_part(&self, part: &'static str) {
        if let Some(watch) = &self.watch {
            watch.begin(part);
        }
    }

    /// Forgets all bindings: a new renderer begins.
    pub fn forget_parts(&self) {
        if let Some(watch) = &self.watch {
            watch.clear();
        }
    }

    /// Notes that a shader was compiled, for those who wait.
    pub(super) fn note_compiled(&self) {
        self.compiled.fetch_add(1, Ordering::Relaxed);
    }

    /// Shaders that were compiled on this device so far.
    pub fn compiled(&self) -> u32 {
        self.compiled.load(Ordering::Relaxed)
    }

    /// Loses the device, as a driver that is reset does: whoever uses it next gets an error.
    pub fn lose(&self) {
        self.device.destroy();
        keep_first(&self.failure, "the device was lost: it was destroyed".to_owned());
    }

    /// Whether the adapter is a program on the processor, as Mesa's lavapipe.
    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Waits until everything submitted so far has run, and tells what failed on the way.
    pub fn wait(&self) -> Result<()> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        polled.map(|_| ()).map_err(|e| Error::Gpu(format!("{e}")))
    }

    /// Tells what has failed since the device was made. What was computed since is of no use.
    pub fn check(&self) -> Result<()> {
        let failure = self.failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        failure.as_ref().map_or(Ok(()), |message| Err(Error::Gpu(message.clone())))
    }
}

fn keep_first(failure: &Failure, message: String) {
    let mut first = failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    first.get_or_insert(message);
}

/// An error with its causes on one line.
fn one_line(error: &wgpu::Error) -> String {
    let text = error.to_string();
    let parts = text.lines().map(str::trim).filter(|line| !line.is_empty());
    parts.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_device_refuses_is_an_error_and_no_panic() {
        let gpu = Gpu::headless().expect("an adapter");
        gpu.check().expect("a fresh device");
        let beyond = gpu.device.limits().max_buffer_size + 4;
        for label in ["first", "second"] {
            let _ = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: beyond,
                usage: wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
        }
        let message = gpu.wait().expect_err("a buffer beyond the limits").to_string();
        assert!(message.contains("first") && message.contains("maximum buffer size"), "{message}");
        assert!(!message.contains('\n'), "{message}");
    }
}
