//! Every function of the shaders stands in `docs/shader-functions.md`, with what it is compared with.

use std::collections::BTreeSet;
use std::path::Path;

/// Functions of the shaders: file below `shaders/` without its ending, and name.
fn written() -> BTreeSet<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut found = BTreeSet::new();
    for folder in std::fs::read_dir(&root).expect("shaders") {
        let folder = folder.expect("a folder").path();
        for file in std::fs::read_dir(&folder).expect("a folder of shaders") {
            let path = file.expect("a file").path();
            let source = std::fs::read_to_string(&path).expect("a shader");
            let relative = path.with_extension("");
            let relative = relative.strip_prefix(&root).expect("below").display().to_string();
            let functions = source.lines().filter_map(|line| line.strip_prefix("fn "));
            for line in functions {
                let name = line.split('(').next().unwrap_or_default();
                found.insert((relative.replace('\\', "/"), name.to_owned()));
            }
        }
    }
    found
}

#[test]
fn every_function_of_the_shaders_is_compared_with_something() {
    let text = include_str!("../../../docs/shader-functions.md");
    let mut listed = BTreeSet::new();
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    for row in text.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<_> = row.split('|').map(str::trim).collect();
        let [_, file, names, error, test, _] = cells[..] else { panic!("{row}") };
        assert!(!error.is_empty(), "{row}");
        // The file that compares is there, and names what it compares in words of its own.
        let place = test.trim_matches('`').split(' ').next().unwrap_or_default();
        assert!(tests.join(place.trim_matches('`')).is_file(), "no file of tests: {row}");
        for name in names.split(',') {
            let name = name.trim().trim_matches('`').to_owned();
            let is_new = listed.insert((file.trim_matches('`').to_owned(), name));
            assert!(is_new, "twice: {row}");
        }
    }
    let written = written();
    assert!(written.len() > 100, "{}", written.len());
    let missing: Vec<_> = written.difference(&listed).collect();
    let unknown: Vec<_> = listed.difference(&written).collect();
    assert!(missing.is_empty(), "not in docs/shader-functions.md: {missing:?}");
    assert!(unknown.is_empty(), "only in docs/shader-functions.md: {unknown:?}");
}
