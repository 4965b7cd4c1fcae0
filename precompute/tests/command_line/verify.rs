//! `precompute verify`: it passes what is right and fails what is wrong.

use std::path::Path;

use cumuli::tables::{ScatteringTable, TableSet};
use half::f16;
use serde_json::Value;

use super::{built_in, precompute, refusal};

/// All rows of a quick run, and whether it ended as the rows say.
fn rows(file: &Path, more: &[&str]) -> Vec<Value> {
    let file = file.display().to_string();
    let output = precompute(&[&["verify", &file, "--quick", "--json"], more].concat());
    let rows: Vec<Value> = serde_json::from_slice(&output.stdout).unwrap_or_else(|e| {
        panic!("{e}: {}", String::from_utf8_lossy(&output.stderr));
    });
    let failed = rows.iter().filter(|row| row["pass"] == false).count();
    assert_eq!(output.status.code(), Some(i32::from(failed > 0)));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(said.contains(&format!("{failed} of {} checks failed", rows.len())), failed > 0);
    rows
}

fn named<'a>(rows: &'a [Value], part: &str) -> Vec<&'a Value> {
    let found: Vec<_> =
        rows.iter().filter(|row| row["name"].as_str().is_some_and(|n| n.contains(part))).collect();
    assert!(!found.is_empty(), "no row about {part}");
    found
}

/// The built-in tables with the values of every medium changed: channel and value.
fn changed(path: &Path, change: impl Fn(f32) -> f32) {
    let tables = TableSet::embedded().expect("built-in tables");
    let media = tables.scattering().iter().map(|table| {
        let values = table.values().iter();
        let values = values.map(|v| f16::from_f32(change(v.to_f32()))).collect();
        let (resolution, range) = (table.resolution(), table.optical_radius_range());
        let report = table.report().clone();
        let (phase, albedo) = (*table.phase(), table.albedo());
        ScatteringTable::from_parts(phase, albedo, resolution, range, values, report)
            .expect("a table")
    });
    let media = media.collect();
    let shapes = tables.optical_depth()[..1].to_vec();
    let set = TableSet::new(shapes, *tables.optical_depth_options(), media).expect("a set");
    set.save(path).expect("saved");
}

#[test]
fn what_is_exact_passes() {
    let rows = rows(&built_in(), &[]);
    for part in [
        "escape probability",
        "lookups out of range",
        "not finite",
        "device against host",
        "mean density",
        "never falls",
        "as recorded",
        "depth 10",
    ] {
        for row in named(&rows, part) {
            let exact =
                part != "depth 10" || row["name"].as_str().is_some_and(|n| n.contains("uniform"));
            assert!(!exact || row["pass"] == true, "{row}");
        }
    }
    for field in ["expected", "got", "error", "tolerance"] {
        assert!(rows.iter().all(|row| row[field].is_number()), "{field}");
    }
}

#[test]
fn light_from_nowhere_fails() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("tables");
    // 10 % more light of orders from 2 on.
    changed(&path, |v| v + 1.1f32.ln());
    let rows = rows(&path, &["--no-gpu"]);
    for row in named(&rows, "light out over light in") {
        let got = row["got"].as_f64().expect("a number");
        // From optical radius 0.7 on, half or more of the light has scattered twice.
        let thick = !row["name"].as_str().is_some_and(|n| n.contains("0.1000"));
        assert!(!thick || (row["pass"] == false && got > 1.02), "{row}");
    }
    let passed = named(&rows, "order 1");
    assert!(passed.iter().any(|row| row["pass"] == true), "order 1 is as it was");
    assert!(rows.iter().all(|row| !row["name"].as_str().expect("a name").contains("device")));
}

#[test]
fn what_f16_costs_is_told_of_tables_in_f32() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("tables");
    let tables = TableSet::embedded().expect("built-in tables");
    let table = &tables.scattering()[0];
    // A third of a step of f16 beside what it can hold, in logarithms from 4 to 8; more in smaller ones.
    let values = table.values().iter().map(|v| v.to_f32() + 1.0 / 768.0).collect();
    let table = ScatteringTable::from_precise_parts(
        *table.phase(),
        table.albedo(),
        table.resolution(),
        table.optical_radius_range(),
        values,
        table.report().clone(),
    );
    let shapes = tables.optical_depth()[..1].to_vec();
    let media = vec![table.expect("a table")];
    let set = TableSet::new(shapes, *tables.optical_depth_options(), media).expect("a set");
    set.save(&path).expect("saved");
    let in_f32 = rows(&path, &["--no-gpu", "--samples=500"]);
    let costs = named(&in_f32, "f16 beside f32");
    assert_eq!(costs.len(), 2, "largest and RMS");
    for row in costs {
        let error = row["error"].as_f64().expect("a number");
        assert!(row["pass"] == true && error > 1e-4, "{row}");
    }
    let in_f16 = rows(&built_in(), &["--no-gpu", "--samples=500"]);
    let told = |row: &Value| row["name"].as_str().is_some_and(|n| n.contains("f16"));
    assert!(!in_f16.iter().any(told), "nothing is known of what was rounded before");
}

#[test]
fn the_table_says_what_json_says() {
    let file = built_in().display().to_string();
    let options = ["verify", &file, "--quick", "--samples=500", "--no-gpu", "--seed=7"];
    let text = precompute(&options);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    let rows = rows(&built_in(), &["--samples=500", "--no-gpu", "--seed=7"]);
    let lines: Vec<&str> = text.lines().skip(1).collect();
    assert_eq!(lines.len(), rows.len());
    for (line, row) in lines.iter().zip(&rows) {
        // The same seed gives the same rows.
        assert!(line.starts_with(row["name"].as_str().expect("a name")), "{line} {row}");
        assert!(line.ends_with(if row["pass"] == true { "pass" } else { "FAIL" }), "{line} {row}");
    }
}

#[test]
fn bad_input_is_one_sentence() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let missing = dir.path().join("missing").display().to_string();
    let folder = dir.path().display().to_string();
    for options in [
        &[missing.as_str()][..],
        &[folder.as_str()],
        &["/dev/null"],
        &[&built_in().display().to_string(), "--samples=0"],
        &[&built_in().display().to_string(), "--seed=-1"],
    ] {
        let text = refusal(&precompute(&[&["verify"], options].concat()));
        assert!(!text.is_empty());
    }
}
