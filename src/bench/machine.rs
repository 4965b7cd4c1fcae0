//! What a bench ran on.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, SystemTime};

use super::record::Machine;
use crate::gpu::Gpu;

/// What cannot be found out.
const UNKNOWN: &str = "unknown";

impl Machine {
    /// This machine with this device.
    pub fn of(gpu: &Gpu) -> Self {
        let adapter = gpu.adapter.get_info();
        Self {
            cpu: processor().unwrap_or_else(|| UNKNOWN.to_owned()),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            adapter: adapter.name,
            kind: format!("{:?}", adapter.device_type),
            backend: adapter.backend.to_string(),
            driver: format!("{} {}", adapter.driver, adapter.driver_info).trim().to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: commit().unwrap_or_else(|| UNKNOWN.to_owned()),
            build: if cfg!(debug_assertions) { "debug" } else { "release" }.to_owned(),
        }
    }
}

/// Name of the processor: Linux and Windows tell it without asking the hardware.
fn processor() -> Option<String> {
    let listed = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        line.split_once(':').map(|(_, name)| name.trim().to_owned())
    });
    listed.or_else(|| std::env::var("PROCESSOR_IDENTIFIER").ok())
}

/// The commit of this build: what the builder said in `CUMULI_COMMIT`, or what git says of the
/// source tree, if that is still there.
fn commit() -> Option<String> {
    if let Some(commit) = option_env!("CUMULI_COMMIT") {
        return Some(commit.to_owned());
    }
    let built = std::env::current_exe().ok()?.metadata().ok()?.modified().ok()?;
    commit_of(Path::new(env!("CARGO_MANIFEST_DIR")), built)
}

/// What git says of a source tree. A tree that has gone on since the program was built does not tell which commit
/// that was.
fn commit_of(tree: &Path, built: SystemTime) -> Option<String> {
    // Without one of its own, git would take that of a folder above.
    if !tree.join(".git").exists() {
        return None;
    }
    let described = git(tree, &["describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"])?;
    let seconds = git(tree, &["log", "-1", "--format=%ct"])?.parse().ok()?;
    let committed = SystemTime::UNIX_EPOCH + Duration::from_secs(seconds);
    Some(if built < committed { format!("before-{described}") } else { described })
}

fn git(tree: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").current_dir(tree).args(arguments).output().ok();
    let text = String::from_utf8(output.filter(|o| o.status.success())?.stdout).ok()?;
    Some(text.trim().to_owned()).filter(|text| !text.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_says_something() {
        let gpu = Gpu::headless().expect("an adapter");
        let machine = Machine::of(&gpu);
        let fields = [
            &machine.cpu,
            &machine.system,
            &machine.adapter,
            &machine.kind,
            &machine.backend,
            &machine.version,
            &machine.commit,
        ];
        assert!(fields.iter().all(|f| !f.is_empty()), "{machine:?}");
        assert!(machine.threads >= 1);
    }

    #[test]
    fn a_commit_is_told_that_the_program_may_be_of() {
        let folder = tempfile::tempdir().expect("a folder");
        let tree = folder.path();
        let run = |arguments: &[&str]| {
            let author = ["-c", "user.name=nobody", "-c", "user.email=nobody@example.org"];
            git(tree, &[&author[..], arguments].concat())
        };
        let now = SystemTime::now();
        assert_eq!(commit_of(tree, now), None, "a folder without a tree of its own");
        run(&["init"]).expect("git");
        assert_eq!(commit_of(tree, now), None, "a tree without a commit");
        let file = tree.join("file");
        std::fs::write(&file, "first").expect("a file");
        run(&["add", "file"]);
        run(&["-c", "commit.gpgsign=false", "commit", "-m", "first"]).expect("a commit");
        let hash = run(&["rev-parse", "--short=12", "HEAD"]).expect("its hash");
        let later = SystemTime::now() + Duration::from_secs(1);
        let earlier = now - Duration::from_secs(3600);
        assert_eq!(commit_of(tree, later), Some(hash.clone()));
        assert_eq!(commit_of(tree, earlier), Some(format!("before-{hash}")));
        std::fs::write(&file, "second, and longer").expect("a file");
        assert_eq!(commit_of(tree, later), Some(format!("{hash}-dirty")));
    }
}
