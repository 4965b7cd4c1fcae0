//! Real-time volumetric clouds from precomputed particle tables, on wgpu.

pub mod bench;
pub mod cli;
pub mod compare;
pub mod error;
pub mod frame;
pub mod gpu;
pub mod medium;
pub mod output;
pub mod reference;
pub mod scene;
pub mod stress;
pub mod tables;
#[cfg(feature = "window")]
pub mod window;

pub use error::{Error, Result};
