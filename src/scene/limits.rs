//! The range of every number in a scene.
//!
//! The limits are wide: they keep what is plainly a mistake out, and numbers whose products would
//! overflow the 32-bit floats of the graphics device (about 3e38).

use crate::frame::gpu_data::FIELD_SLOTS;

/// Numbers that are accepted, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least.
    pub least: f64,
    /// The greatest.
    pub most: f64,
    /// The unit, for messages; empty for a pure number.
    pub unit: &'static str,
}

const fn range(least: f64, most: f64, unit: &'static str) -> Range {
    Range { least, most, unit }
}

/// A coordinate: up to ten times what the precision tests ask for (1e10 m from the origin).
pub const COORDINATE: Range = range(-1e11, 1e11, "m");
/// Horizontal field of view of a flat picture, which reaches 180 degrees only at infinite width.
pub const FIELD_OF_VIEW: Range = range(1.0, 179.0, "degrees");
/// Diameter of a lens: wider ones see round mountains.
pub const APERTURE: Range = range(0.0, 1e4, "m");
/// Distance of what a lens shows sharp.
pub const FOCUS: Range = range(1e-3, 1e12, "m");
/// Time that a shutter is open: eleven days.
pub const SHUTTER: Range = range(0.0, 1e6, "s");
/// A component of a direction of any length.
pub const DIRECTION: Range = range(-f64::MAX, f64::MAX, "");
/// The sun's irradiance, and a radiance, in the scene's own unit.
pub const IRRADIANCE: Range = range(0.0, 1e6, "");
/// The sun's angular diameter: a point would have infinite radiance.
pub const ANGULAR_DIAMETER: Range = range(0.01, 20.0, "degrees");
/// A reflected or scattered share.
pub const ALBEDO: Range = range(0.0, 1.0, "");
/// Speed of the wind over a sea: Cox and Munk measured up to 14 m/s; beyond, the slopes' mean square is carried on in proportion.
pub const WIND_SPEED: Range = range(0.0, 60.0, "m/s");
/// Radius of a particle.
pub const RADIUS: Range = range(1e-3, 1e6, "m");
/// Extinction at density 1.
pub const EXTINCTION: Range = range(0.0, 1e6, "1/m");
/// Exposure: a factor of 16 million up or down.
pub const EXPOSURE: Range = range(-24.0, 24.0, "EV");
/// Altitude of the cloud base: from fog to the tropopause in the tropics.
pub const CLOUD_BASE: Range = range(0.0, 20_000.0, "m");
/// Height of the tallest cloud.
pub const CLOUD_THICKNESS: Range = range(1.0, 20_000.0, "m");
/// Share of the sky that is covered.
pub const COVERAGE: Range = range(0.0, 1.0, "");
/// What a weather map spans: from a few cells to the Earth around.
pub const WEATHER_EXTENT: Range = range(10.0, 1e8, "m");
/// A share of something.
pub const SHARE: Range = range(0.0, 1.0, "");
/// Wavelength of the coverage noise: from a street to a continent.
pub const FEATURE_SIZE: Range = range(10.0, 1e6, "m");
/// Side of a cell of the innermost ring.
pub const CELL_SIZE: Range = range(1.0, 1e5, "m");
/// Radius of a particle in cells.
pub const PARTICLE_SIZE: Range = range(0.1, 4.0, "cells");
/// A component of the wind: twice the strongest jet stream.
pub const WIND: Range = range(-200.0, 200.0, "m/s");
/// Time in which clouds grow and vanish.
pub const EVOLUTION_TIME: Range = range(1.0, 1e9, "s");
/// Time of a picture: 300 years either way.
pub const TIME: Range = range(-1e10, 1e10, "s");

/// Time on a camera path, from its beginning.
pub const PATH_TIME: Range = range(0.0, 1e7, "s");
/// Between two keys of a path, s: the camera's speed stays far below what f64 holds.
pub const LEAST_KEY_STEP: f64 = 1e-4;
/// Keys of a path.
pub const MOST_PATH_KEYS: usize = 100_000;

/// Cells per side of a ring: even, so that the ring inside it takes a square of whole cells.
pub const CELLS: std::ops::RangeInclusive<u32> = 2..=512;
/// Number of rings: what the frame's uniforms have room for; the cells of the outermost are 2^7
/// times as wide as the innermost.
pub const RINGS: std::ops::RangeInclusive<u32> = 1..=FIELD_SLOTS as u32;
/// Shapes that one field can name, for the same reason.
pub const MOST_FIELD_SHAPES: usize = FIELD_SLOTS;
/// Pixels a side of a weather map: 64 MiB of texels, half of what WebGPU lets one buffer have.
pub const MOST_MAP_SIDE: u32 = 4096;
/// Size of a weather map's file, bytes: more than such an image takes with four channels of 16 bits.
pub const MOST_MAP_BYTES: u64 = 256 << 20;
/// Colours of a weather map.
pub const MAP_CHANNELS: std::ops::RangeInclusive<usize> = 1..=3;
/// Particles stacked in a cell.
pub const LAYERS: std::ops::RangeInclusive<u32> = 1..=64;
/// Cells of all rings times layers: what a device of 2 GiB holds.
pub const MOST_SLOTS: u64 = 4 << 20;
/// Listed particles.
pub const MOST_PARTICLES: usize = 2_000_000;
