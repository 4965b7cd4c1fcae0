//! Disks that are full and places that cannot be written.

use super::{Place, sentence};

/// No file may grow beyond 4 KiB, and writing further fails as on a full disk. (Without the trap the
/// shell's limit ends the program by a signal, which no disk does.)
const FULL: &str = "trap '' XFSZ; ulimit -f 4";

/// What a run that finds the disk full leaves: the exit code, the sentence, no new file, and what
/// stood under the name before.
#[track_caller]
fn runs_out(place: &Place, arguments: &str, file: &str) {
    let before = place.names("");
    let output = place.after(FULL, arguments);
    let (code, text) = sentence(&output);
    assert_eq!(code, Some(1), "{arguments}: {text}");
    assert!(text.contains(file) && text.contains("cannot write"), "{arguments}: {text}");
    assert_eq!(place.names(""), before, "{arguments}: something is left");
}

#[test]
fn a_full_disk_is_an_error_and_leaves_what_was_there() {
    let place = Place::new();
    let frame = "render --scene scene.toml --size 96x64 --preset low";
    let truth = "render --scene scene.toml --size 96x64 --reference --spp 2 --save-every 0";
    for old in ["new", "old"] {
        for (arguments, file) in [
            (format!("{frame} --out a.exr"), "a.exr"),
            (format!("{truth} --out b.exr"), "b.exr"),
            (format!("{frame} --exact --out c.exr"), "c.exr"),
        ] {
            runs_out(&place, &arguments, file);
            if old == "old" {
                assert_eq!(place.read(file), b"old", "{file}");
            }
        }
        if old == "new" {
            for file in ["a.exr", "b.exr", "c.exr"] {
                std::fs::write(place.path(file), "old").expect("written");
            }
        }
    }
    // With room again all goes well.
    place.works(&format!("{frame} --out a.exr"));
    assert!(place.read("a.exr").len() > 4096);
}

/// Frames that were written before the disk was full stay, and the sequence goes on.
#[test]
fn a_sequence_goes_on_when_there_is_room_again() {
    let (place, whole) = (Place::new(), Place::new());
    let frames = "render --scene scene.toml --size 96x64 --preset low --frames 0..2 --out f";
    let output = place.after(FULL, &format!("{frames} --format exr"));
    let (code, text) = sentence(&output);
    assert_eq!(code, Some(1), "{text}");
    assert!(place.names("f").iter().all(|n| n == "sequence.json"), "{:?}", place.names("f"));
    place.works(&format!("{frames} --format exr"));
    whole.works(&format!("{frames} --format exr"));
    assert_eq!(place.names("f"), whole.names("f"));
    for name in place.names("f") {
        assert!(place.read(&format!("f/{name}")) == whole.read(&format!("f/{name}")), "{name}");
    }
}

#[test]
fn places_that_cannot_be_written_are_errors() {
    let place = Place::new();
    let frame = "render --scene scene.toml --size 8x8 --preset low";
    for out in ["/proc/a.png", "/proc/none/a.exr", "/dev/null/a.png", "scene.toml/a.png"] {
        let output = place.after("true", &format!("{frame} --out {out}"));
        let (code, text) = sentence(&output);
        assert!(matches!(code, Some(1 | 2)), "{out}: {text}");
        assert_eq!(place.names(""), ["scene.toml"], "{out}");
    }
    // Standard output is a file like any other.
    let output = place.after("exec >/dev/full", &format!("{frame} --out a.png"));
    let (code, text) = sentence(&output);
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("standard output"), "{text}");
}

/// Address space for the program and its driver, but not for the picture's textures.
#[test]
fn too_little_memory_for_the_device_is_an_error() {
    memory_ends(&[1_500_000]);
}

/// For the textures too, but not for the picture that is read back.
#[test]
#[ignore = "a picture of 8192 x 8192 takes a minute"]
fn too_little_memory_for_the_picture_is_an_error() {
    memory_ends(&[4_000_000]);
}

fn memory_ends(kilobytes: &[u64]) {
    let place = Place::new();
    let arguments = "render --scene scene.toml --size 8192x8192 --preset low --out a.exr";
    for kilobytes in kilobytes {
        let output = place.after(&format!("ulimit -v {kilobytes}"), arguments);
        let (code, text) = sentence(&output);
        assert_eq!(code, Some(1), "{kilobytes}: {text}");
        assert!(text.to_lowercase().contains("memory"), "{kilobytes}: {text}");
        assert_eq!(place.names(""), ["scene.toml"]);
    }
}
