//! FLIP, a difference evaluator for alternating images (Andersson et al. 2020), and HDR-FLIP
//! (Andersson et al. 2021): how different two pictures look when one flips between them, from 0,
//! the same, to 1. In f64 throughout; a test compares with the authors' own implementation, which
//! takes 8 bits a channel (crate `nv-flip`).

use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Pixels a degree of a 4K screen 0.7 m wide seen from 0.7 m: the authors' default.
pub const PIXELS_PER_DEGREE: f64 = 67.020_643_276_582_25;

/// Exponent on the colour difference.
const COLOUR_EXPONENT: f64 = 0.7;
/// Share of the largest colour difference below which differences are spread ...
const COLOUR_KNEE: f64 = 0.4;
/// ... over this share of the scale.
const COLOUR_KNEE_VALUE: f64 = 0.95;
/// Width of features, degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent on the feature difference.
const FEATURE_EXPONENT: f64 = 0.5;

/// Contrast sensitivity as two Gaussians in frequency for achromatic, red-green and blue-yellow:
/// weights and squared widths (degrees^2 / pi^2 units of the paper).
const SENSITIVITY: [[[f64; 2]; 2]; 3] =
    [[[1.0, 0.0047], [0.0, 1e-5]], [[1.0, 0.0053], [0.0, 1e-5]], [[34.1, 0.04], [13.5, 0.025]]];

/// A picture of three numbers a pixel.
#[derive(Clone, Debug)]
struct Plane {
    size: [usize; 2],
    values: Vec<DVec3>,
}

impl Plane {
    fn map(&self, f: impl Fn(DVec3) -> DVec3 + Sync) -> Self {
        Self { size: self.size, values: self.values.par_iter().map(|v| f(*v)).collect() }
    }

    /// A sum over columns, then over rows; beyond the edge lies what is at the edge. `kernels`
    /// hold `2 radius + 1` weights each, a vector for the three numbers.
    fn convolved(&self, along_x: &[DVec3], along_y: &[DVec3]) -> Self {
        self.along(along_x, true).along(along_y, false)
    }

    fn along(&self, kernel: &[DVec3], x_axis: bool) -> Self {
        let [width, height] = self.size;
        let radius = kernel.len() as isize / 2;
        let values = (0..width * height)
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let (x, y) = ((i % width) as isize, (i / width) as isize);
                let mut sum = DVec3::ZERO;
                for (k, weight) in kernel.iter().enumerate() {
                    let off = k as isize - radius;
                    let (x, y) = if x_axis {
                        ((x + off).clamp(0, width as isize - 1), y)
                    } else {
                        (x, (y + off).clamp(0, height as isize - 1))
                    };
                    sum += *weight * self.values[y as usize * width + x as usize];
                }
                sum
            })
            .collect();
        Self { size: self.size, values }
    }

    fn plus(&self, other: &Self) -> Self {
        let values = self.values.iter().zip(&other.values).map(|(a, b)| *a + *b).collect();
        Self { size: self.size, values }
    }
}

/// Linear Rec. 709 to XYZ, the authors' digits.
fn xyz_matrix() -> DMat3 {
    DMat3::from_cols(
        DVec3::new(
            10_135_552.0 / 24_577_794.0,
            2_613_072.0 / 12_288_897.0,
            1_425_312.0 / 73_733_382.0,
        ),
        DVec3::new(
            8_788_810.0 / 24_577_794.0,
            8_788_810.0 / 12_288_897.0,
            8_788_810.0 / 73_733_382.0,
        ),
        DVec3::new(
            4_435_075.0 / 24_577_794.0,
            887_015.0 / 12_288_897.0,
            70_074_185.0 / 73_733_382.0,
        ),
    )
}

/// Colour spaces that share one set of matrices.
struct Spaces {
    to_xyz: DMat3,
    from_xyz: DMat3,
    white: DVec3,
}

impl Spaces {
    fn new() -> Self {
        let to_xyz = xyz_matrix();
        Self { to_xyz, from_xyz: to_xyz.inverse(), white: to_xyz * DVec3::ONE }
    }

    /// Linear Rec. 709 to the opponent space YCxCz.
    fn opponent(&self, rgb: DVec3) -> DVec3 {
        let v = self.to_xyz * rgb / self.white;
        DVec3::new(116.0 * v.y - 16.0, 500.0 * (v.x - v.y), 200.0 * (v.y - v.z))
    }

    fn opponent_to_rgb(&self, v: DVec3) -> DVec3 {
        let y = (v.x + 16.0) / 116.0;
        self.from_xyz * (DVec3::new(y + v.y / 500.0, y, y - v.z / 200.0) * self.white)
    }

    /// Linear Rec. 709 to CIELAB with Hunt's adjustment: dark colours differ less.
    fn hunt_lab(&self, rgb: DVec3) -> DVec3 {
        const DELTA: f64 = 6.0 / 29.0;
        let v = self.to_xyz * rgb / self.white;
        let f = |t: f64| {
            if t > DELTA * DELTA * DELTA {
                t.cbrt()
            } else {
                t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
            }
        };
        let [x, y, z] = v.to_array().map(f);
        let light = 116.0 * y - 16.0;
        DVec3::new(light, 0.01 * light * 500.0 * (x - y), 0.01 * light * 200.0 * (y - z))
    }
}

/// Distance of two colours: lightness by amount, the rest by length (Abasi et al. 2020).
fn hybrid_distance(a: DVec3, b: DVec3) -> f64 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// The two Gaussians of the contrast sensitivity, as kernels in space: both are separable.
fn sensitivity_kernels(pixels_per_degree: f64) -> [Vec<DVec3>; 2] {
    use std::f64::consts::PI;
    let widest = SENSITIVITY.iter().flatten().fold(0.0f64, |w, g| w.max(g[1]));
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
    let weight = |gaussian: usize, channel: usize, x: i32| {
        let [_, width] = SENSITIVITY[channel][gaussian];
        let place = f64::from(x) / pixels_per_degree;
        (-PI * PI * place * place / width).exp()
    };
    let line_sum =
        |gaussian, channel| (-radius..=radius).map(|x| weight(gaussian, channel, x)).sum::<f64>();
    let amplitude = |gaussian: usize, channel: usize| {
        let [scale, width] = SENSITIVITY[channel][gaussian];
        scale * (PI / width).sqrt()
    };
    [0, 1].map(|gaussian| {
        // The sum of the whole kernel, both Gaussians over the square, is 1.
        let share = DVec3::from_array([0, 1, 2].map(|channel| {
            let volume = |g| amplitude(g, channel) * line_sum(g, channel).powi(2);
            (amplitude(gaussian, channel) / (volume(0) + volume(1))).sqrt()
        }));
        (-radius..=radius)
            .map(|x| share * DVec3::from_array([0, 1, 2].map(|c| weight(gaussian, c, x))))
            .collect()
    })
}

/// Kernels of features along one axis: x, first and second derivative; smoothing across. Each
/// side of a derivative sums to 1, over the square.
fn feature_kernels(pixels_per_degree: f64) -> (Vec<DVec3>, Vec<DVec3>) {
    let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as i32;
    let range = || (-radius..=radius).map(f64::from);
    let gauss = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
    let across: f64 = range().map(gauss).sum();
    let normalised = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let values: Vec<f64> = range().map(f).collect();
        let positive: f64 = values.iter().filter(|v| **v > 0.0).sum();
        let negative: f64 = -values.iter().filter(|v| **v < 0.0).sum::<f64>();
        values.iter().map(|v| v / if *v > 0.0 { positive } else { negative }).collect()
    };
    let edge = normalised(&|x| -x * gauss(x));
    let point = normalised(&|x| (x * x / (deviation * deviation) - 1.0) * gauss(x));
    let derivative = edge.iter().zip(&point).map(|(e, p)| DVec3::new(*e, *p, 0.0)).collect();
    let smoothing = range().map(|x| DVec3::splat(gauss(x) / across)).collect();
    (derivative, smoothing)
}

/// Strength of edges (x) and points (y) in a picture's brightness.
fn features(opponent: &Plane, pixels_per_degree: f64) -> Vec<[f64; 2]> {
    let brightness = opponent.map(|v| DVec3::splat((v.x + 16.0) / 116.0));
    let (derivative, smoothing) = feature_kernels(pixels_per_degree);
    let x = brightness.convolved(&derivative, &smoothing);
    let y = brightness.convolved(&smoothing, &derivative);
    x.values.iter().zip(&y.values).map(|(x, y)| [x.x.hypot(y.x), x.y.hypot(y.y)]).collect()
}

/// FLIP of two pictures of linear Rec. 709 in 0..1, pixel by pixel, rows from the top.
pub fn flip(a: &[DVec3], b: &[DVec3], size: [u32; 2], pixels_per_degree: f64) -> Vec<f64> {
    let spaces = Spaces::new();
    let size = size.map(|s| s as usize);
    let kernels = sensitivity_kernels(pixels_per_degree);
    let seen = |rgb: &[DVec3]| {
        let linear = Plane { size, values: rgb.to_vec() };
        let opponent = linear.map(|v| spaces.opponent(v));
        let filtered = opponent
            .convolved(&kernels[0], &kernels[0])
            .plus(&opponent.convolved(&kernels[1], &kernels[1]));
        let colour = filtered
            .map(|v| spaces.hunt_lab(spaces.opponent_to_rgb(v).clamp(DVec3::ZERO, DVec3::ONE)));
        (colour, features(&opponent, pixels_per_degree))
    };
    let ((colour_a, features_a), (colour_b, features_b)) = (seen(a), seen(b));
    let largest =
        hybrid_distance(spaces.hunt_lab(DVec3::Y), spaces.hunt_lab(DVec3::Z)).powf(COLOUR_EXPONENT);
    let knee = COLOUR_KNEE * largest;
    (0..a.len())
        .map(|i| {
            let distance =
                hybrid_distance(colour_a.values[i], colour_b.values[i]).powf(COLOUR_EXPONENT);
            let colour = if distance < knee {
                COLOUR_KNEE_VALUE / knee * distance
            } else {
                COLOUR_KNEE_VALUE + (distance - knee) / (largest - knee) * (1.0 - COLOUR_KNEE_VALUE)
            };
            let change = |k: usize| (features_a[i][k] - features_b[i][k]).abs();
            let feature = (change(0).max(change(1)) * std::f64::consts::FRAC_1_SQRT_2)
                .powf(FEATURE_EXPONENT)
                .clamp(0.0, 1.0);
            colour.powf(1.0 - feature)
        })
        .collect()
}

/// Coefficients of the curve that HDR-FLIP shows radiance through: Narkowicz's fit (2015) of the
/// ACES curve, the pre-exposure of 0.6 within: (k0 x^2 + k1 x + k2) / (k3 x^2 + k4 x + k5).
const CURVE: [f64; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];
/// The curve's value that the brightest and the median pixel are exposed to, in the shortest and
/// the longest exposure.
const CURVE_TOP: f64 = 0.85;

fn curve(v: DVec3) -> DVec3 {
    let [k0, k1, k2, k3, k4, k5] = CURVE;
    let shown = (v * (k0 * v + k1) + k2) / (v * (k3 * v + k4) + k5);
    shown.clamp(DVec3::ZERO, DVec3::ONE)
}

/// Exposures (EV) from the one that shows the brightest pixel of the reference to the one that
/// shows its median.
fn exposures(reference: &[DVec3]) -> Option<Vec<f64>> {
    let [k0, k1, k2, k3, k4, k5] = CURVE;
    let t = CURVE_TOP;
    let (a, b, c) = (k0 - t * k3, k1 - t * k4, k2 - t * k5);
    // The larger root: where the curve reaches its top.
    let top = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    let weights = xyz_matrix().transpose().col(1);
    let mut luminances: Vec<f64> = reference.iter().map(|v| weights.dot(*v).max(0.0)).collect();
    luminances.sort_by(f64::total_cmp);
    let most = *luminances.last()?;
    let n = luminances.len();
    let median = 0.5 * (luminances[(n - 1) / 2] + luminances[n / 2]);
    if most <= 0.0 {
        return None;
    }
    let start = (top / most).log2();
    // A picture more than half of which is black has no median to expose for.
    let stop = if median > 0.0 { (top / median).log2() } else { start + 1.0 };
    let count = ((stop - start).ceil() as usize).max(2);
    Some((0..count).map(|i| start + (stop - start) * i as f64 / (count - 1) as f64).collect())
}

/// HDR-FLIP of two pictures of linear radiance of any brightness: of each pixel the most over a
/// range of exposures. `b` is the reference, from which the exposures follow; where it is black
/// there is nothing to expose for, and no result.
pub fn hdr_flip(
    a: &[DVec3],
    b: &[DVec3],
    size: [u32; 2],
    pixels_per_degree: f64,
) -> Option<Vec<f64>> {
    let mut most = vec![0.0f64; a.len()];
    for exposure in exposures(b)? {
        let shown = |v: &[DVec3]| -> Vec<DVec3> {
            v.iter()
                .map(|v| curve(v.clamp(DVec3::ZERO, DVec3::splat(65536.0)) * exposure.exp2()))
                .collect()
        };
        let errors = flip(&shown(a), &shown(b), size, pixels_per_degree);
        most.iter_mut().zip(errors).for_each(|(most, e)| *most = most.max(e));
    }
    Some(most)
}

#[cfg(test)]
mod tests;
