//! The program as people type it: exit codes, messages, and what lies on disk afterwards.

mod arguments;
mod benches;
mod comparisons;
mod pictures;
mod references;
mod sequences;
mod tables;
#[cfg(unix)]
mod videos;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// One particle under a uniform sky: the cheapest scene with a cloud in it.
const SMALL: &str = r#"
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

/// A folder of a test with the small scene in it, in which the program runs.
struct Place {
    dir: tempfile::TempDir,
}

/// What a run of the program came to.
#[derive(Debug)]
struct Run {
    code: Option<i32>,
    out: String,
    err: String,
}

impl Place {
    fn new() -> Self {
        let place = Self { dir: tempfile::tempdir().expect("a temporary folder") };
        place.write("small.toml", SMALL);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Everything in the folder, or in one below it, sorted.
    fn names(&self, below: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path(below)).expect("a folder");
        let mut names: Vec<_> = entries
            .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    /// The program, in this folder, with arguments separated by spaces.
    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cumuli"));
        command.current_dir(self.dir.path()).args(arguments.split_whitespace());
        // What the log says is nobody's promise.
        command.env("RUST_LOG", "off").stdin(Stdio::null());
        // Without it a layer of Mesa's complains.
        command.env("XDG_RUNTIME_DIR", self.dir.path());
        command
    }

    fn run(&self, arguments: &str) -> Run {
        Run::of(self.command(arguments).output().expect("the program starts"))
    }

    /// Runs what must work.
    #[track_caller]
    fn works(&self, arguments: &str) -> Run {
        let run = self.run(arguments);
        assert_eq!(run.code, Some(0), "{arguments}: {}", run.err);
        run
    }

    /// Runs what must be refused as bad input, in one sentence, with nothing left on disk.
    #[track_caller]
    fn refuses(&self, arguments: &str) -> String {
        let before = self.names("");
        let run = self.run(arguments);
        assert_eq!(run.code, Some(2), "{arguments}: {}", run.err);
        assert_eq!(run.out, "", "{arguments}");
        assert_eq!(self.names(""), before, "{arguments} left something behind");
        assert!(!run.err.contains("panicked"), "{arguments}: {}", run.err);
        run.err
    }
}

impl Run {
    fn of(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        Self { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }
}

/// One sentence on one line, from the program.
#[track_caller]
fn assert_sentence(message: &str, parts: &[&str]) {
    assert!(message.starts_with("cumuli: "), "{message}");
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    for part in parts {
        assert!(message.contains(part), "{message} lacks {part}");
    }
}

/// The pixels of a PNG.
fn pixels(path: &Path) -> image::RgbImage {
    image::open(path).expect("a PNG").into_rgb8()
}
