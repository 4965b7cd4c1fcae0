//! Twin of `shaders/frame/light.wgsl` and `shaders/shared/light_lists.wgsl`, in double precision
//! and without lists: every particle is asked.

use glam::{DQuat, DVec3};

use crate::frame::gpu_data::Particle;
use crate::tables::TableSet;

/// Optical depth on the two sides of a point on a line of light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Occlusion {
    /// Towards the light.
    pub front: f64,
    /// Away from it.
    pub behind: f64,
}

/// What one particle takes from the line of light through a point (m, relative to the camera).
pub fn particle_occlusion(
    tables: &TableSet,
    particle: &Particle,
    towards: DVec3,
    point: DVec3,
) -> Occlusion {
    let radius = f64::from(particle.radius);
    let offset = point - DVec3::from(particle.centre.map(f64::from));
    let along = offset.dot(towards);
    let across = offset - along * towards;
    let square = radius * radius - across.length_squared();
    if square <= 0.0 {
        return Occlusion::default();
    }
    let half = square.sqrt();
    let to_own = DQuat::from_array(particle.orientation.map(f64::from));
    let end = |sign: f64| to_own * ((across + sign * half * towards) / radius);
    let profile = tables.chord_step(particle.shape, end(1.0), end(-1.0));
    let tau = f64::from(particle.extinction) * 2.0 * half * f64::from(profile.mean_density);
    let share = f64::from(profile.fraction(((half - along) / (2.0 * half)) as f32));
    Occlusion { front: tau * share, behind: tau * (1.0 - share) }
}

/// What all particles but one take from the line of light through a point.
pub fn occlusion(
    tables: &TableSet,
    particles: &[Particle],
    left_out: Option<usize>,
    towards: DVec3,
    point: DVec3,
) -> Occlusion {
    let others = particles.iter().enumerate().filter(|(i, _)| Some(*i) != left_out);
    others.fold(Occlusion::default(), |sum, (_, other)| {
        let taken = particle_occlusion(tables, other, towards, point);
        Occlusion { front: sum.front + taken.front, behind: sum.behind + taken.behind }
    })
}

/// The points of a particle where its light is measured, in radii from its centre: `samples` is
/// 1 (the centre), 2 (along the light), 4 (a tetrahedron) or 8 (a cube).
pub fn sample_points(samples: u32, towards: DVec3) -> Vec<DVec3> {
    // The second moment of a uniform ball along any axis is 1/5.
    let distance = (3.0_f64 / 5.0).sqrt();
    let sign = |index: u32, bit: u32| if index & bit == 0 { -1.0 } else { 1.0 };
    let direction = |i: u32| match samples {
        1 => DVec3::ZERO,
        2 => sign(i, 1) * towards,
        4 => DVec3::new(sign(i, 1), sign(i, 2), sign(i, 1) * sign(i, 2)).normalize(),
        _ => DVec3::new(sign(i, 1), sign(i, 2), sign(i, 4)).normalize(),
    };
    (0..samples).map(|i| distance * direction(i)).collect()
}

/// Affine function of the place by least squares: its value at the origin and its slope. Of all
/// that fit equally well, the one with the smallest slope.
pub fn affine_fit(points: &[DVec3], values: &[f64]) -> (f64, DVec3) {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    // The points lie evenly around the origin: value and slope do not mix.
    let moments = |v: DVec3| points.iter().map(|p| *p * p.dot(v)).sum::<DVec3>();
    let sum: DVec3 = points.iter().zip(values).map(|(p, v)| *p * (v - mean)).sum();
    // Conjugate gradients from 0 end after as many steps as there are dimensions, and stay among
    // the directions that the points span.
    let (mut slope, mut rest) = (DVec3::ZERO, sum);
    let mut step = rest;
    for _ in 0..3 {
        if rest.length() <= 1e-12 * sum.length() {
            break;
        }
        let turned = moments(step);
        let before = rest.length_squared();
        let length = before / step.dot(turned);
        slope += length * step;
        rest -= length * turned;
        step = rest + step * (rest.length_squared() / before);
    }
    (mean, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_affine_function_is_fitted_exactly() {
        let (value, slope) = (2.5, DVec3::new(0.3, -1.7, 0.9));
        let towards = DVec3::new(2.0, 3.0, 6.0) / 7.0;
        for (samples, seen) in
            [(1, DVec3::ZERO), (2, slope.dot(towards) * towards), (4, slope), (8, slope)]
        {
            let points = sample_points(samples, towards);
            let values: Vec<f64> = points.iter().map(|p| value + slope.dot(*p)).collect();
            let (a, b) = affine_fit(&points, &values);
            // Roundings of some ten sums of numbers near 1.
            assert!((a - value).abs() < 1e-14 && (b - seen).length() < 1e-13, "{samples}: {b}");
        }
    }
}
