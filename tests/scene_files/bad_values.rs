//! Values that cannot be used: one sentence each, with line, field and what was expected.

use super::{EVERY_FIELD, SMALLEST, refusal};

/// `EVERY_FIELD` with the first line that starts with `from` replaced, and that line's number.
fn edited(from: &str, to: &str) -> (String, usize) {
    let line = EVERY_FIELD.lines().position(|l| l.starts_with(from));
    let line = line.unwrap_or_else(|| panic!("no line starts with {from}"));
    let lines: Vec<_> =
        EVERY_FIELD.lines().enumerate().map(|(i, l)| if i == line { to } else { l }).collect();
    (lines.join("\n"), line + 1)
}

/// Each case: the line that is replaced, by what, and what the message must hold.
#[track_caller]
fn refused(cases: &[(&str, &str, &[&str])]) {
    for (from, to, parts) in cases {
        let (text, line) = edited(from, to);
        let message = refusal(&text);
        assert!(message.starts_with(&format!("a.toml:{line}: ")), "{to}: {message}");
        for part in *parts {
            assert!(message.contains(part), "{to}: {message} lacks {part}");
        }
        assert!(!message.contains('\n'), "{message}");
    }
}

#[test]
fn numbers_out_of_range() {
    refused(&[
        (
            "fov_x",
            "fov_x = 180.0",
            &["camera.fov_x: expected a number from 1 to 179 degrees, found 180"],
        ),
        ("fov_x", "fov_x = -36", &["camera.fov_x", "found -36"]),
        ("position", "position = [0.0, 1e12, 0.0]", &["camera.position[1]", "1e11 m", "1e12"]),
        ("irradiance", "irradiance = -1.0", &["sun.irradiance", "from 0 to 1000000, found -1"]),
        ("angular_diameter", "angular_diameter = 0.0", &["sun.angular_diameter", "0.01"]),
        ("radiance", "radiance = -0.1", &["sky.radiance", "found -0.1"]),
        ("albedo = [", "albedo = [0.5, 0.5, 1.5]", &["ground.albedo[2]", "from 0 to 1, found 1.5"]),
        ("albedo = 0.9", "albedo = -0.5", &["medium.albedo", "found -0.5"]),
        ("exposure", "exposure = 25.0", &["output.exposure", "-24 to 24 EV"]),
        ("base", "base = -1.0", &["clouds.base", "from 0 to 20000 m"]),
        ("thickness", "thickness = 0.0", &["clouds.thickness", "from 1 to 20000 m"]),
        ("coverage", "coverage = 1.01", &["clouds.coverage", "from 0 to 1"]),
        ("extinction = 0.05", "extinction = -0.05", &["clouds.extinction", "1/m"]),
        ("feature_size", "feature_size = 1.0", &["clouds.feature_size", "from 10"]),
        ("cell_size", "cell_size = 0.0", &["clouds.cell_size", "from 1"]),
        ("particle_size", "particle_size = 5.0", &["clouds.particle_size", "cells"]),
        ("wind", "wind = [0, 0, 201]", &["clouds.wind[2]", "-200 to 200 m/s"]),
        ("evolution_time", "evolution_time = 0.0", &["clouds.evolution_time", "from 1"]),
        ("extent", "extent = [1e9, 1e4]", &["clouds.weather.extent[0]", "from 10 to 1e8 m"]),
        ("extent", "extent = [1e4, 59.0]", &["weather.extent", "at least clouds.cell_size, 60 m"]),
        ("centre = [-", "centre = [0, 1e12]", &["clouds.weather.centre[1]", "1e11 m"]),
        ("noise", "noise = 1.5", &["clouds.weather.noise", "from 0 to 1, found 1.5"]),
        ("radius", "radius = -180.0", &["particles[0].radius", "found -180"]),
        ("radius", "radius = 0.0", &["particles[0].radius", "from 0.001"]),
        ("extinction = 0.02", "extinction = 1e7", &["particles[0].extinction", "1e7"]),
    ]);
}

#[test]
fn a_sea_out_of_range() {
    let ground = |lines: &str| format!("{SMALLEST}[ground]\nalbedo = [0, 0, 0]\n{lines}");
    for (lines, part) in [
        (
            "kind = \"sea\"\nwind_speed = 61.0",
            "ground.wind_speed: expected a number from 0 to 60 m/s, found 61",
        ),
        (
            "kind = \"sea\"\nwind_speed = -0.5",
            "ground.wind_speed: expected a number from 0 to 60 m/s",
        ),
        ("kind = \"sea\"\nwind_speed = nan", "ground.wind_speed: expected a number"),
        ("kind = \"sea\"", "ground.wind_speed: is missing, a sea needs it"),
        ("wind_speed = 5.0", "ground.wind_speed: only a sea has a wind_speed"),
        ("kind = \"lake\"", "ground.kind: "),
    ] {
        let message = refusal(&ground(lines));
        assert!(message.starts_with("a.toml:") && message.contains(part), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
    }
}

#[test]
fn not_a_number() {
    for (from, field) in [
        ("position", "camera.position[0]"),
        ("target", "camera.target[0]"),
        ("up", "camera.up[0]"),
        ("direction", "sun.direction[0]"),
        ("wind", "clouds.wind[0]"),
        ("centre", "particles[0].centre[0]"),
    ] {
        for value in ["nan", "inf", "-inf"] {
            let line = format!("{from} = [{value}, 0.0, 1.0]");
            refused(&[(from, &line, &[field, "expected"])]);
        }
    }
    for (from, field) in [
        ("fov_x", "camera.fov_x"),
        ("irradiance", "sun.irradiance"),
        ("radiance", "sky.radiance"),
        ("exposure", "output.exposure"),
        ("coverage", "clouds.coverage"),
        ("radius", "particles[0].radius"),
    ] {
        for value in ["nan", "inf", "-inf", "1e999"] {
            let line = format!("{from} = {value}");
            refused(&[(from, &line, &[field, "expected"])]);
        }
    }
    let line = "orientation = [nan, 0.0, 0.0, 1.0]";
    refused(&[("orientation", line, &["particles[0].orientation[0]", "NaN"])]);
}

#[test]
fn directions_without_a_direction() {
    refused(&[
        ("direction", "direction = [0, 0, 0]", &["sun.direction", "expected a direction"]),
        ("up", "up = [0.0, -0.0, 0.0]", &["camera.up", "expected a direction"]),
        ("target", "target = [1, 2, 3]", &["camera.target", "other than camera.position"]),
        ("orientation", "orientation = [0, 0, 0, 0]", &["particles[0].orientation", "not zero"]),
    ]);
}

#[test]
fn wrong_types_and_lengths() {
    refused(&[
        ("fov_x", "fov_x = \"wide\"", &["camera.fov_x", "expected a number", "\"wide\""]),
        ("fov_x", "fov_x = [36.0]", &["camera.fov_x", "expected a number"]),
        ("fov_x", "fov_x = 1979-05-27", &["camera.fov_x", "expected a number"]),
        ("position", "position = [1, 2]", &["camera.position", "expected a list of 3 numbers"]),
        ("position", "position = [1, 2, 3, 4]", &["camera.position", "a list of 3 numbers"]),
        ("position", "position = 1", &["camera.position", "expected a list of 3 numbers"]),
        ("orientation", "orientation = [0, 0, 1]", &["particles[0].orientation", "list of 4"]),
        ("name", "name = 7", &["name", "string"]),
        ("seed", "seed = -1", &["clouds.seed", "expected a whole number"]),
        ("seed", "seed = 1.5", &["clouds.seed", "expected a whole number"]),
        ("seed", "seed = 4294967296", &["clouds.seed", "expected a whole number"]),
        ("shapes", "shapes = \"soft\"", &["clouds.shapes", "sequence"]),
        ("shapes", "shapes = [\"\"]", &["clouds.shapes[0]", "name of a shape"]),
        ("kind", "kind = \"cloudy\"", &["sky.kind", "cloudy", "uniform", "atmosphere"]),
        ("[sky]", "[[sky]]", &["sky: expected one table, [sky] or {...}, found a list"]),
    ]);
}

/// Positions would be taken for fields.
#[test]
fn lists_in_place_of_tables() {
    let message = refusal(&format!("medium = [\"hg:0.85\", 1.0]\n{SMALLEST}"));
    assert!(message.starts_with("a.toml:1: medium: expected one table"), "{message}");
    let message = refusal(&format!("particles = [[[0, 0, 0], 1.0, 1.0]]\n{SMALLEST}"));
    assert!(message.starts_with("a.toml:1: particles[0]: expected a table"), "{message}");
}

#[test]
fn counts_of_the_field() {
    refused(&[
        ("cells", "cells = 0", &["clouds.cells", "from 2 to 512, found 0"]),
        ("cells", "cells = 33", &["clouds.cells", "even", "33"]),
        ("rings", "rings = 9", &["clouds.rings", "from 1 to 8"]),
        ("layers", "layers = 65", &["clouds.layers", "from 1 to 64"]),
    ]);
    let huge = format!("{SMALLEST}[clouds]\ncells = 512\nrings = 8\nlayers = 64\n");
    let message = refusal(&huge);
    assert!(message.contains("clouds: expected cells * cells * rings * layers"), "{message}");
}

#[test]
fn phase_functions() {
    for bad in
        ["hg", "hg:", "hg:nan", "hg:1.0", "hg:-2", "mie:4um", "mie:51um", "mie:20", "rayleigh", ""]
    {
        let line = format!("phase = \"{bad}\"");
        refused(&[("phase", &line, &["medium.phase", "expected"])]);
    }
}

#[test]
fn a_sky_with_too_much_or_too_little() {
    let (text, line) = edited("kind", "kind = \"atmosphere\"");
    let message = refusal(&text);
    assert!(message.starts_with(&format!("a.toml:{}: sky.radiance: only", line + 1)), "{message}");
    let message = refusal(&format!("{SMALLEST}[sky]\nkind = \"uniform\"\n"));
    assert!(message.contains("sky.radiance: is missing"), "{message}");
    let message = refusal(&format!("{SMALLEST}[sky]\nradiance = 1.0\n"));
    assert!(message.contains("sky.kind: is missing"), "{message}");
}

#[test]
fn misspelt_keys_get_a_suggestion() {
    refused(&[
        ("fov_x", "fov = 36.0", &["camera.fov", "unknown field `fov`", "did you mean `fov_x`?"]),
        ("position", "positon = [0, 0, 0]", &["did you mean `position`?"]),
        ("coverage", "covrage = 0.5", &["clouds.covrage", "did you mean `coverage`?"]),
        ("radius", "Radius = 1.0", &["particles[0].Radius", "did you mean `radius`?"]),
        ("[medium]", "[meduim]", &["meduim", "did you mean `medium`?"]),
        ("kind", "kind = \"unifrom\"", &["sky.kind", "did you mean `uniform`?"]),
        ("name", "zebra = 1", &["unknown field `zebra`", "expected one of"]),
    ]);
    let (text, _) = edited("name", "zebra = 1");
    assert!(!refusal(&text).contains("did you mean"), "nothing is near to zebra");
}

#[test]
fn missing_fields_are_named_by_their_path() {
    for (gone, field) in [
        ("position", "camera.position"),
        ("target", "camera.target"),
        ("direction", "sun.direction"),
        ("centre", "particles[0].centre"),
        ("radius", "particles[0].radius"),
        ("extinction = 0.02", "particles[0].extinction"),
    ] {
        let (text, _) = edited(gone, "");
        let message = refusal(&text);
        assert!(message.ends_with(&format!(": {field}: is missing")), "{message}");
    }
    for table in ["camera", "sun"] {
        let text = SMALLEST.replace(&format!("[{table}]"), "[ground]");
        let message = refusal(&text);
        assert!(message.starts_with("a.toml:"), "{message}");
    }
    assert_eq!(refusal(""), "a.toml:1: camera: is missing");
}

#[test]
fn what_is_not_toml() {
    for bad in [
        "[camera",
        "camera = ",
        "= 1",
        "[camera]\nposition = [0, 0, 0",
        "a = \"unclosed",
        "[camera]\n[camera]\n",
        "{\"camera\": {}}",
        "\0",
        "\u{1b}[2J = 1",
        "<scene/>",
    ] {
        let message = refusal(bad);
        assert!(message.starts_with("a.toml"), "{message}");
        assert!(!message.contains(|c: char| c.is_control()), "{message:?}");
    }
}

#[test]
fn hostile_text_is_refused_shortly() {
    let deep_lists = format!("{SMALLEST}[ground]\nalbedo = {}", "[".repeat(100_000));
    let deep_tables = format!("{SMALLEST}name = {}", "{a=".repeat(100_000));
    let deep_keys = format!("{}a = 1", "a.".repeat(100_000));
    let long_key = format!("{} = 1", "k".repeat(1_000_000));
    let long_value = format!("{SMALLEST}[medium]\nphase = \"{}\"", "p".repeat(1_000_000));
    let long_number = format!("{SMALLEST}[output]\nexposure = 1{}", "0".repeat(100_000));
    for text in [deep_lists, deep_tables, deep_keys, long_key, long_value, long_number] {
        let message = refusal(&text);
        assert!(message.len() < 800, "a message of {} bytes", message.len());
    }
}
