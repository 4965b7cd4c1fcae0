//! What happens to the window's surface: it is lost, and the display's scale changes under it.

use x11rb::connection::Connection;
use x11rb::protocol::xproto::{AtomEnum, PropMode};
use x11rb::wrapper::ConnectionExt;

use super::flight::{Flight, until};
use super::{SCENE, cloud_at};

#[test]
fn a_lost_surface_is_replaced_and_shows_what_comes() {
    let Some(mut flight) = Flight::start(SCENE, "320x240") else { return };
    flight.keys(&["F1"]);
    let before = flight.picture();
    flight.screen_at_rest([320, 240]);
    flight.keys(&["F9"]);
    until("it is replaced", || flight.log().contains("surface was lost").then_some(()));
    assert_eq!(flight.picture(), before, "the device is the same");
    // What comes after it is on the screen: the panel, and then the view without it.
    let left_of_the_cloud = |screen: &image::RgbImage| screen.get_pixel(60, 200).0[1];
    until("the message is gone", || {
        let screen = flight.display.screen([320, 240]);
        (left_of_the_cloud(&screen).abs_diff(screen.get_pixel(10, 20).0[1]) < 12).then_some(())
    });
    let bare = left_of_the_cloud(&flight.screen_at_rest([320, 240]));
    flight.keys(&["F1"]);
    until("the panel is shown", || {
        (left_of_the_cloud(&flight.display.screen([320, 240])) != bare).then_some(())
    });
    flight.keys(&["F1"]);
    until("the view is on the screen", || {
        let screen = flight.display.screen([320, 240]);
        let off = |at: [f64; 2], to: [f64; 2]| (at[0] - to[0]).hypot(at[1] - to[1]);
        let shown = left_of_the_cloud(&screen) == bare;
        (shown && off(cloud_at(&screen), cloud_at(&before)) < 3.0).then_some(())
    });
    assert_eq!(flight.quit(), Some(0));
}

/// Sets the display's dots per inch, as a desktop's settings do. Programs read the root window's; winit is
/// told that it changed by an event of a window of its own, which desktops have a settings daemon for.
fn set_dpi(flight: &Flight, dpi: u32) {
    let (server, screen) = x11rb::connect(Some(flight.display.name())).expect("the server");
    let root = server.setup().roots[screen].root;
    let text = format!("Xft.dpi:\t{dpi}\n");
    let (property, kind) = (AtomEnum::RESOURCE_MANAGER, AtomEnum::STRING);
    let own = flight.window.parse().expect("a window's number");
    for window in [root, own] {
        server
            .change_property8(PropMode::REPLACE, window, property, kind, text.as_bytes())
            .expect("sent");
    }
    // It is there when the server answers.
    server.sync().expect("an answer");
}

#[test]
fn the_display_changes_its_scale() {
    let Some(mut flight) = Flight::start_at_scale(SCENE, "300x200", None) else { return };
    let before = flight.picture();
    assert_eq!(before.dimensions(), (300, 200));
    for (dpi, size) in [(192, (600, 400)), (144, (450, 300)), (96, (300, 200))] {
        set_dpi(&flight, dpi);
        until("a picture of the new scale", || {
            (flight.picture().dimensions() == size).then_some(())
        });
        // The panel begins at a margin of 8 points and is some 300 points wide, whatever a point is.
        let screen = flight.screen_at_rest([size.0, size.1]);
        let at = |points: u32| screen.get_pixel(points * dpi / 96, 30 * dpi / 96).0[1];
        assert!(at(250) < 60, "the panel is there: {}", at(250));
        flight.keep_screen(&format!("scale-{dpi}.png"), [size.0, size.1]);
    }
    assert_eq!(flight.picture(), before, "as it was");
    assert_eq!(flight.quit(), Some(0));
}
