//! A window that is minimised, by a window manager.

use std::process::{Command, Stdio};
use std::time::Duration;

use super::display::is_there;
use super::flight::{Flight, until};
use super::maps::SKY;

/// How long it is watched while nobody sees it.
const WATCHED: Duration = Duration::from_secs(2);
/// Most processor time meanwhile: looking four times a second whether it is shown again takes a
/// hundredth of this; pictures took all there is.
const MOST: Duration = Duration::from_millis(300);
const SIZE: [u32; 2] = [320, 240];

#[test]
fn minimised_it_makes_no_pictures_and_shown_again_it_goes_on() {
    if !is_there("openbox") {
        println!("skipped: openbox is needed to minimise the window");
        return;
    }
    let drifting = SKY.replace("wind = [0.0, 0.0, 0.0]", "wind = [100.0, 0.0, 0.0]");
    let Some(flight) = Flight::start(&drifting, "320x240") else { return };
    let mut manager = Command::new("openbox")
        .env("DISPLAY", flight.display.name())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("openbox starts");
    let tool = |command: &str| flight.display.tool(&[command, "--sync", &flight.window]);
    until("the window is managed", || {
        tool("windowactivate");
        let active = flight.display.tool(&["getactivewindow"]);
        (active.trim() == flight.window).then_some(())
    });
    let busy = || {
        let before = flight.processor_time();
        std::thread::sleep(WATCHED);
        flight.processor_time() - before >= MOST
    };
    flight.keys(&["F1", "space"]);
    until("clouds drift", || busy().then_some(()));
    tool("windowminimize");
    // What was under way is finished first.
    until("it rests", || (!busy()).then_some(()));
    tool("windowactivate");
    until("it goes on", || busy().then_some(()));
    let before = flight.display.screen(SIZE);
    until("clouds drift again", || (flight.display.screen(SIZE) != before).then_some(()));
    assert_eq!(flight.quit(), Some(0));
    let _ = manager.kill();
    let _ = manager.wait();
}
