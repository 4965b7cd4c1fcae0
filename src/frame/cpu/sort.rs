//! Twin of `shaders/frame/sort.wgsl`.

/// Pairs of key and value by rising key; equal keys keep their order.
pub fn sort(pairs: &mut [(u32, u32)]) {
    pairs.sort_by_key(|(key, _)| *key);
}
