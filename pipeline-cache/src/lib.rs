//! Pipelines that a driver has compiled, as bytes to be kept from run to run.
//!
//! Handing such bytes back to a driver is the one thing in this project that the compiler cannot check:
//! a driver may take them for its own code. So the bytes are sealed here when they are taken from a
//! cache, and a file that lacks a whole seal is not handed on. The seal finds damage and files of
//! others, not forgery: whoever can write into the user's cache folder can run programs as that user.

use std::hash::{DefaultHasher, Hasher};

/// First bytes of what is kept; the digit changes with the layout.
const MAGIC: &[u8; 8] = b"cumulip1";
/// Bytes of the hash behind it.
const HASH: usize = size_of::<u64>();

/// A cache for a device with the feature [`wgpu::Features::PIPELINE_CACHE`], filled with what [`sealed`]
/// gave in an earlier run where that is whole, and was made by the same driver for the same adapter.
#[allow(unsafe_code)]
pub fn open(device: &wgpu::Device, kept: &[u8]) -> wgpu::PipelineCache {
    let descriptor = wgpu::PipelineCacheDescriptor {
        label: Some("pipelines of earlier runs"),
        data: unsealed(kept),
        // What the driver does not know any more is as good as nothing.
        fallback: true,
    };
    // SAFETY: the data must have come from `PipelineCache::get_data`. What has a whole seal was sealed by
    // `sealed`, which takes it from there and from nowhere else. wgpu itself compares the adapter, and
    // the driver its version, both of which are in the data.
    unsafe { device.create_pipeline_cache(&descriptor) }
}

/// What a cache holds, to be kept; none where the driver does not tell.
pub fn sealed(cache: &wgpu::PipelineCache) -> Option<Vec<u8>> {
    cache.get_data().map(|data| seal(&data))
}

fn seal(data: &[u8]) -> Vec<u8> {
    [&MAGIC[..], &hash(data), data].concat()
}

/// What was sealed, if it is whole.
fn unsealed(kept: &[u8]) -> Option<&[u8]> {
    let (found, data) = kept.strip_prefix(MAGIC)?.split_at_checked(HASH)?;
    (found == hash(data)).then_some(data)
}

fn hash(data: &[u8]) -> [u8; HASH] {
    let mut hasher = DefaultHasher::new();
    hasher.write(data);
    hasher.finish().to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_sealed_and_is_whole_is_handed_on() {
        let data = b"pipelines of some driver";
        let kept = seal(data);
        assert_eq!(unsealed(&kept), Some(&data[..]));
        assert_eq!(unsealed(&seal(&[])), Some(&[][..]));
        for length in 0..kept.len() {
            assert_eq!(unsealed(&kept[..length]), None, "cut to {length}");
        }
        for bit in 0..8 * kept.len() {
            let mut damaged = kept.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(unsealed(&damaged), None, "bit {bit}");
        }
        assert_eq!(unsealed(data), None, "of another program");
        assert_eq!(unsealed(&[kept, vec![0]].concat()), None, "longer");
    }
}
