//! The graphics device, and shaders composed from modules.

pub mod buffers;
mod context;
mod kernel;
mod pipelines;
mod read_back;
mod shaders;
pub mod watch;

pub use context::Gpu;
pub use kernel::{Kernel, ShaderFile};
pub use shaders::ShaderLibrary;
