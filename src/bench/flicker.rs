//! Flicker: what is left between two frames of a flight when the clouds are followed along wind and camera.

use glam::{DVec2, DVec3, DVec4};

use crate::reference::{Filter, View, Window};
use crate::scene::Scene;

/// Pixels whose clouds are thinner are left out of the flicker: their distance is that of no surface.
const OPAQUE: f64 = 0.5;
/// A place that was seen at another distance (relative) was hidden in the frame before.
const SAME_DISTANCE: f64 = 0.05;

/// A frame as flicker needs it.
pub struct Seen {
    /// The scene with the frame's camera.
    pub scene: Scene,
    /// s.
    pub time: f64,
    /// Radiance and opacity of a window.
    pub radiance: Vec<DVec4>,
    /// Distance of the clouds in the same pixels, m.
    pub distance: Vec<f64>,
}

/// A pixel of the later frame whose cloud the earlier one shows too.
pub struct Followed {
    /// Its number in the window.
    pub pixel: usize,
    /// The four pixels of the earlier frame around that cloud's place then.
    pub corners: [usize; 4],
    /// Their shares in what the earlier frame shows there.
    pub shares: [f64; 4],
}

/// The pixels that can be followed from one frame to the next. `size` is that of the whole pictures.
pub fn followed(before: &Seen, after: &Seen, size: [u32; 2], window: Window) -> Vec<Followed> {
    let view = View::new(&after.scene.camera, size, None, Filter::Centre);
    let wind = after.scene.clouds.as_ref().map_or(DVec3::ZERO, |field| field.wind);
    let drift = wind * (after.time - before.time);
    let opaque = after.radiance.iter().enumerate().filter(|(_, pixel)| pixel.w >= OPAQUE);
    let follow = |(pixel, _): (usize, &DVec4)| {
        let ray = view.ray(middle_of(pixel, window), [0.0; 2]);
        let point = ray.origin + ray.dir * after.distance[pixel] - drift;
        let (corners, shares) = around(before, point, size, window)?;
        Some(Followed { pixel, corners, shares })
    };
    opaque.filter_map(follow).collect()
}

/// The middle of a pixel of a window, in pixels of the whole picture.
pub fn middle_of(pixel: usize, window: Window) -> [f64; 2] {
    let [x, y] = [pixel as u32 % window.size[0], pixel as u32 / window.size[0]];
    [x + window.corner[0], y + window.corner[1]].map(|v| f64::from(v) + 0.5)
}

/// The residual between two frames along the clouds' motion: RMS of the difference between the later
/// frame's pixels and the earlier frame where their clouds were, over the mean; with the number of
/// pixels. `size` is that of the whole pictures.
pub fn residual(
    before: &Seen,
    after: &Seen,
    size: [u32; 2],
    window: Window,
) -> (Option<f64>, usize) {
    let pixels = residuals(before, after, size, window);
    let (square, sum) = pixels.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0, sum.1 + p.1));
    let count = pixels.len() as f64;
    let mean = sum / count.max(1.0);
    let share = (mean > 0.0).then(|| (square / count).sqrt() / mean);
    (share, pixels.len())
}

/// The same pixel by pixel: mean square over red, green and blue, and what the later frame shows, their mean.
pub fn residuals(before: &Seen, after: &Seen, size: [u32; 2], window: Window) -> Vec<(f64, f64)> {
    let of = |Followed { pixel, corners, shares }: Followed| {
        let seen: DVec4 = (0..4).map(|i| before.radiance[corners[i]] * shares[i]).sum();
        let light = after.radiance[pixel];
        let off = (light - seen).truncate();
        (off.length_squared() / 3.0, light.truncate().element_sum() / 3.0)
    };
    followed(before, after, size, window).into_iter().map(of).collect()
}

/// The pixels of the earlier frame around a point, and their shares, where it shows that point.
fn around(
    before: &Seen,
    point: DVec3,
    size: [u32; 2],
    window: Window,
) -> Option<([usize; 4], [f64; 4])> {
    let place = project(&before.scene, point, size)?;
    let [columns, rows] = window.size;
    let at = place - DVec2::from(window.corner.map(f64::from)) - 0.5;
    let low = at.floor();
    let inside = low.x >= 0.0
        && low.y >= 0.0
        && low.x + 1.0 < f64::from(columns)
        && low.y + 1.0 < f64::from(rows);
    if !inside {
        return None;
    }
    let index = low.y as usize * columns as usize + low.x as usize;
    let corners = [index, index + 1, index + columns as usize, index + columns as usize + 1];
    let distance = (point - before.scene.camera.position).length();
    let same = |i: &usize| {
        let there = before.distance[*i];
        before.radiance[*i].w >= OPAQUE && (there / distance - 1.0).abs() < SAME_DISTANCE
    };
    let f = at - low;
    let shares = [(1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y];
    corners.iter().all(same).then_some((corners, shares))
}

/// Where a camera sees a point, pixels from the upper left corner.
fn project(scene: &Scene, point: DVec3, size: [u32; 2]) -> Option<DVec2> {
    let (camera, [width, height]) = (&scene.camera, size.map(f64::from));
    let basis = camera.basis();
    let to = point - camera.position;
    let ahead = to.dot(basis.forward);
    if ahead <= 0.0 {
        return None;
    }
    let half = camera.half_width() * ahead;
    let u = to.dot(basis.right) / half;
    let v = -to.dot(basis.up) / (half * height / width);
    Some(0.5 * DVec2::new((u + 1.0) * width, (v + 1.0) * height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::CloudField;

    const SIZE: [u32; 2] = [64, 48];

    /// A painted wall 1000 m ahead that moves with the wind, seen from a camera that flies; smooth,
    /// so that interpolation between pixels errs by less than a thousandth.
    fn wall(position: DVec3, time: f64, light: impl Fn(DVec3) -> f64) -> Seen {
        let mut scene = Scene::default();
        scene.camera.position = position;
        scene.camera.target = position + DVec3::new(0.05, 0.02, -1.0);
        scene.clouds =
            Some(CloudField { wind: DVec3::new(30.0, -10.0, 0.0), ..CloudField::default() });
        let view = View::new(&scene.camera, SIZE, None, Filter::Centre);
        let drift = DVec3::new(30.0, -10.0, 0.0) * time;
        let (mut radiance, mut distance) = (Vec::new(), Vec::new());
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let ray = view.ray([x, y].map(|v| f64::from(v) + 0.5), [0.0; 2]);
                let far = (-1000.0 - ray.origin.z) / ray.dir.z;
                radiance.push(DVec3::splat(light(ray.at(far) - drift)).extend(1.0));
                distance.push(far);
            }
        }
        Seen { scene, time, radiance, distance }
    }

    #[test]
    fn what_moves_with_the_wind_does_not_flicker() {
        let paint = |p: DVec3| 1.0 + 0.5 * (p.x / 150.0).sin() * (p.y / 120.0).cos();
        let before = wall(DVec3::new(0.0, 5.0, 0.0), 2.0, paint);
        let after = wall(DVec3::new(3.0, 6.0, -20.0), 2.5, paint);
        let whole = Window::whole(SIZE);
        let (still, pixels) = residual(&before, &after, SIZE, whole);
        assert!(pixels > 2000, "{pixels}");
        assert!(still.is_some_and(|r| r < 1e-3), "{still:?}");
        // A paint that stays behind while the wall moves on is off by its slope times the way.
        let slipped = wall(DVec3::new(3.0, 6.0, -20.0), 2.5, |p| paint(p + 15.0 * DVec3::X));
        let (slip, _) = residual(&before, &slipped, SIZE, whole);
        assert!(slip.is_some_and(|r| r > 0.01), "{slip:?}");
        // 2 % of flicker everywhere is found to be 2 %.
        let lit = wall(DVec3::new(3.0, 6.0, -20.0), 2.5, |p| 1.02 * paint(p));
        let (flicker, _) = residual(&before, &lit, SIZE, whole);
        assert!(flicker.is_some_and(|r| (r - 0.02).abs() < 2e-3), "{flicker:?}");
    }

    #[test]
    fn what_was_hidden_does_not_count() {
        let paint = |_: DVec3| 1.0;
        let mut before = wall(DVec3::ZERO, 0.0, paint);
        let after = wall(DVec3::ZERO, 0.0, paint);
        before.distance.iter_mut().for_each(|d| *d *= 0.8);
        assert_eq!(residual(&before, &after, SIZE, Window::whole(SIZE)), (None, 0));
    }
}
