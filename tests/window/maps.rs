//! Weather maps in the window: dropped, changed on disk, damaged, saved.

use image::{GrayImage, Luma};

use super::drop::drop_file;
use super::files::tells_mistake;
use super::flight::{Flight, until};

/// Looks up at a small field; its time stands still, so its picture is always the same.
pub const SKY: &str = r#"
[camera]
position = [0.0, 2.0, 0.0]
target = [0.0, 700.0, -600.0]
[sun]
direction = [1.0, 1.0, 1.0]
[sky]
kind = "uniform"
radiance = 0.05
[clouds]
coverage = 0.5
cells = 16
rings = 2
layers = 3
wind = [0.0, 0.0, 0.0]
"#;
const SIZE: [u32; 2] = [480, 360];

fn map(value: u8) -> GrayImage {
    GrayImage::from_pixel(4, 4, Luma([value]))
}

#[test]
fn a_dropped_map_is_shown_watched_and_saved() {
    let Some(mut flight) = Flight::start(SKY, "480x360") else { return };
    flight.keys(&["F1"]);
    let noise = flight.picture();
    let path = flight.path("weather.png");
    map(0).save(&path).expect("written");
    drop_file(&flight, &path);
    // Black is clear: nothing but the sky is left.
    let mut clear = flight.picture();
    until("the sky is clear", || {
        clear = flight.picture();
        let first = *clear.get_pixel(0, 0);
        clear
            .pixels()
            .all(|p| p.0.iter().zip(first.0).all(|(a, b)| a.abs_diff(b) < 3))
            .then_some(())
    });
    assert!(clear != noise);

    // Another image under its name is another sky.
    map(255).save(&path).expect("written");
    let mut white = flight.picture();
    until("the change is shown", || {
        white = flight.picture();
        (white != clear).then_some(())
    });
    assert!(flight.log().contains("weather.png was changed"), "{}", flight.log());

    // What is no image leaves the last good one, and is told.
    std::fs::write(&path, "no image").expect("written");
    until("the mistake is told", || flight.log().contains("is no PNG image").then_some(()));
    until("it is on the screen", || tells_mistake(&flight.display.screen(SIZE)).then_some(()));
    flight.keep_screen("map-mistake.png", SIZE);
    assert!(flight.picture() == white, "the last good map goes on");
    map(255).save(&path).expect("written");
    let changes = |log: String| log.matches("weather.png was changed").count();
    until("it is mended", || (changes(flight.log()) == 2).then_some(()));

    // Nothing that is too large is decoded, and the map stays.
    let mut claim = std::fs::read(&path).expect("the map");
    claim[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
    let huge = flight.path("huge.png");
    std::fs::write(&huge, claim).expect("written");
    drop_file(&flight, &huge);
    until("it is refused", || flight.log().contains("is 60000 x 60000 pixels").then_some(()));
    assert!(flight.picture() == white, "what is refused changes nothing");

    // The saved scene names the map, and `cumuli render` makes the same picture.
    flight.saved("F6", "scene-0001.toml");
    let text = std::fs::read_to_string(flight.path("scene-0001.toml")).expect("a scene");
    assert!(text.contains("[clouds.weather]") && text.contains("file = \"weather.png\""), "{text}");
    let render = ["render", "--scene", "scene-0001.toml", "--preset", "low", "--size", "480x360"];
    let time = time_of(&flight);
    flight.other(&[&render[..], &["--time", &time, "--out", "rendered.png"]].concat());
    let rendered = image::open(flight.path("rendered.png")).expect("a PNG").into_rgb8();
    assert!(rendered == white, "cumuli render makes another picture");
    flight.keys(&["F1"]);
    flight.screen_at_rest(SIZE);
    flight.keep_screen("map.png", SIZE);

    // A scene that is dropped takes the map away again.
    drop_file(&flight, &flight.path("scene.toml"));
    until("the first sky is back", || (flight.picture() == noise).then_some(()));
    assert_eq!(flight.quit(), Some(0));
}

/// The time that the program told with its last saved scene.
fn time_of(flight: &Flight) -> String {
    let log = flight.log();
    let told = log.rsplit("--time ").next().and_then(|rest| rest.split(' ').next());
    told.expect("the command that makes the picture").to_owned()
}
