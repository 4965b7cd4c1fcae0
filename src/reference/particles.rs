//! A particle in the world, with its density.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::geometry::Ray;
use crate::medium::Shape;

/// One particle in the world.
#[derive(Clone, Debug)]
pub struct WorldParticle {
    /// m.
    pub centre: DVec3,
    /// m.
    pub radius: f64,
    /// 1/m at density 1.
    pub extinction: f64,
    /// From world axes to the particle's own.
    pub to_own: DQuat,
    /// Its density.
    pub shape: Arc<Shape>,
}

impl WorldParticle {
    /// Whether light can meet it.
    pub fn has_matter(&self) -> bool {
        self.radius > 0.0 && self.extinction > 0.0 && self.centre.is_finite()
    }

    /// Optical depth of a part of a ray that lies within the particle, begin and end in m.
    pub fn optical_depth(&self, ray: &Ray, begin: f64, end: f64) -> f64 {
        let own = |t: f64| self.to_own * ((ray.at(t) - self.centre) / self.radius);
        let mut mean = [0.0];
        self.shape.segment_means(own(begin), own(end), &mut mean);
        self.extinction * (end - begin) * mean[0]
    }

    /// Where a ray enters and leaves, m along it; before the origin is negative.
    pub fn span(&self, ray: &Ray) -> Option<(f64, f64)> {
        let to_centre = self.centre - ray.origin;
        let middle = to_centre.dot(ray.dir);
        let half_squared =
            self.radius * self.radius - (to_centre - middle * ray.dir).length_squared();
        (half_squared > 0.0).then(|| {
            let half = half_squared.sqrt();
            (middle - half, middle + half)
        })
    }

    /// Extinction at a point, 1/m.
    pub fn extinction_at(&self, point: DVec3) -> f64 {
        let offset = (point - self.centre) / self.radius;
        if offset.length_squared() >= 1.0 {
            return 0.0;
        }
        self.extinction * self.shape.density(self.to_own * offset)
    }
}
