//! What a path of the reference tracer is worth: how noisy one is in pixels that show clouds, and
//! how long it takes. Pictures come the sooner the smaller the product of the two is.
//!
//! `cargo run --release --example path_noise -- [PATHS [SCENE ...]]`

use std::path::PathBuf;

use cpu_time::ThreadTime;
use cumuli::Error;
use cumuli::reference::{Filter, Place, Random, View, World, look};
use cumuli::scene::Scene;
use cumuli::tables::TableSet;
use glam::DVec3;

/// Of the picture, pixels; one in `STRIDE` is looked at.
const SIZE: [u32; 2] = [64, 36];
const STRIDE: usize = 7;
/// Paths that tell whether it shows clouds.
const PILOT: u64 = 32;
/// Rec. 709.
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let paths = arguments.next().map_or(Ok(512), |n| n.parse::<u64>())?.max(2 * PILOT);
    let mut scenes: Vec<PathBuf> = arguments.map(PathBuf::from).collect();
    if scenes.is_empty() {
        scenes = ["cumulus", "flight", "sunset"].map(|n| format!("scenes/{n}.toml").into()).into();
    }
    for scene in &scenes {
        println!("{}: {}", scene.display(), measure(&Scene::load(scene)?, paths)?);
    }
    Ok(())
}

fn measure(scene: &Scene, paths: u64) -> Result<String, Error> {
    let world = World::new(scene, &TableSet::embedded()?, 0.0)?;
    let view = View::new(&scene.camera, SIZE, None, Filter::Centre);
    // Squared error of one path over the squared brightness, and seconds a path.
    let mut pixels = Vec::new();
    'pixels: for index in (0..(SIZE[0] * SIZE[1]) as usize).step_by(STRIDE) {
        let (x, y) = (index as u32 % SIZE[0], index as u32 / SIZE[0]);
        let ray = view.ray([f64::from(x) + 0.5, f64::from(y) + 0.5], [0.0; 2]);
        let (mut sum, mut squares, mut transmittance) = (0.0, 0.0, 0.0);
        let start = ThreadTime::now();
        for path in 0..paths {
            // The others cost next to nothing where pixels get paths by their noise.
            if path == PILOT && transmittance > 0.5 * PILOT as f64 {
                continue 'pixels;
            }
            let mut random = Random::new(0, index as u64, path);
            let seen = match &world.surroundings {
                Place::Air(sky) => {
                    look(&world.medium, sky.as_ref(), &world.matter, ray, &mut random)
                }
                Place::Uniform(sky) => look(&world.medium, sky, &world.matter, ray, &mut random),
            };
            let brightness = LUMINANCE.dot(seen.radiance);
            sum += brightness;
            squares += brightness * brightness;
            transmittance += seen.transmittance;
        }
        let count = paths as f64;
        let mean = sum / count;
        if transmittance < 0.5 * count && mean > 0.0 {
            let variance = (squares / count - mean * mean) * count / (count - 1.0);
            pixels.push((variance / (mean * mean), start.elapsed().as_secs_f64() / count));
        }
    }
    pixels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let share = |part: usize| pixels.get(part * pixels.len() / 4).map_or(0.0, |p| p.0);
    let micro = 1e6 * pixels.iter().map(|p| p.1).sum::<f64>() / pixels.len().max(1) as f64;
    Ok(format!(
        "{} pixels with clouds, noise of a path squared {:.2} (quartiles {:.2} and {:.2}), {micro:.1} us of \
         processor time a path, product {:.1}",
        pixels.len(),
        share(2),
        share(1),
        share(3),
        share(2) * micro,
    ))
}
