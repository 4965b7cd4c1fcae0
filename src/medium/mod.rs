//! What a particle is made of: how it scatters light, and where inside the unit sphere it is.

pub mod phase;
pub mod shape;

pub use phase::{Phase, PhaseParams, PreparedPhase};
pub use shape::{Shape, ShapeKind, ShapeSpec, VOLUME_CELL};
