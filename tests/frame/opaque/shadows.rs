//! Shadows of clouds on opaque things, and at any points.

use cumuli::frame::{OpaquePicture, Preset};
use cumuli::medium::Truncation;
use cumuli::scene::Scene;
use glam::DVec3;

use super::{GREY, LIT, SIZE, clump, frame, surface, upload};
use crate::{alone, particle, renderer, settings, space};

/// A level floor at an altitude (m) as the scene's camera sees it.
fn floor(scene: &Scene, size: [u32; 2], altitude: f64) -> OpaquePicture {
    let height = scene.camera.position.y - altitude;
    OpaquePicture::cast(&scene.camera, size, |dir| {
        if dir.y < -1e-3 { surface(height / -dir.y) } else { None }
    })
}

/// The shadow of an even ball on a floor in empty space, where no ground is: by the picture, and at points of the floor
/// by themselves; with a high sun and one that is nearly level.
#[test]
fn clouds_throw_shadows_on_what_is_opaque() {
    let _turn = alone();
    let (radius, extinction) = (100.0, 0.012);
    let mut scene = space(
        0.0,
        1.0,
        DVec3::new(0.0, 0.0, 900.0),
        vec![particle(DVec3::ZERO, radius, extinction, "uniform")],
    );
    scene.camera.position.y = 250.0;
    let scale = {
        let medium = &scene.medium;
        Truncation::new(&medium.phase).scale(medium.albedo)
    };
    for sun in [DVec3::new(0.3, 1.0, 0.1), DVec3::new(-0.9, 0.35, 0.2)] {
        scene.sun.direction = sun.normalize();
        let surfaces = floor(&scene, SIZE, -260.0);
        let mut renderer = renderer(&scene, &settings(Preset::High));
        renderer.set_opaque(Some(upload(&surfaces, 1)));
        let picture = frame(&mut renderer, &scene, 0.0);
        let mut points = Vec::new();
        let mut pixels = Vec::new();
        for i in 0..surfaces.distance.len() {
            if let Some(surface) = surfaces.surface(i) {
                let dir = OpaquePicture::ray(&scene.camera, SIZE, i as u32);
                points.push(scene.camera.position + dir * surface.distance);
                pixels.push(i);
            }
        }
        let told = renderer.sun_transmittance(&points).expect("lists of the frame");
        let (mut worst, mut off, mut dark) = (0.0_f64, 0.0, 0);
        for ((point, pixel), told) in points.iter().zip(pixels).zip(told) {
            let toward = scene.sun.direction;
            let across = (*point - point.dot(toward) * toward).length_squared();
            let chord = 2.0 * (radius * radius - across).max(0.0).sqrt();
            let wanted = (-extinction * scale * chord).exp();
            worst = worst.max((f64::from(told) - wanted).abs());
            dark += usize::from(wanted < 0.7);
            let [r, .., opacity] = picture.radiance[pixel].map(f64::from);
            if opacity == 0.0 {
                off += ((r - GREY.x) / LIT.x - wanted).powi(2);
            }
        }
        let off = (off / points.len() as f64).sqrt();
        println!(
            "sun {sun}: {dark} pixels in shadow, points off by {worst:.5}, pixels by {off:.5}"
        );
        // The tables of an even ball are exact; maps have texels of a few metres, and interpolate between them.
        assert!(dark > 30 && worst < 1e-3 && off < 0.02, "{dark} {worst} {off}");
    }
}

#[test]
fn shadows_at_points_need_a_frame() {
    let _turn = alone();
    let scene = clump();
    let mut renderer = renderer(&scene, &settings(Preset::Low));
    let error = renderer.sun_transmittance(&[DVec3::ZERO]).expect_err("no lists yet");
    assert!(error.to_string().contains("expected"), "{error}");
    frame(&mut renderer, &scene, 0.0);
    let high = DVec3::new(0.0, 5000.0, 0.0);
    let within = DVec3::new(0.0, 690.0, 0.0);
    let found = renderer.sun_transmittance(&[high, within]).expect("lists");
    assert!(found[0] == 1.0 && found[1] < 0.5, "{found:?}");
    let error = renderer.sun_transmittance(&[high, DVec3::X * f64::NAN]).expect_err("not a number");
    assert!(error.to_string().contains("points") && error.to_string().contains("at 1"), "{error}");
    // Asked for once, it is known after every frame: one that looks away from all, and one without clouds.
    let mut away = scene.clone();
    away.camera.target = away.camera.position + DVec3::Y;
    let picture = frame(&mut renderer, &away, 0.0);
    let ran = |name: &str| picture.stats.passes.iter().any(|p| p.name == name && p.ran);
    assert!(!ran("blend") && !ran("shadow"), "{:?}", picture.stats.passes);
    assert_eq!(renderer.sun_transmittance(&[high, within]).expect("lists"), found);
    let bare = Scene { particles: Vec::new(), ..away };
    frame(&mut renderer, &bare, 0.0);
    assert_eq!(renderer.sun_transmittance(&[within]).expect("a clear sky"), [1.0]);
}
