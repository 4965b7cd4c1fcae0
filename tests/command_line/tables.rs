//! Table files given on the command line.

use super::{Place, assert_sentence};

const COMMANDS: [&str; 3] = [
    "render --scene small.toml --size 16x9 --out a.png",
    "render --scene small.toml --size 16x9 --frames 0..2 --out new",
    "info",
];

/// The tables that are built in, as a file.
fn built_in() -> Vec<u8> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/default_tables.safetensors");
    std::fs::read(path).expect("the built-in tables")
}

#[test]
fn files_that_are_no_tables_are_refused() {
    let place = Place::new();
    let whole = built_in();
    let mut flipped = whole.clone();
    let last = flipped.len() - 1;
    flipped[last] ^= 1;
    let header = b"{\"a\":{\"dtype\":\"F32\",\"shape\":[1],\"data_offsets\":[0,4]}}";
    let mut foreign = (header.len() as u64).to_le_bytes().to_vec();
    foreign.extend_from_slice(header);
    foreign.extend_from_slice(&[0; 4]);
    let cases: [(&str, &[u8]); 6] = [
        ("empty", b""),
        ("text", b"[camera]\nposition = [0, 0, 0]\n"),
        ("huge", &u64::MAX.to_le_bytes()),
        ("truncated", &whole[..whole.len() / 2]),
        ("flipped", &flipped),
        ("foreign", &foreign),
    ];
    for (name, bytes) in cases {
        std::fs::write(place.path(name), bytes).expect("written");
        for command in COMMANDS {
            let message = place.refuses(&format!("{command} --tables {name}"));
            assert_sentence(&message, &[&format!("cumuli: {name}: ")]);
        }
    }
    std::fs::create_dir(place.path("folder")).expect("a folder");
    for command in COMMANDS {
        for name in ["none", "folder"] {
            let message = place.refuses(&format!("{command} --tables {name}"));
            assert_sentence(&message, &[&format!("cumuli: {name}: ")]);
        }
    }
}

#[test]
fn a_file_of_the_built_in_tables_makes_the_same_picture() {
    let place = Place::new();
    std::fs::write(place.path("tables"), built_in()).expect("written");
    let render = "render --size 32x18 --preset low";
    place.works(&format!("{render} --out a.exr"));
    place.works(&format!("{render} --tables tables --out b.exr"));
    assert!(place.read("a.exr") == place.read("b.exr"));
    assert_eq!(place.works("info").out, place.works("info --tables tables").out);
}

/// Frames made with one table file don't go on with another.
#[test]
fn a_sequence_knows_its_tables() {
    let place = Place::new();
    std::fs::write(place.path("tables"), built_in()).expect("written");
    let render = "render --scene small.toml --size 16x9 --frames 0..2 --out f";
    place.works(&format!("{render} --tables tables"));
    let message = place.refuses(render);
    assert_sentence(&message, &["f: holds frames of another scene or of other settings"]);
    place.works(&format!("{render} --tables tables"));
}
