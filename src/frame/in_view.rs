//! What of a scene may be in a picture: decided on the host from boxes, and never too little.

use glam::DVec3;

use super::cpu::rings::RIM_RADIUS;
use super::rings;
use crate::scene::{Camera, Scene};

/// What may be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InView {
    /// Some particle.
    pub clouds: bool,
    /// The ground.
    pub ground: bool,
}

impl InView {
    /// Everything.
    pub const ALL: Self = Self { clouds: true, ground: true };
}

/// Margin of all tests, relative to the distances in them: the device computes with f32, here a
/// thousand of its steps count as nothing.
const MARGIN: f64 = 1e-4;

/// A box, m, relative to the eye.
#[derive(Clone, Copy, Debug)]
struct Around {
    low: DVec3,
    high: DVec3,
}

impl Around {
    fn of(low: DVec3, high: DVec3, eye: DVec3) -> Self {
        let (low, high) = (low - eye, high - eye);
        let margin = MARGIN * low.abs().max(high.abs()).max_element();
        Self { low: low - margin, high: high + margin }
    }

    /// Farthest place of the box along a direction.
    fn farthest(&self, along: DVec3) -> f64 {
        let pick = |axis: usize| {
            let side = if along[axis] > 0.0 { self.high } else { self.low };
            side[axis] * along[axis]
        };
        pick(0) + pick(1) + pick(2)
    }
}

/// The rays to the corners of a picture.
fn corners(camera: &Camera, size: [u32; 2]) -> [DVec3; 4] {
    let basis = camera.basis();
    let right = basis.right * camera.half_width();
    let up = basis.up * (camera.half_width() * f64::from(size[1]) / f64::from(size[0]));
    // Around the picture in turn.
    [-right - up, right - up, right + up, up - right].map(|offset| basis.forward + offset)
}

/// Whether the pyramid of these rays may reach the box: not where a side of either parts them.
fn reaches(corners: &[DVec3; 4], around: &Around) -> bool {
    let side = |i: usize| corners[i].cross(corners[(i + 1) % 4]);
    let middle = corners.iter().sum::<DVec3>();
    for i in 0..4 {
        let normal = side(i);
        let inward = if normal.dot(middle) < 0.0 { -normal } else { normal };
        if around.farthest(inward) < 0.0 {
            return false;
        }
    }
    if around.farthest(middle) < 0.0 {
        return false;
    }
    // A box all on one side of the eye, that every ray leaves behind.
    (0..3).all(|axis| {
        let beyond = around.low[axis] > 0.0 && corners.iter().all(|c| c[axis] <= 0.0);
        let before = around.high[axis] < 0.0 && corners.iter().all(|c| c[axis] >= 0.0);
        !beyond && !before
    })
}

/// What of a scene may be seen at a time (s) in a picture of this size (pixels).
pub fn in_view(scene: &Scene, time: f64, size: [u32; 2]) -> InView {
    let eye = scene.camera.position;
    let corners = corners(&scene.camera, size);
    let field = scene.clouds.as_ref().is_some_and(|field| {
        // A particle's radius is at most this share of its cloud's height, its centre no higher
        // than the cloud, and no lower than 0.75 radii over the base.
        let radius = f64::from(RIM_RADIUS) * field.thickness;
        let base = field.base + field.wind.y * time;
        let reach = rings::reach(field) + radius;
        let low = DVec3::new(eye.x - reach, base - radius, eye.z - reach);
        let high = DVec3::new(eye.x + reach, base + field.thickness + radius, eye.z + reach);
        reaches(&corners, &Around::of(low, high, eye))
    });
    let mut listed = Around { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
    for particle in &scene.particles {
        listed.low = listed.low.min(particle.centre - particle.radius);
        listed.high = listed.high.max(particle.centre + particle.radius);
    }
    let listed =
        !scene.particles.is_empty() && reaches(&corners, &Around::of(listed.low, listed.high, eye));
    // From below or on the ground all rays may meet it.
    let down = corners.iter().any(|c| c.y < MARGIN * c.length());
    let ground = scene.effective_ground().is_some() && (down || eye.y <= 0.0);
    // A sea shows clouds wherever they are.
    let any = scene.clouds.is_some() || !scene.particles.is_empty();
    let mirrored = ground && scene.is_sea() && any;
    InView { clouds: field || listed || mirrored, ground }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{CloudField, ParticleSpec};

    const SIZE: [u32; 2] = [160, 90];

    fn looking(position: DVec3, ahead: DVec3) -> Camera {
        Camera { position, target: position + 1000.0 * ahead, ..Camera::default() }
    }

    #[test]
    fn a_field_is_seen_from_below_and_from_above_but_not_by_looking_away() {
        let mut scene = Scene { clouds: Some(CloudField::default()), ..Scene::default() };
        let mut seen = |height: f64, ahead: DVec3| {
            scene.camera = looking(DVec3::new(1e5, height, -3e4), ahead);
            in_view(&scene, 12.5, SIZE)
        };
        let up = DVec3::new(0.0, 1.0, -1.0);
        let level = DVec3::NEG_Z;
        assert_eq!(seen(2.0, up), InView { clouds: true, ground: false });
        assert_eq!(seen(3000.0, up), InView { clouds: false, ground: false });
        assert_eq!(seen(3000.0, level), InView { clouds: true, ground: true });
        // From below down: ground, without the clouds that throw shadows on it.
        assert_eq!(seen(500.0, -up), InView { clouds: false, ground: true });
    }

    #[test]
    fn clouds_are_seen_in_the_sea() {
        let mut scene = Scene { clouds: Some(CloudField::default()), ..Scene::default() };
        scene.camera = looking(DVec3::new(0.0, 500.0, 0.0), DVec3::new(0.0, -1.0, 1.0));
        assert_eq!(in_view(&scene, 0.0, SIZE), InView { clouds: false, ground: true });
        scene.ground = Some(crate::scene::Ground::sea(5.0, DVec3::ZERO));
        assert_eq!(in_view(&scene, 0.0, SIZE), InView { clouds: true, ground: true });
        scene.clouds = None;
        assert_eq!(in_view(&scene, 0.0, SIZE), InView { clouds: false, ground: true });
    }

    /// Every particle that the host's projection finds in the picture is found here too.
    #[test]
    fn nothing_that_is_seen_is_missed() {
        let (mut found, mut missed) = (0, 0);
        let mut word = 1u32;
        let mut random = |most: f64| {
            word = crate::frame::cpu::noise::hash(word);
            (f64::from(word) / f64::from(u32::MAX) * 2.0 - 1.0) * most
        };
        for _ in 0..4000 {
            let mut place = |most| DVec3::new(random(most), random(most), random(most));
            let camera = looking(place(800.0), place(1.0));
            let centre = place(1000.0);
            let radius = 20.0 + random(19.0);
            let particle = ParticleSpec {
                centre,
                radius,
                extinction: 1.0,
                shape: "uniform".to_owned(),
                orientation: glam::DQuat::IDENTITY,
            };
            let scene = Scene { camera, particles: vec![particle], ..Scene::default() };
            let seen = in_view(&scene, 0.0, SIZE).clouds;
            // The sphere's own test, by the cone around the picture's sides.
            let corners = corners(&scene.camera, SIZE);
            let middle = corners.iter().sum::<DVec3>();
            let inside = (0..4).all(|i| {
                let normal = corners[i].cross(corners[(i + 1) % 4]).normalize();
                let inward = normal * normal.dot(middle).signum();
                inward.dot(centre - camera.position) > -radius
            });
            let exact = inside && middle.normalize().dot(centre - camera.position) > -radius;
            // A box around a sphere is seen where the sphere is, and hardly more often.
            assert!(seen || !exact, "{centre} {radius} {camera:?}");
            found += u32::from(seen);
            missed += u32::from(seen && !exact);
        }
        assert!(found > 150 && missed < found / 10, "{found} {missed}");
    }
}
