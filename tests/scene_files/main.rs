//! Scene files: what they mean, and what becomes of bad ones.

mod any_text;
mod bad_files;
mod bad_values;
mod meaning;
mod weather;

use std::path::{Path, PathBuf};

use cumuli::scene::Scene;

/// A scene that uses every field there is, none with its default value.
const EVERY_FIELD: &str = include_str!("every_field.toml");

/// The top of the tree.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The scenes that ship.
fn shipped() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root().join("scenes")).expect("a folder of scenes");
    let paths = entries.map(|e| e.expect("an entry").path());
    let mut scenes: Vec<_> = paths.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    scenes.sort();
    scenes
}

fn parse(text: &str) -> cumuli::Result<Scene> {
    Scene::from_toml(text, "a.toml", Path::new(""))
}

/// The message with which a scene is refused.
fn refusal(text: &str) -> String {
    match parse(text) {
        Ok(scene) => panic!("accepted: {text}\nas {scene:?}"),
        Err(error) => {
            assert_eq!(error.exit_code(), 2, "{error}");
            error.to_string()
        }
    }
}

/// The smallest scene, to which tests add what they test.
const SMALLEST: &str = "[camera]\nposition = [0, 0, 0]\ntarget = [0, 0, -1]\n\
                        [sun]\ndirection = [0, 1, 0]\n";
