//! Texels: the square root of a chord's mean density, and the fractions of its length where the
//! matter begins and ends, 10 bits each, in the layout of `Rgb10a2Unorm` (in this order from the
//! lowest bits on, the two highest bits 0).
//!
//! An error of density matters by `exp(-tau) dtau`, so least where there is most; the square root
//! puts steps and straightness where there is little. At equal bytes and central optical depth 10
//! the RMS error of transmittance is 0.7 of that of plain densities, at 50 it is 0.5. Ten bits add
//! 0.001 at central optical depth 10 before filtering averages it down.

use glam::Vec4;

use super::rays::Moments;

/// Name in table files.
pub const NAME: &str = "square root of the mean density, start and end of the matter, rgb10a2unorm";

/// Largest value of a channel.
const LARGEST: f32 = 1023.0;
/// Bits of a channel.
const BITS: u32 = 10;
/// Bits that no channel uses: they are 0 in a sound table.
pub(super) const UNUSED: u32 = 0xc000_0000;

/// What is stored and filtered of a chord.
pub(super) fn encode(density: &Moments) -> Vec4 {
    let [start, end] = extent(density);
    Vec4::new(density.mean.max(0.0).sqrt(), start, end, 0.0)
}

/// Where a smooth step with the moments of the density begins and ends, cut off at the ends of the
/// chord. The density `6 x (1 - x)` of a smooth step over a length w has the variance w^2 / 20.
fn extent(density: &Moments) -> [f32; 2] {
    let half = (5.0 * density.variance).sqrt();
    [(density.centre - half).max(0.0), (density.centre + half).min(1.0)]
}

/// Rounds channels to a texel.
pub(super) fn pack(channels: Vec4) -> u32 {
    let bits = |c: f32| (c.clamp(0.0, 1.0) * LARGEST).round() as u32;
    let [a, b, c, _] = channels.to_array();
    bits(a) | bits(b) << BITS | bits(c) << (2 * BITS)
}

/// The channels of a texel, as a texture gives them.
pub(super) fn unpack(texel: u32) -> Vec4 {
    let channel = |i: u32| (texel >> (BITS * i) & 0x3ff) as f32 / LARGEST;
    Vec4::new(channel(0), channel(1), channel(2), 0.0)
}
