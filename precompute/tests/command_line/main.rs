//! The command line of precompute: what it writes, says and refuses.

mod bake;
mod hostile;
mod plot;
mod resume;
mod sample;
mod verify;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Tables small enough for a test.
const SMALL: &[&str] = &[
    "--shapes=soft-9,pyroclastic-9",
    "--disc=8",
    "--direction=4",
    "--rays=4",
    "--phase=hg:0.5",
    "--albedo=0.9",
    "--scattering=2,4,4,4",
    "--optical-radius=0.5,2",
    "--remainder=0.01",
];

/// The tables that are built into cumuli.
fn built_in() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/default_tables.safetensors")
}

fn precompute(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_precompute")).args(arguments).output().expect("it runs")
}

fn bake(out: &Path, more: &[&str]) -> Output {
    let out = format!("--out={}", out.display());
    precompute(&[&["bake", &out], SMALL, more].concat())
}

/// The sentence on standard error of a command that ends with exit code 2.
fn refusal(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    text
}
