//! Ray files.
#![no_main]

use cumuli::tables::rays;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(rays) = rays::parse(bytes, "fuzz") {
        assert!(rays.iter().all(|r| (r.dir.length() - 1.0).abs() < 1e-9));
    }
});
