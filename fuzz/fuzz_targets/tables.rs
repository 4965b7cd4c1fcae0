//! Table files.
#![no_main]

use cumuli::tables::TableSet;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(tables) = TableSet::from_bytes(bytes, "fuzz") {
        assert!(tables.shape_names().next() == Some("uniform"));
    }
});
