//! How much of a noise shape's matter lies on a chord of the unit sphere, and where on it.
//!
//! A table answers for any chord with its mean density (which stays bounded where the chord
//! shrinks; the optical depth is extinction x length x mean density) and with how the matter is
//! spread on it. It holds two things: the shape's density volume, through which the chords that the
//! eye sees are marched, and a 4D table that answers for lines of light with two fetches. To take
//! the table for small particles too saved nothing: on a device without branches both ways run.
//!
//! Choices, all measured; `precompute compare` shows the figures:
//! - [`lookup`]: a march of 21 steps has a seventh of the 4D table's error at a quarter of its bytes,
//!   and an eighth on parts of chords, for six times the time of the fetches (53 and 8 ns a chord on
//!   two idle cores of lavapipe; half-float volumes take 2.5 ns a fetch, bytes 3.1, bytes of eight
//!   corners packed in a storage buffer 2.3);
//! - [`mapping`]: lines stored once, more nodes for place than for direction;
//! - [`fit`]: least squares to random chords, weighted by what an error does to the transmittance;
//! - [`encoding`]: the square root of the mean density, in 10 bits like the two places. Thin
//!   chords, where transmittance is sensitive, get the finer steps and the straighter curves;
//! - [`volume`]: filtered copies of the density, for distant particles;
//! - [`chord_lookups`]: what each way costs on a device.
//!
//! Tried without success, at central optical depth 10 and equal bytes. Interpolating between
//! directions along the line through the middle of a chord's matter in place of the middle of the
//! chord (parallax-corrected, with the exact middle): 0.022 in place of 0.026, for twice the
//! fetches and one more. Leaving out the finest one, two or three octaves of noise: nothing, since
//! the 4D table's error comes from the large bulges, whose outlines move with the direction.
//! Blurred or coarser density volumes: a march of 16 steps through 48^3 nodes blurred by half a
//! cell 0.034, in place of 0.007. Steps of equal length in place of equal number: 0.019 with 11 on
//! average in place of 0.013 with 12, since short chords at the rim are those that let light
//! through.

pub mod alternatives;
pub mod bake;
pub mod chord_lookups;
pub mod compare;
#[cfg(test)]
mod distant_tests;
pub mod encoding;
pub mod fit;
pub mod grid;
pub mod lookup;
pub mod mapping;
pub mod measure;
#[cfg(test)]
mod precision_tests;
pub mod random;
pub mod rays;
mod table;
#[cfg(test)]
mod twin_tests;
pub mod volume;

pub use bake::OpticalDepthOptions;
pub use grid::Grid;
pub use lookup::{ChordProfile, ChordStep};
pub use measure::OpticalDepthErrors;
pub use table::OpticalDepthTable;
