//! Prefix sums against plain ones, bit for bit.

use cumuli::frame::cpu;
use cumuli::frame::scan::ScanPass;
use cumuli::gpu::buffers;

use crate::common::{Random, gpu, library, submit};

const UNTOUCHED: u32 = 0xabad_cafe;

#[test]
fn sums_are_exact_for_every_length() {
    let pass = ScanPass::new(gpu(), library()).expect("the scan");
    let mut random = Random(20);
    // Around the 256 invocations and their runs, and one of the size of a large field's columns.
    for length in [0, 1, 2, 255, 256, 257, 511, 512, 513, 1000, 10_000, 262_144, 262_145] {
        let counts: Vec<u32> = (0..length).map(|_| random.bits() as u32 % 1000).collect();
        let input = buffers::storage_with(gpu(), "counts", &counts);
        // Two words behind the total show whether anything is written there.
        let marks = vec![UNTOUCHED; length + 3];
        let output = buffers::storage_with(gpu(), "offsets", &marks);
        let job = pass.job(gpu(), &input, &output, length as u32);
        submit(|compute| pass.encode(compute, &job));
        let offsets: Vec<u32> = gpu().read_buffer(&output, length + 3).expect("offsets");
        assert_eq!(offsets[..=length], cpu::scan::scan(&counts), "{length} counts");
        assert_eq!(offsets[length + 1..], [UNTOUCHED; 2], "{length} counts");
    }
}
