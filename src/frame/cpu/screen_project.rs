//! Twin of `shaders/frame/screen_project.wgsl`, in double precision.

use glam::{DVec2, DVec3};

use crate::frame::gpu_data::{FrameUniforms, Particle};

/// Where a particle is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnScreen {
    /// Distance from the eye, m; 0 around it.
    pub nearest: f64,
    /// Upper left corner of its bounds, pixels, inside the picture.
    pub low: DVec2,
    /// Lower right corner.
    pub high: DVec2,
}

/// Bounds of the picture of a sphere along one axis, in tangents of the angle from the view axis.
fn tangent_bounds(x: f64, z: f64, radius: f64) -> [f64; 2] {
    let distance = x.hypot(z);
    if distance <= radius {
        return [f64::NEG_INFINITY, f64::INFINITY];
    }
    let (middle, half) = (x.atan2(z), (radius / distance).asin());
    let quarter = std::f64::consts::FRAC_PI_2;
    let bound = |angle: f64| match angle {
        a if a <= -quarter => f64::NEG_INFINITY,
        a if a >= quarter => f64::INFINITY,
        a => a.tan(),
    };
    [bound(middle - half), bound(middle + half)]
}

/// The particle on the screen, if any part of it can be there.
pub fn project(frame: &FrameUniforms, particle: &Particle) -> Option<OnScreen> {
    let axis = |v: [f32; 4]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
    let (right, up) = (axis(frame.right), axis(frame.up));
    let centre = DVec3::from(particle.centre.map(f64::from));
    let radius = f64::from(particle.radius);
    let z = centre.dot(axis(frame.forward));
    if z + radius <= 0.0 || particle.extinction <= 0.0 {
        return None;
    }
    let bounds = |axis: DVec3| {
        let tangent = axis.length();
        tangent_bounds(centre.dot(axis) / tangent, z, radius).map(|t| t / tangent)
    };
    let ([left, right], [bottom, top]) = (bounds(right), bounds(up));
    if left >= 1.0 || right <= -1.0 || bottom >= 1.0 || top <= -1.0 {
        return None;
    }
    let size = DVec2::new(frame.size[0].into(), frame.size[1].into());
    let pixels = |x: f64, y: f64| {
        DVec2::new(x.clamp(-1.0, 1.0) + 1.0, 1.0 - y.clamp(-1.0, 1.0)) * 0.5 * size
    };
    Some(OnScreen {
        nearest: (centre.length() - radius).max(0.0),
        low: pixels(left, top),
        high: pixels(right, bottom),
    })
}
