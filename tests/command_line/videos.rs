//! Sequences as video. What stands in for ffmpeg keeps what it is given.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use super::{Place, Run, assert_sentence, pixels};

const RENDER: &str = "render --scene small.toml --size 24x16 --preset low --frames 0..2 --out f";

/// A folder with a program of this name in it, for PATH.
fn with_ffmpeg(place: &Place, script: &str) {
    std::fs::create_dir(place.path("bin")).expect("a folder");
    place.write("bin/ffmpeg", script);
    let mode = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(place.path("bin/ffmpeg"), mode).expect("executable");
}

/// Runs with only the place's own programs, and those of the shell.
fn run(place: &Place, arguments: &str) -> Run {
    let path = format!("{}:/bin:/usr/bin", place.path("bin").display());
    let path = if place.path("bin").exists() { path } else { "/nowhere".to_owned() };
    Run::of(place.command(arguments).env("PATH", path).output().expect("the program starts"))
}

fn header(rate: &str) -> String {
    format!("YUV4MPEG2 W24 H16 F{rate} Ip A1:1 C444 XCOLORRANGE=LIMITED\n")
}

/// Two frames of three planes.
fn assert_video(bytes: &[u8], rate: &str, first: &Path) {
    let header = header(rate);
    assert!(bytes.starts_with(header.as_bytes()), "{:?}", String::from_utf8_lossy(&bytes[..60]));
    let frame = "FRAME\n".len() + 3 * 24 * 16;
    assert_eq!(bytes.len(), header.len() + 2 * frame);
    // Brighter pixels have more luma: the middle is cloud, the corner sky.
    let luma = |x: usize, y: usize| bytes[header.len() + 6 + 24 * y + x];
    let picture = pixels(first);
    let green = |x: u32, y: u32| picture.get_pixel(x, y).0[1];
    assert_eq!(luma(12, 8) > luma(0, 0), green(12, 8) > green(0, 0));
}

#[test]
fn standard_output_carries_the_video_alone() {
    let place = Place::new();
    let mut command = place.command(&format!("{RENDER} --video - --video-fps 12.5"));
    let output = command.output().expect("the program starts");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert_video(&output.stdout, "25:2", &place.path("f/frame_00000.png"));
    // The frames are kept: a second command makes only the video.
    let run = place.works(&format!("{RENDER} --video v.y4m"));
    assert!(run.err.contains("written: 0, kept: 2"), "{}", run.err);
    assert!(run.out.ends_with("v.y4m\n"), "{}", run.out);
    assert_video(&place.read("v.y4m"), "25:1", &place.path("f/frame_00000.png"));
}

#[test]
fn ffmpeg_encodes_where_it_is_there() {
    let place = Place::new();
    let without = run(&place, &format!("{RENDER} --video v.mp4"));
    assert_eq!(without.code, Some(2), "{}", without.err);
    assert_sentence(&without.err, &["v.mp4", "ffmpeg", ".y4m"]);
    assert!(!place.path("f").exists(), "refused before anything is rendered");

    // The last argument is the file.
    with_ffmpeg(
        &place,
        "#!/bin/sh\n[ \"$1\" = -version ] && exit\nfor last; do :; done\ncat > \"$last\"\n",
    );
    let with = run(&place, &format!("{RENDER} --video new/v.mp4"));
    assert_eq!(with.code, Some(0), "{}", with.err);
    assert_video(&place.read("new/v.mp4"), "25:1", &place.path("f/frame_00000.png"));
    assert_eq!(place.names("new"), ["v.mp4"], "nothing else is left");

    place.write(
        "bin/ffmpeg",
        "#!/bin/sh\n[ \"$1\" = -version ] && exit\necho no codec >&2; exit 3\n",
    );
    let fails = run(&place, &format!("{RENDER} --video bad/v.mp4"));
    assert_eq!(fails.code, Some(1), "{}", fails.err);
    assert!(
        fails.err.contains("no codec") && fails.err.contains("could not encode"),
        "{}",
        fails.err
    );
    assert_eq!(place.names("bad"), [""; 0], "no half video");
}

#[test]
fn a_video_needs_png_frames() {
    let place = Place::new();
    let message = place.refuses(&format!("{RENDER} --video v.y4m --format exr"));
    assert_sentence(&message, &["--video", "png"]);
    let message = place.refuses("render --scene small.toml --video v.y4m --out a.png");
    assert!(message.contains("--frames"), "{message}");
}
