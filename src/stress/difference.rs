//! What of a difference to the exact compositor fails a case.

use glam::DVec3;
use serde::Serialize;

use crate::frame::Picture;

/// Differences that fail a case, each in the worst of its pixels: an error in few is not to be hidden by many without.
/// Where a frame is farther from the exact picture than a hundredth, its few steps have to be all of the reason: the
/// same march in f64 has to show what the frame does, and with many more steps what is exact (`explained.rs`). What is
/// measured is told in the README.
///
/// Transmittance, frame against its march: the most at the corners is 7e-5, where f32 rounds places on a
/// surface; noise of up to 10,000 optical depths is no worse.
const MOST_TRANSMITTANCE: f64 = 1e-3;
/// Transmittance, the march in many steps against exact: 16 times as many as the frame's, for noise of up to a hundred
/// optical depths. The most at the corners is 0.0022, in random scenes 0.0045 (`random 600:81`, 15 optical depths to
/// a step of the frame).
const MOST_LEFT: f64 = 0.02;
/// Radiance, frame against its march, over what is there: the march knows the true depth to the sun, the frame
/// has the deep shadow maps, of seven nodes a texel. The most at the corners is 0.13, in balls of 640 optical depths.
pub(super) const MOST_RADIANCE: f64 = 0.25;
/// Radiance, the march in many steps against exact: the most is 0.024 there in preset low, 0.020 in high.
const MOST_RADIANCE_LEFT: f64 = 0.05;
/// Of transmittance and radiance of pictures that are to be the same: 7e-6 and 2e-6 are measured
/// (`cargo nextest run --test stress long_lists`).
const MOST_UNLIKE: f64 = 1e-3;

/// How far a frame is from the exact picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Difference {
    /// Pixels compared.
    pub pixels: usize,
    /// Root mean square of transmittance.
    pub transmittance: f64,
    /// Of radiance, over the root mean square of the exact one, darkness apart; without pixels of the sun's disc, which
    /// is so bright that it shows the last digit of the transmittance.
    pub radiance: f64,
    /// Of transmittance and radiance in the worst pixels; radiance over what is there.
    pub worst: [f64; 2],
    /// The same to the frame's own march in f64, in the pixels that are not plain.
    pub march: [f64; 2],
    /// The same that is left between the march in many steps and the exact picture, in pixels that meet no noise
    /// shapes deeper than clouds.
    pub left: [f64; 2],
    /// Steps in a radius that the frame was marched with.
    pub steps: u32,
    /// Whether the two are to be the same, steps and all.
    pub alike: bool,
}

/// NaN is too much.
pub(super) fn is_beyond(value: f64, most: f64) -> bool {
    value.is_nan() || value > most
}

impl Difference {
    /// Why it is too much.
    pub fn failure(&self) -> Option<String> {
        if self.alike {
            if is_beyond(self.transmittance, MOST_UNLIKE) {
                return Some(format!("transmittance is off by {:.4} RMS", self.transmittance));
            }
            return is_beyond(self.radiance, MOST_UNLIKE)
                .then(|| format!("radiance is off by {:.1} % RMS", 100.0 * self.radiance));
        }
        Unexplained { march: self.march, left: self.left }.failure()
    }
}

/// Of transmittance and radiance, what steps don't explain.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Unexplained {
    pub march: [f64; 2],
    pub left: [f64; 2],
}

impl Unexplained {
    pub fn failure(&self) -> Option<String> {
        let judged = [
            ("transmittance", "the frame's march", self.march[0], MOST_TRANSMITTANCE),
            ("transmittance", "exact after many steps", self.left[0], MOST_LEFT),
            ("radiance", "the frame's march", self.march[1], MOST_RADIANCE),
            ("radiance", "exact after many steps", self.left[1], MOST_RADIANCE_LEFT),
        ];
        let beyond = judged.into_iter().find(|(_, _, value, most)| is_beyond(*value, *most));
        beyond
            .map(|(what, of, value, _)| format!("{what} of a pixel is off by {value:.4} from {of}"))
    }

    /// The worse of both; NaN stays.
    pub fn or_worse(self, other: Self) -> Self {
        Self { march: worse(self.march, other.march), left: worse(self.left, other.left) }
    }
}

/// The worse of both; NaN stays.
pub(super) fn worse(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|i| if b[i] > a[i] || b[i].is_nan() { b[i] } else { a[i] })
}

/// Difference of two pictures that are to be the same.
pub fn like(picture: &Picture, other: &Picture, steps: u32) -> Difference {
    let pixels = picture.radiance.len();
    let (mut transmittance, mut radiance, mut total) = (0.0, 0.0, 0.0);
    for (a, b) in picture.radiance.iter().zip(&other.radiance) {
        let ([r, g, b, opacity], [x, y, z, other]) = (a.map(f64::from), b.map(f64::from));
        transmittance += (opacity - other).powi(2);
        radiance += (DVec3::new(r, g, b) - DVec3::new(x, y, z)).length_squared();
        total += DVec3::new(x, y, z).length_squared();
    }
    let radiance = if radiance == 0.0 { 0.0 } else { (radiance / total).sqrt() };
    let transmittance = (transmittance / pixels.max(1) as f64).sqrt();
    Difference { pixels, transmittance, radiance, steps, alike: true, ..Difference::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_pixel_of_many_fails_a_case() {
        let sound = Difference { pixels: 48, ..Difference::default() };
        assert_eq!(sound.failure(), None);
        for (i, what) in ["transmittance", "radiance"].into_iter().enumerate() {
            for of_march in [true, false] {
                for wrong in [0.3, f64::NAN] {
                    let mut pixel = [0.0; 2];
                    pixel[i] = wrong;
                    let mut found = Unexplained::default();
                    for number in 0..48 {
                        let here = if number == 11 { pixel } else { [1e-6; 2] };
                        let (march, left) =
                            if of_march { (here, [0.0; 2]) } else { ([0.0; 2], here) };
                        found = found.or_worse(Unexplained { march, left });
                    }
                    let difference = Difference { march: found.march, left: found.left, ..sound };
                    assert!(
                        difference.failure().is_some_and(|why| why.starts_with(what)),
                        "{i} {wrong}"
                    );
                }
            }
        }
        // Far from exact, by steps alone.
        assert_eq!(Difference { transmittance: 0.4, worst: [0.7; 2], ..sound }.failure(), None);
        let alike = Difference { alike: true, transmittance: 0.01, ..sound };
        assert!(alike.failure().is_some());
    }
}
