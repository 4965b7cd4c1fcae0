//! Twin of `shaders/frame/light_project.wgsl`, in double precision.

use glam::{DVec2, DVec3};

use crate::frame::gpu_data::{LightView, Particle};
use crate::frame::view::{unwarped, warped};

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

/// A point of a light's picture (m, relative to the camera) in tiles.
fn in_tiles(view: &LightView, place: DVec2) -> DVec2 {
    let origin = DVec2::new(view.origin[0].into(), view.origin[1].into());
    (warped(place, view.warp.into()) - origin) * f64::from(view.inverse_tile_size)
}

/// A point (m, relative to the camera) in the picture of a light, m.
fn place(view: &LightView, point: DVec3) -> DVec2 {
    DVec2::new(point.dot(axis(view.axis_u)), point.dot(axis(view.axis_v)))
}

/// The particle in the picture, which it may leave.
pub fn project(view: &LightView, particle: &Particle) -> InLight {
    let centre = DVec3::from(particle.centre.map(f64::from));
    let radius = f64::from(particle.radius);
    let middle = place(view, centre);
    InLight {
        nearest: -centre.dot(axis(view.towards)) - radius,
        low: in_tiles(view, middle - radius),
        high: in_tiles(view, middle + radius),
    }
}

/// Whether the line of light through a place of the picture, in tiles, meets the particle.
pub fn meets(view: &LightView, particle: &Particle, tiles: DVec2) -> bool {
    let origin = DVec2::new(view.origin[0].into(), view.origin[1].into());
    let at = unwarped(tiles / f64::from(view.inverse_tile_size) + origin, view.warp.into());
    let centre = DVec3::from(particle.centre.map(f64::from));
    (at - place(view, centre)).length() < f64::from(particle.radius)
}
