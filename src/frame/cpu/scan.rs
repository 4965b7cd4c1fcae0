//! Twin of `shaders/frame/scan.wgsl`.

/// Sum of the counts before each one, and the sum of all behind the last.
pub fn scan(counts: &[u32]) -> Vec<u32> {
    let mut sum = 0_u32;
    let mut offsets = vec![0];
    offsets.extend(counts.iter().map(|count| {
        sum = sum.wrapping_add(*count);
        sum
    }));
    offsets
}
