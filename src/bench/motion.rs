//! What frames of a flight owe to the frames before them: an error against the same frame made
//! alone, and flicker.

use glam::{DVec2, DVec3, DVec4};

use super::cases::Case;
use super::errors::{OPACITY_OF_ALGORITHM, cut, error, measured};
use super::record::Motion;
use super::run::{Subject, picture_alone};
use crate::frame::{Picture, Quality};
use crate::reference::{Filter, View, Window, exact_frame};
use crate::scene::Scene;
use crate::tables::TableSet;
use crate::{Error, Result};

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

/// The residual between two frames along the clouds' motion: RMS of the difference between the later
/// frame's pixels and the earlier frame where their clouds were, over the mean; with the number of
/// pixels. `size` is that of the whole pictures.
pub fn residual(
    before: &Seen,
    after: &Seen,
    size: [u32; 2],
    window: Window,
) -> (Option<f64>, usize) {
    let view = View::new(&after.scene.camera, size, None, Filter::Centre);
    let wind = after.scene.clouds.as_ref().map_or(DVec3::ZERO, |field| field.wind);
    let drift = wind * (after.time - before.time);
    let (mut square, mut sum, mut count) = (0.0, 0.0, 0);
    for (i, pixel) in after.radiance.iter().enumerate() {
        if pixel.w < OPAQUE {
            continue;
        }
        let [x, y] = [i as u32 % window.size[0], i as u32 / window.size[0]];
        let place = [x + window.corner[0], y + window.corner[1]].map(|v| f64::from(v) + 0.5);
        let ray = view.ray(place, [0.0; 2]);
        let point = ray.origin + ray.dir * after.distance[i] - drift;
        let Some(seen) = sample(before, point, size, window) else { continue };
        let off = (*pixel - seen).truncate();
        square += off.length_squared() / 3.0;
        sum += pixel.truncate().element_sum() / 3.0;
        count += 1;
    }
    let mean = sum / f64::from(count.max(1));
    let share = (mean > 0.0).then(|| (square / f64::from(count)).sqrt() / mean);
    (share, count as usize)
}

/// The earlier frame at a point, where it shows that point.
fn sample(before: &Seen, point: DVec3, size: [u32; 2], window: Window) -> Option<DVec4> {
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
    if !corners.iter().all(same) {
        return None;
    }
    let f = at - low;
    let [a, b, c, d] = corners.map(|i| before.radiance[i]);
    Some(a.lerp(b, f.x).lerp(c.lerp(d, f.x), f.y))
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

/// What to measure a flight's frames with.
pub struct Instruments<'a> {
    /// The tables of the renderer.
    pub tables: &'a TableSet,
    /// The numbers it was made with.
    pub quality: Quality,
    /// Pixels.
    pub size: [u32; 2],
}

/// Flies up to `last` and compares that frame with the same one made alone, and with the one before
/// it.
pub fn motion(
    case: &Case,
    subject: &mut Subject,
    with: &Instruments<'_>,
    last: u32,
) -> Result<Option<Motion>> {
    let renderer = &mut subject.renderer;
    let (size, window) = (with.size, Window::middle(with.size));
    renderer.forget();
    let (mut frames, mut exact) = (Vec::new(), Vec::new());
    let mut picture = None;
    for index in 0..=last {
        let (scene, time) = case.frame(index);
        if index + 1 < last {
            renderer.frame(&scene, time, size)?;
            continue;
        }
        let shown = renderer.render(&scene, time, size)?;
        let distance = renderer.distance()?;
        let pixels =
            exact_frame(renderer, &scene, with.tables, &with.quality, size, window, &mut || {})?;
        let of_pixel = |p: &crate::reference::ExactPixel| p.radiance.extend(1.0 - p.transmittance);
        let distance = cut(&distance, size, window).into_iter().map(f64::from).collect::<Vec<_>>();
        let seen =
            |radiance| Seen { scene: scene.clone(), time, radiance, distance: distance.clone() };
        let radiance = cut(&shown.radiance, size, window);
        frames.push(seen(radiance.iter().map(|p| DVec4::from(p.map(f64::from))).collect()));
        exact.push(seen(pixels.iter().map(of_pixel).collect()));
        picture = Some(shown);
    }
    let Some(picture) = picture else {
        return Err(Error::Failed("a flight of no frames".to_owned()));
    };
    let (scene, _) = case.frame(last);
    let alone: Picture = picture_alone(renderer, case, size, last)?;
    let reference = measured("alone", size, &alone.radiance);
    let Some(alone) = error(&picture, &reference, OPACITY_OF_ALGORITHM, scene.exposure)? else {
        return Ok(None);
    };
    let pair = |seen: &[Seen]| match seen {
        [before, after] => residual(before, after, size, window),
        _ => (None, 0),
    };
    let ((flicker, flicker_pixels), (flicker_of_exact, _)) = (pair(&frames), pair(&exact));
    Ok(Some(Motion {
        case: case.name.clone(),
        preset: subject.name.clone(),
        frame: last,
        alone,
        flicker,
        flicker_of_exact,
        flicker_pixels,
    }))
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
