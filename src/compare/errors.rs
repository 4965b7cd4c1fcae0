//! The numbers.

use glam::DVec3;
use serde::Serialize;

use super::flip::{PIXELS_PER_DEGREE, flip, hdr_flip};
use super::picture::{Kind, Measured};
use crate::error::{Error, Result};
use crate::frame::cpu::tonemap;

/// Luminance of linear Rec. 709.
pub(crate) const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// relMSE divides by the square of the reference plus this share of its mean's square, so that
/// what is black does not count for everything; no unit enters.
const DARK_SHARE: f64 = 0.01;

/// A standard error of 0 leaves rounding to f32: a difference is at least this share of the value.
const ROUNDING: f64 = 1e-6;

/// How to compare.
#[derive(Clone, Copy, Debug)]
pub struct Differences {
    /// Only pixels where either picture's clouds are at least this opaque.
    pub least_opacity: Option<f64>,
    /// For the tone-mapped numbers of radiance, EV.
    pub exposure: f64,
    /// Differences beyond so many standard errors are counted.
    pub most_z: f64,
}

/// How far picture A is from picture B, the reference. Sums are over the pixels that count, and
/// over red, green and blue.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Name of A.
    pub a: String,
    /// Name of B.
    pub b: String,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// How many pixels count.
    pub pixels: usize,
    /// Mean of A, rgb.
    pub mean_a: [f64; 3],
    /// Mean of B, rgb.
    pub mean_b: [f64; 3],
    /// Mean of A - B: the bias.
    pub mean_error: f64,
    /// The same over the mean of B.
    pub relative_mean_error: Option<f64>,
    /// Root of the mean of (A - B)^2.
    pub rmse: f64,
    /// The same over the mean of B.
    pub relative_rmse: Option<f64>,
    /// Mean of (A - B)^2 / (B^2 + 0.01 mean(B)^2).
    pub rel_mse: Option<f64>,
    /// What the standard errors alone would make of that; none where none are known.
    pub rel_mse_of_noise: Option<f64>,
    /// Of the tone-mapped pictures, dB; none where they are the same.
    pub psnr: Option<f64>,
    /// Mean FLIP of the tone-mapped pictures, 0 to 1.
    pub ldr_flip: f64,
    /// Mean HDR-FLIP; none for pictures that hold no radiance.
    pub hdr_flip: Option<f64>,
    /// Of pictures with standard errors.
    pub z: Option<ZScores>,
    /// How large the standard errors of B are, or of A where B has none.
    pub noise: Option<Noise>,
    /// FLIP of every pixel, for the picture of the differences.
    #[serde(skip)]
    pub flip_map: Vec<f64>,
    /// Which pixels count.
    #[serde(skip)]
    pub counted: Vec<bool>,
}

/// Differences in units of their standard errors.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ZScores {
    /// Share of pixels with a channel beyond `limit`. If only noise differs, 0.3 % (channels that
    /// vary together) to 0.8 % (that do not) at 3.
    pub beyond: f64,
    /// The limit.
    pub limit: f64,
    /// z of the mean of all pixels and channels, as if these were independent.
    pub of_mean: f64,
}

/// Standard errors of a pixel's brightness over the brightness of B, as if its channels always
/// varied together, which can only make them larger.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Noise {
    /// Half of the pixels have less.
    pub median: f64,
    /// Share of pixels with less than 2 %.
    pub below_2_percent: f64,
}

/// Compares two pictures of the same size.
pub fn compare(a: &Measured, b: &Measured, how: &Differences) -> Result<Report> {
    if a.size != b.size {
        let message = format!(
            "has {}x{} pixels and {} has {}x{}, expected the same size",
            a.size[0], a.size[1], b.name, b.size[0], b.size[1]
        );
        return Err(Error::input(a.name.clone(), message));
    }
    let counted = counted(a, b, how)?;
    let pixels = counted.iter().filter(|c| **c).count();
    if pixels == 0 {
        return Err(Error::input("--mask", "no pixel of either picture has such clouds"));
    }
    let (shown_a, shown_b) = (a.displayed(how.exposure), b.displayed(how.exposure));
    let both_radiance = a.kind == Kind::Radiance && b.kind == Kind::Radiance;
    let (light_a, light_b) =
        if both_radiance { (&a.light, &b.light) } else { (&shown_a, &shown_b) };
    let noise = both_radiance.then(|| variance(a, b)).flatten();

    let picked = || (0..counted.len()).filter(|i| counted[*i]);
    let mean = |value: &dyn Fn(usize) -> DVec3| picked().map(value).sum::<DVec3>() / pixels as f64;
    let even = |v: DVec3| v.element_sum() / 3.0;
    let (mean_a, mean_b) = (mean(&|i| light_a[i]), mean(&|i| light_b[i]));
    let level = even(mean_b);
    let over_level = |v: f64| (level > 0.0).then_some(v / level);
    let off = |i: usize| light_a[i] - light_b[i];
    let weight = |i: usize| (light_b[i] * light_b[i] + DARK_SHARE * level * level).recip();
    let rmse = even(mean(&|i| off(i) * off(i))).sqrt();

    let code = |v: &DVec3| DVec3::from_array(v.to_array().map(tonemap::srgb));
    let display_mse = even(mean(&|i| (code(&shown_a[i]) - code(&shown_b[i])).powf(2.0)));
    let flip_map = flip(&shown_a, &shown_b, a.size, PIXELS_PER_DEGREE);
    let over_pixels = |map: &[f64]| picked().map(|i| map[i]).sum::<f64>() / pixels as f64;
    let hdr = both_radiance
        .then(|| hdr_flip(light_a, light_b, a.size, PIXELS_PER_DEGREE))
        .flatten()
        .map(|map| over_pixels(&map));

    let z = noise.as_ref().map(|noise| {
        let floor = |i: usize| (ROUNDING * light_b[i]).powf(2.0) + DVec3::splat(f64::MIN_POSITIVE);
        let beyond = |i: &usize| {
            let limit = how.most_z * how.most_z * noise[*i].max(floor(*i));
            (off(*i) * off(*i)).cmpgt(limit).any()
        };
        let sum: DVec3 = picked().map(|i| noise[i].max(floor(i))).sum();
        ZScores {
            beyond: picked().filter(beyond).count() as f64 / pixels as f64,
            limit: how.most_z,
            of_mean: 3.0 * pixels as f64 * even(mean(&off)) / sum.element_sum().sqrt(),
        }
    });
    let known = b.standard_error.as_ref().or(a.standard_error.as_ref());
    let relative_noise = known.filter(|_| both_radiance).map(|error| {
        let relative = |i: usize| {
            let value = LUMINANCE.dot(light_b[i]).abs().max(f64::MIN_POSITIVE);
            LUMINANCE.dot(error[i]) / value
        };
        let mut all: Vec<f64> = picked().map(relative).collect();
        all.sort_by(f64::total_cmp);
        let below = all.partition_point(|v| *v < 0.02) as f64 / pixels as f64;
        Noise { median: all[pixels / 2], below_2_percent: below }
    });
    Ok(Report {
        a: a.name.clone(),
        b: b.name.clone(),
        size: a.size,
        pixels,
        mean_a: mean_a.to_array(),
        mean_b: mean_b.to_array(),
        mean_error: even(mean(&off)),
        relative_mean_error: over_level(even(mean(&off))),
        rmse,
        relative_rmse: over_level(rmse),
        rel_mse: (level > 0.0).then(|| even(mean(&|i| off(i) * off(i) * weight(i)))),
        rel_mse_of_noise: noise
            .filter(|_| level > 0.0)
            .map(|noise| even(mean(&|i| noise[i] * weight(i)))),
        psnr: (display_mse > 0.0).then(|| -10.0 * display_mse.log10()),
        ldr_flip: over_pixels(&flip_map),
        hdr_flip: hdr,
        z,
        noise: relative_noise,
        flip_map,
        counted,
    })
}

/// Which pixels count.
fn counted(a: &Measured, b: &Measured, how: &Differences) -> Result<Vec<bool>> {
    let count = a.light.len();
    let Some(least) = how.least_opacity else { return Ok(vec![true; count]) };
    if a.opacity.is_none() && b.opacity.is_none() {
        let message = format!(
            "neither {} nor {} tells where clouds are; expected a channel A or T",
            a.name, b.name
        );
        return Err(Error::input("--mask", message));
    }
    let cloudy = |m: &Measured, i: usize| m.opacity.as_ref().is_some_and(|o| o[i] >= least);
    Ok((0..count).map(|i| cloudy(a, i) || cloudy(b, i)).collect())
}

/// Squares of the standard errors of the differences.
fn variance(a: &Measured, b: &Measured) -> Option<Vec<DVec3>> {
    if a.standard_error.is_none() && b.standard_error.is_none() {
        return None;
    }
    let square =
        |m: &Measured, i: usize| m.standard_error.as_ref().map_or(DVec3::ZERO, |e| e[i] * e[i]);
    Some((0..a.light.len()).map(|i| square(a, i) + square(b, i)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::Random;

    const SIZE: [u32; 2] = [40, 30];

    fn picture(light: impl Fn(usize) -> f64) -> Measured {
        Measured {
            name: "a test's".to_owned(),
            size: SIZE,
            kind: Kind::Radiance,
            light: (0..1200).map(|i| DVec3::new(1.0, 2.0, 4.0) * light(i)).collect(),
            standard_error: None,
            opacity: None,
        }
    }

    const HOW: Differences = Differences { least_opacity: None, exposure: 0.0, most_z: 3.0 };

    /// A uniform picture and one 10 % brighter: every number by hand.
    #[test]
    fn numbers_by_hand() {
        let report = compare(&picture(|_| 0.11), &picture(|_| 0.1), &HOW).expect("alike");
        let close = |value: Option<f64>, expected: f64| {
            let value = value.expect("known");
            assert!((value / expected - 1.0).abs() < 1e-9, "{value} {expected}");
        };
        close(Some(report.mean_error), 0.01 * 7.0 / 3.0);
        close(report.relative_mean_error, 0.1);
        close(Some(report.rmse), 0.01 * 7.0f64.sqrt());
        let level = 0.1 * 7.0 / 3.0;
        let share = |c: f64| (0.01 * c).powi(2) / ((0.1 * c).powi(2) + 0.01 * level * level);
        close(report.rel_mse, (share(1.0) + share(2.0) + share(4.0)) / 3.0);
        assert!(report.z.is_none() && report.rel_mse_of_noise.is_none());
        assert!(report.ldr_flip > 0.0 && report.hdr_flip.is_some_and(|e| e > 0.0));
        let same = compare(&picture(|_| 0.1), &picture(|_| 0.1), &HOW).expect("alike");
        assert_eq!((same.rmse, same.ldr_flip, same.psnr), (0.0, 0.0, None));
    }

    /// Normal noise of the stated standard error: as many pixels beyond as there should be, and
    /// relMSE is what noise makes of it.
    #[test]
    fn noise_is_told_from_error() {
        let mut random = Random::new(1, 0, 0);
        let deviation = 0.004;
        let mut normal = || (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        let noise: Vec<f64> = (0..1200).map(|_| deviation * normal()).collect();
        let mut noisy = picture(|i| 0.1 + noise[i]);
        noisy.standard_error = Some(vec![DVec3::new(1.0, 2.0, 4.0) * deviation; noisy.light.len()]);
        let how = Differences { most_z: 1.0, ..HOW };
        let report = compare(&noisy, &picture(|_| 0.1), &how).expect("alike");
        // 31.7 % of a normal distribution lie beyond 1; one standard deviation of that share over
        // 1200 pixels is 1.3 %.
        let beyond = report.z.expect("errors are known").beyond;
        assert!((beyond - 0.317).abs() < 4.0 * 0.013, "{beyond}");
        let (all, noise) =
            (report.rel_mse.expect("light"), report.rel_mse_of_noise.expect("noise"));
        // The variance of 1200 normal numbers is known to sqrt(2 / 1200) = 4 %.
        assert!((all / noise - 1.0).abs() < 4.0 * 0.041, "{all} {noise}");
        let told = report.noise.expect("errors are known");
        assert!((told.median - 0.04).abs() < 1e-9 && told.below_2_percent == 0.0, "{told:?}");
        let wrong = compare(&noisy, &picture(|_| 0.11), &how).expect("alike");
        assert!(wrong.z.expect("errors are known").beyond > 0.9);
    }

    #[test]
    fn a_mask_leaves_clear_sky_out() {
        let (mut a, b) = (picture(|i| if i < 600 { 0.2 } else { 0.1 }), picture(|_| 0.1));
        let how = Differences { least_opacity: Some(0.5), ..HOW };
        assert!(compare(&a, &b, &how).is_err(), "nobody knows where clouds are");
        a.opacity = Some((0..1200).map(|i| if i < 600 { 0.9 } else { 0.1 }).collect());
        let report = compare(&a, &b, &how).expect("alike");
        assert_eq!(report.pixels, 600);
        assert!((report.relative_mean_error.expect("light") - 1.0).abs() < 1e-9);
        let how = Differences { least_opacity: Some(0.95), ..HOW };
        assert!(compare(&a, &b, &how).is_err(), "no cloud is so dense");
    }

    #[test]
    fn sizes_must_agree() {
        let mut other = picture(|_| 0.1);
        other.size = [30, 40];
        let message = compare(&picture(|_| 0.1), &other, &HOW).expect_err("sizes").to_string();
        assert!(message.contains("40x30") && message.contains("30x40"), "{message}");
    }
}
