//! Scenes with a weather map: which file is meant, and what becomes of bad ones.

use std::path::Path;

use cumuli::scene::{Channel, Scene, WeatherImage};
use image::{ExtendedColorType, ImageEncoder};
use proptest::prelude::*;

use super::{SMALLEST, root};

/// The program that draws the map that ships.
#[allow(dead_code)]
#[path = "../../examples/weather_map.rs"]
mod cyclone;

fn png(size: [u32; 2], colour: ExtendedColorType, bytes: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    image::codecs::png::PngEncoder::new(&mut file)
        .write_image(bytes, size[0], size[1], colour)
        .expect("encoded");
    file
}

fn grey(values: &[u8]) -> Vec<u8> {
    png([values.len() as u32, 1], ExtendedColorType::L8, values)
}

/// A scene file with these lines about its map, and files beside it.
fn folder(lines: &str, files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let scene = format!("{SMALLEST}[clouds]\n[clouds.weather]\n{lines}\n");
    std::fs::write(dir.path().join("a.toml"), scene).expect("written");
    for (name, bytes) in files {
        std::fs::write(dir.path().join(name), bytes).expect("written");
    }
    dir
}

fn load(dir: &Path) -> cumuli::Result<Scene> {
    Scene::load(&dir.join("a.toml"))
}

fn refusal(dir: &Path) -> String {
    let error = load(dir).expect_err("a bad scene");
    assert_eq!(error.exit_code(), 2, "{error}");
    let message = error.to_string();
    // The table of the map is in the seventh line, what is in it from the eighth on.
    let place = dir.join("a.toml").display().to_string();
    assert!(message.starts_with(&place) && !message.contains('\n'), "{message}");
    message[place.len()..].to_owned()
}

#[test]
fn the_map_lies_beside_the_scene() {
    let dir = folder("file = \"m.png\"", &[("m.png", &grey(&[0, 255]))]);
    let scene = load(dir.path()).expect("a scene");
    let map = scene.clouds.as_ref().and_then(|c| c.weather.as_ref()).expect("a map");
    assert_eq!(map.file, dir.path().join("m.png"));
    assert_eq!(map.image.texels(), [0xffff_0000, 0xffff_ffff]);
    scene.validate().expect("in range");
    // Saved here, its map is named as it was; saved elsewhere, it is found from there.
    let here = scene.to_toml_in(dir.path()).expect("TOML");
    assert!(here.contains("file = \"m.png\""), "{here}");
    assert_eq!(Scene::from_toml(&here, "b", dir.path()).expect("a scene").clouds, scene.clouds);
    let elsewhere = scene.to_toml_in(Path::new("/nonexistent")).expect("TOML");
    let again = Scene::from_toml(&elsewhere, "b", Path::new("/nonexistent")).expect("a scene");
    assert_eq!(again.clouds, scene.clouds);

    // Other pixels under the same name are another scene.
    std::fs::write(dir.path().join("m.png"), grey(&[0, 254])).expect("written");
    let other = load(dir.path()).expect("a scene");
    assert_ne!(other, scene);
    assert_eq!(other.to_toml().expect("TOML"), scene.to_toml().expect("TOML"));
    assert_ne!(other.identity().expect("TOML"), scene.identity().expect("TOML"));
}

#[test]
fn the_map_that_ships_is_what_its_program_draws() {
    let ships = image::open(root().join("scenes/cyclone.png")).expect("it ships").into_rgb8();
    let drawn = cyclone::map();
    assert_eq!(ships.dimensions(), drawn.dimensions());
    // Sines and powers may differ by their last bits from one system to another.
    let off = ships.iter().zip(drawn.iter()).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(off <= Some(1), "off by {off:?} steps of 8 bits");
}

#[test]
fn bad_maps_are_told_with_line_field_and_file() {
    let huge = {
        let mut huge = grey(&[1, 2]);
        huge[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
        huge
    };
    let files: [(&str, &[u8]); 3] =
        [("good.png", &grey(&[9])), ("text.png", b"no image"), ("huge.png", &huge)];
    for (lines, parts) in [
        ("", &[": clouds.weather.file: is missing"][..]),
        ("file = \"\"", &[":8: clouds.weather.file: expected a PNG image, found no name"]),
        ("file = \"none.png\"", &[":8: clouds.weather.file: ", "none.png: there is no such file"]),
        ("file = \".\"", &["is not a plain file, expected a PNG image"]),
        ("file = \"text.png\"", &[":8: ", "text.png: is no PNG image, expected a PNG image"]),
        ("file = \"huge.png\"", &["huge.png: is 60000 x 60000 pixels, expected 1 to 4096 a side"]),
        (
            "file = \"good.png\"\nchannels = []",
            &[":9: clouds.weather.channels: expected 1 to 3 names"],
        ),
        (
            "file = \"good.png\"\nchannels = [\"height\", \"height\"]",
            &["channels[1]: expected each name once"],
        ),
        ("file = \"good.png\"\nchannels = [\"covrage\"]", &["did you mean `coverage`?"]),
        (
            "file = \"good.png\"\nchannels = [\"height\", \"coverage\"]",
            &["has 1 channel, expected at least 2"],
        ),
        (
            "file = \"good.png\"\noutside = \"mirror\"",
            &[":9: clouds.weather.outside: ", "`repeat`"],
        ),
        ("file = \"good.png\"\nextent = [1.0, 2.0, 3.0]", &[":9: clouds.weather.extent: "]),
    ] {
        let dir = folder(lines, &files);
        let message = refusal(dir.path());
        for part in parts {
            assert!(message.contains(part), "{lines}: {message} lacks {part}");
        }
    }
    let list = format!("{SMALLEST}[clouds]\nweather = [1, 2]\n");
    let error = Scene::from_toml(&list, "a.toml", Path::new("")).expect_err("a list");
    assert!(error.to_string().contains("clouds.weather: expected one table"), "{error}");
}

/// What a head claims is judged before anything else is read: nothing more is there.
#[test]
fn a_claim_is_refused_by_its_head() {
    let head = |width: u32, height: u32| {
        let mut file = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
        file.extend(width.to_be_bytes());
        file.extend(height.to_be_bytes());
        WeatherImage::from_bytes(&file, "m.png", &[Channel::Coverage])
            .expect_err("a head")
            .to_string()
    };
    for (size, told) in [
        ([60_000, 60_000], "m.png: is 60000 x 60000 pixels, expected 1 to 4096 a side"),
        ([4097, 1], "m.png: is 4097 x 1 pixels, expected 1 to 4096 a side"),
        (
            [u32::MAX, u32::MAX],
            "m.png: is 4294967295 x 4294967295 pixels, expected 1 to 4096 a side",
        ),
        ([0, 5], "m.png: is 0 x 5 pixels, expected 1 to 4096 a side"),
    ] {
        assert_eq!(head(size[0], size[1]), told);
    }
    assert!(head(4096, 4096).contains("is no sound PNG image"));
}

/// The kinds of PNG files that there are, with or without sense.
fn kinds() -> impl Strategy<Value = (u8, u8)> {
    let depth = prop_oneof![Just(1_u8), Just(2), Just(4), Just(8), Just(16), any::<u8>()];
    let colour = prop_oneof![Just(0_u8), Just(2), Just(3), Just(4), Just(6), any::<u8>()];
    (depth, colour)
}

fn chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
    // The checksum of PNG files (ISO 15948, annex D), bit by bit.
    let mut sum = u32::MAX;
    for byte in name.iter().chain(data) {
        sum ^= u32::from(*byte);
        for _ in 0..8 {
            sum = (sum >> 1) ^ (0xedb8_8320 * (sum & 1));
        }
    }
    [&(data.len() as u32).to_be_bytes()[..], name, data, &(!sum).to_be_bytes()].concat()
}

fn png_of(chunks: &[Vec<u8>]) -> Vec<u8> {
    [&b"\x89PNG\r\n\x1a\n"[..], &chunks.concat()].concat()
}

/// The decoder panics at those that are not whole.
#[test]
fn palettes_are_whole() {
    let read = |bytes: usize| {
        let head = [0, 0, 0, 1, 0, 0, 0, 1, 8, 3, 0, 0, 0];
        // One row of one pixel: no filter, the first colour; stored as such.
        let data = [0x78, 1, 1, 2, 0, 0xfd, 0xff, 0, 0, 0, 2, 0, 1];
        let palette = vec![51; bytes];
        let chunks = [
            chunk(b"IHDR", &head),
            chunk(b"PLTE", &palette),
            chunk(b"IDAT", &data),
            chunk(b"IEND", &[]),
        ];
        WeatherImage::from_bytes(&png_of(&chunks), "m.png", &[Channel::Coverage])
    };
    assert_eq!(read(6).expect("two colours").texels(), [0xffff_0000 | (51 * 257)]);
    read(768).expect("as many as there are");
    for bytes in [1, 28, 767, 769, 771, 3000] {
        let message = read(bytes).expect_err("a palette").to_string();
        assert!(message.contains(&format!("its palette has {bytes} bytes")), "{message}");
    }
}

proptest! {
    // Most are refused within microseconds; those of 64 x 64 pixels take a tenth of a millisecond.
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Sound chunks with sound checksums, that claim anything and hold anything.
    #[test]
    fn hostile_maps_end_in_a_map_or_in_a_sentence(
        size in prop_oneof![(1_u32..64, 1_u32..64), (any::<u32>(), any::<u32>()), (4000_u32..5000, 1_u32..3)],
        (depth, colour) in kinds(),
        interlaced in 0_u8..3,
        name in prop_oneof![Just(*b"PLTE"), Just(*b"tRNS"), Just(*b"iCCP"), Just(*b"acTL"), any::<[u8; 4]>()],
        extra in proptest::collection::vec(any::<u8>(), 0..64),
        rows in proptest::collection::vec(any::<u8>(), 0..512),
        wanted in 1_usize..4,
    ) {
        let head = [&size.0.to_be_bytes()[..], &size.1.to_be_bytes(), &[depth, colour, 0, 0, interlaced]].concat();
        // Stored, not compressed: RFC 1950 and 1951, without the sum at the end.
        let length = rows.len() as u16;
        let data = [&[0x78, 1, 1][..], &length.to_le_bytes(), &(!length).to_le_bytes(), &rows].concat();
        let chunks = [chunk(b"IHDR", &head), chunk(&name, &extra), chunk(b"IDAT", &data), chunk(b"IEND", &[])];
        let file = png_of(&chunks);
        let channels = [Channel::Height, Channel::Coverage, Channel::Unused];
        match WeatherImage::from_bytes(&file, "m.png", &channels[..wanted]) {
            Ok(map) => {
                prop_assert_eq!(map.size(), [size.0, size.1]);
                prop_assert_eq!(map.texels().len(), size.0 as usize * size.1 as usize);
            }
            Err(error) => {
                let message = error.to_string();
                prop_assert_eq!(error.exit_code(), 2);
                prop_assert!(message.starts_with("m.png: ") && message.len() < 500, "{}", message);
                prop_assert!(!message.contains(|c: char| c.is_control()), "{:?}", message);
            }
        }
    }

    /// Any bytes behind the signature.
    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let file = [&b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"[..], &bytes].concat();
        for file in [&bytes, &file] {
            let read = WeatherImage::from_bytes(file, "m.png", &[Channel::Coverage]);
            prop_assert!(read.is_err_and(|e| e.to_string().starts_with("m.png: ")));
        }
    }
}
