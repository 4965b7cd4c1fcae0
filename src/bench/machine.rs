//! What a bench ran on.

use std::path::Path;
use std::process::Command;

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
    let tree = Path::new(env!("CARGO_MANIFEST_DIR"));
    // Without one of its own, git would take that of a folder above.
    if !tree.join(".git").exists() {
        return None;
    }
    let mut git = Command::new("git");
    git.current_dir(tree).args(["describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]);
    let output = git.output().ok().filter(|output| output.status.success())?;
    let text = String::from_utf8(output.stdout).ok()?;
    Some(text.trim().to_owned()).filter(|commit| !commit.is_empty())
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
}
