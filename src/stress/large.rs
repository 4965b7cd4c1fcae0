//! Cases that take gigabytes or minutes.

use glam::DVec3;

use super::corners::{NOISE, clump, particle, space};
use super::{Case, Way};
use crate::frame::Preset;
use crate::scene::{Scene, Sky};

/// Pixels of cases that are not about them.
const SIZE: [u32; 2] = [16, 9];

/// The same of a million particles. At 16x9 half of them are in the list of each tile, which is more than a software
/// driver walks: 107 rays and texels of shadow maps are cut, and told of.
const OF_MANY: [u32; 2] = [256, 144];

/// All of them.
pub fn large() -> Vec<Case> {
    let case = |name: &str, scene: Scene| {
        let (name, size, preset) = (name.to_owned(), SIZE, Preset::Low);
        Case { name, scene, time: 0.0, size, preset, way: Way::Alone, like: None }
    };
    let mut far = clump(DVec3::new(0.0, 800.0, 0.0));
    far.sky = Sky::Atmosphere;
    vec![
        Case { size: [7680, 4320], ..case("8K", far) },
        Case { like: Some(Box::new(row(MANY / 100))), ..case("300000 in a row", row(MANY)) },
        Case { size: OF_MANY, ..case("a million particles", million()) },
    ]
}

fn million() -> Scene {
    let side = 100;
    let place = |i: u32, step: u32| f64::from(i / step % side) - 0.5 * f64::from(side);
    let particles = (0..side * side * side)
        .map(|i| {
            let centre = 20.0 * DVec3::new(place(i, 1), place(i, side), place(i, side * side));
            particle(centre, 12.0, 1e-3, if i % 3 == 0 { NOISE } else { "uniform" })
        })
        .collect();
    space(DVec3::new(900.0, 1200.0, 2400.0), particles)
}

/// Particles of the long row.
const MANY: u32 = 300_000;
/// m, from the first to the last.
const LENGTH: f64 = 1e4;
/// m, of a particle.
const RADIUS: f64 = 10.0;
/// Optical depth of the row.
const DEPTH: f64 = 2.0;

/// A row of particles along the view, of the same matter however many they are: every pixel's ray meets
/// most of them, hundreds at a place.
pub fn row(count: u32) -> Scene {
    let extinction = DEPTH / (2.0 * RADIUS * f64::from(count));
    let particles = (0..count)
        .map(|i| {
            let along = (f64::from(i) + 0.5) / f64::from(count);
            particle(DVec3::NEG_Z * LENGTH * along, RADIUS, extinction, "uniform")
        })
        .collect();
    let mut scene = space(DVec3::Z * 100.0, particles);
    scene.camera.target = DVec3::NEG_Z * LENGTH;
    scene.camera.fov_x = 1.0;
    // From the side: each particle's light depends on few others.
    scene.sun.direction = DVec3::new(0.6, 0.8, 0.0);
    scene
}
