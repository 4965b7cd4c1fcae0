//! The fixed scenes and camera paths of the bench.

use std::path::Path;

use crate::Result;
use crate::scene::{Camera, CameraPath, Scene};
use glam::DVec3;

/// Frames a second of the scene's time: a frame's step is what a slow machine shows.
pub const FPS: f64 = 10.0;

/// Scenes and the path that ship, built in: the bench measures the same everywhere.
pub const CUMULUS: &str = include_str!("../../scenes/cumulus.toml");
/// Among the tops.
pub const FLIGHT: &str = include_str!("../../scenes/flight.toml");
const SUNSET: &str = include_str!("../../scenes/sunset.toml");
const THROUGH: &str = include_str!("../../scenes/paths/through.toml");

/// What moves.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Nothing: every frame shows the same time from the same place.
    Paused,
    /// The clouds.
    Animated,
    /// The clouds, and the camera on a path.
    Flight(CameraPath),
}

/// A scene and what moves in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// A name without spaces.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// What moves.
    pub motion: Motion,
}

impl Case {
    /// The scene as a frame shows it, and the frame's time in s.
    pub fn frame(&self, frame: u32) -> (Scene, f64) {
        let mut scene = self.scene.clone();
        let time = f64::from(frame) / FPS;
        match &self.motion {
            Motion::Paused => (scene, 0.0),
            Motion::Animated => (scene, time),
            Motion::Flight(path) => {
                scene.camera = path.camera(time, &self.scene.camera);
                (scene, time)
            }
        }
    }
}

/// A built-in scene by its file's name.
pub fn built_in(name: &str, text: &str) -> Result<Scene> {
    Scene::from_toml(text, &format!("the built-in {name}"), Path::new(""))
}

/// How far away from the origin a case lies, m.
const FAR: f64 = 1e6;
/// Of a sky that is nearly closed.
const OVERCAST: f64 = 0.95;

/// The cases of the bench.
pub fn cases() -> Result<Vec<Case>> {
    let cumulus = built_in("cumulus", CUMULUS)?;
    let case = |name: &str, scene: &Scene, motion: Motion| {
        Ok(Case { name: name.to_owned(), scene: scene.clone(), motion })
    };
    let changed = |change: &dyn Fn(&mut Scene)| {
        let mut scene = cumulus.clone();
        change(&mut scene);
        scene
    };
    let away = changed(&|s| s.camera = above_all_clouds(&s.camera));
    let empty = changed(&|s| {
        s.camera = above_all_clouds(&s.camera);
        s.clouds = None;
    });
    let far = changed(&|s| {
        s.camera.position.x += FAR;
        s.camera.target.x += FAR;
    });
    let overcast = changed(&|s| {
        if let Some(clouds) = &mut s.clouds {
            clouds.coverage = OVERCAST;
        }
    });
    let path = CameraPath::from_toml(THROUGH, "the built-in path")?;
    [
        case("still_paused", &cumulus, Motion::Paused),
        case("still_animated", &cumulus, Motion::Animated),
        case("flight", &built_in("flight", FLIGHT)?, Motion::Flight(path)),
        case("looking_away", &away, Motion::Animated),
        case("empty_sky", &empty, Motion::Animated),
        case("low_sun", &built_in("sunset", SUNSET)?, Motion::Animated),
        case("far_from_origin", &far, Motion::Animated),
        case("overcast", &overcast, Motion::Animated),
    ]
    .into_iter()
    .collect()
}

/// The two cases of a scene of the user's.
pub fn of_scene(scene: &Scene, stem: &str) -> [Case; 2] {
    [("paused", Motion::Paused), ("animated", Motion::Animated)].map(|(what, motion)| Case {
        name: format!("{stem}/{what}"),
        scene: scene.clone(),
        motion,
    })
}

/// The scenes with references of their own, by their files' stems.
pub fn scenes_with_references() -> Result<Vec<(String, Scene)>> {
    [("cumulus", CUMULUS), ("flight", FLIGHT), ("sunset", SUNSET)]
        .into_iter()
        .map(|(name, text)| Ok((name.to_owned(), built_in(name, text)?)))
        .collect()
}

/// Over the tops, looking up: the lower edge of a picture of 16:9 is 20 degrees above the horizon.
fn above_all_clouds(camera: &Camera) -> Camera {
    let position = DVec3::new(0.0, 3000.0, 0.0);
    let target = position + DVec3::new(0.0, 1000.0, -1000.0);
    Camera { position, target, ..*camera }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_are_sound_and_as_their_names_say() {
        let cases = cases().expect("built in");
        assert_eq!(cases.len(), 8);
        for case in &cases {
            let frames = [0, 7].map(|frame| case.frame(frame));
            for (scene, _) in &frames {
                scene.validate().expect(&case.name);
            }
            let moves = frames[0].0.camera != frames[1].0.camera;
            assert_eq!(moves, case.name == "flight", "{}", case.name);
            assert_eq!(frames[0].1 != frames[1].1, case.name != "still_paused", "{}", case.name);
        }
        let find = |name: &str| cases.iter().find(|c| c.name == name).expect(name);
        assert!(find("empty_sky").scene.clouds.is_none());
        // The same view, but for the clouds: the price of clouds that are not seen.
        assert_eq!(find("looking_away").scene.camera, find("empty_sky").scene.camera);
        assert!(find("looking_away").scene.clouds.is_some());
        assert!(find("low_sun").scene.sun.direction.y < 0.1);
        assert!(find("far_from_origin").scene.camera.position.length() >= 1e6);
    }
}
