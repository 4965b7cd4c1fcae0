//! Real-time volumetric clouds from precomputed particle tables, on wgpu.

pub mod error;
pub mod gpu;
pub mod medium;

pub use error::{Error, Result};
