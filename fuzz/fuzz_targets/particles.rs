//! Lists of particles.
#![no_main]

use cumuli::scene::Scene;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(particles) = Scene::particles_from_json(text, "fuzz") {
        let scene = Scene { particles, ..Scene::default() };
        scene.validate().expect("in range");
    }
});
