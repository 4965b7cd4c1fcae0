//! Scene files. What is read is in range, and can be written and read again.
#![no_main]

use std::path::Path;

use cumuli::scene::Scene;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(scene) = Scene::from_toml(text, "fuzz", Path::new("/nonexistent")) {
        scene.validate().expect("in range");
        let written = scene.to_toml().expect("written");
        let again = Scene::from_toml(&written, "fuzz", Path::new("/nonexistent"));
        assert_eq!(again.expect("read again"), scene);
    }
});
