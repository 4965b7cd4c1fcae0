//! `precompute bake` and `precompute info`: what they write, say and refuse.

use super::{SMALL, bake, precompute, refusal};

#[test]
fn threads_do_not_change_the_bytes() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let bytes: Vec<_> = ["1", "2", "5"]
        .iter()
        .map(|threads| {
            let path = dir.path().join(threads);
            let output = bake(&path, &["--threads", threads]);
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            std::fs::read(path).expect("written")
        })
        .collect();
    assert!(bytes[0] == bytes[1] && bytes[0] == bytes[2]);

    let path = dir.path().join("other");
    assert!(bake(&path, &["--seed=2"]).status.success());
    assert!(std::fs::read(path).expect("written") != bytes[0], "other chords, other values");
}

#[test]
fn info_tells_what_was_asked_for() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("tables.safetensors");
    assert!(bake(&path, &[]).status.success());
    let output = precompute(&["info", &path.display().to_string()]);
    assert!(output.status.success());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in
        ["soft-9", "pyroclastic-9", "4 x 4 x 8 x 8", "hg:0.5, albedo 0.9", "0.5 to 2", "RMS"]
    {
        assert!(text.contains(part), "{part} in {text}");
    }
}

#[test]
fn single_precision_is_stored_and_read() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let [half, single] = ["f16", "f32"].map(|precision| {
        let path = dir.path().join(precision);
        assert!(bake(&path, &["--precision", precision]).status.success());
        let tables = cumuli::tables::TableSet::load(&path).expect("tables");
        let info = precompute(&["info", &path.display().to_string()]);
        assert!(String::from_utf8_lossy(&info.stdout).contains(precision));
        tables
    });
    let (half, single) = (&half.scattering()[0], &single.scattering()[0]);
    assert!(half.precise_values().is_none());
    let precise = single.precise_values().expect("unrounded values");
    assert!(precise.iter().zip(single.values()).any(|(p, v)| *p != v.to_f32()));
    for (p, v) in precise.iter().zip(half.values()) {
        // Half a step of f16 and a little for what was rounded twice.
        assert!((p - v.to_f32()).abs() <= 2f32.powi(-10) * p.abs() + 1e-7, "{p} {v}");
    }
}

/// Extremes of what is accepted: each gives a file that can be read, or a sentence and no file.
#[test]
fn extreme_media_are_baked_or_refused() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for (number, options) in [
        ["--phase=hg:0.5", "--albedo=0"],
        ["--phase=hg:0.999", "--albedo=1"],
        ["--phase=hg:-0.95", "--albedo=1"],
        ["--phase=mie:50um", "--albedo=1e-9"],
    ]
    .iter()
    .enumerate()
    {
        let path = dir.path().join(number.to_string());
        let out = format!("--out={}", path.display());
        let shape = ["--shapes=soft-9", "--disc=4", "--direction=4", "--rays=1"];
        let table = ["--scattering=2,3,3,4", "--optical-radius=0.5,1", "--remainder=0.1"];
        let output = precompute(&[&["bake", &out], &options[..], &shape[..], &table[..]].concat());
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() {
            let tables = cumuli::tables::TableSet::load(&path).expect("tables");
            assert!(tables.scattering()[0].values().iter().all(|v| v.is_finite()), "{options:?}");
        } else {
            let last = told.lines().last().expect("a sentence");
            assert!(last.contains("no solution") && !path.exists(), "{options:?}: {told}");
        }
    }
    assert!(dir.path().join("0").exists(), "albedo 0 is nothing special");
}

#[test]
fn bad_input_is_one_sentence_and_leaves_nothing() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("tables.safetensors");
    for (option, word) in [
        ("--shapes=cube-1", "cube-1"),
        ("--shapes=uniform", "noise shape"),
        ("--shapes=soft-1,soft-1", "twice"),
        ("--disc=1", "disc"),
        ("--direction=65", "direction"),
        ("--rays=0", "rays"),
        ("--iterations=-1", "--iterations"),
        ("--phase=hg:1", "hg:1"),
        ("--albedo=nan", "albedo"),
        ("--albedo=1.5", "albedo"),
        ("--optical-radius=1", "--optical-radius"),
        ("--optical-radius=2,1", "2..1"),
        ("--optical-radius=inf,nan", "inf..NaN"),
        ("--scattering=1,2,3", "--scattering"),
        ("--scattering=2,2,2,99999", "99999"),
        ("--events=0", "events"),
        ("--precision=f8", "--precision"),
        ("--threads=0", "--threads"),
    ] {
        // An option given twice is refused by itself: leave out the sound one.
        let name = option.split('=').next().expect("a name");
        let sound: Vec<_> = SMALL.iter().copied().filter(|o| !o.starts_with(name)).collect();
        let out = format!("--out={}", path.display());
        let text = refusal(&precompute(&[&["bake", &out, option], &sound[..]].concat()));
        assert!(text.contains(word) && text.contains(name), "{option}: {text}");
        assert_eq!(std::fs::read_dir(dir.path()).expect("a folder").count(), 0, "{option}");
    }
    let text = refusal(&precompute(&["info", &path.display().to_string()]));
    assert!(text.contains("tables.safetensors"), "{text}");
    std::fs::write(&path, "no tables").expect("written");
    let text = refusal(&precompute(&["info", &path.display().to_string()]));
    assert!(text.contains("tables.safetensors") && text.lines().count() == 1, "{text}");
}
