//! The radix sort against the standard library's stable sort, pair for pair.

use cumuli::frame::cpu;
use cumuli::frame::scan::ScanPass;
use cumuli::frame::sort::SortPass;

use crate::common::{Random, gpu, library, submit};

fn sorted_on_device(pairs: &[(u32, u32)]) -> Vec<(u32, u32)> {
    let scan = ScanPass::new(gpu(), library()).expect("the scan");
    let sort = SortPass::new(gpu(), library()).expect("the sort");
    let job = sort.job(gpu(), &scan, pairs.len() as u32);
    let (keys, values): (Vec<u32>, Vec<u32>) = pairs.iter().copied().unzip();
    gpu().queue.write_buffer(&job.keys, 0, bytemuck::cast_slice(&keys));
    gpu().queue.write_buffer(&job.values, 0, bytemuck::cast_slice(&values));
    submit(|pass| sort.encode(pass, &scan, &job));
    let keys = gpu().read_buffer::<u32>(&job.keys, pairs.len()).expect("keys");
    let values = gpu().read_buffer::<u32>(&job.values, pairs.len()).expect("values");
    keys.into_iter().zip(values).collect()
}

fn check(name: &str, keys: &[u32]) {
    // Values tell equal keys apart: any that change places are seen.
    let pairs: Vec<(u32, u32)> = keys.iter().copied().zip(0..).collect();
    let mut twin = pairs.clone();
    cpu::sort::sort(&mut twin);
    assert!(sorted_on_device(&pairs) == twin, "{name}, {} pairs", pairs.len());
}

#[test]
fn every_size_and_every_kind_of_keys() {
    let mut random = Random(30);
    // Around one workgroup's block of 512, and enough blocks for several runs of the scan.
    for length in [0, 1, 2, 7, 8, 9, 511, 512, 513, 1025, 10_000] {
        let any: Vec<u32> = (0..length).map(|_| random.bits() as u32).collect();
        check("any keys", &any);
        let few: Vec<u32> = any.iter().map(|k| k % 5 * 0x1111_1111).collect();
        check("many ties", &few);
        check("one key", &vec![0x8000_0001; length]);
        check("all unused", &vec![u32::MAX; length]);
        let mut falling = any.clone();
        falling.sort_by_key(|k| std::cmp::Reverse(*k));
        check("falling", &falling);
        // The digits that a round looks at are the same everywhere but in one round.
        for shift in [0, 12, 28] {
            let digit: Vec<u32> = any.iter().map(|k| (k & 15) << shift).collect();
            check("one digit", &digit);
        }
    }
}
