//! Pipelines of earlier runs, where the adapter can tell and take them (Vulkan).
//!
//! Like every cache this only saves time: what is missing, damaged, of another driver or cannot be written
//! costs the compilation, and nothing else.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::Gpu;
use crate::output::write_atomically;

/// A larger file is not ours, bytes: pipelines of this program take some MB with any driver.
const MOST_BYTES: u64 = 64 << 20;

/// A cache on the device, and its file.
#[derive(Clone, Debug)]
pub(super) struct Pipelines {
    cache: wgpu::PipelineCache,
    path: PathBuf,
    /// What the file holds.
    kept: Arc<Mutex<Vec<u8>>>,
}

impl Pipelines {
    /// Of the adapter's own file in a folder; none where the device has no such cache.
    pub fn open(gpu: &Gpu, folder: &Path) -> Option<Self> {
        if !gpu.device.features().contains(wgpu::Features::PIPELINE_CACHE) {
            return None;
        }
        let path = folder.join(wgpu::util::pipeline_cache_key(&gpu.adapter.get_info())?);
        let kept = read(&path);
        let cache = pipeline_cache::open(&gpu.device, &kept);
        tracing::debug!("{} bytes of pipelines in {}", kept.len(), path.display());
        Some(Self { cache, path, kept: Arc::new(Mutex::new(kept)) })
    }

    /// What pipelines are made with.
    pub fn cache(&self) -> &wgpu::PipelineCache {
        &self.cache
    }

    /// Writes the file where there is something new.
    pub fn keep(&self) {
        let Some(now) = pipeline_cache::sealed(&self.cache) else { return };
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if *kept == now {
            return;
        }
        match write_atomically(&self.path, |out| out.write_all(&now)) {
            Ok(()) => *kept = now,
            Err(e) => tracing::warn!("pipelines were not kept for the next run: {e}"),
        }
    }
}

/// What a file holds; nothing where it cannot be read or is too large.
fn read(path: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    let whole = std::fs::File::open(path)
        .and_then(|file| file.take(MOST_BYTES + 1).read_to_end(&mut bytes))
        .is_ok_and(|length| length as u64 <= MOST_BYTES);
    if whole { bytes } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{Kernel, ShaderLibrary};
    use crate::shader_file;

    /// Compiles something on a new device that keeps its pipelines in a folder; the bytes kept then.
    fn compile_in(folder: &Path) -> Option<Vec<u8>> {
        let gpu = Gpu::headless().expect("an adapter").keeping_pipelines(folder);
        gpu.pipelines()?;
        let library = ShaderLibrary::new().expect("modules");
        let file = shader_file!("frame/tonemap.wgsl");
        Kernel::new(&gpu, &library, file, &[], &[]).expect("a kernel");
        gpu.keep_pipelines();
        gpu.wait().expect("nothing is refused");
        let key = wgpu::util::pipeline_cache_key(&gpu.adapter.get_info()).expect("a name");
        Some(read(&folder.join(key)))
    }

    #[test]
    fn what_is_no_whole_file_of_pipelines_is_replaced() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let Some(first) = compile_in(dir.path()) else {
            println!("skipped: this adapter has no pipeline cache");
            return;
        };
        assert!(!first.is_empty(), "something is kept");
        assert_eq!(compile_in(dir.path()).as_ref(), Some(&first), "nothing new");
        let file = std::fs::read_dir(dir.path()).expect("readable").next().expect("a file");
        let path = file.expect("an entry").path();
        let written = || std::fs::metadata(&path).and_then(|m| m.modified()).expect("a time");
        let before = written();
        compile_in(dir.path());
        assert_eq!(written(), before, "what is known is not written again");
        let mut damaged = first.clone();
        let last = damaged.len() - 1;
        damaged[last] ^= 1;
        for other in [damaged, first[..last].to_vec(), b"of another program".to_vec(), Vec::new()] {
            std::fs::write(&path, other).expect("written");
            assert_eq!(compile_in(dir.path()).as_ref(), Some(&first));
        }
    }

    #[test]
    fn it_goes_on_without_a_folder_to_write_to() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let file = dir.path().join("file");
        std::fs::write(&file, "no folder").expect("written");
        if let Some(kept) = compile_in(&file) {
            assert!(kept.is_empty());
        }
    }
}
