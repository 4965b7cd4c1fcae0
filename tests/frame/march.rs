//! The ray marcher that the blend is measured against.

use cumuli::bench::march::twin::MarchTwin;
use cumuli::bench::march::{March, MarchLight, MarchSettings};
use cumuli::frame::view::SCREEN_TILE;
use cumuli::frame::{Picture, Preset, Renderer};
use cumuli::gpu::ShaderLibrary;
use cumuli::medium::Truncation;
use cumuli::reference::{Window, exact_frame};
use cumuli::scene::{Camera, Medium, ParticleSpec, Scene, Sky, Sun};
use glam::{DQuat, DVec3};

use super::{GPU, TABLES, alone, renderer, settings};

const SIZE: [u32; 2] = [48, 32];
const SKY: f64 = 0.1;
const SUN: f64 = 2.0;

/// Overlapping particles, uniform and noise, one of them around the eye, one apart behind a gap.
fn scene() -> Scene {
    let ball = |centre: [f64; 3], radius, extinction, shape: &str| ParticleSpec {
        centre: DVec3::from_array(centre),
        radius,
        extinction,
        shape: shape.to_owned(),
        orientation: DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.5),
    };
    Scene {
        camera: Camera {
            position: DVec3::new(0.0, 0.0, 500.0),
            target: DVec3::ZERO,
            ..Camera::default()
        },
        sun: Sun {
            direction: DVec3::new(1.0, 2.0, 1.0).normalize(),
            irradiance: SUN,
            ..Sun::default()
        },
        sky: Sky::Uniform { radiance: SKY },
        medium: Medium { phase: "hg:0.85".parse().expect("a phase function"), albedo: 1.0 },
        particles: vec![
            ball([0.0, 0.0, 0.0], 130.0, 0.03, "pyroclastic-1"),
            ball([90.0, 40.0, -60.0], 100.0, 0.02, "uniform"),
            ball([-110.0, -30.0, 40.0], 90.0, 0.05, "soft-1"),
            ball([20.0, -20.0, 480.0], 60.0, 0.002, "uniform"),
            ball([-60.0, 60.0, -900.0], 200.0, 0.01, "pyroclastic-2"),
        ],
        ..Scene::default()
    }
}

/// Frames of the scene, composed by a marcher or by the blend.
struct Marched(Renderer, Scene);

impl Marched {
    fn new(preset: Preset) -> Self {
        let scene = scene();
        Self(renderer(&scene, &settings(preset)), scene)
    }

    fn picture(&mut self, march: Option<MarchSettings>) -> Picture {
        let library = ShaderLibrary::new().expect("the shader modules");
        let mean_cosine = Truncation::new(&self.1.medium.phase).moments[0];
        let composer = march.map(|settings| {
            let layouts = self.0.layouts();
            let march = March::new(&GPU, &library, layouts, settings, SCREEN_TILE, mean_cosine);
            Box::new(march.expect("a marcher")) as _
        });
        self.0.compose_with(composer);
        self.0.render(&self.1, 0.0, SIZE).expect("a picture")
    }
}

/// Root mean square of the differences over the mean of the second.
fn rms(a: &Picture, b: &Picture) -> f64 {
    let each =
        || a.radiance.iter().zip(&b.radiance).flat_map(|(a, b)| (0..3).map(|c| (a[c], b[c])));
    let square: f64 = each().map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let mean: f64 = each().map(|(_, b)| f64::from(b)).sum();
    let count = 3.0 * a.radiance.len() as f64;
    (square / count).sqrt() / (mean / count)
}

/// Pixel by pixel against the march in f64. A sample that lies on a sphere's surface may fall on
/// either side of it: a few pixels are off by one step of 16, all others by rounding.
#[test]
fn agrees_with_its_twin() {
    let _turn = alone();
    let mut marched = Marched::new(Preset::High);
    let how = MarchSettings { light: MarchLight::SunRays, steps: 16 };
    let picture = marched.picture(Some(how));
    let ran = |name: &str| picture.stats.passes.iter().any(|p| p.name == name && p.ran);
    assert!(ran("blend") && !ran("light") && !ran("light_grid"), "{:?}", picture.stats.passes);
    assert!(picture.stats.counters.table_lookups > 0);

    let Marched(renderer, scene) = &marched;
    let (particles, _) = renderer.particles().expect("particles");
    let truncation = Truncation::new(&scene.medium.phase);
    let phase = scene.medium.phase.prepare();
    let twin = MarchTwin {
        delta_scale: truncation.scale(1.0),
        mean_cosine: truncation.moments[0],
        sun: scene.sun.direction,
        sunlight: DVec3::splat(SUN),
        ambient: DVec3::splat(SKY),
        stop: f64::from(Preset::High.quality().transmittance_stop),
        width: SIZE[0],
        tangent: scene.camera.half_width(),
        forward: scene.camera.basis().forward,
        steps: how.steps,
        sun_steps: how.sun_steps(),
        ..MarchTwin::new(&particles, &TABLES, phase)
    };
    let mut off = Vec::new();
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let place = [x, y].map(|v| f64::from(v) + 0.5);
            let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
            let [u, v] = [place[0] / f64::from(SIZE[0]), place[1] / f64::from(SIZE[1])];
            let seen = twin.ray(scene.camera.ray(u, v, aspect), f64::INFINITY);
            let expected = seen.radiance.x + seen.transmittance * SKY;
            let got = f64::from(picture.radiance[(y * SIZE[0] + x) as usize][0]);
            off.push((got - expected).abs() / expected);
        }
    }
    off.sort_by(f64::total_cmp);
    let at = |share: f64| off[(share * (off.len() - 1) as f64) as usize];
    // f32 in places of 500 m, and 8-bit weights of the device's filter: below a thousandth.
    assert!(at(0.97) < 2e-3 && at(1.0) < 0.2, "{} {} {}", at(0.5), at(0.97), at(1.0));
}

/// With the frame's light and many steps the march comes to what the exact compositor shows of the
/// same light, the closer the more steps. Every particle is there three times, a third as dense, so
/// that none is alone: of those that are, the march only knows the mean density.
#[test]
fn comes_to_the_exact_picture() {
    let _turn = alone();
    let mut marched = Marched::new(Preset::Ultra);
    let particles = &mut marched.1.particles;
    particles.iter_mut().for_each(|p| p.extinction /= 3.0);
    *particles = [0; 3].map(|_| particles.clone()).concat();
    let mut exact = marched.picture(None);
    let (renderer, quality) = (&marched.0, Preset::Ultra.quality());
    let window = Window::whole(SIZE);
    let pixels = exact_frame(renderer, &marched.1, &TABLES, &quality, SIZE, window, &mut || {})
        .expect("exact");
    for (pixel, exact) in exact.radiance.iter_mut().zip(pixels) {
        *pixel = exact.radiance.as_vec3().extend(1.0).to_array();
    }
    let errors = [8, 32, 128].map(|steps| {
        let how = MarchSettings { light: MarchLight::Frame, steps };
        rms(&marched.picture(Some(how)), &exact)
    });
    println!("{errors:?}");
    assert!(errors[0] > errors[1] && errors[1] > errors[2], "{errors:?}");
    assert!(errors[2] < 0.01, "{errors:?}");
}

/// The frame after a march is the blend's again, to the bit.
#[test]
fn leaves_nothing_behind() {
    let _turn = alone();
    let mut marched = Marched::new(Preset::Low);
    let before = marched.picture(None);
    let how = MarchSettings { light: MarchLight::SunRays, steps: 8 };
    assert!(marched.picture(Some(how)).radiance != before.radiance);
    assert!(marched.picture(None).radiance == before.radiance);
}
