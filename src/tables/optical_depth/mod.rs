//! How much of a noise shape's matter lies on a chord of the unit sphere, and where on it.
//!
//! A table answers with the mean densities of the [`PARTS`] thirds of any chord: their mean is the
//! mean density of the chord (it stays bounded where the chord shrinks; the optical depth is
//! extinction x length x mean density), their shares place the matter along it.
//!
//! Choices, all measured with `precompute compare` (figures in the README):
//! - [`mapping`]: lines stored once, more nodes for place than for direction;
//! - [`fit`]: least squares to random chords, weighted by what an error does to the transmittance;
//! - [`encoding`]: square roots in 10 bits each, one texel of 4 bytes for all three. Thin parts,
//!   where transmittance is sensitive, get the finer steps and the straighter curves.

pub mod bake;
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

/// Parts of a chord whose mean densities a texel holds.
pub const PARTS: usize = 3;
