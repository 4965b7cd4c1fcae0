//! Reference pictures.

use std::time::{Duration, Instant};

use cumuli::output::Layers;

use super::{Place, assert_sentence, pixels};

const RENDER: &str = "render --scene small.toml --reference --size 24x16";

#[test]
fn radiance_its_error_and_transmittance() {
    let place = Place::new();
    let run = place.works(&format!("{RENDER} --spp 16 --out a.exr --png a.png"));
    assert_eq!(run.out, "a.exr\na.png\n");
    assert_eq!(place.names(""), ["a.exr", "a.png", "small.toml"]);
    let layers = Layers::read(&place.path("a.exr"), 100).expect("an EXR");
    assert_eq!(layers.size, [24, 16]);
    let value = |name: &str, at: usize| f64::from(layers.channel(name).expect(name)[at]);
    let (corner, middle) = (0, 8 * 24 + 12);
    // A corner sees the uniform sky only: f32's 0.05, without any noise.
    assert_eq!((value("G", corner), value("T", corner)), (f64::from(0.05f32), 1.0));
    assert_eq!(value("standard_error.G", corner), 0.0);
    // The middle looks through an optical depth of 4: 2 % of the light passes.
    assert!(value("T", middle) < 0.5 && value("standard_error.R", middle) > 0.0);
    assert_eq!(value("A", middle), 1.0 - value("T", middle));
    assert_eq!(pixels(&place.path("a.png")).dimensions(), (24, 16));
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let place = Place::new();
    let bytes = |name: &str, options: &str| {
        place.works(&format!("{RENDER} --spp 4 --out {name}.exr {options}"));
        place.read(&format!("{name}.exr"))
    };
    let first = bytes("a", "--threads 1");
    assert!(first == bytes("b", "--threads 3"), "threads changed the picture");
    assert!(first != bytes("c", "--seed 1"), "the seed changed nothing");
    assert!(first != bytes("d", "--filter centre"), "the filter changed nothing");
    assert!(first != bytes("e", "--aperture 40 --focus 300"), "the lens changed nothing");
    let half = bytes("f", "--half");
    assert!(half.len() < first.len(), "16 bits are not smaller");
}

/// Killed once some samples are saved: what lies on disk is whole, and the end is as if nothing
/// had happened.
#[test]
fn a_killed_run_goes_on_to_the_same_bytes() {
    let place = Place::new();
    let render = "render --scene small.toml --reference --size 96x64 --spp 40 --save-every 0";
    place.works(&format!("{render} --out whole.exr"));
    let mut child =
        place.command(&format!("{render} --out killed.exr")).spawn().expect("the program starts");
    let start = Instant::now();
    while !(place.path("killed.exr").exists() && place.path("killed.exr.partial").exists()) {
        assert!(start.elapsed() < Duration::from_secs(120), "nothing was saved");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("killed");
    child.wait().expect("an end");
    let so_far = Layers::read(&place.path("killed.exr"), 1000).expect("a whole file");
    assert_eq!(so_far.size, [96, 64]);
    // Another picture is not mixed in.
    let other = place.run(&format!("{render} --seed 2 --out killed.exr"));
    if place.path("killed.exr.partial").exists() {
        assert_eq!(other.code, Some(2));
        assert_sentence(&other.err, &["killed.exr.partial", "another scene"]);
        place.works(&format!("{render} --out killed.exr"));
        assert!(place.read("whole.exr") == place.read("killed.exr"), "the pictures differ");
        assert!(!place.path("killed.exr.partial").exists());
    } else {
        panic!("the run ended before it was killed: give it more samples");
    }
}

/// Attempts to kill a run between two moments.
const KILLS: usize = 20;

/// The same of a run whose pixels get paths by their noise: killed after that was decided.
#[test]
fn a_killed_run_to_an_error_goes_on_to_the_same_bytes() {
    let place = Place::new();
    // 128 paths a pixel are the pilot.
    let render = "render --scene small.toml --reference --size 48x32 --spp 400 --save-every 0";
    let render = format!("{render} --std-error 0.02 --half");
    let whole = place.works(&format!("{render} --threads 1 --out whole.exr"));
    // A uniform sky needs no more paths: what was told last were all of them, and not --spp of each pixel.
    let [done, all] = last_paths(&whole.err);
    assert!(done == all && all > 128 * 48 * 32 && all < 400 * 48 * 32, "{}", whole.err);
    let comment = Layers::read(&place.path("whole.exr"), 1000).expect("an EXR").comment;
    assert!(comment.contains("128 to 400 samples"), "{comment}");
    let decided = 4 * 48 * 32 + 8 * 8 * 48 * 32;
    let partial = place.path("killed.exr.partial");
    let is_decided = || std::fs::metadata(&partial).is_ok_and(|found| found.len() >= decided);
    // On a busy machine it may be done before anybody looks.
    let killed = (0..KILLS).any(|_| {
        let mut child =
            place.command(&format!("{render} --out killed.exr")).spawn().expect("it starts");
        while !is_decided() && child.try_wait().expect("a state").is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        // It may have ended by itself.
        let _ = child.kill();
        child.wait().expect("an end");
        is_decided()
    });
    assert!(killed, "it always ended before it was killed: give it more samples");
    let again = place.works(&format!("{render} --out killed.exr"));
    assert!(place.read("whole.exr") == place.read("killed.exr"), "the pictures differ");
    // It went on: the pilot's paths are not traced again.
    let first = paths_told(&again.err).next().expect("progress");
    assert!(first[0] >= 128 * 48 * 32, "{}", again.err);
}

/// Paths made and paths in all, as a run told them.
fn paths_told(err: &str) -> impl DoubleEndedIterator<Item = [u64; 2]> + '_ {
    err.lines().filter_map(|line| {
        let (done, all) = line.strip_prefix("paths ")?.split_once('/')?;
        let all = all.split_once(',').map_or(all, |(all, _)| all);
        Some([done.trim().parse().ok()?, all.trim().parse().ok()?])
    })
}

fn last_paths(err: &str) -> [u64; 2] {
    paths_told(err).next_back().unwrap_or_else(|| panic!("no progress: {err}"))
}

/// With an open shutter the clouds' motion is in the picture; each time alone is another picture.
#[test]
fn the_shutter_blurs_what_moves() {
    let place = Place::new();
    let layers = |name: &str, options: &str| {
        place.works(&format!("render --reference --size 16x9 --spp 2 {options} --out {name}.exr"));
        Layers::read(&place.path(&format!("{name}.exr")), 100).expect("an EXR")
    };
    let still = layers("a", "");
    assert_ne!(still.channels, layers("b", "--shutter 60").channels);
    assert_ne!(still.channels, layers("c", "--time 30").channels);
}

/// The scene's own lens and shutter are the options' defaults.
#[test]
fn the_scenes_lens_and_shutter_are_used() {
    let place = Place::new();
    let text = String::from_utf8(place.read("small.toml")).expect("text");
    let lens = "[camera]\naperture = 40\nfocus_distance = 300\nshutter = 60\n";
    place.write("lens.toml", &text.replace("[camera]\n", lens));
    let render = |name: &str, scene: &str, options: &str| {
        place.works(&format!(
            "render --scene {scene} --reference --size 24x16 --spp 2 --out {name}.exr {options}"
        ));
        Layers::read(&place.path(&format!("{name}.exr")), 1000).expect("an EXR").channels
    };
    let options = "--aperture 40 --focus 300 --shutter 60";
    let with_lens = render("a", "lens.toml", "");
    assert_eq!(with_lens, render("b", "small.toml", options));
    let pinhole = render("c", "small.toml", "");
    assert_ne!(with_lens, pinhole);
    assert_eq!(render("d", "lens.toml", "--aperture 0 --shutter 0"), pinhole);
    assert_ne!(render("e", "lens.toml", "--focus 500"), with_lens);
}

#[test]
fn a_sequence_of_references_goes_on_where_it_stopped() {
    let place = Place::new();
    let scene = "render --scene small.toml --reference --size 16x9 --spp 2";
    let render = &format!("{scene} --format exr --fps 1 --time 3");
    place.works(&format!("{render} --frames 0..2 --out frames"));
    place.works(&format!("{render} --frames 0..3 --out frames"));
    place.works(&format!("{scene} --time 5 --out alone.exr"));
    assert!(place.read("frames/frame_00002.exr") == place.read("alone.exr"));
    let first = Layers::read(&place.path("frames/frame_00000.exr"), 1000).expect("an EXR");
    assert!(first.channel("standard_error.R").is_some());
    let message = place.refuses(&format!("{render} --seed 1 --frames 0..3 --out frames"));
    assert_sentence(&message, &["frames", "--overwrite"]);
    place.works(&format!("{render} --seed 1 --frames 0..3 --out frames --overwrite"));
    assert!(place.read("frames/frame_00002.exr") != place.read("alone.exr"));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let place = Place::new();
    place.write("a.exr.partial", "something else");
    let message = place.refuses(&format!("{RENDER} --out a.exr"));
    assert_sentence(&message, &["a.exr.partial", "remove it"]);
    for options in [
        "--out a.jpg",
        "--out b.exr --spp 0",
        "--out b.exr --threads 0",
        "--out b.exr --aperture -1",
        "--out b.exr --focus 0",
        "--out b.exr --shutter -1",
        "--out b.exr --png b.exr",
        "--out b.exr --exact",
        "--out b --frames 0..2 --png b.png",
        "--out b --frames 0..2 --time 1e10",
        "--out b.exr --time 1e10 --shutter 1e6",
    ] {
        place.refuses(&format!("{RENDER} {options}"));
    }
    place.refuses("render --scene small.toml --spp 4 --out b.exr");
}

/// One particle: nothing overlaps, and for a uniform one the tables are exact.
#[test]
fn the_exact_picture_is_the_frames_where_there_is_nothing_to_get_wrong() {
    let place = Place::new();
    place.works("render --scene small.toml --size 24x16 --preset high --out frame.exr");
    let run = place.works("render --scene small.toml --size 24x16 --exact --out exact.exr");
    assert_eq!(run.out, "exact.exr\n");
    let run = place.works("compare frame.exr exact.exr --mask --json -");
    let json: serde_json::Value = serde_json::from_str(&run.out).expect("JSON");
    // f32, and texture units that filter with 8 bits of fraction.
    assert!(json["relative_rmse"].as_f64().is_some_and(|v| v < 2e-3), "{json}");
    assert!(json["pixels"].as_u64().is_some_and(|v| v > 30), "{json}");
}
