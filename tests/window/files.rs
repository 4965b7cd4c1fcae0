//! Files between the window and the disk.

use super::SCENE;
use super::flight::{Flight, until};
use super::maps::SKY;

/// Where the panel has the slider for the time of day at nine, in points: its first slider. Moves with
/// the layout of the panel; a picture of it is kept by `CUMULI_SCREENS`.
const TIME_OF_DAY: [u32; 2] = [72, 297];
/// From there to the evening, points.
const TO_EVENING: u32 = 40;

/// Width and height of the lower right corner where mistakes are told, points.
const MISTAKE: [u32; 2] = [376, 120];
/// A line of text has so many light red pixels, which nothing else in that corner has: a word has some
/// hundred.
const RED_PIXELS: usize = 100;

/// Whether a mistake is told where it should be.
pub fn tells_mistake(screen: &image::RgbImage) -> bool {
    let [left, top] = [screen.width() - MISTAKE[0], screen.height() - MISTAKE[1]];
    let corner = image::imageops::crop_imm(screen, left, top, MISTAKE[0], MISTAKE[1]).to_image();
    let red = corner.pixels().filter(|p| p.0[0] > 200 && p.0[1] < 160 && p.0[2] < 160);
    red.count() > RED_PIXELS
}

#[test]
fn the_saved_scene_makes_the_same_picture() {
    let Some(mut flight) = Flight::start(SCENE, "800x600") else { return };
    flight.screen_at_rest([800, 600]);
    flight.keep_screen("start.png", [800, 600]);
    // The sun goes to the evening, and the camera to the right and up.
    flight.drag(TIME_OF_DAY, [TIME_OF_DAY[0] + TO_EVENING, TIME_OF_DAY[1]]);
    flight.keep_screen("evening.png", [800, 600]);
    flight.display.tool(&["keydown", "d"]);
    std::thread::sleep(std::time::Duration::from_millis(400));
    flight.display.tool(&["keyup", "d"]);
    flight.keys(&["e"]);
    // It glides; at rest nothing changes any more.
    let mut shown = flight.picture();
    until("it rests", || {
        let next = flight.picture();
        (std::mem::replace(&mut shown, next) == shown).then_some(())
    });
    flight.saved("F6", "scene-0001.toml");
    flight.keep_screen("saved.png", [800, 600]);
    let scene = std::fs::read_to_string(flight.path("scene-0001.toml")).expect("a scene");
    let table: toml::Table = scene.parse().expect("TOML");
    let east = table["sun"]["direction"][0].as_float().expect("a number");
    // It was in the east.
    assert!(east < 0.0, "the slider was moved to the evening: {scene}");
    // Listed particles do not change with time: any will do.
    let arguments =
        ["render", "--scene", "scene-0001.toml", "--preset", "low", "--size", "800x600"];
    flight.other(&[&arguments[..], &["--out", "rendered.png"]].concat());
    let rendered = image::open(flight.path("rendered.png")).expect("a PNG").into_rgb8();
    assert!(rendered == shown, "cumuli render makes another picture");
    assert_eq!(flight.quit(), Some(0));
}

#[test]
fn changes_on_disk_are_shown_and_mistakes_told() {
    let Some(mut flight) = Flight::start(SCENE, "640x480") else { return };
    flight.keys(&["F1"]);
    let before = flight.picture();
    assert!(!tells_mistake(&flight.display.screen([640, 480])), "there is none yet");
    let path = flight.path("scene.toml");
    std::fs::write(&path, SCENE.replace("radius = 100.0", "radius = \"wide\"")).expect("written");
    until("the mistake is told", || flight.log().contains("particles[0].radius").then_some(()));
    let size = [640, 480];
    until("it is on the screen", || tells_mistake(&flight.display.screen(size)).then_some(()));
    flight.keep_screen("mistake.png", [640, 480]);
    assert_eq!(flight.picture(), before, "the last good scene goes on");
    std::fs::write(&path, SCENE.replace("radius = 100.0", "radius = 160.0")).expect("written");
    until("the change is shown", || (flight.picture() != before).then_some(()));
    std::fs::write(&path, SCENE).expect("written");
    until("and back", || (flight.picture() == before).then_some(()));
    assert_eq!(flight.quit(), Some(0));
}

#[test]
fn a_scene_whose_map_is_broken_is_loaded_when_the_map_is_mended() {
    let Some(mut flight) = Flight::start(SKY, "480x360") else { return };
    let noise = flight.picture();
    let (path, map) = (flight.path("scene.toml"), flight.path("map.png"));
    std::fs::write(&map, "no image").expect("written");
    let scene = format!("{SKY}[clouds.weather]\nfile = \"map.png\"\n");
    std::fs::write(&path, scene).expect("written");
    until("the mistake is told", || flight.log().contains("is no PNG image").then_some(()));
    assert!(flight.picture() == noise, "the last good scene goes on");
    // Only the map is mended: the scene's file is not touched.
    image::GrayImage::new(4, 4).save(&map).expect("written");
    until("the scene is loaded", || flight.log().contains("scene.toml was changed").then_some(()));
    assert!(flight.picture() != noise, "black is a clear sky");
    assert_eq!(flight.quit(), Some(0));
}

#[test]
fn a_recorded_path_is_saved() {
    let Some(mut flight) = Flight::start(SCENE, "320x240") else { return };
    flight.keys(&["r"]);
    flight.display.tool(&["keydown", "d"]);
    std::thread::sleep(std::time::Duration::from_millis(1500));
    flight.display.tool(&["keyup", "d"]);
    flight.keys(&["r"]);
    let path = flight.saved("F7", "path-0001.toml");
    let text = std::fs::read_to_string(path).expect("a path");
    let table: toml::Table = text.parse().expect("TOML");
    let keys = table["keys"].as_array().expect("keys");
    let x = |key: &toml::Value| key["position"][0].as_float().expect("a number");
    assert!(keys.len() >= 3 && x(&keys[keys.len() - 1]) > x(&keys[0]) + 1.0, "{text}");
    let render = ["render", "--scene", "scene.toml", "--preset", "low", "--size", "64x48"];
    let frames = ["--path", "path-0001.toml", "--frames", "0..2", "--fps", "1", "--out", "f"];
    flight.other(&[&render[..], &frames].concat());
    flight.keys(&["Home"]);
    let home = flight.picture();
    flight.keys(&["p"]);
    until("it flies along the path", || (flight.picture() != home).then_some(()));
    let frame =
        |i: u32| std::fs::read(flight.path(&format!("f/frame_{i:05}.png"))).expect("a frame");
    assert!(frame(0) != frame(1), "the camera moves");
    assert_eq!(flight.quit(), Some(0));
}
