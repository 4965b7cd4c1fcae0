//! What clouds change of the light of the air and of the ground: against its twin, against a fine march, and
//! against the path tracer.

use cumuli::frame::air_shadow::{ENTRIES, NODES, corners};
use cumuli::frame::cpu::air_shadow::{
    CloudLight, NET, change_along, clouded_span, light_on_ground, node_distance,
};
use cumuli::frame::cpu::light_grid::FieldSeen;
use cumuli::frame::cpu::shadow::Maps;
use cumuli::frame::cpu::sky::Sky;
use cumuli::frame::renderer::sky_inputs;
use cumuli::frame::{Pass, Preset, RenderSettings, Renderer};
use cumuli::reference::{AIR_STEPS, Exposure, Film, Filter, SunTruth};
use cumuli::scene::{Camera, Scene};
use glam::DVec3;
use half::f16;

use crate::{TABLES, alone, particle, renderer, settings};

const SIZE: [u32; 2] = [320, 180];
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
fn direction(camera: &Camera, size: [u32; 2], [x, y]: [f64; 2]) -> DVec3 {
    let (basis, half) = (camera.basis(), camera.half_width());
    let [width, height] = size.map(f64::from);
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
    rays_agree(&clump(), SIZE, [30, 10]);
}

/// The same of a small and wide picture, which has a ray through the middle of every pixel.
#[test]
fn rays_of_small_pictures_are_those_of_the_twin() {
    let _turn = alone();
    let mut scene = clump();
    scene.camera.fov_x = 111.0;
    rays_agree(&scene, [24, 14], [100, 30]);
}

/// `least`: rays along which something changes, and that meet the ground.
fn rays_agree(scene: &Scene, size: [u32; 2], least: [u32; 2]) {
    let mut renderer = renderer(scene, &settings(Preset::High));
    renderer.render(scene, 0.0, size).expect("a frame");
    let known = renderer.air_shadow().expect("what it knows");
    let (uniforms, entries, block) = (known.maps, known.entries, known.block);
    let maps = Maps { uniforms: &uniforms, texels: &known.texels };
    let field = renderer.field().expect("a field");
    let sky = Sky::new(&sky_inputs(scene), AIR_STEPS);
    let sun_depth = &|point| maps.depth(point);
    let light = CloudLight { sun_depth, field: &field };
    let [across, up] = corners(size, block);
    assert_eq!(entries.len(), (across * up) as usize * ENTRIES);
    let (mut changed, mut grounds, mut worst) = (0, 0, 0.0_f64);
    for (i, found) in entries.chunks(ENTRIES).enumerate() {
        let corner = [i as u32 % across, i as u32 / across];
        let middle = if block == 1 { 0.5 } else { 0.0 };
        let place = |axis: usize| f64::from(corner[axis] * block) + middle;
        let corner = [0, 1].map(|axis| place(axis).min(f64::from(size[axis])));
        let dir = direction(&scene.camera, size, corner);
        let span = clouded_span(&uniforms, dir);
        let nodes: Vec<f64> = (0..=NODES).map(|n| node_distance(span, f64::from(n))).collect();
        let exact = change_along(&sky, dir, &nodes, Preset::High.quality().air_steps, &light);
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
    assert!(changed > least[0] && grounds > least[1], "{changed} {grounds}");
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
    let sky = Sky::new(&sky_inputs(&scene), AIR_STEPS);
    let sun_depth = &|point| truth.depth(point);
    let light = CloudLight { sun_depth, field: &field };
    let (mut square, mut sum, mut all, mut count) = (0.0, 0.0, 0.0, 0);
    for (i, (a, b)) in with.radiance.iter().zip(&without.radiance).enumerate() {
        let place = [i as u32 % SIZE[0], i as u32 / SIZE[0]].map(|p| f64::from(p) + 0.5);
        let dir = direction(&scene.camera, SIZE, place);
        // No cloud, no ground, and no glare of the sun.
        if i % 29 != 0 || b[3] > 0.0 || dir.y < 0.01 || dir.dot(scene.sun.direction) > 0.99 {
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
const MOST_RMS: f64 = 0.003;

/// Means of the open sky, or of the ground, over the path tracer's: of the frame, without what clouds send into the air,
/// and without the pass.
fn against_paths(scene: &Scene, samples: u32, of_ground: bool) -> [f64; 3] {
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
    let frame = |omit| {
        let settings = RenderSettings { omit, ..settings(Preset::High) };
        let mut renderer: Renderer = renderer(scene, &settings);
        (renderer.render(scene, 0.0, SMALL).expect("a frame").radiance, renderer)
    };
    let (with, renderer) = frame(None);
    let (without, _) = frame(Some(Pass::AirShadow));
    let known = renderer.air_shadow().expect("what it knows");
    let maps = Maps { uniforms: &known.maps, texels: &known.texels };
    let (field, dark) = (renderer.field().expect("a field"), FieldSeen::dark());
    let sun_depth = &|point| maps.depth(point);
    let sky = Sky::new(&sky_inputs(scene), AIR_STEPS);
    let view = |i: usize| {
        let place = [i as u32 % SMALL[0], i as u32 / SMALL[0]].map(|p| f64::from(p) + 0.5);
        direction(&scene.camera, SMALL, place)
    };
    // What the field adds to a pixel of the sky.
    let sent = |i: usize| {
        let dir = view(i);
        let span = clouded_span(&known.maps, dir);
        let nodes: Vec<f64> = (0..=NODES).map(|n| node_distance(span, f64::from(n))).collect();
        let steps = Preset::High.quality().air_steps;
        let [all, beam] = [&field, &dark].map(|field| {
            let light = CloudLight { sun_depth, field };
            change_along(&sky, dir, &nodes, steps, &light)[NODES as usize].y
        });
        all - beam
    };
    let open = |i: &usize| {
        let is_open = film.pixels[*i].mean[3] == 1.0 && with[*i][3] == 0.0;
        is_open && if of_ground { view(*i).y < -0.01 } else { view(*i).y > 0.01 }
    };
    let pixels: Vec<usize> = (0..film.pixels.len()).filter(open).collect();
    assert!(pixels.len() > 150, "{}", pixels.len());
    let sum = |of: &dyn Fn(usize) -> f64| pixels.iter().map(|i| of(*i)).sum::<f64>();
    let traced = sum(&|i| film.pixels[i].mean[1]);
    let all = sum(&|i| with[i][1].into());
    [all, all - sum(&sent), sum(&|i| without[i][1].into())].map(|light| light / traced)
}

fn shipped(path: &str) -> Scene {
    Scene::load(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("it ships")
}

/// The sky between clouds with the sun behind the eye's side, before a sun that they hide, and at noon: the fit of
/// what clouds send into the air, by least squares, with what it leaves.
#[test]
fn open_sky_is_as_bright_as_paths_find_it() {
    let _turn = alone();
    let (mut off, mut off_without, mut fit) = (0.0, 0.0, [0.0; 2]);
    for path in ["scenes/cumulus.toml", "docs/pictures/backlit.toml", "docs/pictures/noon.toml"] {
        let [with, beam, without] = against_paths(&shipped(path), 20, false);
        println!("{path}: {with:.4}, without what clouds send {beam:.4}, as bare air {without:.4}");
        assert!((with - 1.0).abs() < WORST_SKY, "{path}: {with}");
        off += (with - 1.0).abs();
        off_without += (without - 1.0).abs();
        fit[0] += (1.0 - beam) * (with - beam);
        fit[1] += (with - beam).powi(2);
    }
    println!("share of the field that fits: {:.3}", NET * fit[0] / fit[1]);
    assert!(off < 0.5 * off_without, "{off} {off_without}");
    // A tenth of it changes the sky by 1 to 2 %.
    assert!((fit[0] / fit[1] - 1.0).abs() < 0.15, "{fit:?}");
}

/// From over the clouds, in sunlight and in shadow.
#[test]
fn the_ground_is_as_bright_as_paths_find_it() {
    let _turn = alone();
    let [with, _, without] = against_paths(&shipped("docs/pictures/above.toml"), 20, true);
    println!("{with:.4}, without the pass {without:.4}");
    assert!((with - 1.0).abs() < 0.05, "{with}");
    assert!((without - 1.0).abs() > 2.0 * (with - 1.0).abs(), "{with} {without}");
}

/// What the fit leaves in its worst scene, and noise.
const WORST_SKY: f64 = 0.045;
