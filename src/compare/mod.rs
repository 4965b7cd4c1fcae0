//! How far two pictures are apart: numbers, and a picture of the differences.

pub mod error_image;
mod errors;
pub mod flip;
mod picture;

pub(crate) use errors::LUMINANCE;
pub use errors::{Differences, Report, compare};
pub use picture::{Kind, Measured};
