//! Sequences: killed, continued, mixed up.

use std::time::{Duration, Instant};

use super::{Place, assert_sentence};

const RENDER: &str = "render --scene small.toml --size 24x16 --preset low";

fn frame(number: u32) -> String {
    format!("frame_{number:05}.png")
}

#[test]
fn frames_follow_the_scenes_time() {
    let place = Place::new();
    // The built-in field moves with the wind.
    let fast = "--size 48x27 --preset low --fps 0.01";
    place.works(&format!("render {fast} --time 50 --frames 1..3 --out f"));
    assert_eq!(place.names("f"), [&frame(1), &frame(2), "sequence.json"]);
    place.works("render --size 48x27 --preset low --time 150 --out one.png");
    assert!(place.read("one.png") == place.read(&format!("f/{}", frame(1))), "50 s + 1 / 0.01");
    assert!(place.read("one.png") != place.read(&format!("f/{}", frame(2))), "a still sequence");
}

/// A camera that moves away and comes back: its first and third frame are the same picture, the
/// second another, and the first that of a still camera.
#[test]
fn the_camera_follows_a_path() {
    let place = Place::new();
    let key = |time: u32, x: u32| {
        format!("[[keys]]\ntime = {time}\nposition = [{x}, 0, 500]\ntarget = [{x}, 0, 0]\n")
    };
    place.write("path.toml", &[key(0, 0), key(1, 80), key(2, 0)].concat());
    place.works(&format!("{RENDER} --fps 1 --frames 0..3 --path path.toml --out f"));
    place.works(&format!("{RENDER} --out still.png"));
    let [first, second, third] = [0, 1, 2].map(|i| place.read(&format!("f/{}", frame(i))));
    assert!(first == third && first == place.read("still.png") && first != second);

    // Frames of another path are others.
    place.write("other.toml", &[key(0, 0), key(1, 90)].concat());
    let same = place.run(&format!("{RENDER} --fps 1 --frames 0..3 --path other.toml --out f"));
    assert_eq!(same.code, Some(2), "{}", same.err);
    let message = place.refuses(&format!("{RENDER} --path path.toml --out one.png"));
    assert!(message.contains("--frames"), "{message}");
    let message = place.refuses(&format!("{RENDER} --frames 0..2 --path none.toml --out g"));
    assert_sentence(&message, &["none.toml", "camera path"]);
}

#[test]
fn a_killed_sequence_goes_on_where_it_stopped() {
    let place = Place::new();
    let mut child = place
        .command(&format!("{RENDER} --frames 0..100000 --out f"))
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("the program starts");
    // Long enough for the slowest machine to start; on the way there it is looked at often.
    let patience = Instant::now() + Duration::from_secs(120);
    while !place.path("f").join(frame(2)).exists() {
        assert!(Instant::now() < patience, "no third frame in two minutes");
        assert!(child.try_wait().expect("a state").is_none(), "it ended by itself");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("killed");
    child.wait().expect("an end");

    // What a kill in the middle of a write leaves; nobody holds it any more.
    let there = place.names("f").iter().filter(|name| name.starts_with("frame_")).count() as u32;
    let left = format!("f/.{}.k1ll3d.tmp", frame(there));
    place.write(&left, "half a picture");

    let end = there + 2;
    let run = place.works(&format!("{RENDER} --frames 0..{end} --out f"));
    assert!(run.err.contains(&format!("frames written: 2, kept: {there}")), "{}", run.err);
    let mut expected: Vec<String> = (0..end).map(frame).collect();
    expected.push("sequence.json".to_owned());
    assert_eq!(place.names("f"), expected, "all frames and nothing else");

    place.works(&format!("{RENDER} --frames 0..{end} --out whole"));
    for number in 0..end {
        let name = frame(number);
        let (stopped, whole) = (format!("f/{name}"), format!("whole/{name}"));
        assert!(place.read(&stopped) == place.read(&whole), "{name} differs");
    }
}

#[test]
fn a_cut_frame_is_made_again() {
    let place = Place::new();
    place.works(&format!("{RENDER} --frames 0..3 --out f"));
    let name = format!("f/{}", frame(1));
    let whole = place.read(&name);
    std::fs::write(place.path(&name), &whole[..whole.len() / 2]).expect("written");
    let run = place.works(&format!("{RENDER} --frames 0..3 --out f"));
    assert!(run.err.contains("frames written: 1, kept: 2"), "{}", run.err);
    assert!(place.read(&name) == whole);
}

#[test]
fn frames_of_another_scene_are_not_mixed_in() {
    let place = Place::new();
    place.works(&format!("{RENDER} --frames 0..2 --out f"));
    let old = place.read(&format!("f/{}", frame(0)));
    place.write("small.toml", &super::SMALL.replace("0.05", "0.5"));
    let message = place.refuses(&format!("{RENDER} --frames 0..2 --out f"));
    assert_sentence(&message, &["f: holds frames of another scene", "--overwrite"]);
    assert!(place.read(&format!("f/{}", frame(0))) == old);
    place.works(&format!("{RENDER} --frames 0..2 --out f --overwrite"));
    assert!(place.read(&format!("f/{}", frame(0))) != old);
}
