//! Lookup tables: everything about one particle that is expensive, computed once.

mod defaults;
pub mod description;
mod file;
pub mod fingerprint;
mod gpu;
pub mod optical_depth;
pub mod progress;
pub mod scattering;
mod set;
mod summary;

pub use defaults::default_shapes;
pub use gpu::{OpticalDepthParams, TablesGpu};
pub use progress::{Progress, Silent};
pub use set::TableSet;
