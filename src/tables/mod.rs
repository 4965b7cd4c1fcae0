//! Lookup tables: everything about one particle that is expensive, computed once.

mod cache;
mod defaults;
pub mod description;
mod file;
pub mod fingerprint;
mod gpu;
mod header;
pub mod optical_depth;
mod parts;
pub mod progress;
pub mod rays;
pub mod sample;
pub mod scattering;
mod set;
mod summary;

pub use defaults::{default_media, default_shapes};
pub use gpu::{OpticalDepthParams, TablesGpu};
pub use progress::{Progress, Silent};
pub use scattering::{Precision, ScatteringOptions, ScatteringTable};
pub use set::{BakeOptions, TableSet};
