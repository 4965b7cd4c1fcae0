//! The graphics device, and shaders composed from modules.

mod context;
mod shaders;

pub use context::Gpu;
pub use shaders::ShaderLibrary;
