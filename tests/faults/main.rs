//! Nothing lost: runs that are killed at random moments, full disks, lost devices. Whatever lies on
//! disk afterwards is whole, and starting again ends with the same bytes.
#![cfg(unix)]

mod device;
mod disk;
mod killed;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// A scene that takes little, with a cloud in it.
const SCENE: &str = r#"
[camera]
position = [0.0, 0.0, 500.0]
target = [0.0, 0.0, 0.0]
[sun]
direction = [1.0, 1.0, 1.0]
[sky]
kind = "uniform"
radiance = 0.05
[[particles]]
centre = [0.0, 0.0, 0.0]
radius = 100.0
extinction = 0.02
"#;

/// A folder with the scene in it, in which the program runs.
struct Place {
    dir: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let place = Self { dir: tempfile::tempdir().expect("a temporary folder") };
        std::fs::write(place.path("scene.toml"), SCENE).expect("written");
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn names(&self, below: &str) -> Vec<String> {
        names(&self.path(below))
    }

    /// The program with arguments separated by spaces, quiet.
    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cumuli"));
        command.args(arguments.split_whitespace());
        self.quiet(command)
    }

    /// The program, started by a shell that says something first.
    fn after(&self, shell: &str, arguments: &str) -> Output {
        let program = env!("CARGO_BIN_EXE_cumuli");
        let mut command = Command::new("bash");
        command.args(["-c", &format!("{shell}; exec {program} {arguments}")]);
        self.quiet(command).stderr(Stdio::piped()).output().expect("bash")
    }

    fn quiet(&self, mut command: Command) -> Command {
        command.current_dir(self.dir.path()).env("RUST_LOG", "off");
        command.env("XDG_RUNTIME_DIR", self.dir.path());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }

    #[track_caller]
    fn works(&self, arguments: &str) {
        let status = self.command(arguments).status().expect("the program starts");
        assert!(status.success(), "{arguments}: {status}");
    }
}

/// Names in a folder, sorted; none where there is no folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut names: Vec<_> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// What the program said, in one sentence, and its exit code.
#[track_caller]
fn sentence(output: &Output) -> (Option<i32>, String) {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.contains("panicked"), "{text}");
    let last = text.lines().last().unwrap_or_default().to_owned();
    assert!(last.starts_with("cumuli: "), "{text}");
    (output.status.code(), last)
}
