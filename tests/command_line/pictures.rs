//! Single pictures.

use super::{Place, pixels};

#[test]
fn a_picture_of_the_asked_size_with_a_cloud_in_it() {
    let place = Place::new();
    let run = place.works("render --scene small.toml --size 33x17 --out new/a.png");
    assert_eq!(run.out, "new/a.png\n");
    let picture = pixels(&place.path("new/a.png"));
    assert_eq!(picture.dimensions(), (33, 17));
    // The camera looks at the particle's middle; corners show the uniform sky.
    let (corner, middle) = (picture.get_pixel(0, 0).0, picture.get_pixel(16, 8).0);
    assert!(middle[1].abs_diff(corner[1]) > 10, "corner {corner:?}, middle {middle:?}");
    assert_eq!(place.names("new"), ["a.png"]);
}

/// Something opaque before the particle hides it, in the frame and in what is composed exactly; what is no such file is
/// told.
#[test]
fn opaque_things_hide_what_is_behind() {
    use cumuli::output::Layers;
    let place = Place::new();
    let write = |name: &str, depth: &str, size: [u32; 2]| {
        let count = (size[0] * size[1]) as usize;
        let mut layers = Layers { size, ..Layers::default() };
        // The left half, right before the eye.
        let there = |i: usize| i % 16 < 8;
        layers.add(depth, (0..count).map(|i| if there(i) { 0.5 } else { f32::INFINITY }));
        for (channel, radiance) in [("R", 0.1), ("G", 0.2), ("B", 0.3)] {
            layers.add(channel, (0..count).map(|_| radiance));
        }
        layers.write(&place.path(name), false).expect("written");
    };
    write("near.exr", "distance", [16, 16]);
    write("axis.exr", "Z", [16, 16]);
    for (opaque, more) in [("near.exr", ""), ("axis.exr", ""), ("near.exr", "--exact")] {
        place.works(&format!(
            "render --scene small.toml --size 16x16 --opaque {opaque} --out a.exr {more}"
        ));
        let picture = image::open(place.path("a.exr")).expect("an EXR").into_rgba32f();
        let [r, g, b, a] = picture.get_pixel(7, 8).0;
        assert_eq!([r, g, b, a], [0.1, 0.2, 0.3, 0.0], "{opaque} {more}");
        assert!(picture.get_pixel(8, 8).0[3] > 0.5, "{opaque} {more}");
    }
    write("other.exr", "distance", [16, 8]);
    write("none.exr", "depth", [16, 16]);
    for (opaque, part) in
        [("other.exr", "16x8"), ("none.exr", "distance"), ("gone.exr", "gone.exr")]
    {
        let message = place
            .run(&format!("render --scene small.toml --size 16x16 --opaque {opaque} --out b.png"));
        assert_ne!(message.code, Some(0), "{opaque}");
        super::assert_sentence(&message.err, &[opaque, part]);
    }
    place.refuses("render --scene small.toml --opaque near.exr --frames 0..2 --out frames");
}

/// A run that was killed in the middle of writing leaves a part under another name.
#[test]
fn what_a_killed_run_left_is_removed() {
    let place = Place::new();
    place.write(".a.png.k1ll3d.tmp", "half a picture");
    place.write(".b.png.k1ll3d.tmp", "half of another");
    place.works("render --scene small.toml --size 16x9 --out a.png");
    assert_eq!(place.names(""), [".b.png.k1ll3d.tmp", "a.png", "small.toml"]);
}

#[test]
fn linear_radiance_in_the_scenes_unit() {
    let place = Place::new();
    place.works("render --scene small.toml --size 16x16 --out a.exr");
    let picture = image::open(place.path("a.exr")).expect("an EXR").into_rgba32f();
    assert_eq!(picture.dimensions(), (16, 16));
    // A corner looks past the particle: the sky's radiance to the last bit of a 32-bit float, and
    // no opacity.
    assert_eq!(picture.get_pixel(0, 0).0, [0.05, 0.05, 0.05, 0.0]);
    assert!(picture.get_pixel(8, 8).0[3] > 0.5, "{:?}", picture.get_pixel(8, 8));
}

#[test]
fn the_smallest_and_the_oddest_sizes() {
    let place = Place::new();
    for size in ["1x1", "1x64", "64x1", "7x5"] {
        place.works(&format!("render --scene small.toml --size {size} --out {size}.png"));
        let picture = pixels(&place.path(&format!("{size}.png")));
        assert_eq!(format!("{}x{}", picture.width(), picture.height()), size);
    }
}

#[test]
fn the_same_command_gives_the_same_bytes() {
    let place = Place::new();
    // The built-in scene, so that all passes take part.
    for (name, format) in [("a", "png"), ("b", "exr")] {
        let out = |run: u32| format!("{name}{run}.{format}");
        let bytes = [0, 1].map(|run| {
            place
                .works(&format!("render --size 64x36 --time 12.5 --preset low --out {}", out(run)));
            place.read(&out(run))
        });
        assert!(bytes[0] == bytes[1], "two runs made different {format} files");
    }
}

#[test]
fn time_and_preset_matter() {
    let place = Place::new();
    let render = |name: &str, options: &str| {
        place.works(&format!("render --size 64x36 {options} --out {name}.exr"));
        place.read(&format!("{name}.exr"))
    };
    let first = render("a", "--preset low");
    assert!(first != render("b", "--preset low --time 600"), "ten minutes changed nothing");
    assert!(first != render("c", "--preset ultra"), "the preset changed nothing");
}

#[test]
fn statistics_say_what_was_done() {
    let place = Place::new();
    let run =
        place.works("render --scene small.toml --size 32x32 --timings --stats s.json --out a.png");
    assert_eq!(run.out, "a.png\ns.json\n");
    for pass in ["blend", "tonemap", "rings"] {
        assert!(run.err.contains(pass), "{}", run.err);
    }
    let stats: serde_json::Value = serde_json::from_slice(&place.read("s.json")).expect("JSON");
    let frame = &stats[0];
    assert_eq!(frame["counters"]["particles_generated"], 1);
    assert_eq!(frame["counters"]["particles_visible"], 1);
    assert_eq!(frame["counters"]["overflowed"], 0);
    let passes = frame["passes"].as_array().expect("a list");
    let rings = passes.iter().find(|p| p["name"] == "rings").expect("the pass");
    assert_eq!(rings["ran"], false, "{rings}");
    assert!(rings["reason"].as_str().is_some_and(|r| !r.is_empty()), "{rings}");
}

/// `cumuli info | head -1` and the like.
#[cfg(unix)]
#[test]
fn a_reader_that_has_gone_is_no_error() {
    use std::process::Stdio;
    let place = Place::new();
    let mut child = place
        .command("render --scene small.toml --size 16x9 --out a.png")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    drop(child.stderr.take());
    assert_eq!(child.wait().expect("an end").code(), Some(0));
    assert_eq!(pixels(&place.path("a.png")).dimensions(), (16, 9));
}
