//! Fields under weather maps: of one pixel and of many, with every value that a colour can have, with
//! and without noise, near and far.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec2;

use super::corners::field;
use crate::frame::cpu::noise::hash;
use crate::scene::{Channel, Outside, Scene, WeatherImage, WeatherMap};

/// Pixels a side of the motley map.
const SIDE: u32 = 64;

/// The scenes, each with a name.
pub(super) fn scenes() -> impl Iterator<Item = (&'static str, Scene)> {
    let motley = WeatherImage::new([SIDE; 2], (0..SIDE * SIDE).map(hash).collect());
    let (motley, pixel) = (Arc::new(motley), Arc::new(WeatherImage::new([1, 1], vec![u32::MAX])));
    [
        ("a map of a pixel", pixel, 1e8, Outside::Repeat, 1.0, 0.0),
        ("a motley map", motley.clone(), 1500.0, Outside::Clear, 0.5, 0.0),
        ("a map finer than cells", motley.clone(), 60.0, Outside::Edge, 0.0, 0.0),
        ("a map far away", motley, 1e4, Outside::Repeat, 0.0, 1e10),
    ]
    .into_iter()
    .map(|(name, image, width, outside, noise, away)| {
        let mut scene = field();
        if let Some(clouds) = &mut scene.clouds {
            clouds.coverage = 1.0;
            clouds.weather = Some(WeatherMap {
                file: PathBuf::from("map.png"),
                extent: DVec2::splat(width),
                centre: DVec2::new(17.0, -1e3),
                outside,
                channels: vec![Channel::Coverage, Channel::Height, Channel::Extinction],
                noise,
                image,
            });
        }
        scene.camera.position.x += away;
        scene.camera.target.x += away;
        (name, scene)
    })
}
