//! The camera, and its axes in the world.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::vector;

/// A camera: a pinhole for the frame, a thin lens with a shutter for reference pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// The pinhole, m.
    #[serde(with = "vector::three")]
    pub position: DVec3,
    /// A point in the middle of the picture, m.
    #[serde(with = "vector::three")]
    pub target: DVec3,
    /// A direction that is up in the picture, any length. Where it is parallel to the view,
    /// -Z is up instead, so that a look straight down has a defined picture.
    #[serde(with = "vector::three", default = "default_up")]
    pub up: DVec3,
    /// Horizontal field of view from edge to edge, degrees.
    #[serde(default = "default_fov_x")]
    pub fov_x: f64,
    /// Diameter of a thin lens, m; 0 is a pinhole. Only reference pictures have it.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub aperture: f64,
    /// Distance along the view axis at which the lens is sharp, m; that of the target if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_distance: Option<f64>,
    /// How long the shutter is open, s, from the picture's time on. Only reference pictures have it.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub shutter: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

fn default_up() -> DVec3 {
    DVec3::Y
}

fn default_fov_x() -> f64 {
    60.0
}

/// The camera's axes: orthogonal unit vectors in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraBasis {
    /// Into the picture.
    pub forward: DVec3,
    /// To the picture's right.
    pub right: DVec3,
    /// To the picture's upper edge.
    pub up: DVec3,
}

impl Default for Camera {
    /// Eye height above the ground, looking along -Z and somewhat up.
    fn default() -> Self {
        Self {
            position: DVec3::new(0.0, 1.7, 0.0),
            target: DVec3::new(0.0, 300.0, -1000.0),
            up: default_up(),
            fov_x: default_fov_x(),
            aperture: 0.0,
            focus_distance: None,
            shutter: 0.0,
        }
    }
}

impl Camera {
    /// The axes. Orthonormal for every camera that passes the checks of a scene.
    pub fn basis(&self) -> CameraBasis {
        let forward = vector::unit(self.target - self.position).unwrap_or(DVec3::NEG_Z);
        let up = vector::unit(self.up).unwrap_or(DVec3::Y);
        // Below this sine the direction of the cross product is mostly rounding.
        const PARALLEL: f64 = 1e-9;
        let right = [up, DVec3::NEG_Z, DVec3::Y]
            .into_iter()
            .map(|up| forward.cross(up))
            .find(|right| right.length() > PARALLEL)
            .unwrap_or(DVec3::X)
            .normalize();
        CameraBasis { forward, right, up: right.cross(forward) }
    }

    /// Distance along the view axis at which a lens is sharp, m.
    pub fn focus(&self) -> f64 {
        self.focus_distance.unwrap_or_else(|| self.target.distance(self.position))
    }

    /// Half the width of the picture at distance 1: the tangent of half the field of view.
    pub fn half_width(&self) -> f64 {
        (0.5 * self.fov_x.to_radians()).tan()
    }

    /// The travel direction of the ray through a point of the picture: (0, 0) is the upper left
    /// corner and (1, 1) the lower right one; `aspect` is width over height.
    pub fn ray(&self, x: f64, y: f64, aspect: f64) -> DVec3 {
        let CameraBasis { forward, right, up } = self.basis();
        let half = self.half_width();
        (forward + right * ((2.0 * x - 1.0) * half) + up * ((1.0 - 2.0 * y) * half / aspect))
            .normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_orthonormal(basis: &CameraBasis) {
        let CameraBasis { forward, right, up } = *basis;
        for v in [forward, right, up] {
            assert!((v.length() - 1.0).abs() < 1e-12, "{basis:?}");
        }
        for d in [forward.dot(right), right.dot(up), up.dot(forward)] {
            assert!(d.abs() < 1e-12, "{basis:?}");
        }
    }

    #[test]
    fn looks_along_minus_z_with_x_to_the_right() {
        let camera = Camera {
            position: DVec3::ZERO,
            target: DVec3::new(0.0, 0.0, -5.0),
            ..Camera::default()
        };
        let basis = camera.basis();
        assert_eq!((basis.forward, basis.right, basis.up), (DVec3::NEG_Z, DVec3::X, DVec3::Y));
    }

    #[test]
    fn every_view_has_axes_even_along_up() {
        for target in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, -2.0, 0.3)] {
            for up in [DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z, DVec3::splat(1e300)] {
                for sign in [1.0, -1.0] {
                    let camera = Camera {
                        position: DVec3::ZERO,
                        target: target * sign,
                        up,
                        ..Camera::default()
                    };
                    assert_orthonormal(&camera.basis());
                }
            }
        }
    }

    #[test]
    fn the_picture_is_as_wide_as_the_field_of_view() {
        let camera = Camera { fov_x: 90.0, ..Camera::default() };
        let (left, right) = (camera.ray(0.0, 0.5, 16.0 / 9.0), camera.ray(1.0, 0.5, 16.0 / 9.0));
        assert!(left.dot(right).abs() < 1e-12);
        assert!((camera.ray(0.5, 0.5, 1.0) - camera.basis().forward).length() < 1e-12);
        assert!(camera.ray(0.5, 0.0, 1.0).dot(camera.basis().up) > 0.0);
    }
}
