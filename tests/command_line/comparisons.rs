//! `cumuli compare`.

use cumuli::output::Layers;

use super::{Place, assert_sentence, pixels};

/// A picture of one brightness with clouds in its left half.
fn write(place: &Place, name: &str, size: [u32; 2], light: f32) {
    let count = (size[0] * size[1]) as usize;
    let mut layers = Layers { size, ..Layers::default() };
    for channel in ["R", "G", "B"] {
        layers.add(channel, vec![light; count]);
        layers.add(&format!("standard_error.{channel}"), vec![0.001; count]);
    }
    layers.add("A", (0..count).map(|i| if i as u32 % size[0] < size[0] / 2 { 1.0 } else { 0.0 }));
    layers.write(&place.path(name), false).expect("written");
}

#[test]
fn a_table_json_and_a_picture() {
    let place = Place::new();
    write(&place, "a.exr", [32, 20], 0.11);
    write(&place, "b.exr", [32, 20], 0.1);
    let run = place.works("compare a.exr b.exr --mask --json e.json --out e.png");
    for part in ["320 of 32x20", "10.0000 %", "LDR FLIP", "HDR FLIP", "100.0000 %"] {
        assert!(run.out.contains(part), "{} lacks {part}", run.out);
    }
    let json: serde_json::Value = serde_json::from_slice(&place.read("e.json")).expect("JSON");
    let error = json["relative_mean_error"].as_f64().expect("a number");
    // The pictures hold f32.
    assert!((error - 0.1).abs() < 1e-6, "{error}");
    for key in ["rmse", "rel_mse", "psnr", "ldr_flip", "hdr_flip", "mean_error"] {
        assert!(json[key].as_f64().is_some_and(|v| v > 0.0), "{key}: {}", json[key]);
    }
    assert_eq!(json["z"]["beyond"], 1.0);
    assert_eq!(pixels(&place.path("e.png")).dimensions(), (64, 42));
    let printed = place.works("compare a.exr b.exr --mask --json -");
    assert_eq!(serde_json::from_str::<serde_json::Value>(&printed.out).expect("JSON"), json);
}

#[test]
fn pictures_as_people_see_them_compare_too() {
    let place = Place::new();
    place.works("render --scene small.toml --size 16x9 --preset low --out a.png");
    place.works("render --scene small.toml --size 16x9 --preset low --out a.exr");
    let run = place.works("compare a.png a.exr --json -");
    let json: serde_json::Value = serde_json::from_str(&run.out).expect("JSON");
    // 8 bits and a dither of up to one step are all that differs: FLIP of a step is below 0.02.
    assert!(json["ldr_flip"].as_f64().is_some_and(|v| v < 0.02), "{json}");
    assert!(json["hdr_flip"].is_null());
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let place = Place::new();
    write(&place, "a.exr", [8, 4], 0.1);
    write(&place, "b.exr", [4, 8], 0.1);
    write(&place, "nan.exr", [8, 4], f32::NAN);
    place.write("text.exr", "no picture");
    place.write("text.png", "no picture");
    place.write("a.jpg", "no picture");
    let mut gray = Layers { size: [8, 4], ..Layers::default() };
    gray.add("Y", [0.5; 32]);
    gray.write(&place.path("gray.exr"), false).expect("written");
    for (b, parts) in [
        ("b.exr", ["8x4", "4x8"]),
        ("nan.exr", ["pixel 0, 0", "NaN"]),
        ("text.exr", ["text.exr", "OpenEXR"]),
        ("text.png", ["text.png", "PNG"]),
        ("a.jpg", ["a.jpg", ".png or .exr"]),
        ("gray.exr", ["gray.exr", "R, G and B"]),
        ("none.exr", ["none.exr", "read"]),
    ] {
        assert_sentence(&place.refuses(&format!("compare a.exr {b}")), &parts);
    }
    assert_sentence(&place.refuses("compare a.exr a.exr --out e.exr"), &["--out", ".png"]);
    place.works("compare a.exr a.exr");
}
