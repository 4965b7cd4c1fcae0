//! `precompute plot`: pictures of what is in a file.

use std::path::Path;

use super::{SMALL, precompute, refusal};

fn plot(file: &Path, out: &Path) -> Vec<String> {
    let (file, out) = (file.display().to_string(), out.display().to_string());
    let output = precompute(&["plot", &file, "--out", &out, "--samples=100"]);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{told}");
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
}

/// How many different colours a picture has, and its share of white.
fn colours(path: &str) -> (usize, f64) {
    let picture = image::open(path).expect("a picture").into_rgb8();
    let (mut all, mut white) = (std::collections::HashSet::new(), 0);
    for pixel in picture.pixels() {
        all.insert(pixel.0);
        white += usize::from(pixel.0 == [255; 3]);
    }
    let pixels = picture.width() as f64 * f64::from(picture.height());
    (all.len(), white as f64 / pixels)
}

#[test]
fn every_table_has_its_pictures() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let file = dir.path().join("tables");
    let options = ["--shapes=soft-9", "--phase=hg:0.5,mie:9um"];
    let options: Vec<&str> = super::SMALL
        .iter()
        .copied()
        .filter(|o| !o.starts_with("--shapes") && !o.starts_with("--phase"))
        .chain(options)
        .collect();
    let out = format!("--out={}", file.display());
    assert!(precompute(&[&["bake", &out], &options[..]].concat()).status.success());
    let first = plot(&file, &dir.path().join("a/b"));
    assert_eq!(first.len(), 3 + 2 * 4);
    for path in &first {
        let (count, white) = colours(path);
        // Words and lines alone are smoothed in tens of shades; charts are mostly paper.
        assert!(count > 20 && white < 0.99, "{path}: {count} colours, {white} of it white");
        if path.contains("spheres") || path.contains("soft-9") {
            assert!(count > 200 && white < 0.8, "{path}: {count} colours, {white} of it white");
        }
    }
    let names: std::collections::HashSet<_> =
        first.iter().map(|path| std::fs::read(path).expect("a picture")).collect();
    assert_eq!(names.len(), first.len(), "no picture twice");
}

#[test]
fn other_tables_are_other_pictures() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let files = ["soft-9", "soft-8"].map(|soft| {
        let file = dir.path().join(soft);
        let shapes = format!("--shapes={soft},pyroclastic-9");
        let out = format!("--out={}", file.display());
        let mut options = vec!["bake", &out, &shapes];
        options.extend(SMALL.iter().filter(|option| !option.starts_with("--shapes")));
        assert!(precompute(&options).status.success());
        plot(&file, &dir.path().join(format!("plots of {soft}")))
    });
    assert_eq!(files[0].len(), files[1].len());
    let name = |path: &String| Path::new(path).file_name().expect("a name").to_owned();
    for (a, b) in files[0].iter().zip(&files[1]) {
        let same = std::fs::read(a).expect("a picture") == std::fs::read(b).expect("a picture");
        let (a, b) = (name(a), name(b));
        let text = a.to_string_lossy();
        // Pictures of the other shape, and the errors of all shapes' chords; the rest is the same to
        // the byte.
        let of_shape = text.contains("soft-9");
        assert_eq!(a == b, !of_shape, "{text}");
        assert_eq!(same, !of_shape && !text.contains("chords"), "{text}");
    }
}

#[test]
fn a_file_in_the_way_is_refused_at_once() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let way = dir.path().join("file");
    std::fs::write(&way, "x").expect("written");
    for out in [way.clone(), way.join("below")] {
        let file = super::built_in().display().to_string();
        let text = refusal(&precompute(&["plot", &file, "--out", &out.display().to_string()]));
        assert!(text.contains("is a file, expected a folder"), "{text}");
    }
}
