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
