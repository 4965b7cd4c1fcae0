//! The program in a real window: an X server without a screen, a software driver, keys and mouse
//! by xdotool. The logic of camera and panel has tests of its own, which need no display.

#![cfg(all(target_os = "linux", feature = "window"))]

mod choices;
mod display;
mod drop;
mod files;
mod flight;
mod maps;
mod minimised;
mod surfaces;
mod views;

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use flight::{Flight, until};

/// One particle under a uniform sky; it is off the middle of the picture, so every turn shows.
const SCENE: &str = r#"
[camera]
position = [0.0, 0.0, 500.0]
target = [0.0, 0.0, 0.0]
[sun]
direction = [1.0, 1.0, 1.0]
[sky]
kind = "uniform"
radiance = 0.05
[[particles]]
centre = [60.0, 40.0, 0.0]
radius = 100.0
extinction = 0.02
"#;

/// Middle of what is brighter than the sky of the corner, pixels.
fn cloud_at(picture: &image::RgbImage) -> [f64; 2] {
    let sky = picture.get_pixel(0, picture.height() - 1).0[1];
    let cloud = picture.enumerate_pixels().filter(|(_, _, p)| p.0[1].abs_diff(sky) > 12);
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for (x, y, _) in cloud {
        sum = [sum[0] + f64::from(x), sum[1] + f64::from(y)];
        count += 1.0;
    }
    assert!(count > 50.0, "no cloud in the picture");
    sum.map(|s| s / count)
}

/// Moves the mouse to the left with its button held. The press follows the first movement at once:
/// nothing is painted between.
fn press_and_move(flight: &Flight, [x, y]: [&str; 2]) {
    let place = ["mousemove", "--window", &flight.window, x, y];
    flight.display.tool(&[&place[..], &["mousedown", "1"]].concat());
    std::thread::sleep(Duration::from_millis(500));
    flight.display.tool(&["mousemove_relative", "--", "-40", "0"]);
    std::thread::sleep(Duration::from_millis(500));
    flight.display.tool(&["mouseup", "1"]);
}

#[test]
fn keys_and_mouse_move_the_view() {
    let Some(mut flight) = Flight::start(SCENE, "640x480") else { return };
    let start = cloud_at(&flight.picture());
    assert!(start[0] > 340.0 && start[1] < 220.0, "right of the middle and above it: {start:?}");

    flight.display.tool(&["keydown", "d"]);
    std::thread::sleep(Duration::from_millis(700));
    flight.display.tool(&["keyup", "d"]);
    let right = cloud_at(&flight.picture());
    assert!(right[0] < start[0] - 10.0, "flying right moves it left: {start:?} {right:?}");

    flight.keys(&["Home"]);
    let home = cloud_at(&flight.picture());
    assert_eq!(home, start, "back at the start to the bit");

    // In the middle there is no panel.
    press_and_move(&flight, ["480", "300"]);
    let turned = cloud_at(&flight.picture());
    assert!(turned[0] > start[0] + 10.0, "looking left moves it right: {start:?} {turned:?}");

    // A press on the panel is the panel's: its title is dragged, the view stays.
    press_and_move(&flight, ["80", "16"]);
    assert_eq!(cloud_at(&flight.picture()), turned, "the panel was meant");

    assert_eq!(flight.quit(), Some(0));
}

#[test]
fn the_window_shows_the_view_and_the_panel_comes_and_goes() {
    let Some(mut flight) = Flight::start(SCENE, "320x240") else { return };
    let saved = flight.picture();
    flight.keys(&["F1"]);
    // What is on the screen is the saved picture, perhaps at a lower resolution: its mean colour is near.
    let mean = |picture: &image::RgbImage| {
        let sum: u64 = picture.pixels().map(|p| u64::from(p.0[1])).sum();
        sum as f64 / f64::from(picture.width() * picture.height())
    };
    let bare = until("the panel is gone", || {
        let screen = flight.display.screen([320, 240]);
        // Scaled up from a smaller picture until it rests.
        ((mean(&screen) - mean(&saved)).abs() < 2.0).then_some(screen)
    });
    assert!((cloud_at(&bare)[0] - cloud_at(&saved)[0]).abs() < 3.0);
    flight.keys(&["F1"]);
    until("the panel is back", || {
        let dark = flight.display.screen([320, 240]);
        (mean(&dark) < mean(&bare) - 10.0).then_some(())
    });
    assert_eq!(flight.quit(), Some(0));
}

#[test]
fn odd_and_tiny_sizes() {
    let Some(mut flight) = Flight::start_at_scale(SCENE, "320x240", Some("1.5")) else { return };
    for (width, height) in [(333, 77), (1, 1), (7, 301), (640, 480)] {
        let (w, h) = (width.to_string(), height.to_string());
        let window = flight.window.clone();
        flight.display.tool(&["windowsize", "--sync", &window, &w, &h]);
        // The event may come after the key: until the picture has the window's size.
        until("a picture of the window's size", || {
            let picture = flight.picture();
            (picture.dimensions() == (width, height)).then_some(())
        });
    }
    let window = flight.window.clone();
    flight.display.tool(&["windowunmap", "--sync", &window]);
    flight.display.tool(&["windowmap", "--sync", &window]);
    flight.display.tool(&["windowfocus", "--sync", &window]);
    assert_eq!(flight.picture().dimensions(), (640, 480), "after it was hidden");
    assert_eq!(flight.quit(), Some(0));
}

#[test]
fn without_a_display_there_is_one_clear_sentence() {
    for arguments in [&["fly"][..], &[]] {
        let output = Command::new(env!("CARGO_BIN_EXE_cumuli"))
            .args(arguments)
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .output()
            .expect("the program starts");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.starts_with("cumuli: no window can be opened"), "{message}");
        assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    }
}

#[test]
fn bad_scenes_are_refused_before_a_window_opens() {
    let output = Command::new(env!("CARGO_BIN_EXE_cumuli"))
        .args(["fly", "--scene", "none.toml"])
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")))
        .output()
        .expect("the program starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("none.toml: there is no such file"), "{message}");
}

#[test]
fn a_lost_device_is_replaced_and_the_flight_goes_on() {
    let Some(mut flight) = Flight::start(SCENE, "320x240") else { return };
    let before = flight.picture();
    flight.keys(&["F10"]);
    until("it starts again", || flight.log().contains("starting again").then_some(()));
    // A picture that was under way when the device went may be lost; the next is not.
    assert_eq!(flight.picture(), before, "the same bits from the new device");
    flight.keys(&["F1"]);
    until("the view is on the screen again", || {
        let screen = flight.display.screen([320, 240]);
        let off = |at: [f64; 2], to: [f64; 2]| (at[0] - to[0]).hypot(at[1] - to[1]);
        let shown = screen.pixels().any(|p| p.0[1] > 12);
        (shown && off(cloud_at(&screen), cloud_at(&before)) < 3.0).then_some(())
    });
    assert!(flight.is_alive());
    assert_eq!(flight.quit(), Some(0));
}
