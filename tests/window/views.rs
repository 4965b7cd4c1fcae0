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
    let mut last = flight.display.screen(size);
    // Lists, light, steps, rings, and the picture again.
    for name in ["lists.png", "light.png", "steps.png", "rings.png", "picture.png"] {
        flight.keys(&["i"]);
        let shown = until(name, || {
            let screen = flight.display.screen(size);
            (difference(&screen, &last) > 8.0).then_some(screen)
        });
        // At rest it is shown sharp after a while.
        std::thread::sleep(std::time::Duration::from_millis(1500));
        flight.keep_screen(name, size);
        last = shown;
    }
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
    let before = flight.display.screen([1000, 740]);
    flight.keys(&["h"]);
    until("the keys are shown", || {
        let screen = flight.display.screen([1000, 740]);
        // At the right edge, where the sky was.
        let dark =
            |s: &image::RgbImage| (750..980).filter(|x| s.get_pixel(*x, 60).0[1] < 50).count();
        (dark(&screen) > dark(&before) + 100).then_some(())
    });
    flight.keep_screen("panel.png", [1000, 740]);
    assert_eq!(flight.quit(), Some(0));
}
