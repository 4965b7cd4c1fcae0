//! Frames one after the other, as a window makes them: the eye is on its way to where a case has it.

use glam::DVec3;

use super::{Case, Way};
use crate::scene::limits::{COORDINATE, TIME};
use crate::scene::{Medium, Scene};

/// Frames on the way: one more than a block has pixels, so that each is shaded once in motion.
const MOVES: u32 = 5;
/// Way of the eye from one frame to the next, over its distance to what it looks at: some pixels of a
/// small picture.
const STEP: f64 = 0.02;
/// s from one frame to the next: clouds move and evolve, and the light grid that is shown is not yet that
/// of the frame.
const TIME_STEP: f64 = 0.1;
/// Frames at rest after which a picture is finished: a solution of the light grid in preset ultra takes
/// less than 300 steps, four a frame, and then four pixels of a block.
pub const MOST_FRAMES: u32 = 100;

/// Every so many corners are made so too: neighbours in the list are of a kind.
const SOME: usize = 5;

/// The same corners as in a window: some of all, and those that are about times and sizes, since blocks of
/// pixels stick out of small pictures.
pub fn corners(alone: &[Case], size: [u32; 2]) -> Vec<Case> {
    let is_special = |case: &Case| case.time != 0.0 || (case.size != size && case.size != [1, 1]);
    let chosen = alone.iter().enumerate().filter(|(number, case)| {
        // Others need renderers of their own.
        let is_plain = case.scene.medium == Medium::default();
        is_plain && (number.is_multiple_of(SOME) || is_special(case))
    });
    chosen
        .map(|(_, case)| Case {
            name: format!("live: {}", case.name),
            way: Way::Live,
            ..case.clone()
        })
        .collect()
}

/// Scenes and times on the way, the farthest first. All are within the ranges.
pub fn way(case: &Case) -> impl Iterator<Item = (Scene, f64)> {
    let camera = &case.scene.camera;
    let away = STEP * camera.position.distance(camera.target);
    let across = away * DVec3::new(0.6, 0.0, 0.8);
    (1..=MOVES).rev().map(move |left| {
        let mut scene = case.scene.clone();
        let position = scene.camera.position + f64::from(left) * across;
        scene.camera.position =
            position.clamp(DVec3::splat(COORDINATE.least), DVec3::splat(COORDINATE.most));
        let time = (case.time - f64::from(left) * TIME_STEP).clamp(TIME.least, TIME.most);
        (scene, time)
    })
}
