//! How much of a noise shape's matter lies on a chord of the unit sphere, and where on it.
//!
//! A table answers for any chord with its mean density (which stays bounded where the chord
//! shrinks; the optical depth is extinction x length x mean density) and with the place where the
//! matter begins and ends on it.
//!
//! Choices, all measured; `precompute compare` shows the figures of mapping and fit:
//! - [`mapping`]: lines stored once, more nodes for place than for direction;
//! - [`fit`]: least squares to random chords, weighted by what an error does to the transmittance;
//! - [`encoding`]: the square root of the mean density, in 10 bits like the two places. Thin
//!   chords, where transmittance is sensitive, get the finer steps and the straighter curves;
//! - [`lookup`]: a smooth step between the two places.

pub mod alternatives;
pub mod bake;
pub mod compare;
pub mod encoding;
pub mod fit;
pub mod grid;
pub mod lookup;
pub mod mapping;
pub mod measure;
pub mod random;
pub mod rays;
mod table;
#[cfg(test)]
mod twin_tests;

pub use bake::OpticalDepthOptions;
pub use grid::Grid;
pub use lookup::ChordProfile;
pub use measure::OpticalDepthErrors;
pub use table::OpticalDepthTable;
