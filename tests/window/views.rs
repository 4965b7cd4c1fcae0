//! Insides, reference and plots in the window. The scenes are small, and so are the pictures.

use super::flight::{Flight, until};

/// A small field of clouds, so that there are rings, lists and shadows; the time stands.
const FIELD: &str = r#"
[camera]
position = [0.0, 300.0, 0.0]
target = [0.0, 600.0, -1000.0]
[sun]
direction = [0.5, 0.7, 0.3]
[clouds]
base = 600.0
coverage = 0.5
cells = 24
rings = 3
layers = 4
"#;

/// How much two screens differ: mean over all bytes.
fn difference(a: &image::RgbImage, b: &image::RgbImage) -> f64 {
    let sum: u64 = a.iter().zip(b.iter()).map(|(x, y)| u64::from(x.abs_diff(*y))).sum();
    sum as f64 / a.len() as f64
}

#[test]
fn insides_and_reference_are_shown() {
    let size = [480, 360];
    let Some(flight) = Flight::start(FIELD, "480x360") else { return };
    flight.keys(&["F1"]);
    // Without the panel, and sharp.
    let mut screens = vec![flight.screen_at_rest(size)];
    for name in ["Some(Lists)", "Some(Light)", "Some(Steps)", "Some(Rings)", "None"] {
        flight.keys(&["i"]);
        until(name, || flight.log().contains(&format!("shows {name}")).then_some(()));
        // From the log to the screen.
        let last = screens[screens.len() - 1].clone();
        let shown = until("another screen", || {
            let screen = flight.display.screen(size);
            (difference(&screen, &last) > 4.0).then_some(screen)
        });
        flight.keep_screen(&format!("{name}.png"), size);
        screens.push(shown);
    }
    let again = || difference(&flight.display.screen(size), &screens[0]) < 4.0;
    until("the picture again", || again().then_some(()));
    flight.keys(&["t"]);
    until("figures of the comparison", || flight.log().contains("bias: Some").then_some(()));
    flight.keep_screen("reference.png", size);
    // Moving gives the reference up; the flight goes on.
    flight.keys(&["d"]);
    flight.keys(&["t"]);
    assert_eq!(flight.quit(), Some(0));
}

#[test]
fn the_panel_shows_everything() {
    let Some(flight) = Flight::start(FIELD, "1000x740") else { return };
    // At the right edge, where nothing but the keys is shown.
    let corner =
        |screen: image::RgbImage| image::imageops::crop_imm(&screen, 780, 500, 200, 200).to_image();
    let before = corner(flight.screen_at_rest([1000, 740]));
    flight.keys(&["h"]);
    until("the keys are shown", || {
        let now = corner(flight.display.screen([1000, 740]));
        (difference(&now, &before) > 15.0).then_some(())
    });
    flight.keep_screen("panel.png", [1000, 740]);
    assert_eq!(flight.quit(), Some(0));
}
