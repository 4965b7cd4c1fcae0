//! Orders that cannot be carried out.

use super::{Place, assert_sentence};

const RENDER: &str = "render --scene small.toml --size 16x9";

#[test]
fn sizes_frames_and_presets_are_checked() {
    let place = Place::new();
    for (arguments, parts) in [
        ("--size 0x9", ["--size", "1 to 8192"]),
        ("--size 16x0", ["--size", "1 to 8192"]),
        ("--size 8193x9", ["--size", "1 to 8192"]),
        ("--size 99999999999x1", ["--size", "1 to 8192"]),
        ("--size=-16x9", ["--size", "1 to 8192"]),
        ("--size 16", ["--size", "WIDTHxHEIGHT"]),
        ("--preset best", ["best", "low, medium, high, ultra"]),
        ("--lighting none", ["none", "grid, octaves, alone"]),
        ("--lighting alone --reference", ["--lighting", "--reference"]),
        ("--lighting grid --exact", ["--lighting", "--exact"]),
        ("--time nan", ["--time", "seconds"]),
        ("--time 1e11", ["--time", "seconds"]),
        ("--frames 5..5", ["--frames", "at least one frame"]),
        ("--frames 7..5", ["--frames", "at least one frame"]),
        ("--frames five", ["--frames", "0..24"]),
        ("--frames 0..99999999999", ["--frames", "0..24"]),
        ("--frames 0..2 --fps 0", ["--fps", "frames per second"]),
        ("--fps 25", ["--frames", "required"]),
        ("--overwrite", ["--frames", "required"]),
        ("--colour", ["--colour", "unexpected"]),
    ] {
        // A later option replaces an earlier one only where clap is told so; here it is an error,
        // so the size is given once.
        let size = if arguments.contains("--size") { "" } else { "--size 16x9" };
        let message =
            place.refuses(&format!("render --scene small.toml {size} {arguments} --out a.png"));
        for part in parts {
            assert!(message.contains(part), "{arguments}: {message} lacks {part}");
        }
    }
    let message = place.refuses("rendr --out a.png");
    assert!(message.contains("rendr") && message.contains("render"), "{message}");
    let message = place.refuses("render");
    assert!(message.contains("--out"), "{message}");
}

#[test]
fn places_that_cannot_be_written_are_refused_before_anything_is_rendered() {
    let place = Place::new();
    place.write("file", "");
    std::fs::create_dir(place.path("folder.png")).expect("a folder");
    for (arguments, parts) in [
        ("--out a.jpg", ["a.jpg", "expected a name that ends in .png or .exr"]),
        ("--out a", ["a", "expected a name that ends in .png or .exr"]),
        ("--out folder.png", ["folder.png", "is a folder, expected a file name"]),
        ("--out file/a.png", ["file", "is a file, expected a folder"]),
        ("--frames 0..2 --out file", ["file", "is a file, expected a folder"]),
        ("--out a.png --stats folder.png", ["folder.png", "is a folder, expected a file name"]),
        ("--out a.png --stats file/a.json", ["file", "is a file, expected a folder"]),
    ] {
        assert_sentence(&place.refuses(&format!("{RENDER} {arguments}")), &parts);
    }
}

#[test]
fn bad_scenes_are_refused_with_file_line_and_field() {
    let place = Place::new();
    place.write("typo.toml", &super::SMALL.replace("radius", "raduis"));
    place.write("nan.toml", &super::SMALL.replace("500.0", "nan"));
    place.write("negative.toml", &super::SMALL.replace("radius = 100.0", "radius = -100.0"));
    place.write("list.toml", &format!("particles_file = \"none.json\"\n{}", super::SMALL));
    place.write("shape.toml", &format!("{}shape = \"cube\"\n", super::SMALL));
    place.write("empty.toml", "");
    for (scene, parts) in [
        ("none.toml", ["none.toml: there is no such file", "expected a scene"]),
        (".", [".: is a folder", "expected a scene"]),
        ("empty.toml", ["empty.toml:1: camera", "is missing"]),
        ("typo.toml", ["typo.toml:12: particles[0].raduis", "did you mean `radius`?"]),
        ("nan.toml", ["nan.toml:3: camera.position[2]", "expected a number from"]),
        ("negative.toml", ["negative.toml:12: particles[0].radius", "found -100"]),
        (
            "list.toml",
            ["list.toml:1: particles_file: expected a JSON file of particles", "`none.json`"],
        ),
        ("shape.toml", ["shape.toml: particles[0].shape", "cube"]),
    ] {
        let message = place.refuses(&format!("render --scene {scene} --size 16x9 --out a.png"));
        assert_sentence(&message, &parts);
        let message =
            place.refuses(&format!("render --scene {scene} --size 16x9 --frames 0..2 --out new"));
        assert_sentence(&message, &parts);
    }
}

/// Times of frames are checked for the whole range before the first is rendered.
#[test]
fn a_sequence_that_runs_out_of_time_is_refused() {
    let place = Place::new();
    let message = place.refuses(&format!("{RENDER} --time 1e10 --frames 0..2 --fps 1 --out new"));
    assert_sentence(&message, &["--frames", "expected a number from -1e10 to 1e10 s"]);
}

#[cfg(target_os = "linux")]
#[test]
fn without_an_adapter_nothing_is_written() {
    let place = Place::new();
    for arguments in [
        "info",
        "render --scene small.toml --size 16x9 --out a.png",
        "render --scene small.toml --size 16x9 --frames 0..2 --out new",
    ] {
        let mut command = place.command(arguments);
        for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
            command.env(variable, place.path("no_driver.json"));
        }
        let output = command.output().expect("the program starts");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains("no usable graphics adapter"), "{message}");
        assert!(message.contains("mesa-vulkan-drivers"), "{message}");
        assert!(!message.contains("panicked"), "{message}");
        assert_eq!(place.names(""), ["small.toml"]);
    }
}

#[test]
fn help_and_version_are_no_errors() {
    let place = Place::new();
    for arguments in ["--help", "render --help", "info --help", "--version"] {
        let run = place.works(arguments);
        assert!(run.out.contains("cumuli") && run.err.is_empty(), "{arguments}: {run:?}");
    }
    let info = place.works("info").out;
    for line in ["adapter", "driver", "largest picture", "largest binding"] {
        assert!(info.contains(line), "{info}");
    }
}
