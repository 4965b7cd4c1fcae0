//! The tone map: twin of `shaders/frame/tonemap.wgsl`.

use glam::{DMat3, DVec3};

use super::noise::{hash, hash_combine, unit_float};

/// Greatest exposed radiance: f16's, far in the shoulder of the curve.
const MOST: f64 = 65504.0;

/// Stephen Hill's fit (2016) of the ACES reference rendering and sRGB output transforms, 0 to 1.
pub fn aces(linear: DVec3) -> DVec3 {
    let input = DMat3::from_cols_array(&[
        0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777,
    ]);
    let output = DMat3::from_cols_array(&[
        1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602,
    ]);
    let v = input * linear;
    let a = v * (v + 0.0245786) - 0.000090537;
    let b = v * (0.983729 * v + 0.4329510) + 0.238081;
    (output * (a / b)).clamp(DVec3::ZERO, DVec3::ONE)
}

/// The sRGB transfer function, IEC 61966-2-1.
pub fn srgb(linear: f64) -> f64 {
    if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Display values, 0 to 1, of exposed radiance, without dither.
pub fn display(linear: DVec3) -> DVec3 {
    let shown = aces(linear.clamp(DVec3::ZERO, DVec3::splat(MOST)));
    DVec3::new(srgb(shown.x), srgb(shown.y), srgb(shown.z))
}

/// What is added to the display values of a pixel: triangular, up to one 8-bit step either way.
pub fn dither(x: u32, y: u32) -> f64 {
    let h = hash_combine(hash_combine(0, x), y);
    (f64::from(unit_float(h)) + f64::from(unit_float(hash(h))) - 1.0) / 255.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two values in 0..1 add up to a triangle of mean 0 and variance 1/6.
    #[test]
    fn dither_is_triangular_and_at_most_one_step() {
        let (mut sum, mut squares, side) = (0.0, 0.0, 256_u32);
        for i in 0..side * side {
            let d = 255.0 * dither(i % side, i / side);
            assert!(d.abs() <= 1.0, "{d}");
            sum += d;
            squares += d * d;
        }
        let count = f64::from(side * side);
        // Four standard errors: sqrt(1/6 / count) of the mean, about the same of the variance.
        let slack = 4.0 * (1.0 / 6.0 / count).sqrt();
        assert!((sum / count).abs() < slack, "{}", sum / count);
        assert!((squares / count - 1.0 / 6.0).abs() < slack, "{}", squares / count);
    }

    #[test]
    fn brighter_is_never_darker() {
        let mut last = DVec3::splat(-1.0);
        for i in 0..=1000 {
            let grey = 10.0_f64.powf(-5.0 + 0.01 * f64::from(i));
            let shown = display(DVec3::splat(grey));
            assert!(shown.cmpge(last).all(), "{grey}: {shown} after {last}");
            last = shown;
        }
        assert_eq!(display(DVec3::ZERO), DVec3::ZERO);
        assert!(last.min_element() > 0.99, "{last}");
        assert!(display(DVec3::splat(f64::INFINITY)).is_finite());
    }

    /// Values of the standard's own formula, worked out by hand.
    #[test]
    fn srgb_is_the_standards() {
        for (linear, expected) in [(0.0, 0.0), (0.5, 0.735357), (0.002, 0.02584), (1.0, 1.0)] {
            assert!((srgb(linear) - expected).abs() < 1e-6, "{linear}: {}", srgb(linear));
        }
    }
}
