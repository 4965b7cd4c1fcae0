//! What a particle is made of: how it scatters light, and where inside the unit sphere it is.

mod bricks;
pub mod halo;
pub mod phase;
pub mod sea;
pub mod shape;
mod truncation;

pub use halo::Halo;
pub use phase::{Phase, PhaseParams, PreparedPhase};
pub use sea::{Sea, fresnel};
pub use shape::{Shape, ShapeKind, ShapeSpec, VOLUME_CELL};
pub use truncation::Truncation;
