//! How uneven the sky is: what of its light comes to the light grid along each direction. The grid keeps one number
//! for the light from above, so colours are those of the mean sky, and the shares those of its luminance.

use std::f64::consts::PI;
use std::sync::{Mutex, PoisonError};

use glam::{DVec3, DVec4, Vec3};

use crate::frame::cpu::sky_march::{Air, AirRay};
use crate::frame::sky::gpu_data::seen_from;
use crate::frame::sky::spectrum::{Coefficients, reflectance, to_rgb};
use crate::frame::sky::{SkyInputs, SkyKind};

/// Directions in which the sky is looked at: equal in the cosine of the zenith angle, and in azimuth. Half of them:
/// the other side of the sun mirrors it.
const ZENITHS: u32 = 12;
const AZIMUTHS: u32 = 12;
/// Steps along each.
const STEPS: u32 = 24;
/// Luminance of linear sRGB (IEC 61966-2-1).
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);
/// Turns of the solution below: half of them change it by less than f32 does (test).
const TURNS: u32 = 4096;
/// What values cost besides what they miss: more axes than moments leave some sums of them open, or nearly (an eigenvalue of
/// 0.0007 for 20 directions), and those stay small.
const RIDGE: f64 = 0.003;

/// What was asked for last, with the tables of the air over that ground, which take longer than all else here.
struct Kept {
    ground: (Vec3, Option<f64>),
    air: Air,
    sun: Vec3,
    altitude: f64,
    axes: &'static [DVec4],
    values: Vec<f32>,
}

static KEPT: Mutex<Option<Kept>> = Mutex::new(None);

/// Light that comes from above along each axis, over that of a sky that is as bright everywhere, less 1; at least -1,
/// their sum by the axes' weights is 0. Altitude in m. With them sums over directions of travel have the moments of degrees 0 to 2 that
/// the sky has, as nearly as one number an axis can: those that the grid's phase function asks for.
/// The axes are those of `Directions`.
pub fn unevenness(inputs: &SkyInputs, altitude: f64, axes: &'static [DVec4]) -> Vec<f32> {
    if inputs.kind != SkyKind::Atmosphere {
        return vec![0.0; axes.len()];
    }
    let (ground, sun) = ((inputs.ground_albedo, inputs.sea_wind), inputs.sun_direction);
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let air = match kept.take() {
        Some(k) if (k.ground, k.sun, k.altitude, k.axes) == (ground, sun, altitude, axes) => {
            return kept.insert(k).values.clone();
        }
        Some(k) if k.ground == ground => k.air,
        _ => {
            let albedo = reflectance(inputs.ground_albedo.as_dvec3());
            Air::new(Coefficients::earth(), albedo, inputs.sea())
        }
    };
    let values = of_air(&air, sun.as_dvec3(), seen_from(altitude), axes);
    *kept = Some(Kept { ground, air, sun, altitude, axes, values: values.clone() });
    values
}

fn of_air(air: &Air, sun: DVec3, altitude: f64, axes: &[DVec4]) -> Vec<f32> {
    let beside = DVec3::Y.cross(sun).try_normalize().unwrap_or(DVec3::X);
    let along = beside.cross(DVec3::Y);
    let mut seen = Vec::new();
    for i in 0..ZENITHS {
        let mu = (f64::from(i) + 0.5) / f64::from(ZENITHS);
        let across = (1.0 - mu * mu).sqrt();
        for j in 0..AZIMUTHS {
            let (sin, cos) = (PI * (f64::from(j) + 0.5) / f64::from(AZIMUTHS)).sin_cos();
            let [left, right] = [1.0, -1.0]
                .map(|side| across * (cos * along + side * sin * beside) + mu * DVec3::Y);
            let ray =
                AirRay { altitude, mu, sun_mu: sun.y, cos_sun: left.dot(sun).clamp(-1.0, 1.0) };
            let light = to_rgb(air.gather_all(ray, false, STEPS).radiance).dot(LUMINANCE);
            seen.extend([(left, light), (right, light)]);
        }
    }
    let mean = seen.iter().map(|(_, light)| light).sum::<f64>() / seen.len() as f64;
    if mean > 0.0 {
        fitted(seen.iter().map(|(from, light)| (*from, light / mean - 1.0)), axes, TURNS)
    } else {
        vec![0.0; axes.len()]
    }
}

/// Where light along an axis comes from, above the horizon.
fn from_above(axis: &DVec4) -> DVec3 {
    let d = axis.truncate();
    if d.y > 0.0 { d } else { -d }
}

/// Sum over the degrees 0 to 2 of the products of spherical harmonics, of two unit vectors with this cosine.
fn harmonics(cosine: f64) -> f64 {
    (1.0 + 3.0 * cosine + 5.0 * (1.5 * cosine * cosine - 0.5)) / (4.0 * PI)
}

/// Values at the axes whose moments are nearest to those of `seen`, even in the upper hemisphere: the least squares (Tikhonov) with none below -1,
/// by projected Gauss-Seidel.
fn nearest(
    seen: impl Iterator<Item = (DVec3, f64)> + Clone,
    axes: &[DVec4],
    turns: u32,
) -> Vec<f64> {
    let above: Vec<DVec3> = axes.iter().map(from_above).collect();
    let solid_angle = 2.0 * PI / seen.clone().count() as f64;
    let moment_at =
        |a: &DVec3| seen.clone().map(|(v, f)| f * harmonics(a.dot(v))).sum::<f64>() * solid_angle;
    let wanted: Vec<f64> = above.iter().map(moment_at).collect();
    let product = |i: usize, j: usize| {
        let ridge = if i == j { RIDGE } else { 0.0 };
        ridge + harmonics(above[i].dot(above[j])) * (4.0 * PI * axes[j].w)
    };
    let products: Vec<Vec<f64>> =
        (0..axes.len()).map(|i| (0..axes.len()).map(|j| product(i, j)).collect()).collect();
    let mut values = vec![0.0f64; axes.len()];
    for _ in 0..turns {
        for i in 0..axes.len() {
            let row = &products[i];
            let all: f64 = row.iter().zip(&values).map(|(p, v)| p * v).sum();
            values[i] = (values[i] + (wanted[i] - all) / row[i]).max(-1.0);
        }
    }
    values
}

/// The same with a sum of 0: the mean sky is exact.
fn fitted(
    seen: impl Iterator<Item = (DVec3, f64)> + Clone,
    axes: &[DVec4],
    turns: u32,
) -> Vec<f32> {
    let values = nearest(seen, axes, turns);
    let excess: f64 = values.iter().zip(axes).map(|(v, a)| 2.0 * a.w * v).sum();
    let mean = 1.0 + excess;
    let over = |v: &f64| if mean > 0.0 { ((v - excess) / mean) as f32 } else { 0.0 };
    values.iter().map(over).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::light_grid::Directions;

    fn inputs(sun: DVec3) -> SkyInputs {
        SkyInputs {
            kind: SkyKind::Atmosphere,
            sun_direction: sun.normalize().as_vec3(),
            sun_irradiance: 1.0,
            angular_diameter: 0.01,
            camera_altitude: 0.0,
            ground_albedo: Vec3::splat(0.2),
            has_ground: true,
            sea_wind: None,
        }
    }

    /// Points even in the cosine and in azimuth.
    fn hemisphere() -> impl Iterator<Item = DVec3> + Clone {
        (0..40).flat_map(|i| {
            (0..80).map(move |j| {
                let up = (f64::from(i) + 0.5) / 40.0;
                let (sin, cos) = (PI * (f64::from(j) + 0.5) / 40.0).sin_cos();
                let across = (1.0 - up * up).sqrt();
                DVec3::new(across * cos, up, across * sin)
            })
        })
    }

    #[test]
    fn what_is_even_stays_even() {
        for set in Directions::ALL {
            let axes = set.axes();
            let even = fitted(hemisphere().map(|v| (v, 0.0)), axes, TURNS);
            assert_eq!(even, vec![0.0; axes.len()]);
            let uniform =
                SkyInputs { kind: SkyKind::Uniform { radiance: 3.0 }, ..inputs(DVec3::Y) };
            assert_eq!(unevenness(&uniform, 1000.0, axes), vec![0.0; axes.len()]);
        }
    }

    /// Real spherical harmonics of degrees 0 to 2, orthonormal.
    fn basis(v: DVec3) -> [f64; 9] {
        let [a, b, c] = [1.0, 3.0, 15.0].map(|n: f64| (n / (4.0 * PI)).sqrt());
        let last = 0.5 * (5.0 / (4.0 * PI)).sqrt() * (3.0 * v.z * v.z - 1.0);
        let (xy, xz, yz) = (v.x * v.y, v.x * v.z, v.y * v.z);
        [
            a,
            b * v.x,
            b * v.y,
            b * v.z,
            c * xy,
            c * yz,
            c * xz,
            0.5 * c * (v.x * v.x - v.y * v.y),
            last,
        ]
    }

    /// A sky that is brighter on one side, so that no value is bounded: no other values near them have moments nearer to its
    /// own, and they point to that side.
    #[test]
    fn a_bright_side_is_the_bright_side() {
        for (set, side) in
            Directions::ALL.into_iter().flat_map(|set| SIDES.map(|side| (set.axes(), side)))
        {
            let light = |v: DVec3| 0.5 * v.dot(side);
            let values = nearest(hemisphere().map(|v| (v, light(v))), set, TURNS);
            let half = nearest(hemisphere().map(|v| (v, light(v))), set, TURNS / 2);
            assert!(half.iter().zip(&values).all(|(a, b)| (a - b).abs() < 1e-6), "{half:?}");
            let wanted = hemisphere().fold([0.0; 9], |sum: [f64; 9], v| {
                let b = basis(v);
                std::array::from_fn(|j| sum[j] + light(v) * b[j] * 2.0 * PI / 3200.0)
            });
            let off = |values: &[f64]| -> f64 {
                let moment = |j: usize| -> f64 {
                    let of_axis = |(v, a): (&f64, &DVec4)| v * a.w * basis(from_above(a))[j];
                    values.iter().zip(set).map(of_axis).sum::<f64>() * 4.0 * PI
                };
                (0..9).map(|j| (moment(j) - wanted[j]).powi(2)).sum()
            };
            // As far as what the values cost does not count.
            for axis in 0..set.len() {
                for step in [-0.03, 0.03] {
                    let mut others = values.clone();
                    others[axis] += step;
                    assert!(off(&others) > off(&values), "{side}: {axis}, {step}");
                }
            }
            let pairs = values.iter().zip(set);
            let found: f64 = pairs.map(|(v, a)| v * 12.0 * a.w * from_above(a).dot(side)).sum();
            assert!(found > 0.5, "{side}: {values:?}");
        }
    }

    const SIDES: [DVec3; 4] = [DVec3::X, DVec3::Z, DVec3::NEG_Z, DVec3::new(0.6, 0.0, -0.8)];

    /// The sun low in the west: what comes from there is the brightest, and nothing is negative.
    #[test]
    fn a_low_sun_makes_its_side_bright() {
        for set in Directions::ALL {
            let axes = set.axes();
            let [west, east] =
                [-1.0, 1.0].map(|x| unevenness(&inputs(DVec3::new(x, 0.08, 0.0)), 1500.0, axes));
            println!("{set:?}: west {west:?}, east {east:?}");
            let most =
                |of: &[f32]| (0..of.len()).max_by(|a, b| of[*a].total_cmp(&of[*b])).expect("some");
            let (brightest, opposite) = (most(&west), most(&east));
            assert!(from_above(&axes[brightest]).x < -0.5, "{}", axes[brightest]);
            assert!(west[brightest] > 0.3, "{west:?}");
            assert!(from_above(&axes[opposite]).x > 0.5, "{}", axes[opposite]);
            assert!([west, east].iter().flatten().all(|v| *v >= -1.0));
        }
    }
}
