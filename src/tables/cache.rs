//! Scattering tables of media that the program does not bring, kept from run to run.
//!
//! They lie in the user's cache folder, one table file each, under a name made from everything
//! that decides the values. A file that is damaged, or does not hold what its name says, is baked
//! anew. The cache only saves time: where it cannot be read or written, things go on without it.

use std::path::Path;

use super::TableSet;
use super::description::{FORMAT, SCATTERING_VERSION};
use super::fingerprint::Fingerprint;
use super::optical_depth::OpticalDepthOptions;
use super::progress::Progress;
use super::scattering::{ScatteringOptions, ScatteringTable};
use crate::error::Result;
use crate::medium::Phase;
use crate::output::cache_folder;

/// The table of a medium from the cache, or baked and put there.
pub(super) fn scattering(
    phase: &Phase,
    albedo: f64,
    progress: &dyn Progress,
) -> Result<ScatteringTable> {
    let options = ScatteringOptions::default();
    scattering_in(cache_folder().as_deref(), phase, albedo, &options, progress)
}

fn scattering_in(
    folder: Option<&Path>,
    phase: &Phase,
    albedo: f64,
    options: &ScatteringOptions,
    progress: &dyn Progress,
) -> Result<ScatteringTable> {
    let path = folder.map(|folder| folder.join(file_name(phase, albedo, options)));
    if let Some(table) = path.as_deref().and_then(|path| cached(path, phase, albedo, options)) {
        return Ok(table);
    }
    let table = ScatteringTable::bake(*phase, albedo, options, progress)?;
    if let Some(path) = path {
        let set = TableSet::new(Vec::new(), OpticalDepthOptions::default(), vec![table.clone()])?;
        if let Err(e) = set.save(&path) {
            tracing::warn!("the table was not kept for the next run: {e}");
        }
    }
    Ok(table)
}

/// The table in a file, if there is a sound one of exactly this kind.
fn cached(
    path: &Path,
    phase: &Phase,
    albedo: f64,
    options: &ScatteringOptions,
) -> Option<ScatteringTable> {
    if !path.exists() {
        return None;
    }
    let set = match TableSet::load(path) {
        Ok(set) => set,
        Err(e) => {
            tracing::warn!("baked anew: {e}");
            return None;
        }
    };
    let table = set.scattering_for(phase, albedo)?;
    let fits = table.resolution() == options.resolution
        && table.precision() == options.precision
        && table.optical_radius_range() == options.optical_radius;
    fits.then(|| table.clone())
}

/// `scattering-` and a fingerprint of all that decides the values.
fn file_name(phase: &Phase, albedo: f64, options: &ScatteringOptions) -> String {
    let mut hash = Fingerprint::default();
    let text = format!("{FORMAT} {SCATTERING_VERSION} {phase} {albedo} {options:?}");
    hash.add(text.as_bytes());
    format!("scattering-{hash}.safetensors")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::Silent;
    use std::sync::atomic::{AtomicBool, Ordering};

    /// Remembers whether anything was computed.
    #[derive(Default)]
    struct Heard(AtomicBool);

    impl Progress for Heard {
        fn start(&self, _total: u64, _what: &str) {
            self.0.store(true, Ordering::Relaxed);
        }

        fn advance(&self, _steps: u64) {}
    }

    #[test]
    fn a_damaged_file_is_baked_anew() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        // The smallest table: what is tested is the cache.
        let options = ScatteringOptions {
            resolution: [2, 4, 4, 4],
            optical_radius: [0.5, 1.0],
            remainder: 1e-3,
            ..Default::default()
        };
        let phase = Phase::Hg { g: 0.5 };
        let get = || {
            let heard = Heard::default();
            let table = scattering_in(Some(dir.path()), &phase, 0.75, &options, &heard);
            (table.expect("a table"), heard.0.into_inner())
        };
        let (first, baked) = get();
        assert!(baked);
        let (second, baked) = get();
        assert!(!baked, "the second comes from the cache");
        assert_eq!(first.values(), second.values());

        let path = dir.path().join(file_name(&phase, 0.75, &options));
        let mut bytes = std::fs::read(&path).expect("the cached file");
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        std::fs::write(&path, &bytes).expect("written");
        let (third, baked) = get();
        assert!(baked, "one wrong bit is noticed");
        assert_eq!(first.values(), third.values());
        assert!(!get().1, "and mended");

        let other = scattering_in(Some(dir.path()), &phase, 0.5, &options, &Silent);
        assert_ne!(other.expect("a table").values(), first.values());
    }

    #[test]
    fn goes_on_without_a_folder_to_write_to() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let file = dir.path().join("file");
        std::fs::write(&file, "no folder").expect("written");
        let options = ScatteringOptions {
            resolution: [2, 4, 4, 4],
            optical_radius: [0.5, 1.0],
            remainder: 1e-3,
            ..Default::default()
        };
        let phase = Phase::Hg { g: 0.5 };
        assert!(scattering_in(Some(&file), &phase, 1.0, &options, &Silent).is_ok());
    }
}
