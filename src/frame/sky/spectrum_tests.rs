//! The four wavelengths against the whole spectrum.

use glam::DMat3;

use super::*;

/// First wavelength of the tables, nm: the middle of the first band; each is 10 nm wide.
const FIRST: f64 = 365.0;
const BANDS: usize = 48;

/// Sunlight outside of the air, W/m2/nm, means of the bands: ASTM G173-03, extraterrestrial column.
const SUN: [f64; BANDS] = [
    1.11776, 1.14259, 1.01249, 1.14716, 1.72765, 1.73054, 1.6887, 1.61253, 1.91198, 2.03474,
    2.02042, 2.02212, 1.93377, 1.95809, 1.91686, 1.8298, 1.8685, 1.8931, 1.85149, 1.8504, 1.8341,
    1.8345, 1.8147, 1.78158, 1.7533, 1.6965, 1.68194, 1.64654, 1.6048, 1.52143, 1.55622, 1.5113,
    1.474, 1.4482, 1.41018, 1.36775, 1.34188, 1.31429, 1.28303, 1.26758, 1.2367, 1.2082, 1.18737,
    1.14683, 1.12362, 1.1058, 1.07124, 1.04992,
];

/// Cross section of ozone at 233 K, 1e-27 m2, means of the bands: University of Bremen (2011).
const OZONE: [f64; BANDS] = [
    1.18, 0.2182, 0.2818, 0.6636, 1.527, 2.763, 5.52, 8.451, 15.82, 23.16, 36.69, 49.24, 77.52,
    90.16, 148.0, 160.2, 213.9, 275.5, 309.1, 350.0, 426.6, 467.2, 439.8, 470.1, 501.9, 430.5,
    374.0, 321.5, 266.2, 223.8, 185.2, 147.3, 120.9, 94.23, 74.55, 65.66, 51.05, 41.5, 42.28,
    32.37, 24.51, 28.01, 25.34, 16.24, 14.65, 20.78, 13.83, 7.105,
];

/// CIE 1931 colour matching functions, Wyman, Sloan and Shirley's fit (2013).
fn matching(l: f64) -> DVec3 {
    let lobe = |centre: f64, below: f64, above: f64| {
        let t = (l - centre) / if l < centre { below } else { above };
        (-0.5 * t * t).exp()
    };
    DVec3::new(
        1.056 * lobe(599.8, 37.9, 31.0) + 0.362 * lobe(442.0, 16.0, 26.7)
            - 0.065 * lobe(501.1, 20.4, 26.2),
        0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1),
        1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8),
    )
}

fn wavelength(band: usize) -> f64 {
    FIRST + 10.0 * band as f64
}

/// Weights of the bands of light given per unit of sunlight; each channel sums to 1.
fn weights() -> Vec<DVec3> {
    // XYZ to linear sRGB (IEC 61966-2-1).
    let srgb = DMat3::from_cols(
        DVec3::new(3.2404542, -0.969266, 0.0556434),
        DVec3::new(-1.5371385, 1.8760108, -0.2040259),
        DVec3::new(-0.4985314, 0.041556, 1.0572252),
    );
    let raw: Vec<_> = (0..BANDS).map(|i| srgb * matching(wavelength(i)) * SUN[i]).collect();
    let sum: DVec3 = raw.iter().sum();
    raw.into_iter().map(|w| w / sum).collect()
}

/// Spectra that skies have, relative to sunlight.
fn family() -> Vec<[f64; BANDS]> {
    let mut all = Vec::new();
    for scattered in 0..3 {
        for air in [0.0, 0.3, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0] {
            for ozone in [0.0, 1.0, 3.0, 10.0] {
                for aerosol in [0.0, 1.0, 5.0] {
                    all.push(std::array::from_fn(|i| {
                        let l = wavelength(i);
                        let rayleigh = rayleigh_depth(l);
                        let depth = air * rayleigh
                            + ozone * OZONE_COLUMN * OZONE[i] * 1e-27
                            + aerosol * 0.052 * (l / 550.0).powf(-AEROSOL_EXPONENT);
                        (rayleigh / 0.1).powi(scattered) * (-depth).exp()
                    }));
                }
            }
        }
    }
    all
}

fn bands() -> [usize; 4] {
    WAVELENGTHS.map(|l| ((l - FIRST) / 10.0).round() as usize)
}

#[test]
fn colours_are_those_of_the_whole_spectrum() {
    let weights = weights();
    let (mut squares, mut count) = (0.0, 0.0);
    for spectrum in family() {
        let exact: DVec3 = spectrum.iter().zip(&weights).map(|(&s, &w)| s * w).sum();
        let four = DVec4::from_array(bands().map(|b| spectrum[b]));
        let error = (to_rgb(four) - exact) / exact.max_element();
        squares += error.length_squared();
        count += 3.0;
    }
    // 0.27 % is the best that four wavelengths on this grid do.
    let rms = f64::sqrt(squares / count);
    assert!(rms < 0.003, "{rms}");
    for row in TO_RGB {
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 2e-6);
    }
}

#[test]
fn the_matrix_is_the_best_fit() {
    // At the best fit the error is orthogonal to all that can still be changed: one wavelength's
    // weight against the last one's (the sum stays 1).
    let weights = weights();
    for channel in 0..3 {
        let mut slope = [0.0; 3];
        let mut size = [0.0; 3];
        for spectrum in family() {
            let exact: DVec3 = spectrum.iter().zip(&weights).map(|(&s, &w)| s * w).sum();
            let four = bands().map(|b| spectrum[b]);
            let scale = 1.0 / exact.max_element();
            let error = (to_rgb(DVec4::from_array(four)) - exact)[channel] * scale;
            for k in 0..3 {
                let change = (four[k] - four[3]) * scale;
                slope[k] += error * change;
                size[k] += change * change;
            }
        }
        for k in 0..3 {
            // How far a step along this weight alone would still go; the matrix has six decimals.
            assert!(
                (slope[k] / size[k]).abs() < 1e-5,
                "channel {channel}, {k}: {}",
                slope[k] / size[k]
            );
        }
    }
}

#[test]
fn ozone_is_that_of_the_table() {
    for (k, band) in bands().into_iter().enumerate() {
        assert!((OZONE_CROSS_SECTION[k] / (OZONE[band] * 1e-27) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn reflectances_have_their_colour() {
    for colour in [DVec3::splat(0.3), DVec3::new(0.09, 0.11, 0.06), DVec3::new(0.4, 0.3, 0.2)] {
        assert!((to_rgb(reflectance(colour)) - colour).abs().max_element() < 1e-5, "{colour}");
    }
    assert!((reflectance(DVec3::splat(0.3)) - DVec4::splat(0.3)).abs().max_element() < 1e-6);
    // What no reflectance can be is the nearest that one can.
    let loud = reflectance(DVec3::new(1.0, 0.0, 0.0));
    assert!(loud.min_element() >= 0.0 && loud.max_element() <= 1.0);
}
