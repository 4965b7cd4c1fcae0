//! Twin of `shaders/frame/light_project.wgsl`, in double precision.

use glam::{DVec2, DVec3};

use crate::frame::gpu_data::{LightView, Particle};

/// Where a particle is in the picture of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InLight {
    /// Depth of its first point from the light, m, from the plane through the camera.
    pub nearest: f64,
    /// Lowest corner of its bounds, in tiles.
    pub low: DVec2,
    /// Highest corner.
    pub high: DVec2,
}

/// A direction of a light's view.
pub fn axis(v: [f32; 4]) -> DVec3 {
    DVec3::new(v[0].into(), v[1].into(), v[2].into())
}

/// A point (m, relative to the camera) in the picture of a light, in tiles.
pub fn place(view: &LightView, point: DVec3) -> DVec2 {
    let in_picture = DVec2::new(point.dot(axis(view.axis_u)), point.dot(axis(view.axis_v)));
    let origin = DVec2::new(view.origin[0].into(), view.origin[1].into());
    (in_picture - origin) * f64::from(view.inverse_tile_size)
}

/// The particle in the picture, which it may leave.
pub fn project(view: &LightView, particle: &Particle) -> InLight {
    let centre = DVec3::from(particle.centre.map(f64::from));
    let radius = f64::from(particle.radius);
    let middle = place(view, centre);
    let reach = radius * f64::from(view.inverse_tile_size);
    InLight {
        nearest: -centre.dot(axis(view.towards)) - radius,
        low: middle - reach,
        high: middle + reach,
    }
}
