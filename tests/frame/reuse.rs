//! Pixels taken over from the frame before: never in a first frame, exact when all is still, near the
//! frame alone in motion, and gone where the cloud has gone.

use cumuli::frame::{Picture, Preset, Quality, RenderSettings, Renderer};
use cumuli::scene::{CloudField, Scene};
use glam::DVec3;

use crate::{alone, particle, renderer, space};

/// Odd, so that the last blocks stick out of the picture.
const SIZE: [u32; 2] = [97, 65];

fn with_stride(scene: &Scene, pixel_stride: u32) -> Renderer {
    let quality = Some(Quality { pixel_stride, ..Preset::Low.quality() });
    renderer(scene, &RenderSettings { quality, ..Default::default() })
}

fn frame(renderer: &mut Renderer, scene: &Scene, time: f64) -> Picture {
    let picture = renderer.render(scene, time, SIZE).expect("a frame");
    assert_eq!(picture.stats.counters.overflowed, 0);
    picture
}

fn by_itself(scene: &Scene, time: f64) -> Picture {
    frame(&mut with_stride(scene, 1), scene, time)
}

fn bits(picture: &Picture) -> Vec<u32> {
    picture.radiance.iter().flatten().map(|value| value.to_bits()).collect()
}

/// Among the clouds of a field, flying ahead at 90 m/s.
fn flight(time: f64) -> Scene {
    let clouds = CloudField { cells: 40, rings: 3, coverage: 0.5, ..CloudField::default() };
    let mut scene = Scene { clouds: Some(clouds), ..Scene::default() };
    scene.camera.position = DVec3::new(20.0 * time, 1300.0, -90.0 * time);
    scene.camera.target = scene.camera.position + DVec3::new(100.0, -80.0, -1000.0);
    scene
}

/// Root mean square difference over the second picture's mean.
fn difference(a: &Picture, b: &Picture) -> f64 {
    let pairs = || a.radiance.iter().flatten().zip(b.radiance.iter().flatten());
    let square: f64 = pairs().map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let sum: f64 = pairs().map(|(_, b)| f64::from(*b)).sum();
    let count = pairs().count() as f64;
    (square / count).sqrt() / (sum / count)
}

/// A picture from the first pixel of every block of its own.
fn interpolated(whole: &Picture) -> Picture {
    let at = |x: u32, y: u32| glam::Vec4::from(whole.radiance[(y * SIZE[0] + x) as usize]);
    let [right, bottom] = SIZE.map(|s| (s - 1) & !1);
    let pixel = |i: u32| {
        let (x, y) = (i % SIZE[0], i / SIZE[0]);
        let [left, top] = [x & !1, y & !1];
        let beside = [(left + 2 * (x & 1)).min(right), (top + 2 * (y & 1)).min(bottom)];
        let upper = at(left, top).midpoint(at(beside[0], top));
        upper.midpoint(at(left, beside[1]).midpoint(at(beside[0], beside[1]))).to_array()
    };
    let radiance = (0..SIZE[0] * SIZE[1]).map(pixel).collect();
    Picture { radiance, ..whole.clone() }
}

#[test]
fn the_first_frame_is_whole_and_what_stands_still_becomes_so() {
    let _turn = alone();
    let mut lasting = with_stride(&flight(0.0), 2);
    let first = frame(&mut lasting, &flight(0.0), 0.0);
    assert!(bits(&first) == bits(&by_itself(&flight(0.0), 0.0)), "the first frame");
    assert!(!first.stats.unfinished);
    let pixels = first.stats.counters.pixels_shaded;

    let (end, whole) = (flight(0.2), by_itself(&flight(0.2), 0.2));
    // The other three of four pixels.
    for (left, is_moving) in [(3, true), (2, false), (1, false), (0, false)] {
        let picture = frame(&mut lasting, &end, 0.2);
        assert_eq!(bits(&picture) == bits(&whole), left == 0, "{left} pixels of a block left");
        assert_eq!(picture.stats.unfinished, left > 0);
        let shaded = picture.stats.counters.pixels_shaded;
        assert!(3 * shaded < pixels, "{shaded} of {pixels} pixels");
        let rings = picture.stats.passes.iter().find(|p| p.name == "rings").expect("rings");
        assert_eq!(rings.ran, is_moving, "{left}");
    }
    let still = frame(&mut lasting, &end, 0.2);
    assert!(still.stats.passes.iter().all(|p| !p.ran) && bits(&still) == bits(&whole));
    // Long after, nothing of before is of use.
    let later = frame(&mut lasting, &end, 30.0);
    assert!(bits(&later) == bits(&by_itself(&end, 30.0)));
}

#[test]
fn in_motion_a_frame_is_near_what_it_is_alone() {
    let _turn = alone();
    let mut lasting = with_stride(&flight(0.0), 2);
    let mut again = with_stride(&flight(0.0), 2);
    let times = (0..8).map(|i| 0.1 * f64::from(i));
    let (mut reused, mut guessed) = (0.0, 0.0);
    for time in times {
        let picture = frame(&mut lasting, &flight(time), time);
        assert!(bits(&picture) == bits(&frame(&mut again, &flight(time), time)), "{time}");
        let whole = by_itself(&flight(time), time);
        reused += difference(&picture, &whole) / 8.0;
        guessed += difference(&interpolated(&whole), &whole) / 8.0;
    }
    // Half the squared error of a quarter of the pixels without the frame before.
    println!("off by {reused:.4}, interpolated by {guessed:.4}");
    assert!(reused > 0.0 && reused < 0.7 * guessed, "{reused} {guessed}");
}

/// What has gone leaves nothing behind, and what comes is there at once.
#[test]
fn a_cloud_that_jumps_leaves_no_ghost() {
    let _turn = alone();
    let at = |x: f64| {
        let ball = particle(DVec3::new(x, 0.0, 0.0), 60.0, 0.05, "uniform");
        space(0.1, 1.0, DVec3::new(0.0, 0.0, 500.0), vec![ball])
    };
    let mut lasting = with_stride(&at(-100.0), 2);
    frame(&mut lasting, &at(-100.0), 0.0);
    let jumped = frame(&mut lasting, &at(100.0), 0.1);
    let whole = by_itself(&at(100.0), 0.1);
    let opacity = |p: &Picture| p.radiance.iter().map(|r| f64::from(r[3])).collect::<Vec<_>>();
    let (found, expected) = (opacity(&jumped), opacity(&whole));
    let (mut ghosts, mut seen) = (0.0f64, 0.0);
    for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
        let x = i as u32 % SIZE[0];
        if x < SIZE[0] / 2 {
            ghosts = ghosts.max(*found);
        }
        seen += found / expected.max(1e-9) * f64::from(u8::from(*expected > 0.5));
    }
    let opaque = expected.iter().filter(|o| **o > 0.5).count() as f64;
    assert_eq!(ghosts, 0.0, "left behind");
    // Its edges, a large part of so small a cloud, are between what is there and what was.
    let share = seen / opaque;
    assert!(opaque > 100.0 && share > 0.7 && share < 1.02, "{seen} of {opaque}");
    // And that for as long as a block has pixels.
    for _ in 0..3 {
        frame(&mut lasting, &at(100.0), 0.1);
    }
    assert!(bits(&frame(&mut lasting, &at(100.0), 0.1)) == bits(&whole));
}
