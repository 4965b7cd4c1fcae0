//! What surrounds the clouds: sky, ground with shadow, tone map, and no trace of tiles.

use cumuli::frame::Preset;
use cumuli::frame::cpu::atmosphere::distance_to_ground;
use cumuli::frame::cpu::tonemap;
use cumuli::medium::Truncation;
use cumuli::scene::{Ground, Scene};
use glam::DVec3;

use crate::{alone, particle, picture, scene, space};

const SIZE: [u32; 2] = [64, 48];

fn dir(scene: &Scene, size: [u32; 2], index: usize) -> DVec3 {
    let [width, height] = size.map(f64::from);
    let (x, y) = (index % size[0] as usize, index / size[0] as usize);
    scene.camera.ray((x as f64 + 0.5) / width, (y as f64 + 0.5) / height, width / height)
}

#[test]
fn a_uniform_sky_is_exact_where_there_is_no_cloud() {
    let _turn = alone();
    let radiance = 0.0318;
    // The sun is behind the camera.
    let mut scene = space(
        radiance,
        1.0,
        DVec3::new(0.0, 0.0, 500.0),
        vec![particle(DVec3::ZERO, 100.0, 0.02, "uniform")],
    );
    scene.sun.direction = DVec3::new(0.0, 0.6, 0.8);
    let picture = picture(&scene, Preset::Low, SIZE);
    let clear: Vec<_> = picture.radiance.iter().filter(|p| p[3] == 0.0).collect();
    assert!(clear.len() > picture.radiance.len() / 2 && clear.len() < picture.radiance.len());
    assert!(clear.iter().all(|p| p[..3] == [radiance as f32; 3]), "{:?}", clear[0]);
}

/// Each display value is the twin's of the same radiance. The device rounds to the nearest of
/// 255 steps; 0.02 of a step is what `pow` in f32 may be off.
#[test]
fn display_values_are_the_tone_curve_of_the_radiance() {
    let _turn = alone();
    let mut scene = scene(cumuli::scene::DEFAULT_SCENE);
    scene.exposure = 0.0;
    // The factor of `frame::view` at 0 EV and irradiance 1.
    let exposure = 5.0;
    let picture = picture(&scene, Preset::Low, SIZE);
    let mut shades = [false; 256];
    for (i, (radiance, pixel)) in picture.radiance.iter().zip(&picture.pixels).enumerate() {
        let [r, g, b, _] = radiance.map(f64::from);
        let shown = tonemap::display(exposure * DVec3::new(r, g, b)).to_array();
        let dither = tonemap::dither(i as u32 % SIZE[0], i as u32 / SIZE[0]);
        for (channel, shown) in shown.into_iter().enumerate() {
            let expected = 255.0 * (shown + dither).clamp(0.0, 1.0);
            let off = (f64::from(pixel[channel]) - expected).abs();
            assert!(off < 0.52, "pixel {i}: {pixel:?}, expected {expected} in channel {channel}");
            shades[usize::from(pixel[channel])] = true;
        }
    }
    let shades = shades.iter().filter(|s| **s).count();
    assert!(shades > 60, "the picture has {shades} shades: it checks little of the curve");
}

/// The camera looks down from below a thin particle through which the sun shines.
#[test]
fn the_ground_shows_the_shadow_of_the_particle() {
    let _turn = alone();
    let (radius, extinction, sky, albedo) = (600.0, 2e-3, 0.02, DVec3::new(0.3, 0.2, 0.1));
    let cloud = particle(DVec3::new(0.0, 900.0, 0.0), radius, extinction, "uniform");
    let mut scene = space(sky, 1.0, DVec3::new(0.0, 250.0, 0.0), vec![cloud]);
    scene.camera.fov_x = 120.0;
    scene.sun.direction = DVec3::Y;
    scene.ground = Some(Ground::plain(albedo));
    let picture = picture(&scene, Preset::High, SIZE);
    let mut shades = [f64::INFINITY, 0.0];
    for (i, pixel) in picture.radiance.iter().enumerate() {
        assert_eq!(pixel[3], 0.0, "the particle is behind the camera");
        let dir = dir(&scene, SIZE, i);
        let point = scene.camera.position + dir * distance_to_ground(250.0, dir.y);
        let across = radius * radius - point.x * point.x - point.z * point.z;
        // What is scattered within the forward peak reaches the ground too.
        let scale = Truncation::new(&scene.medium.phase).scale(1.0);
        let visibility = (-2.0 * extinction * scale * across.max(0.0).sqrt()).exp();
        let expected = albedo * (visibility / std::f64::consts::PI + sky);
        shades = [shades[0].min(visibility), shades[1].max(visibility)];
        for (found, expected) in pixel.iter().zip(expected.to_array()) {
            let off = (f64::from(*found) / expected - 1.0).abs();
            // Texels of 5 m between which it is linear, and the ground's curvature: 1e-3.
            assert!(off < 2e-3, "{point}: {found}, expected {expected}");
        }
    }
    assert!(shades[1] > 1.3 * shades[0], "{shades:?}: the shadow's depth varies too little");
}

/// Second differences between neighbours are no larger across a border of 8-pixel tiles than
/// elsewhere. Chance makes them differ by some percent in some thousand pixels; a list that
/// lacks one particle of a hundred makes them double.
#[test]
fn tiles_leave_no_seams() {
    let _turn = alone();
    let size = [160, 120];
    let particles = (0..150)
        .map(|i| {
            let i = f64::from(i);
            let (sin, cos) = (2.399963 * i).sin_cos();
            let centre = 14.0 * i.sqrt() * DVec3::new(cos, 0.9 * sin, (0.7 * i).sin());
            particle(centre, 20.0 + 30.0 * (0.37 * i).fract(), 0.004, "soft-1")
        })
        .collect();
    let scene = space(0.05, 1.0, DVec3::new(0.0, 30.0, 330.0), particles);
    let picture = picture(&scene, Preset::High, size);
    let green = |x: u32, y: u32| f64::from(picture.radiance[(y * size[0] + x) as usize][1]);
    let [mut border, mut inside] = [(0.0, 0.0); 2];
    let mut add = |at: u32, difference: f64| {
        let sum = if matches!(at % 8, 0 | 7) { &mut border } else { &mut inside };
        *sum = (sum.0 + difference.abs(), sum.1 + 1.0);
    };
    for y in 1..size[1] - 1 {
        for x in 1..size[0] - 1 {
            let middle = 2.0 * green(x, y);
            add(x, green(x - 1, y) - middle + green(x + 1, y));
            add(y, green(x, y - 1) - middle + green(x, y + 1));
        }
    }
    let ratio = (border.0 / border.1) / (inside.0 / inside.1);
    assert!(inside.0 > 0.0 && ratio < 1.2, "{ratio}");
}
