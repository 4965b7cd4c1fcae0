//! Choosing from the panel's lists by clicks: preset, scene, weather map.

use image::{GrayImage, Luma};

use super::flight::{Flight, until};
use super::maps::SKY;

/// Where the panel has these, in points, as long as nothing is listed before them; they move with its
/// layout. `CUMULI_SCREENS` keeps pictures of it.
const PRESET: [u32; 2] = [60, 95];
const SCENE_SECTION: [u32; 2] = [60, 141];
const SCENE_LIST: [u32; 2] = [60, 187];
/// With the scene's section closed.
const SUN_SECTION: [u32; 2] = [60, 164];
/// With the sun's closed too.
const MAP_SECTION: [u32; 2] = [90, 555];
const MAP_LIST: [u32; 2] = [90, 578];
const SIZE: [u32; 2] = [760, 740];
/// From a list to its first entry, and from entry to entry, points.
const FIRST: u32 = 27;
const NEXT: u32 = 23;

/// Clicks, and waits until what it opens or closes has come to rest: the next click is meant for that.
fn click(flight: &Flight, place: [u32; 2]) {
    flight.click(place);
    flight.screen_at_rest(SIZE);
}

fn choose(flight: &Flight, list: [u32; 2], entry: u32) {
    click(flight, list);
    click(flight, [list[0], list[1] + FIRST + entry * NEXT]);
}

#[test]
fn preset_scene_and_map_are_chosen_by_clicks() {
    let Some(mut flight) = Flight::start_beside(SKY, "760x740", |dir| {
        std::fs::write(dir.join("clear.toml"), SKY.replace("coverage = 0.5", "coverage = 0.0"))
            .expect("written");
        for (name, value) in [("black.png", 0), ("white.png", 255)] {
            let map = GrayImage::from_pixel(4, 4, Luma([value]));
            map.save(dir.join(name)).expect("written");
        }
    }) else {
        return;
    };
    let noise = flight.picture();
    // low, medium, high, ultra
    choose(&flight, PRESET, 1);
    flight.keep_screen("preset.png", SIZE);
    flight.saved("F6", "scene-0001.toml");
    assert!(flight.log().contains("--preset medium"), "{}", flight.log());
    choose(&flight, PRESET, 0);
    assert!(flight.picture() == noise, "the preset low again");

    // Escape closes a list and not the window.
    click(&flight, SCENE_LIST);
    flight.keys(&["Escape"]);
    // clear, scene-0001, scene
    choose(&flight, SCENE_LIST, 0);
    until("it is loaded", || flight.log().contains("loaded clear.toml").then_some(()));
    let clear = flight.picture();
    assert!(clear != noise);
    choose(&flight, SCENE_LIST, 2);
    until("the first again", || flight.log().contains("loaded scene.toml").then_some(()));
    assert!(flight.picture() == noise, "the scene is the first");

    for section in [SCENE_SECTION, SUN_SECTION, MAP_SECTION] {
        click(&flight, section);
    }
    // none, black, white: pictures that were saved meanwhile are no maps.
    choose(&flight, MAP_LIST, 1);
    until("it is loaded", || flight.log().contains("weather map black.png").then_some(()));
    flight.keep_screen("map-list.png", SIZE);
    assert!(flight.picture() == clear, "black is a clear sky");
    choose(&flight, MAP_LIST, 0);
    // The first map brought a coverage of 1 with it, which stays.
    let covered = flight.picture();
    choose(&flight, MAP_LIST, 2);
    until("it is loaded", || flight.log().contains("weather map white.png").then_some(()));
    let white = flight.picture();
    assert!(white == covered && white != clear, "white is what the noise covers");
    assert_eq!(flight.quit(), Some(0));
}
