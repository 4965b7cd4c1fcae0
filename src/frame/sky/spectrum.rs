//! Colour of the air: four wavelengths, and how they make linear sRGB.
//!
//! Three wavelengths are too few: 445, 555 and 685 nm miss the colours of skies and low suns by
//! 5 % of their brightest channel (RMS). Four, with the matrix that fits best, miss them by
//! 0.3 %, and four fit a texel. The wavelengths and the matrix are the least-squares fit, over
//! sunlight behind up to 30 zenith depths of air, 10 of ozone and 5 of aerosol, as it is and
//! scattered once or twice by air, of the colours integrated over the whole spectrum; the test
//! below makes that fit again. White is sunlight outside of the air.

use glam::{DVec3, DVec4};

/// Wavelengths, nm.
pub const WAVELENGTHS: [f64; 4] = [435.0, 485.0, 555.0, 615.0];

/// Rows red, green, blue of linear sRGB; each sums to 1.
pub const TO_RGB: [[f64; 4]; 3] = [
    [0.072312, -0.213068, -0.130458, 1.271214],
    [-0.095840, 0.267501, 0.894328, -0.065989],
    [0.674768, 0.484858, -0.149262, -0.010364],
];

/// Column of ozone, molecules/m2: 300 Dobson units of 2.687e20.
const OZONE_COLUMN: f64 = 300.0 * 2.687e20;
/// Cross section of ozone at 233 K at the four wavelengths, m2, means over 10 nm (Gorshelev and
/// others, Serdyuchenko and others 2014, University of Bremen).
const OZONE_CROSS_SECTION: [f64; 4] = [8.451e-27, 7.752e-26, 3.5e-25, 4.305e-25];
/// Integral of the ozone layer's density over its peak, m: half of its base, 10 to 40 km.
const OZONE_LAYER: f64 = 15e3;
/// As `RAYLEIGH_HEIGHT` in the shader, m.
pub const RAYLEIGH_HEIGHT: f64 = 8434.5;

/// Extinction of aerosol at the ground at 550 nm, 1/m, its single-scattering albedo and its
/// Ångström exponent: continental clean air, Hess, Koepke and Schult (1998), OPAC.
const AEROSOL_EXTINCTION: f64 = 2.6e-5;
const AEROSOL_ALBEDO: f64 = 0.972;
const AEROSOL_EXPONENT: f64 = 1.3;

/// Zenith optical depth of air without aerosol and ozone, at sea level: Bodhaine, Wood, Dutton
/// and Slusser (1999), equation 30. `wavelength` in nm.
pub fn rayleigh_depth(wavelength: f64) -> f64 {
    let square = (wavelength / 1000.0).powi(2);
    0.002_152_0 * (1.045_599_6 - 341.290_61 / square - 0.902_308_50 * square)
        / (1.0 + 0.002_705_988_9 / square - 85.968_563 * square)
}

/// Coefficients of the air, 1/m, at the four wavelengths.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients {
    /// Scattering of air at the ground.
    pub rayleigh: DVec4,
    /// Scattering of aerosol at the ground.
    pub aerosol_scattering: DVec4,
    /// Extinction of aerosol at the ground.
    pub aerosol_extinction: DVec4,
    /// Absorption of ozone in the middle of its layer.
    pub ozone: DVec4,
}

impl Coefficients {
    /// The Earth's.
    pub fn earth() -> Self {
        let each = |f: &dyn Fn(usize, f64) -> f64| {
            DVec4::from_array(std::array::from_fn(|i| f(i, WAVELENGTHS[i])))
        };
        let aerosol = each(&|_, l| AEROSOL_EXTINCTION * (l / 550.0).powf(-AEROSOL_EXPONENT));
        Self {
            rayleigh: each(&|_, l| rayleigh_depth(l) / RAYLEIGH_HEIGHT),
            aerosol_scattering: aerosol * AEROSOL_ALBEDO,
            aerosol_extinction: aerosol,
            ozone: each(&|i, _| OZONE_COLUMN * OZONE_CROSS_SECTION[i] / OZONE_LAYER),
        }
    }
}

/// Linear sRGB of light at the four wavelengths; may be negative out of gamut.
pub fn to_rgb(light: DVec4) -> DVec3 {
    DVec3::from_array(TO_RGB.map(|row| DVec4::from_array(row).dot(light)))
}

/// A reflectance at the four wavelengths that has this colour in sunlight: grey plus the smallest
/// deviation from grey, within 0 to 1.
pub fn reflectance(colour: DVec3) -> DVec4 {
    let rows = TO_RGB.map(DVec4::from_array);
    let gram = glam::DMat3::from_cols_array_2d(&rows.map(|a| rows.map(|b| a.dot(b))));
    let grey = colour.element_sum() / 3.0;
    let weights = gram.inverse() * (colour - grey);
    let deviation = rows[0] * weights.x + rows[1] * weights.y + rows[2] * weights.z;
    (deviation + grey).clamp(DVec4::ZERO, DVec4::ONE)
}

#[cfg(test)]
#[path = "spectrum_tests.rs"]
mod tests;
