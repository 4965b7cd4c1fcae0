//! What clouds change of the light of the air and of the ground: against its twin, against a fine march, and
//! against the path tracer.

use cumuli::frame::air_shadow::{BLOCK, ENTRIES, NODES, corners};
use cumuli::frame::cpu::air_shadow::{
    CloudLight, STEPS, change_along, clouded_span, light_on_ground, node_distance,
};
use cumuli::frame::cpu::shadow::Maps;
use cumuli::frame::cpu::sky::Sky;
use cumuli::frame::renderer::sky_inputs;
use cumuli::frame::{Pass, Preset, RenderSettings, Renderer};
use cumuli::reference::{AIR_STEPS, Exposure, Film, Filter, SunTruth};
use cumuli::scene::{Camera, Scene};
use glam::DVec3;
use half::f16;

use crate::{TABLES, alone, particle, renderer, settings};

const SIZE: [u32; 2] = [96, 56];
/// As in the shaders.
const TABLE_SCALE: f64 = 1024.0;

/// A few thick clouds over the ground, between the eye and a sun 25 degrees high.
fn clump() -> Scene {
    let mut scene = Scene { clouds: None, ..Scene::default() };
    scene.sun.direction = DVec3::new(0.3, 0.47, -0.83).normalize();
    let place = |i: u32| {
        let [x, z] = [f64::from(i % 4) - 1.5, f64::from(i / 4)];
        DVec3::new(1900.0 * x + 300.0 * z, 1200.0 + 90.0 * f64::from(i % 3), -2200.0 - 1700.0 * z)
    };
    scene.particles = (0..12).map(|i| particle(place(i), 420.0, 0.01, "soft-1")).collect();
    scene.camera = Camera {
        position: DVec3::new(0.0, 40.0, 0.0),
        target: DVec3::new(0.0, 290.0, -1000.0),
        fov_x: 70.0,
        ..scene.camera
    };
    scene
}

/// The direction to a place of the picture, pixels from its upper left corner.
fn direction(camera: &Camera, [x, y]: [f64; 2]) -> DVec3 {
    let (basis, half) = (camera.basis(), camera.half_width());
    let [width, height] = SIZE.map(f64::from);
    let (u, v) = (2.0 * x / width - 1.0, 2.0 * y / height - 1.0);
    (basis.forward + basis.right * (half * u) - basis.up * (half * height / width * v)).normalize()
}

fn unpacked([a, b]: [u32; 2]) -> DVec3 {
    let half = |word: u32, high: bool| {
        f64::from(f16::from_bits((if high { word >> 16 } else { word & 0xffff }) as u16))
    };
    DVec3::new(half(a, false), half(a, true), half(b, false))
}

/// Every ray has what the twin finds through the same maps and the same field.
#[test]
fn rays_are_those_of_the_twin() {
    let _turn = alone();
    let scene = clump();
    let mut renderer = renderer(&scene, &settings(Preset::High));
    renderer.render(&scene, 0.0, SIZE).expect("a frame");
    let known = renderer.air_shadow().expect("what it knows");
    let (uniforms, entries) = (known.maps, known.entries);
    let maps = Maps { uniforms: &uniforms, texels: &known.texels };
    let field = renderer.field().expect("a field");
    let light = CloudLight { sun_depth: &|point| maps.depth(point), field: &field };
    let sky = Sky::new(&sky_inputs(&scene), AIR_STEPS);
    let [across, up] = corners(SIZE);
    assert_eq!(entries.len(), (across * up) as usize * ENTRIES);
    let (mut changed, mut grounds, mut worst) = (0, 0, 0.0_f64);
    for (i, found) in entries.chunks(ENTRIES).enumerate() {
        let corner = [i as u32 % across, i as u32 / across].map(|c| f64::from(c * BLOCK));
        let dir = direction(&scene.camera, corner);
        let span = clouded_span(&uniforms, dir);
        let nodes: Vec<f64> = (0..=NODES).map(|n| node_distance(span, f64::from(n))).collect();
        let exact = change_along(&sky, dir, &nodes, STEPS, &light);
        let most = exact.iter().fold(0.0, |most: f64, e| most.max(e.abs().max_element()));
        changed += u32::from(most > 1e-4);
        for (entry, exact) in found.iter().zip(&exact) {
            let off = (unpacked(*entry) / TABLE_SCALE - exact).abs().max_element();
            // Depths are steep at the rims of clouds, where places that f32 rounds differ.
            worst = worst.max(off / most.max(1e-4));
        }
        let ground = sky.ground_distance(dir);
        if ground > 0.0 {
            grounds += 1;
            let exact = light_on_ground(&field, dir * ground);
            let found = unpacked(found[NODES as usize + 1]);
            // Steps of f16, and of the filter's places in a texel.
            assert!((found.x - exact[0]).abs() < 2e-3, "{dir}: {found} {exact:?}");
            assert!((found.y - exact[1]).abs() < 2e-3, "{dir}: {found} {exact:?}");
        }
    }
    println!("{changed} of {} rays, {grounds} on the ground; worst {worst:.4}", across * up);
    assert!(changed > 30 && grounds > 10, "{changed} {grounds}");
    assert!(worst < 0.03, "{worst}");
}

/// Pixels of open sky: what the frame changes, against a march of 2000 steps of every pixel's own ray through the
/// true densities.
#[test]
fn few_steps_on_few_rays_are_enough() {
    let _turn = alone();
    let scene = clump();
    let make = |omit| {
        let settings = RenderSettings { omit, ..settings(Preset::High) };
        let mut renderer = renderer(&scene, &settings);
        (renderer.render(&scene, 0.0, SIZE).expect("a frame"), renderer)
    };
    let (with, renderer) = make(None);
    let (without, _) = make(Some(Pass::AirShadow));
    let uniforms = renderer.air_shadow().expect("what it knows").maps;
    let (particles, _) = renderer.particles().expect("particles");
    let truth = SunTruth::new(&TABLES, &particles, scene.sun.direction).expect("particles");
    let field = renderer.field().expect("a field");
    let light = CloudLight { sun_depth: &|point| truth.depth(point), field: &field };
    let sky = Sky::new(&sky_inputs(&scene), AIR_STEPS);
    let (mut square, mut sum, mut all, mut count) = (0.0, 0.0, 0.0, 0);
    for (i, (a, b)) in with.radiance.iter().zip(&without.radiance).enumerate() {
        let place = [i as u32 % SIZE[0], i as u32 / SIZE[0]].map(|p| f64::from(p) + 0.5);
        let dir = direction(&scene.camera, place);
        // No cloud, no ground, and no glare of the sun.
        if i % 3 != 0 || b[3] > 0.0 || dir.y < 0.01 || dir.dot(scene.sun.direction) > 0.99 {
            continue;
        }
        let span = clouded_span(&uniforms, dir);
        let exact = change_along(&sky, dir, &span, 2000, &light)[1].y;
        square += (f64::from(a[1] - b[1]) - exact).powi(2);
        sum += exact.abs();
        all += f64::from(b[1]);
        count += 1;
    }
    let rms = (square / f64::from(count)).sqrt();
    let (mean, all) = (sum / f64::from(count), all / f64::from(count));
    println!("{count} pixels: of the sky {all:.5} changes {mean:.5}, RMS error {rms:.6}");
    assert!(count > 300 && mean > 0.02 * all, "{count} {mean} {all}");
    // Half as much again as measured.
    assert!(rms < MOST_RMS * all, "{rms} of {all}");
}

/// Of the sky's radiance.
const MOST_RMS: f64 = 0.006;

/// Mean of the open sky, of the frame with and without the pass, over the path tracer's.
fn against_paths(scene: &Scene, samples: u32) -> [f64; 2] {
    const SMALL: [u32; 2] = [48, 28];
    let exposure = Exposure {
        size: SMALL,
        time: 0.0,
        shutter: 0.0,
        lens: None,
        filter: Filter::Box,
        seed: 5,
        aim: None,
    };
    let mut film = Film::new(SMALL);
    exposure.expose(scene, &TABLES, &mut film, samples, |_| Ok(())).expect("traced");
    let mean = |omit| {
        let settings = RenderSettings { omit, ..settings(Preset::High) };
        let mut renderer: Renderer = renderer(scene, &settings);
        let frame = renderer.render(scene, 0.0, SMALL).expect("a frame");
        let open = |i: &usize| film.pixels[*i].mean[3] == 1.0 && frame.radiance[*i][3] == 0.0;
        let sky: Vec<usize> = (0..film.pixels.len() * 3 / 4).filter(open).collect();
        let sum = |of: &dyn Fn(usize) -> f64| sky.iter().map(|i| of(*i)).sum::<f64>();
        assert!(sky.len() > 150, "{}", sky.len());
        sum(&|i| frame.radiance[i][1].into()) / sum(&|i| film.pixels[i].mean[1])
    };
    [None, Some(Pass::AirShadow)].map(mean)
}

/// The fit of what clouds send into the air holds: in broken clouds with the sun behind the eye's side, and before a
/// sun that they hide.
#[test]
fn open_sky_is_as_bright_as_paths_find_it() {
    let _turn = alone();
    for (path, gain) in [("scenes/cumulus.toml", 1.5), ("docs/pictures/backlit.toml", 3.0)] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        let scene = Scene::load(&path).expect("it ships");
        let [with, without] = against_paths(&scene, 48);
        println!("{}: {with:.4}, without the pass {without:.4}", path.display());
        assert!((with - 1.0).abs() < 0.035, "{with}");
        assert!((without - 1.0).abs() > gain * (with - 1.0).abs(), "{with} {without}");
    }
}
