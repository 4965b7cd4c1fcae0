//! From a place on the picture to a ray: pinhole or thin lens.

use std::f64::consts::TAU;

use glam::DVec3;
use serde::Serialize;

use super::geometry::Ray;
use crate::scene::Camera;

/// A lens in place of the pinhole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Lens {
    /// Diameter of the aperture, m; 0 is a pinhole.
    pub aperture: f64,
    /// Distance along the view axis of the plane that is sharp, m.
    pub focus: f64,
}

/// Where in a pixel samples lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Filter {
    /// Evenly over the pixel's area: no stairs at edges.
    #[default]
    Box,
    /// All in the pixel's middle, as the frame's rays, so that edges compare like with like.
    Centre,
}

/// A camera ready to make rays of pictures of one size.
#[derive(Clone, Copy, Debug)]
pub struct View {
    position: DVec3,
    forward: DVec3,
    /// Half the picture's width at distance 1.
    right: DVec3,
    /// Half the picture's height at distance 1.
    up: DVec3,
    size: [f64; 2],
    lens: Option<Lens>,
    /// Where samples lie.
    pub filter: Filter,
}

impl View {
    /// The rays of a camera for a picture of this size, pixels.
    pub fn new(camera: &Camera, size: [u32; 2], lens: Option<Lens>, filter: Filter) -> Self {
        let basis = camera.basis();
        let size = size.map(f64::from);
        let half_width = camera.half_width();
        Self {
            position: camera.position,
            forward: basis.forward,
            right: basis.right * half_width,
            up: basis.up * (half_width * size[1] / size[0]),
            size,
            lens: lens.filter(|lens| lens.aperture > 0.0),
            filter,
        }
    }

    /// The ray from a place on the lens (uniform numbers) to a place on the picture in pixels from
    /// its upper left corner.
    pub fn ray(&self, place: [f64; 2], lens: [f64; 2]) -> Ray {
        let [x, y] = [0, 1].map(|axis| 2.0 * place[axis] / self.size[axis] - 1.0);
        // Length along the view axis: 1.
        let through = self.forward + self.right * x - self.up * y;
        match self.lens {
            None => Ray { origin: self.position, dir: through.normalize() },
            Some(Lens { aperture, focus }) => {
                let (reach, turn) = (0.5 * aperture * lens[0].sqrt(), TAU * lens[1]);
                let offset = (self.right.normalize() * turn.cos()
                    + self.up.normalize() * turn.sin())
                    * reach;
                let dir = (through * focus - offset).normalize();
                Ray { origin: self.position + offset, dir }
            }
        }
    }

    /// Whether rays differ by their place on the lens.
    pub fn has_lens(&self) -> bool {
        self.lens.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position: DVec3::new(3.0, 2.0, 1.0),
            target: DVec3::new(-4.0, 3.0, 9.0),
            fov_x: 50.0,
            ..Camera::default()
        }
    }

    #[test]
    fn a_pinholes_rays_are_the_cameras() {
        let view = View::new(&camera(), [40, 30], None, Filter::Box);
        for (x, y) in [(0.0, 0.0), (40.0, 30.0), (12.5, 3.25)] {
            let ray = view.ray([x, y], [0.3, 0.7]);
            let expected = camera().ray(x / 40.0, y / 30.0, 40.0 / 30.0);
            assert_eq!(ray.origin, camera().position);
            assert!((ray.dir - expected).length() < 1e-14);
        }
    }

    /// All rays of one place on the picture meet where that place's pinhole ray meets the sharp
    /// plane, and leave from the lens.
    #[test]
    fn a_lens_is_sharp_at_its_focus() {
        let lens = Lens { aperture: 0.5, focus: 20.0 };
        let view = View::new(&camera(), [40, 30], Some(lens), Filter::Box);
        let forward = camera().basis().forward;
        let place = [10.0, 25.0];
        let pinhole = camera().ray(10.0 / 40.0, 25.0 / 30.0, 40.0 / 30.0);
        let sharp = camera().position + pinhole * (20.0 / pinhole.dot(forward));
        for u in [[0.0, 0.0], [0.25, 0.6], [0.999, 0.1]] {
            let ray = view.ray(place, u);
            let offset = ray.origin - camera().position;
            assert!((offset.length() - 0.25 * u[0].sqrt()).abs() < 1e-12);
            assert!(offset.dot(forward).abs() < 1e-12);
            let miss = (sharp - ray.origin).cross(ray.dir).length();
            assert!(miss < 1e-12, "{miss}");
        }
    }
}
