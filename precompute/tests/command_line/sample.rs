//! `precompute sample`: answers for rays, on the host and on the device.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use cumuli::medium::Phase;
use glam::DVec3;
use proptest::prelude::*;
use serde_json::{Value, json};

use super::{built_in, precompute, refusal};

/// A command's answers; it must succeed.
fn answers(dir: &Path, rays: &Value, more: &[&str]) -> Vec<Value> {
    let (input, output) = (dir.join("rays.json"), dir.join("answers.json"));
    std::fs::write(&input, rays.to_string()).expect("written");
    let result = run(&input, &output, more);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    let text = std::fs::read(&output).expect("answers");
    let file: Value = serde_json::from_slice(&text).expect("JSON");
    file["rays"].as_array().expect("an array").clone()
}

fn run(input: &Path, output: &Path, more: &[&str]) -> std::process::Output {
    let paths = [
        built_in().display().to_string(),
        format!("--rays={}", input.display()),
        format!("--out={}", output.display()),
    ];
    let paths: Vec<&str> = paths.iter().map(String::as_str).collect();
    precompute(&[&["sample"], &paths[..], more].concat())
}

fn number(answer: &Value, field: &str) -> f64 {
    answer[field].as_f64().unwrap_or_else(|| panic!("{field} of {answer}"))
}

const FIELDS: [&str; 5] = ["optical_depth", "transmittance", "single", "multiple", "total"];

/// Points spread evenly over the sphere.
fn direction(index: usize, salt: f64) -> DVec3 {
    let z = 2.0 * (index as f64 * 0.819_172_5 + salt).fract() - 1.0;
    let turn = TAU * (index as f64 * 0.671_043_6 + 0.3 * salt).fract();
    let across = (1.0 - z * z).sqrt();
    DVec3::new(across * turn.cos(), across * turn.sin(), z)
}

/// Rays all over: inwards, in all positions to the sun, optical radii across the table and beyond.
fn all_over(count: usize) -> Value {
    let rays = (0..count).map(|i| {
        let (entry, dir) = (direction(i, 0.1), direction(i, 0.45));
        let dir = if dir.dot(entry) > 0.0 { -dir } else { dir };
        let sun = match i % 20 {
            0 => (dir + 0.01 * direction(i, 0.7)).normalize(),
            1 => dir,
            2 => -dir,
            _ => direction(i, 0.9),
        };
        let radius = 0.03 * 5000f64.powf((i as f64 * 0.577_215_66).fract());
        let mut ray = json!({"entry": entry.to_array(), "dir": dir.to_array(),
            "sun": sun.to_array(), "optical_radius": radius});
        if i % 3 == 0 {
            let (a, b) = ((i as f64 * 0.324).fract(), (i as f64 * 0.761).fract());
            ray["from"] = a.min(b).into();
            ray["to"] = a.max(b).into();
        }
        ray
    });
    json!({"rays": rays.collect::<Vec<_>>()})
}

#[test]
fn the_device_agrees_with_the_host() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let rays = all_over(4000);
    for more in [&[][..], &["--shape=soft-1"], &["--shape=pyroclastic-2", "--phase=hg:0.85"]] {
        let host = answers(dir.path(), &rays, more);
        let device = answers(dir.path(), &rays, &[more, &["--gpu"]].concat());
        assert_eq!((host.len(), device.len()), (4000, 4000));
        for ((ray, a), b) in rays["rays"].as_array().expect("rays").iter().zip(&host).zip(&device) {
            let depths = [number(a, "optical_depth"), number(b, "optical_depth")];
            for field in FIELDS {
                let (a, b) = (number(a, field), number(b, field));
                // What f32 makes of a chord of 2 radii at this optical radius; light is in
                // proportion to it where it is small, and ends at 1e-38 in f32, before a phase
                // function of up to 1e4.
                let rounding = 2e-7 * number(ray, "optical_radius").max(1.0);
                let source = |light: f64, depth: f64| light / depth.max(f64::MIN_POSITIVE);
                // The path of order 1 through the table is misplaced by up to 1.5e-5 radii, a
                // thirtieth of a step of f16 in what is stored.
                let place = 1.5e-5 * number(ray, "optical_radius") * a.abs();
                let rounding = match field {
                    "optical_depth" | "transmittance" => rounding,
                    _ => rounding * source(a, depths[0]).max(source(b, depths[1])) + place + 1e-33,
                };
                // A step of f16 next to any value, 2^-10 of it. Filters that keep 8 bits of the
                // weights could be off by more; that of lavapipe keeps f32's.
                let tolerance = 2f64.powi(-10) * a.abs() + rounding;
                assert!((a - b).abs() <= tolerance, "{more:?} {field} of {ray}: {a} {b}");
            }
        }
    }
}

#[test]
fn a_uniform_sphere_has_the_optical_depth_of_its_chords() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let rays = all_over(500);
    let found = answers(dir.path(), &rays, &[]);
    for (ray, answer) in rays["rays"].as_array().expect("rays").iter().zip(&found) {
        let vector = |field: &str| {
            DVec3::from_array(std::array::from_fn(|i| ray[field][i].as_f64().expect("a number")))
        };
        let share =
            ray.get("to").map_or(1.0, |to| to.as_f64().expect("a number") - number(ray, "from"));
        let chord = -2.0 * vector("entry").dot(vector("dir"));
        let expected = number(ray, "optical_radius") * chord * share;
        let found = number(answer, "optical_depth");
        // The fractions of the chord are looked up in f32.
        let tolerance = 2e-7 * number(ray, "optical_radius") * chord + 1e-12;
        assert!((found - expected).abs() <= tolerance, "{ray}: {found} {expected}");
        let passed = number(answer, "transmittance");
        assert!((passed - (-found).exp()).abs() < 1e-14, "{ray}: {passed}");
        let sum = number(answer, "single") + number(answer, "multiple");
        assert!((number(answer, "total") - sum).abs() <= 1e-15 * sum, "{answer}");
    }
}

#[test]
fn parts_of_a_chord_compose_to_the_whole() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let cuts = [0.0, 0.13, 0.4, 0.41, 0.9, 1.0];
    for shape in ["uniform", "pyroclastic-1"] {
        let ray = |from: f64, to: f64| {
            json!({"entry": [0.48, 0.6, 0.64], "dir": [-0.28, -0.96, 0.0], "sun": [0.0, 0.8, -0.6],
                "optical_radius": 6.0, "from": from, "to": to})
        };
        let mut rays = vec![ray(0.0, 1.0)];
        rays.extend(cuts.windows(2).map(|cut| ray(cut[0], cut[1])));
        let found = answers(dir.path(), &json!({"rays": rays}), &[&format!("--shape={shape}")]);
        for field in FIELDS {
            let values = found[1..].iter().map(|answer| number(answer, field));
            let composed: f64 =
                if field == "transmittance" { values.product() } else { values.sum() };
            let whole = number(&found[0], field);
            assert!(whole > 0.0, "{field} of {shape}");
            // Fractions are f32 and cancel where a part is short.
            assert!(
                (composed / whole - 1.0).abs() < 1e-5,
                "{field} of {shape}: {composed} {whole}"
            );
        }
    }
}

#[test]
fn looking_into_the_sun_through_the_centre_is_the_closed_form() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for phase in ["hg:0.85", "mie:20um"] {
        let forward = phase.parse::<Phase>().expect("a phase function").eval(1.0);
        for radius in [0.1, 1.0, 4.0] {
            let rays = json!({"rays": [{"entry": [0.0, 0.0, -1.0], "dir": [0.0, 0.0, 1.0],
                "sun": [0.0, 0.0, 1.0], "optical_radius": radius}]});
            let found = answers(dir.path(), &rays, &[&format!("--phase={phase}")]);
            let tau = 2.0 * radius;
            let expected = forward * tau * (-tau).exp();
            // Target of the radiance of any ray.
            let error = (number(&found[0], "single") - expected).abs();
            assert!(error < 0.01 * number(&found[0], "total"), "{phase} {radius}: {error}");
        }
    }
}

#[test]
fn a_grazing_ray_meets_nothing() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let rays = json!({"rays": [
        {"entry": [0, 0, 1], "dir": [1, 0, 0], "sun": [0, 1, 0], "optical_radius": 9},
        // Rounded to five digits, it points outwards by 5e-6.
        {"entry": [0.83867, 0.0, 0.54464], "dir": [0.54464, 0.0, -0.83866], "sun": [0, 1, 0],
            "optical_radius": 9},
        {"entry": [0, 0, 1], "dir": [0, 0, -1], "sun": [0, 1, 0], "optical_radius": 0},
        {"entry": [0, 0, 1], "dir": [0, 0, -1], "sun": [0, 1, 0], "optical_radius": 5,
            "from": 0.5, "to": 0.5},
    ]});
    for more in [&[][..], &["--gpu"], &["--shape=soft-1"], &["--shape=soft-1", "--gpu"]] {
        for answer in answers(dir.path(), &rays, more) {
            assert_eq!(number(&answer, "optical_depth"), 0.0, "{more:?}");
            assert_eq!(number(&answer, "transmittance"), 1.0, "{more:?}");
            assert_eq!(number(&answer, "total"), 0.0, "{more:?}");
        }
    }
}

#[test]
fn no_rays_have_no_answers() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for more in [&[][..], &["--gpu"]] {
        assert!(answers(dir.path(), &json!({"rays": []}), more).is_empty());
    }
}

/// A sound ray with one field replaced by this text.
fn spoilt(field: &str, text: &str) -> String {
    let sound =
        [("entry", "[0,0,1]"), ("dir", "[0,0,-1]"), ("sun", "[0,1,0]"), ("optical_radius", "2")];
    let mut fields: Vec<_> = sound.iter().filter(|(name, _)| *name != field).collect();
    let replaced = (field, text);
    if !text.is_empty() {
        fields.push(&replaced);
    }
    let fields: Vec<_> = fields.iter().map(|(name, value)| format!("\"{name}\":{value}")).collect();
    format!("{{{}}}", fields.join(","))
}

#[test]
fn bad_rays_are_named() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (input, output) = (dir.path().join("rays.json"), dir.path().join("answers.json"));
    for (field, text, word) in [
        ("entry", "", "missing field `entry`"),
        ("entry", "[0,0,1.001]", "rays[1].entry"),
        ("entry", "[0,0,0]", "rays[1].entry"),
        ("entry", "[0,0]", "rays[1].entry"),
        ("entry", "[0,0,1,0]", "rays[1].entry"),
        ("entry", "[0,0,1e999]", "rays[1].entry[2]"),
        ("entry", "[0,0,NaN]", "rays[1].entry[2]"),
        ("entry", "[0,0,null]", "rays[1].entry[2]"),
        ("entry", "[1e200,0,1e200]", "rays[1].entry"),
        ("dir", "[0,0,1]", "rays[1].dir"),
        ("dir", "[0,0,-2]", "rays[1].dir"),
        ("dir", "[0,\"x\",-1]", "rays[1].dir[1]"),
        ("sun", "[0,0.9,0]", "rays[1].sun"),
        ("optical_radius", "-1", "rays[1].optical_radius"),
        ("optical_radius", "1e300", "rays[1].optical_radius"),
        ("optical_radius", "Infinity", "rays[1].optical_radius"),
        ("from", "-0.1", "rays[1].from"),
        ("from", "1.1", "rays[1].from"),
        ("to", "1.1", "rays[1].to"),
        ("to", "0.2,\"from\":0.3", "rays[1].to"),
        ("form", "0.5", "rays[1].form"),
        ("sun", "[0,1,0],\"sun\":[0,1,0]", "duplicate field `sun`"),
    ] {
        let text = format!("{{\"rays\":[{},{}]}}", spoilt("", ""), spoilt(field, text));
        std::fs::write(&input, &text).expect("written");
        let message = refusal(&run(&input, &output, &[]));
        assert!(message.contains(word) && message.contains("rays.json"), "{text}: {message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        assert!(!output.exists(), "{text}");
    }
    for text in ["", "[", "{}", "{\"rays\":{}}", "{\"rays\":[]}x", "\u{0}", "{\"rays\":[],\"a\":1}"]
    {
        std::fs::write(&input, text).expect("written");
        let message = refusal(&run(&input, &output, &[]));
        assert!(message.contains("rays.json") && message.lines().count() == 1, "{message}");
    }
    // Brackets without end must not exhaust the stack.
    std::fs::write(&input, "[".repeat(1_000_000)).expect("written");
    refusal(&run(&input, &output, &[]));
    for path in [dir.path(), &dir.path().join("none.json")] {
        let message = refusal(&run(path, &output, &[]));
        assert!(message.contains(&path.display().to_string()), "{message}");
    }
}

#[test]
fn what_the_tables_lack_is_refused() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let input = dir.path().join("rays.json");
    std::fs::write(&input, "{\"rays\":[]}").expect("written");
    for (option, word) in [
        ("--shape=soft-99", "soft-99"),
        ("--phase=hg:0.1", "hg:0.1"),
        ("--albedo=0.5", "0.5"),
        ("--albedo=nan", "NaN"),
        ("--phase=cube", "cube"),
    ] {
        let message = refusal(&run(&input, &dir.path().join("answers.json"), &[option]));
        assert!(message.contains(word), "{option}: {message}");
    }
    let message = refusal(&run(&input, dir.path(), &[]));
    assert!(message.contains("folder"), "{message}");
}

proptest! {
    // A process each: a dozen takes a second.
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..Default::default() })]

    /// Whatever a ray file is cut, overwritten or filled with, the answer is a file or a sentence.
    #[test]
    fn any_bytes_get_answers_or_one_sentence(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let (input, output) = (dir.path().join("rays.json"), dir.path().join("answers.json"));
        let mut bytes = all_over(3).to_string().into_bytes();
        for (place, byte) in &edits {
            let at = place.index(bytes.len());
            bytes[at] = *byte;
        }
        if let Some(cut) = &cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        std::fs::write(&input, &bytes).expect("written");
        let result = run(&input, &output, &[]);
        if result.status.success() {
            let text = std::fs::read_to_string(&output).expect("answers");
            let file: Value = serde_json::from_str(&text).expect("JSON");
            for answer in file["rays"].as_array().expect("an array") {
                for field in FIELDS {
                    prop_assert!(number(answer, field).is_finite());
                }
            }
        } else {
            let message = refusal(&result);
            prop_assert!(message.contains("rays.json") && message.lines().count() == 1, "{message}");
        }
    }
}

/// Four figures of a sphere, seen from the side, as anybody could integrate them: the mean of the
/// transmittance over the disc is `(1 - (1 + 2R) exp(-2R)) / (2 R^2)`.
#[test]
fn transmittance_over_the_disc_is_the_closed_form() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for radius in [0.01f64, 1.0, 10.0] {
        // Midpoints in the squared distance from the centre: equal areas.
        const RINGS: usize = 4000;
        let rays: Vec<_> = (0..RINGS)
            .map(|i| {
                let across = ((i as f64 + 0.5) / RINGS as f64).sqrt();
                let turn = PI * 0.1 * i as f64;
                let entry = [across * turn.cos(), across * turn.sin(), (1.0 - across * across).sqrt()];
                json!({"entry": entry, "dir": [0, 0, -1], "sun": [0, 0, 1], "optical_radius": radius})
            })
            .collect();
        let found = answers(dir.path(), &json!({"rays": rays}), &[]);
        let mean: f64 =
            found.iter().map(|a| number(a, "transmittance")).sum::<f64>() / RINGS as f64;
        let expected =
            (1.0 - (1.0 + 2.0 * radius) * (-2.0 * radius).exp()) / (2.0 * radius * radius);
        // The square root at the rim costs the midpoint rule 1e-5.
        assert!((mean - expected).abs() < 2e-5, "{radius}: {mean} {expected}");
    }
}
