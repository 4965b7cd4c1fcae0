//! Twin of `shaders/frame/light.wgsl` and `shaders/shared/light_lists.wgsl`, in double precision
//! and without lists: every particle is asked.

use glam::{DMat3, DQuat, DVec3};

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
    let profile = tables.chord_profile(particle.shape, end(1.0), end(-1.0));
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
    // Share of the points' spread that decides between equal fits.
    const RIDGE: f64 = 1e-9;
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let mut moments = DMat3::from_diagonal(DVec3::splat(RIDGE));
    let mut sum = DVec3::ZERO;
    // The points lie evenly around the origin: value and slope do not mix.
    for (point, value) in points.iter().zip(values) {
        moments += DMat3::from_cols(*point * point.x, *point * point.y, *point * point.z);
        sum += *point * (value - mean);
    }
    (mean, moments.inverse() * sum)
}
