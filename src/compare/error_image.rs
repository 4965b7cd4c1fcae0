//! A picture of the differences, for people. Four panels: above A and B as they are displayed;
//! below left where A is brighter (red) and darker (blue) than B, below right FLIP from black over
//! red and yellow to white. Under each of the lower ones lies its scale.

use glam::DVec3;

use super::errors::{LUMINANCE, Report};
use super::picture::Measured;
use crate::frame::cpu::tonemap;

/// Relative difference in brightness that gets the full colour.
pub const FULL_DIFFERENCE: f64 = 0.5;
/// What B's darkest parts are taken for, as a share of its mean brightness, so that noise in the
/// dark is not all that is seen.
const DARK: f64 = 0.1;
/// What does not count is dimmed by this factor.
const DIMMED: f64 = 0.25;
/// Height of the scales, as a share of a panel's.
const SCALE: u32 = 16;

/// Pixels of the four panels, rows from the top, with the size.
pub fn error_image(
    a: &Measured,
    b: &Measured,
    report: &Report,
    exposure: f64,
) -> ([u32; 2], Vec<[u8; 3]>) {
    let [width, height] = a.size;
    let scale = height.div_ceil(SCALE);
    let size = [2 * width, 2 * height + scale];
    let shown = [a.displayed(exposure), b.displayed(exposure)];
    let brightness = |m: &Measured| m.light.iter().map(|v| LUMINANCE.dot(*v)).collect::<Vec<_>>();
    let light = if a.kind == b.kind {
        [brightness(a), brightness(b)]
    } else {
        shown.each_ref().map(|v| v.iter().map(|v| LUMINANCE.dot(*v)).collect())
    };
    let mean = light[1].iter().sum::<f64>() / light[1].len() as f64;
    let pixel = |x: u32, y: u32| {
        let (column, right) = (x % width, x >= width);
        let across = (f64::from(column) + 0.5) / f64::from(width);
        if y >= 2 * height {
            return if right { heat(across) } else { diverging(2.0 * across - 1.0) };
        }
        let i = (y % height * width + column) as usize;
        if y < height {
            return DVec3::from_array(shown[usize::from(right)][i].to_array().map(tonemap::srgb));
        }
        let colour = if right {
            heat(report.flip_map[i])
        } else {
            let off = light[0][i] - light[1][i];
            let base = light[1][i].max(DARK * mean).max(f64::MIN_POSITIVE);
            diverging(off / base / FULL_DIFFERENCE)
        };
        if report.counted[i] { colour } else { colour * DIMMED }
    };
    let byte = |v: f64| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
    let pixels = (0..size[1])
        .flat_map(|y| (0..size[0]).map(move |x| (x, y)))
        .map(|(x, y)| pixel(x, y).to_array().map(byte))
        .collect();
    (size, pixels)
}

/// Blue at -1, white at 0, red at 1; display values.
fn diverging(t: f64) -> DVec3 {
    let t = t.clamp(-1.0, 1.0);
    let end = if t > 0.0 { DVec3::new(0.7, 0.02, 0.1) } else { DVec3::new(0.02, 0.2, 0.7) };
    DVec3::ONE.lerp(end, t.abs().sqrt())
}

/// Black, red, yellow, white from 0 to 1; display values.
pub(crate) fn heat(t: f64) -> DVec3 {
    let t = 3.0 * t.clamp(0.0, 1.0);
    DVec3::new(t, t - 1.0, t - 2.0).clamp(DVec3::ZERO, DVec3::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::{Differences, Kind, compare};

    #[test]
    fn brighter_is_red_and_darker_is_blue() {
        let picture = |light: [f64; 2]| Measured {
            name: String::new(),
            size: [2, 1],
            kind: Kind::Radiance,
            light: light.map(DVec3::splat).to_vec(),
            standard_error: None,
            opacity: None,
        };
        let (a, b) = (picture([0.2, 0.05]), picture([0.1, 0.1]));
        let how = Differences { least_opacity: None, exposure: 0.0, most_z: 3.0 };
        let report = compare(&a, &b, &how).expect("alike");
        let (size, pixels) = error_image(&a, &b, &report, 0.0);
        assert_eq!((size, pixels.len()), ([4, 3], 12));
        let [brighter, darker] = [pixels[4], pixels[5]];
        assert!(brighter[0] > brighter[2] && darker[2] > darker[0], "{brighter:?} {darker:?}");
        // Above: A is bright on the left, and B the same everywhere.
        assert!(pixels[0][0] > pixels[1][0] && pixels[2] == pixels[3]);
    }
}
