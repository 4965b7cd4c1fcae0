//! Camera paths. What is read can be followed and written.
#![no_main]

use cumuli::scene::{CameraPath, Scene};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(path) = CameraPath::from_toml(text, "fuzz") {
        for share in [0.0, 0.3, 1.0] {
            let camera = path.camera(share * path.end(), &Scene::default().camera);
            assert!(camera.position.is_finite() && camera.target.is_finite());
        }
        let written = path.to_toml().expect("written");
        CameraPath::from_toml(&written, "fuzz").expect("read again");
    }
});
