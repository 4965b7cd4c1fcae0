//! The light grid on the device against its twin in double precision.

use cumuli::frame::cpu::light_grid::GridLight;
use cumuli::frame::light_grid::{GridInputs, GridRoom, Spreads};
use cumuli::frame::population::Shapes;
use cumuli::frame::{Preset, RenderSettings, Renderer, cpu};
use cumuli::medium::{Phase, Truncation};
use cumuli::scene::{Camera, CloudField, Medium, ParticleSpec, Scene, Sky, Sun};
use cumuli::tables::{ScatteringOptions, ScatteringTable, Silent, TableSet};
use glam::{DQuat, DVec3};

use crate::common::{Random, gpu, tables};

const SIZE: [u32; 2] = [16, 16];

/// Largest difference of the field at random points around the eye, over the largest value: sun,
/// above, all around, depth.
fn difference(tables: &TableSet, scene: &Scene, time: f64, reach: DVec3) -> [f64; 5] {
    differ(tables, scene, time, reach, Preset::Low)
}

fn differ(tables: &TableSet, scene: &Scene, time: f64, reach: DVec3, preset: Preset) -> [f64; 5] {
    let settings = RenderSettings { preset, ..RenderSettings::default() };
    let mut renderer = Renderer::new(gpu(), tables, scene, &settings).expect("a renderer");
    renderer.frame(scene, time, SIZE).expect("a frame");
    let found = renderer.field().expect("the field");

    let shapes = Shapes::new(tables);
    let truncation = Truncation::new(&scene.medium.phase);
    let quality = preset.quality();
    let inputs = GridInputs::new(
        scene,
        &shapes,
        &truncation,
        &quality.grid,
        time,
        (u32::MAX, GridRoom::default()),
    )
    .expect("inputs")
    .expect("there are particles");
    let shift = inputs.anchor_at(time) - scene.camera.position;
    let mut particles = inputs.listed.clone();
    if let Some(clouds) = &inputs.clouds {
        particles.extend(cpu::rings::particles(clouds));
    }
    assert!(particles.len() > 10, "{} particles", particles.len());
    let spreads = Spreads::new(&shapes).expect("spreads");
    let twin = GridLight::solve(&inputs.uniforms, &particles, (&spreads.0, tables), inputs.turns);
    let expected = twin.seen_from(-shift);

    let mut random = Random(90);
    let (mut off, mut largest, mut shaded) = ([0.0f64; 5], [0.0f64; 5], false);
    for _ in 0..2000 {
        let point = random.direction() * random.uniform().cbrt() * reach + shift;
        let [a, b] = [&found, &expected].map(|field| {
            let (light, [sun, sky]) = (field.at(point), field.ground_shares(point));
            [light.x, light.y, light.z, sun, sky]
        });
        for i in 0..5 {
            off[i] = off[i].max((a[i] - b[i]).abs());
            largest[i] = largest[i].max(b[i].abs());
        }
        shaded |= (b[3] - 1.0).abs() > 0.01;
    }
    assert!(largest[0] > 1e-3 && shaded, "{largest:?}: no light or no shade");
    std::array::from_fn(|i| off[i] / largest[i])
}

/// Light is stored in f16 between turns: 5e-4 of a value at each; the turns of a conservative medium
/// add these up.
const LIGHT: f64 = 5e-3;
/// Uniform light is uniform in the cells, to the bit; between them it is the quotient of two filtered numbers, each of
/// a few roundings of f32.
const UNIFORM: f64 = 2.5e-7;
/// Matter is summed in counts of 2^-31 of the densest particle's extinction times their number, the
/// rest are roundings of f32.
const SHARES: f64 = 1e-3;

fn clump(albedo: f64) -> Scene {
    let mut random = Random(91);
    let particles = (0..60)
        .map(|i| ParticleSpec {
            centre: random.direction() * 400.0 * random.uniform().cbrt(),
            radius: 60.0 + 60.0 * random.uniform(),
            extinction: 0.01 + 0.02 * random.uniform(),
            shape: if i % 2 == 0 { "uniform".to_owned() } else { "pyroclastic-1".to_owned() },
            orientation: DQuat::IDENTITY,
        })
        .collect();
    Scene {
        camera: Camera {
            position: DVec3::new(900.0, 100.0, 1200.0),
            target: DVec3::ZERO,
            ..Camera::default()
        },
        sun: Sun { direction: DVec3::new(0.3, 0.8, 0.2).normalize(), ..Sun::default() },
        sky: Sky::Uniform { radiance: 0.1 },
        medium: Medium { phase: Phase::Mie { diameter_um: 20.0 }, albedo },
        particles,
        ..Scene::default()
    }
}

#[test]
fn the_light_of_a_clump_is_that_of_the_twin() {
    let off = difference(tables(), &clump(1.0), 0.0, DVec3::splat(600.0));
    println!("clump: {off:?}");
    assert!(
        off[0] < LIGHT && off[1] < LIGHT && off[2] < UNIFORM && off[3].max(off[4]) < SHARES,
        "{off:?}"
    );
}

/// All directions, with weights of their own, under a sky that is brighter on one side.
#[test]
fn the_light_of_many_directions_is_that_of_the_twin() {
    let mut scene = clump(1.0);
    scene.particles.truncate(12);
    scene.particles.iter_mut().for_each(|p| p.shape = "uniform".to_owned());
    scene.sky = Sky::Atmosphere;
    scene.sun.direction = DVec3::new(0.9, 0.1, 0.2).normalize();
    let off = differ(tables(), &scene, 0.0, DVec3::splat(600.0), Preset::High);
    println!("32 directions: {off:?}");
    assert!(
        off[0] < LIGHT && off[1] < LIGHT && off[2] < UNIFORM && off[3].max(off[4]) < SHARES,
        "{off:?}"
    );
}

#[test]
fn the_light_of_a_field_is_that_of_the_twin() {
    let mut scene = clump(1.0);
    scene.particles.clear();
    scene.camera.position = DVec3::new(0.0, 1100.0, 0.0);
    scene.clouds = Some(CloudField { cells: 24, rings: 2, ..CloudField::default() });
    // Beyond the first level, into the second.
    let off = difference(tables(), &scene, 700.0, DVec3::new(2500.0, 600.0, 2500.0));
    println!("field: {off:?}");
    assert!(
        off[0] < LIGHT && off[1] < LIGHT && off[2] < UNIFORM && off[3].max(off[4]) < SHARES,
        "{off:?}"
    );
}

#[test]
fn a_giant_over_a_field_is_spread_as_the_twin_does() {
    let mut scene = clump(1.0);
    scene.particles.truncate(1);
    // Its box has a million cells of the finest level, most of them outside.
    scene.particles[0].radius = 3000.0;
    scene.particles[0].extinction = 2e-4;
    scene.particles[0].centre = DVec3::new(300.0, 2500.0, -200.0);
    scene.camera.position = DVec3::new(0.0, 1100.0, 0.0);
    scene.clouds = Some(CloudField { cells: 24, rings: 2, ..CloudField::default() });
    let off = difference(tables(), &scene, 700.0, DVec3::new(2500.0, 600.0, 2500.0));
    println!("giant: {off:?}");
    assert!(
        off[0] < LIGHT && off[1] < LIGHT && off[2] < UNIFORM && off[3].max(off[4]) < SHARES,
        "{off:?}"
    );
}

#[test]
fn the_light_of_a_clump_that_absorbs_is_that_of_the_twin() {
    // The grid does not read the scattering table, but a renderer asks for one of its medium.
    let (phase, albedo) = (Phase::hg(0.6).expect("in range"), 0.9);
    let options = ScatteringOptions {
        resolution: [8, 8, 8, 24],
        optical_radius: [0.05, 100.0],
        remainder: 1e-3,
        ..ScatteringOptions::default()
    };
    let table = ScatteringTable::bake(phase, albedo, &options, &Silent).expect("a table");
    let shapes = tables().optical_depth().to_vec();
    let options = *tables().optical_depth_options();
    let tables = TableSet::new(shapes, options, vec![table]).expect("tables");
    let mut scene = clump(albedo);
    scene.medium.phase = phase;
    let off = difference(&tables, &scene, 0.0, DVec3::splat(600.0));
    println!("absorbing clump: {off:?}");
    assert!(
        off[0] < LIGHT && off[1] < LIGHT && off[2] < LIGHT && off[3].max(off[4]) < SHARES,
        "{off:?}"
    );
}
