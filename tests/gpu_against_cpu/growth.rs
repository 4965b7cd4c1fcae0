//! Scenes that need more room than a renderer starts with.

use cumuli::frame::population::Shapes;
use cumuli::frame::{RenderSettings, Renderer};
use cumuli::scene::{CloudField, ParticleSpec, Scene};
use glam::{DQuat, DVec3};

use crate::common::{Random, gpu, tables};

const SIZE: [u32; 2] = [64, 40];
/// What a renderer has room for at first: particles, entries of a picture's tiles.
const FIRST_PARTICLES: u64 = 1 << 14;
const FIRST_TILES: u64 = 1 << 17;

fn render(scene: &Scene, size: [u32; 2]) -> cumuli::frame::Picture {
    let settings = RenderSettings::default();
    let mut renderer = Renderer::new(gpu(), tables(), scene, &settings).expect("a renderer");
    let first = renderer.render(scene, 0.0, size).expect("a picture");
    // Growing left nothing half done behind: with room from the start the picture is the same.
    let again = renderer.render(scene, 0.0, size).expect("a picture");
    assert!(first.radiance == again.radiance, "the picture after growing differs");
    assert_eq!(again.stats.counters.overflowed, 0);
    first
}

#[test]
fn a_large_field_finds_room() {
    let clouds = CloudField { coverage: 1.0, cells: 80, rings: 3, ..CloudField::default() };
    let scene = Scene { clouds: Some(clouds), ..Scene::default() };
    let counters = render(&scene, SIZE).stats.counters;
    let populated = Shapes::new(tables()).populate(&scene, 0.0).expect("particles").len() as u64;
    assert!(populated > FIRST_PARTICLES, "{populated} particles fit from the start");
    // One at the very edge of being left out may differ, as in rings.rs.
    assert!(counters.particles_generated.abs_diff(populated) <= 3, "{counters:?}, {populated}");
    assert!(counters.light_list_entries > 2 * FIRST_TILES, "{counters:?}");
    assert_eq!(counters.overflowed, 0);
}

#[test]
fn many_particles_on_every_tile_find_room() {
    let mut random = Random(90);
    let particles = (0..700)
        .map(|_| ParticleSpec {
            centre: DVec3::new(0.0, 0.0, -1000.0) + random.direction() * 300.0,
            radius: 900.0,
            extinction: 1e-5,
            shape: "uniform".to_owned(),
            orientation: DQuat::IDENTITY,
        })
        .collect();
    let scene = Scene { particles, ..Scene::default() };
    // 375 tiles, all of them inside the picture of every particle.
    let counters = render(&scene, [200, 120]).stats.counters;
    assert!(counters.screen_list_entries > FIRST_TILES, "{counters:?}");
    assert_eq!(counters.overflowed, 0);
}
