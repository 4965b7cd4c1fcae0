//! Values on the command line.

use std::fmt::{Display, Formatter};
use std::str::FromStr;

use crate::scene::limits::{self, Range};

/// Longest side of a picture, pixels: the largest 2D texture within WebGPU's default limits,
/// which are all a device is asked for. A test compares the two.
pub const MAX_SIDE: u32 = 8192;

/// Width and height of a picture, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size(pub [u32; 2]);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let bad =
            || format!("expected WIDTHxHEIGHT, each from 1 to {MAX_SIDE} pixels, found `{text}`");
        let (width, height) = text.split_once(['x', 'X']).ok_or_else(bad)?;
        let side = |text: &str| match text.parse() {
            Ok(side @ 1..=MAX_SIDE) => Ok(side),
            _ => Err(bad()),
        };
        Ok(Self([side(width)?, side(height)?]))
    }
}

impl Display for Size {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.0[0], self.0[1])
    }
}

/// Frames per second of a sequence: from a time lapse to slow motion.
const FPS: Range = Range { least: 1e-6, most: 1e6, unit: "" };

/// Seconds of the scene's time.
pub(super) fn time(text: &str) -> Result<f64, String> {
    number(text, &limits::TIME, "seconds")
}

/// Frames per second of the scene's time.
pub(super) fn fps(text: &str) -> Result<f64, String> {
    number(text, &FPS, "frames per second")
}

/// Optical depth of a slab.
pub(super) fn optical_depth(text: &str) -> Result<f64, String> {
    number(text, &Range { least: 0.0, most: 1e6, unit: "" }, "an optical depth")
}

/// A share from 0 to 1.
pub(super) fn share(text: &str) -> Result<f64, String> {
    number(text, &Range { least: 0.0, most: 1.0, unit: "" }, "a number")
}

/// A standard error over the value.
pub(super) fn noise(text: &str) -> Result<f64, String> {
    number(text, &Range { least: 1e-4, most: 1.0, unit: "" }, "a number")
}

/// The cosine of an angle from the zenith, of something above the horizon.
pub(super) fn cosine(text: &str) -> Result<f64, String> {
    number(text, &Range { least: 1e-6, most: 1.0, unit: "" }, "a cosine")
}

/// A number of random samples.
pub(super) fn samples(text: &str) -> Result<u64, String> {
    match text.parse() {
        Ok(samples @ 1..=1_000_000_000_000) => Ok(samples),
        _ => Err(format!("expected a whole number from 1 to 1e12, found `{text}`")),
    }
}

/// Paths a pixel.
pub(super) fn samples_a_pixel(text: &str) -> Result<u32, String> {
    whole(text, 1_000_000_000)
}

/// A number of frames.
pub(super) fn frame_count(text: &str) -> Result<u32, String> {
    whole(text, 1_000_000)
}

/// Threads.
pub(super) fn threads(text: &str) -> Result<usize, String> {
    whole(text, 4096).map(|n| n as usize)
}

fn whole(text: &str, most: u32) -> Result<u32, String> {
    match text.parse() {
        Ok(n) if (1..=most).contains(&n) => Ok(n),
        _ => Err(format!("expected a whole number from 1 to {most}, found `{text}`")),
    }
}

/// Diameter of a lens, m.
pub(super) fn aperture(text: &str) -> Result<f64, String> {
    number(text, &limits::APERTURE, "metres")
}

/// Distance of what is sharp, m.
pub(super) fn focus(text: &str) -> Result<f64, String> {
    number(text, &limits::FOCUS, "metres")
}

/// Exposure, EV.
pub(super) fn exposure(text: &str) -> Result<f64, String> {
    number(text, &limits::EXPOSURE, "an exposure")
}

/// A number of standard errors.
pub(super) fn z_score(text: &str) -> Result<f64, String> {
    number(text, &Range { least: 0.0, most: 1e6, unit: "" }, "a number")
}

/// Time between two events, s.
pub(super) fn interval(text: &str) -> Result<f64, String> {
    number(text, &Range { least: 0.0, most: 1e9, unit: "" }, "seconds")
}

/// Time that a shutter is open, s.
pub(super) fn shutter(text: &str) -> Result<f64, String> {
    number(text, &limits::SHUTTER, "seconds")
}

fn number(text: &str, range: &Range, what: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= range.least && value <= range.most => Ok(value),
        _ => Err(format!(
            "expected {what} from {:e} to {:e}, found `{text}`",
            range.least, range.most
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_refused() {
        assert_eq!("1280x720".parse(), Ok(Size([1280, 720])));
        assert_eq!("1X8192".parse(), Ok(Size([1, 8192])));
        for bad in [
            "",
            "x",
            "0x1",
            "1x0",
            "8193x1",
            "-1x5",
            "1.5x2",
            "1280",
            "1x2x3",
            "99999999999x1",
            " 1x1",
        ] {
            let message = bad.parse::<Size>().expect_err(bad);
            assert!(message.contains("8192"), "{message}");
        }
        assert_eq!(MAX_SIDE, wgpu::Limits::default().max_texture_dimension_2d);
    }

    #[test]
    fn times_are_finite() {
        assert_eq!(time("-12.5"), Ok(-12.5));
        assert_eq!(fps("0.25"), Ok(0.25));
        for bad in ["nan", "inf", "-inf", "1e11", "", "x", "1e999"] {
            assert!(time(bad).is_err(), "{bad}");
        }
        for bad in ["0", "-1", "nan", "inf"] {
            assert!(fps(bad).is_err(), "{bad}");
        }
    }
}
