//! What a scene may legally ask for at its extremes: finite pictures, nothing left out, no panic.

use cumuli::frame::{Picture, Preset};
use cumuli::scene::{Scene, Sky};
use glam::DVec3;

use crate::{alone, particle, picture, renderer, scene, settings, space};

const SIZE: [u32; 2] = [40, 24];

fn assert_sound(picture: &Picture, what: &str) {
    assert_eq!(picture.radiance.len(), (picture.size[0] * picture.size[1]) as usize, "{what}");
    assert_eq!(picture.stats.counters.overflowed, 0, "{what}");
    for (i, [r, g, b, opacity]) in picture.radiance.iter().enumerate() {
        let sound = |v: &f32| v.is_finite() && *v >= 0.0;
        assert!([r, g, b].into_iter().all(sound), "{what}: pixel {i} is {r} {g} {b}");
        assert!((0.0..=1.0).contains(opacity), "{what}: pixel {i} has opacity {opacity}");
    }
}

/// Largest difference of two pictures in 8-bit steps, and the share of pixels that differ at all.
fn steps(a: &Picture, b: &Picture) -> (u8, f64) {
    let pairs = || a.pixels.iter().zip(&b.pixels);
    let most = pairs().flat_map(|(a, b)| (0..4).map(|c| a[c].abs_diff(b[c]))).max();
    let differing = pairs().filter(|(a, b)| a != b).count();
    (most.unwrap_or(0), differing as f64 / a.pixels.len() as f64)
}

fn clump(origin: DVec3) -> Scene {
    let particles = (0..40)
        .map(|i| {
            let i = f64::from(i);
            let (sin, cos) = (2.399963 * i).sin_cos();
            let centre = 40.0 * i.sqrt() * DVec3::new(cos, 0.4 * (1.7 * i).sin(), sin);
            particle(origin + centre, 60.0 + 50.0 * (0.37 * i).fract(), 0.02, "pyroclastic-1")
        })
        .collect();
    let mut scene = space(0.05, 1.0, origin + DVec3::new(100.0, 150.0, 700.0), particles);
    scene.camera.target = origin;
    scene
}

/// 10,000 km away f64 still resolves 2 nm, so positions relative to the camera are the same up
/// to the rounding of f32; tiles of the lights begin elsewhere, which no value depends on. One
/// step can flip where a value lies on the edge between two.
#[test]
fn far_from_the_origin_the_picture_is_the_same() {
    let _turn = alone();
    let near = picture(&clump(DVec3::ZERO), Preset::Medium, SIZE);
    assert_sound(&near, "at the origin");
    for far in [DVec3::new(1e7, 0.0, -1e7), DVec3::new(-1e7, 0.0, 3e6)] {
        let away = picture(&clump(far), Preset::Medium, SIZE);
        assert_sound(&away, "far away");
        let (most, share) = steps(&near, &away);
        assert!(most <= 1 && share < 0.02, "{far}: {most} steps, {share} of the pixels");
    }
}

fn field() -> Scene {
    let mut scene = scene(cumuli::scene::DEFAULT_SCENE);
    let field = scene.clouds.as_mut().expect("the default scene has a field");
    (field.cells, field.rings, field.coverage) = (32, 3, 0.5);
    scene.camera.position.y = 900.0;
    scene.camera.target.y = 1000.0;
    scene
}

/// A field has other clouds elsewhere and at other times: what can be asked is that they are
/// sound and that there are as many.
#[test]
fn fields_go_on_far_away_and_for_years() {
    let _turn = alone();
    let ten_years = 3.156e8; // s
    let mut renderer = renderer(&field(), &settings(Preset::Low));
    let mut particles = Vec::new();
    for (offset, time) in
        [(0.0, 0.0), (1e7, 0.0), (0.0, ten_years), (-1e7, -ten_years), (1e10, 1e9), (1e7, 1.0)]
    {
        let mut scene = field();
        let offset = DVec3::new(offset, 0.0, 0.7 * offset);
        scene.camera.position += offset;
        scene.camera.target += offset;
        let picture = renderer.render(&scene, time, SIZE).expect("a frame");
        assert_sound(&picture, &format!("{offset} {time}"));
        particles.push(picture.stats.counters.particles_generated as f64);
    }
    let most = particles.iter().fold(0.0, |a: f64, b| a.max(*b));
    let least = particles.iter().fold(most, |a, b| a.min(*b));
    // A field of 3 km holds a few clouds of 2 km at half coverage: a factor of ten in their
    // number is chance, none at all is a defect.
    assert!(least > 0.1 * most, "{particles:?}");
}

#[test]
fn extremes_of_particles_are_sound() {
    let _turn = alone();
    let eye = DVec3::new(0.0, 0.0, 300.0);
    let mut lasting = renderer(&space(0.05, 1.0, eye, Vec::new()), &settings(Preset::High));
    for shape in ["uniform", "pyroclastic-1"] {
        for radius in [1e-3, 1.0, 1e5] {
            for extinction in [0.0, 1e-9, 1.0, 1e6] {
                let around = [DVec3::ZERO, DVec3::new(0.3, 0.1, 0.0) * radius, eye];
                let particles = around.map(|c| particle(c, radius, extinction, shape)).to_vec();
                let scene = space(0.05, 1.0, eye, particles);
                let picture = lasting.render(&scene, 0.0, SIZE).expect("a frame");
                assert_sound(&picture, &format!("{shape} {radius} m {extinction} 1/m"));
                let middle = picture.radiance[(SIZE[0] * (SIZE[1] / 2) + SIZE[0] / 2) as usize];
                // The eye is inside the last particle: opaque where it is dense, gone where not.
                if extinction * radius >= 1e3 {
                    assert!(middle[3] > 0.99, "{shape} {radius} {extinction}: {middle:?}");
                } else if extinction * radius <= 1e-4 {
                    assert!(middle[3] < 1e-3, "{shape} {radius} {extinction}: {middle:?}");
                }
            }
        }
    }
}

#[test]
fn extremes_of_views_are_sound() {
    let _turn = alone();
    let mut scene = clump(DVec3::new(0.0, 500.0, 0.0));
    scene.sky = Sky::Atmosphere;
    let mut lasting = renderer(&scene, &settings(Preset::Low));
    let mut check = |scene: &Scene, size: [u32; 2], what: &str| {
        let picture = lasting.render(scene, 0.0, size).expect(what);
        assert_sound(&picture, what);
    };
    for size in [[1, 1], [7, 3], [257, 131], [1, 300]] {
        check(&scene, size, &format!("{size:?}"));
    }
    for fov_x in [1.0, 170.0, 179.0] {
        scene.camera.fov_x = fov_x;
        check(&scene, SIZE, &format!("{fov_x} degrees"));
    }
    scene.camera.fov_x = 60.0;
    for sun in [DVec3::Y, DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z] {
        scene.sun.direction = sun;
        check(&scene, SIZE, &format!("sun at {sun}"));
    }
    scene.sun.direction = DVec3::new(0.6, 0.8, 0.0);
    for altitude in [0.0, 1.0, 1e4, 1e5, 1e7, 1e10] {
        scene.camera.position = DVec3::new(0.0, altitude, 10.0);
        scene.camera.target = DVec3::new(0.0, 500.0, 0.0);
        check(&scene, SIZE, &format!("camera at {altitude} m"));
    }
    scene.camera.position = scene.particles[0].centre;
    scene.camera.target = scene.particles[0].centre + DVec3::NEG_Z;
    check(&scene, SIZE, "at a centre");
    scene.camera.target = scene.camera.position + DVec3::Y;
    check(&scene, SIZE, "straight up");
    scene.particles.clear();
    check(&scene, SIZE, "no particles");
}
