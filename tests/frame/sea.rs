//! The sea: what waves reflect of sky and sun, against the twin; the shipped scene; glitter under clouds; and that a plain
//! ground has no part of it.

use cumuli::frame::cpu::atmosphere::distance_to_ground;
use cumuli::frame::cpu::sky::Sky;
use cumuli::frame::renderer::sky_inputs;
use cumuli::frame::{Pass, Picture, Preset};
use cumuli::reference::{Film, Filter, View, World};
use cumuli::scene::{Ground, Scene};
use glam::DVec3;

use crate::{TABLES, alone, particle, picture, scene, space};

const SIZE: [u32; 2] = [64, 48];
/// Where blocks of rays count: they are as fine as in the picture of a window.
const FINE: [u32; 2] = [480, 360];
/// Of these one pixel of so many is asked: no divisor of the width.
const EVERY: usize = 61;
/// Steps of the twin's rays.
const STEPS: u32 = 64;

fn sea(wind: f64, eye: DVec3, target: DVec3, sun: DVec3) -> Scene {
    let mut scene =
        Scene { ground: Some(Ground::sea(wind, DVec3::new(0.02, 0.05, 0.08))), ..Scene::default() };
    (scene.camera.position, scene.camera.target) = (eye, target);
    scene.camera.fov_x = 70.0;
    scene.sun.direction = sun.normalize();
    scene
}

fn direction(scene: &Scene, index: usize) -> DVec3 {
    let [width, height] = FINE.map(f64::from);
    let (x, y) = (index % FINE[0] as usize, index / FINE[0] as usize);
    scene.camera.ray((x as f64 + 0.5) / width, (y as f64 + 0.5) / height, width / height)
}

/// Pixels of a sea without clouds over those of the twin: mean, RMS from 1, largest.
fn over_twin(scene: &Scene, picture: &Picture) -> [f64; 3] {
    let inputs = sky_inputs(scene);
    let (sky, waves) = (Sky::new(&inputs, STEPS), inputs.sea().expect("a sea"));
    let (mut sum, mut square, mut most, mut count) = (0.0, 0.0, 0.0f64, 0.0);
    for (i, pixel) in picture.radiance.iter().enumerate().step_by(EVERY) {
        let dir = direction(scene, i);
        let distance = distance_to_ground(scene.camera.position.y, dir.y);
        // Rows of blocks that the horizon parts know nothing of its curvature in them.
        if distance < 0.0 || dir.y > -0.01 {
            continue;
        }
        let mirrored = sky.reflected_sky(&waves, dir, distance);
        let radiance = sky.sea_radiance(&waves, dir, distance, [1.0, 0.0, 1.0], mirrored);
        let air = sky.air_between(dir, distance);
        let expected = radiance * air.transmittance + air.inscatter;
        let ratio = f64::from(pixel[1]) / expected.y;
        (sum, square, count) = (sum + ratio, square + (ratio - 1.0).powi(2), count + 1.0);
        most = most.max((ratio - 1.0).abs());
    }
    assert!(count > 300.0, "{count} pixels of sea");
    [sum / count, (square / count).sqrt(), most]
}

#[test]
fn a_sea_without_clouds_is_that_of_the_twin() {
    let _turn = alone();
    let ahead = |height: f64| (DVec3::Y * height, DVec3::new(0.0, height - 300.0, -1000.0));
    for (name, wind, height, sun) in [
        ("noon", 5.0, 20.0, DVec3::new(0.2, 0.9, -0.4)),
        ("low sun ahead", 5.0, 20.0, DVec3::new(0.1, 0.2, -1.0)),
        ("low sun behind, calm", 0.0, 2.0, DVec3::new(0.3, 0.1, 1.0)),
        ("gale, from an aeroplane", 20.0, 3000.0, DVec3::new(0.3, 0.5, -1.0)),
    ] {
        let (eye, target) = ahead(height);
        let scene = sea(wind, eye, target, sun);
        let [mean, rms, most] = over_twin(&scene, &picture(&scene, Preset::High, FINE));
        println!("{name}: mean {mean:.4}, RMS {rms:.4}, at most {most:.3} off");
        // Tables of the sky and of the air in half floats, and rays between which light is linear.
        assert!(
            (mean - 1.0).abs() < 0.005 && rms < 0.005 && most < 0.02,
            "{name}: {mean} {rms} {most}"
        );
    }
}

/// A sea under an even sky, without a sun, is as bright as what it reflects and what enters and leaves it.
#[test]
fn a_white_sea_under_an_even_sky_is_even() {
    let _turn = alone();
    let mut scene = space(0.05, 0.0, DVec3::new(0.0, 30.0, 0.0), Vec::new());
    scene.camera.target = DVec3::new(0.0, 0.0, -100.0);
    scene.ground = Some(Ground::sea(5.0, DVec3::ONE));
    let picture = picture(&scene, Preset::Low, FINE);
    let off = |pixel: &[f32; 4]| (f64::from(pixel[1]) / 0.05 - 1.0).abs();
    let worst = picture.radiance.iter().map(off).fold(0.0, f64::max);
    let mean = picture.radiance.iter().map(off).sum::<f64>() / picture.radiance.len() as f64;
    println!("off by {mean:.5} on average, {worst:.4} at most");
    // The reflected share is interpolated between rays, what enters is not: at the horizon, where it changes by a tenth from
    // ray to ray, by 0.01.
    assert!(mean < 5e-4 && worst < 0.015, "{mean} {worst}");
}

/// A cloud before the sun takes the glitter below it, and is seen in the water.
#[test]
fn clouds_shade_the_glitter_and_are_mirrored() {
    let _turn = alone();
    let sun = DVec3::new(0.0, 0.5, -1.0).normalize();
    let eye = DVec3::new(0.0, 30.0, 0.0);
    let bare = sea(5.0, eye, DVec3::new(0.0, -20.0, -100.0), sun);
    let mut clouded = bare.clone();
    clouded.particles = vec![particle(eye + 3000.0 * sun, 700.0, 0.05, "uniform")];
    let [bare, clouded] = [&bare, &clouded].map(|scene| picture(scene, Preset::Medium, SIZE));
    // Where the glitter is brightest, under the sun.
    let brightest = |p: &Picture| p.radiance.iter().map(|p| p[1]).fold(0.0, f32::max);
    let at = bare.radiance.iter().position(|p| p[1] == brightest(&bare)).expect("a pixel");
    let left = clouded.radiance[at][1] / bare.radiance[at][1];
    println!("of the glitter {left:.3} is left");
    assert!(left < 0.2, "{left} of the glitter is left");
    // Beside the shadow the water still shows the cloud: a cloud behind the eye, over which the sun shines.
    let mut back = sea(5.0, eye, DVec3::new(0.0, 0.0, -100.0), DVec3::new(0.0, 0.5, 1.0));
    let clear = picture(&back, Preset::Medium, SIZE);
    back.particles = vec![particle(DVec3::new(0.0, 900.0, -4000.0), 600.0, 0.05, "uniform")];
    let clouds = picture(&back, Preset::Medium, SIZE);
    let sum = |p: &Picture, low: u32, high: u32| -> f32 {
        let rows = (low * SIZE[0]) as usize..(high * SIZE[0]) as usize;
        p.radiance[rows].iter().map(|p| p[1]).sum()
    };
    // The horizon is at 24: below it.
    let brighter = sum(&clouds, 30, 48) / sum(&clear, 30, 48);
    println!("with a white cloud ahead the water is {brighter:.3} times as bright");
    assert!(brighter > 1.02 && brighter < 3.0, "{brighter}");
}

/// What the water shows of a white cloud ahead, against the path tracer: sums over rows of the sea.
#[test]
fn mirrored_clouds_are_as_bright_as_traced_ones() {
    const PATHS: u32 = 96;
    let _turn = alone();
    let eye = DVec3::new(0.0, 30.0, 0.0);
    let mut scene = sea(5.0, eye, DVec3::new(0.0, 0.0, -100.0), DVec3::new(0.0, 0.5, 1.0));
    scene.particles = (0..5)
        .map(|i| {
            particle(DVec3::new(1200.0 * f64::from(i - 2), 900.0, -4000.0), 600.0, 0.05, "uniform")
        })
        .collect();
    // Blocks of the frame are as fine as in a picture of a window.
    const SIDE: u32 = 5;
    let frame = picture(&scene, Preset::High, SIZE.map(|s| SIDE * s));
    let world = World::new(&scene, &TABLES, 0.0).expect("a world");
    let view = View::new(&scene.camera, SIZE, None, Filter::Box);
    let mut film = Film::new(SIZE);
    for _ in 0..PATHS {
        world.expose_rows(&mut film, &view, 3, SIZE[1]);
    }
    for [low, high] in [[26, 36], [36, 48]] {
        let (mut traced, mut square) = (0.0, 0.0);
        for pixel in (low * SIZE[0])..(high * SIZE[0]) {
            let green = film.estimates(pixel as usize)[1];
            (traced, square) = (traced + green.value, square + green.standard_error.powi(2));
        }
        let width = (SIDE * SIZE[0]) as usize;
        let rows = (low * SIDE) as usize * width..(high * SIDE) as usize * width;
        let made: f64 = frame.radiance[rows].iter().map(|p| f64::from(p[1])).sum();
        let ratio = made / f64::from(SIDE * SIDE) / traced;
        let noise = square.sqrt() / traced;
        println!("rows {low} to {high}: frame over traced {ratio:.4} +- {noise:.4}");
        // Lone balls are too dark in the light grid, on their lit sides by up to a sixth (tests/frame/thick.rs); beside what
        // they change, which is as large, the water's own light is without error.
        assert!((ratio - 1.0).abs() < 0.12 + 3.0 * noise && noise < 0.04, "{low}: {ratio} {noise}");
    }
}

#[test]
fn the_shipped_sea_is_made() {
    let _turn = alone();
    let scene = scene(include_str!("../../scenes/sea.toml"));
    let picture = picture(&scene, Preset::Low, SIZE);
    assert!(picture.radiance.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    let runs = |pass: Pass| picture.stats.passes.iter().any(|p| p.name == pass.name() && p.ran);
    assert!(runs(Pass::Sea));
    // Sky and sea, parted by the horizon: brighter at the sun's side.
    let mean = |columns: std::ops::Range<u32>| {
        let pixels =
            columns.clone().flat_map(|x| (30..48).map(move |y| (y * SIZE[0] + x) as usize));
        pixels.map(|i| picture.radiance[i][1]).sum::<f32>() / (columns.len() * 18) as f32
    };
    assert!(mean(40..56) > 2.0 * mean(0..16), "{} {}", mean(40..56), mean(0..16));
}

#[test]
fn a_plain_ground_has_no_part_of_it() {
    let _turn = alone();
    let plain = scene(cumuli::scene::DEFAULT_SCENE);
    let picture = picture(&plain, Preset::Low, SIZE);
    let runs = |pass: Pass| picture.stats.passes.iter().any(|p| p.name == pass.name() && p.ran);
    assert!(!runs(Pass::Sea) && runs(Pass::Resolve));
}
