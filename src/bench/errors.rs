//! How far pictures of the bench are off.

use glam::DVec3;

use super::record::PictureError;
use crate::Result;
use crate::compare::{Differences, Kind, Measured, compare};
use crate::frame::Picture;
use crate::reference::{ExactPixel, Film, Window};

/// Pixels count from this opacity on where the reference is path traced: thin veils are mostly its
/// noise.
pub const OPACITY_OF_MODEL: f64 = 0.5;
/// And from this where it is exact.
pub const OPACITY_OF_ALGORITHM: f64 = 0.01;

/// A picture to be compared.
pub fn measured(name: &str, size: [u32; 2], radiance: &[[f32; 4]]) -> Measured {
    let light = |p: &[f32; 4]| DVec3::new(p[0].into(), p[1].into(), p[2].into());
    Measured {
        name: name.to_owned(),
        size,
        kind: Kind::Radiance,
        light: radiance.iter().map(light).collect(),
        standard_error: None,
        opacity: Some(radiance.iter().map(|p| p[3].into()).collect()),
    }
}

/// A path-traced picture, with its standard errors where there is more than one path.
pub fn of_film(film: &Film) -> Measured {
    let mut picture = measured("reference", film.size, &film.radiance());
    if film.samples > 1 {
        let errors = (0..film.pixels.len()).map(|i| {
            let [r, g, b, _] = film.estimates(i).map(|e| e.standard_error);
            DVec3::new(r, g, b)
        });
        picture.standard_error = Some(errors.collect());
    }
    picture
}

/// Pixels of the exact compositor, as a picture to be compared.
pub fn of_exact(size: [u32; 2], pixels: &[ExactPixel]) -> Measured {
    let one = |p: &ExactPixel| p.radiance.as_vec3().extend((1.0 - p.transmittance) as f32);
    let radiance: Vec<[f32; 4]> = pixels.iter().map(|p| one(p).to_array()).collect();
    measured("exact", size, &radiance)
}

/// Error of a picture over pixels with clouds, at this exposure (EV); none where there are none.
pub fn error(
    picture: &Picture,
    reference: &Measured,
    least_opacity: f64,
    exposure: f64,
) -> Result<Option<PictureError>> {
    let picture = measured("frame", picture.size, &picture.radiance);
    let cloudy = |m: &Measured| m.opacity.iter().flatten().any(|o| *o >= least_opacity);
    if !cloudy(&picture) && !cloudy(reference) {
        return Ok(None);
    }
    let how = Differences { least_opacity: Some(least_opacity), exposure, most_z: 3.0 };
    let report = compare(&picture, reference, &how)?;
    Ok(Some(PictureError {
        bias: report.relative_mean_error.unwrap_or(0.0),
        rel_mse: report.rel_mse.unwrap_or(0.0),
        rel_mse_of_noise: report.rel_mse_of_noise.unwrap_or(0.0),
        flip: report.ldr_flip,
        pixels: report.pixels,
    }))
}

/// The pixels of a window.
pub fn cut<T: Copy>(pixels: &[T], size: [u32; 2], window: Window) -> Vec<T> {
    let rows = pixels.chunks_exact(size[0] as usize);
    let (left, width) = (window.corner[0] as usize, window.size[0] as usize);
    rows.skip(window.corner[1] as usize)
        .take(window.size[1] as usize)
        .flat_map(|row| row[left..left + width].iter().copied())
        .collect()
}

/// The radiance of a window of a picture.
pub fn cut_picture(picture: &Picture, window: Window) -> Picture {
    let radiance = cut(&picture.radiance, picture.size, window);
    Picture { size: window.size, radiance, pixels: Vec::new(), stats: picture.stats.clone() }
}

/// A picture of another size by bilinear interpolation between the middles of pixels, as a window
/// shows a frame of lower resolution.
pub fn resized(picture: &Picture, size: [u32; 2]) -> Picture {
    if picture.size == size {
        return picture.clone();
    }
    let from = picture.size;
    let axis = |i: u32, axis: usize| {
        let place = (f64::from(i) + 0.5) * f64::from(from[axis]) / f64::from(size[axis]) - 0.5;
        let place = place.clamp(0.0, f64::from(from[axis] - 1));
        let low = (place as u32).min(from[axis].saturating_sub(2));
        let high = (low + 1).min(from[axis] - 1);
        (low, high, (place - f64::from(low)) as f32)
    };
    let mut radiance = Vec::with_capacity(Picture::pixel_count(size));
    for y in 0..size[1] {
        for x in 0..size[0] {
            let ((left, right, u), (top, bottom, v)) = (axis(x, 0), axis(y, 1));
            let at =
                |x: u32, y: u32| glam::Vec4::from(picture.radiance[(y * from[0] + x) as usize]);
            let upper = at(left, top).lerp(at(right, top), u);
            radiance.push(upper.lerp(at(left, bottom).lerp(at(right, bottom), u), v).to_array());
        }
    }
    Picture { size, radiance, pixels: Vec::new(), stats: picture.stats.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(size: [u32; 2], light: impl Fn(u32, u32) -> f32) -> Picture {
        let radiance = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
        Picture {
            size,
            radiance: radiance.map(|(x, y)| [light(x, y), 0.5, 0.25, 1.0]).collect(),
            pixels: Vec::new(),
            stats: Default::default(),
        }
    }

    /// A ramp stays a ramp, but for the outermost half pixels, where nothing lies beyond.
    #[test]
    fn larger_pictures_are_interpolated() {
        let small = picture([8, 4], |x, _| x as f32);
        let large = resized(&small, [16, 12]);
        for (i, pixel) in large.radiance.iter().enumerate() {
            let x = (i % 16) as f32;
            let expected = (0.5 * (x + 0.5) - 0.5).clamp(0.0, 7.0);
            assert!((pixel[0] - expected).abs() < 1e-6, "{i}: {pixel:?}");
            assert_eq!(pixel[1..], [0.5, 0.25, 1.0]);
        }
        assert_eq!(resized(&small, [8, 4]).radiance, small.radiance);
        assert_eq!(resized(&picture([1, 1], |_, _| 3.0), [2, 2]).radiance[3][0], 3.0);
    }

    #[test]
    fn a_window_is_cut_out() {
        let whole = picture([8, 4], |x, y| (10 * y + x) as f32);
        let middle = cut_picture(&whole, Window::middle(whole.size, 2));
        assert_eq!(middle.size, [4, 2]);
        let light: Vec<f32> = middle.radiance.iter().map(|p| p[0]).collect();
        assert_eq!(light, [12.0, 13.0, 14.0, 15.0, 22.0, 23.0, 24.0, 25.0]);
        assert_eq!(cut_picture(&whole, Window::whole(whole.size)).radiance, whole.radiance);
    }

    #[test]
    fn errors_by_hand() {
        let (a, b) = (picture([8, 8], |_, _| 0.55), picture([8, 8], |_, _| 0.5));
        let reference = measured("b", b.size, &b.radiance);
        let found = error(&a, &reference, 0.5, 0.0).expect("alike").expect("clouds");
        assert!((found.bias - 0.05 / 1.25).abs() < 1e-6, "{found:?}");
        assert_eq!((found.pixels, found.rel_mse_of_noise), (64, 0.0));
        assert!(found.flip > 0.0 && found.rel_mse > 0.0);
        assert_eq!(found.without_noise(), found.rel_mse);
        assert_eq!(error(&a, &reference, 1.5, 0.0).expect("alike"), None);
    }
}
