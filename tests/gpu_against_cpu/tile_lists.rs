//! Lists per tile against plain loops over rectangles, entry for entry.

use cumuli::frame::cpu;
use cumuli::frame::scan::ScanPass;
use cumuli::frame::tile_lists::{LENGTHS, ListInputs, ListSize, TileListPass, TileLists};
use cumuli::gpu::buffers;

use crate::common::{Random, gpu, library, submit};

/// Particles of a picture in an order, some of them beyond the sorted ones.
struct Case {
    tiles: [u32; 2],
    order: Vec<u32>,
    rectangles: Vec<[u32; 2]>,
}

impl Case {
    fn new(tiles: [u32; 2], particles: u32, widest: u64, random: &mut Random) -> Self {
        let mut order: Vec<u32> = (0..particles).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, random.bits() as usize % (i + 1));
        }
        let rectangles = (0..particles)
            .map(|i| {
                let mut side = |tiles: u32| {
                    let first = random.bits() % u64::from(tiles);
                    let past = first + 1 + random.bits() % widest;
                    [first as u32, past.min(u64::from(tiles)) as u32]
                };
                let (x, y) = (side(tiles[0]), side(tiles[1]));
                // Every ninth is out of the picture.
                if i % 9 == 0 { [0, 0] } else { [x[0] | y[0] << 16, x[1] | y[1] << 16] }
            })
            .collect();
        Self { tiles, order, rectangles }
    }

    fn run(&self, sorted: u32, bin_entries: u32, tile_entries: u32) -> TileLists {
        let scan = ScanPass::new(gpu(), library()).expect("the scan");
        let pass = TileListPass::new(gpu(), library()).expect("the lists");
        let inputs = ListInputs {
            // The number stands in the third word here.
            lengths: &buffers::storage_with(gpu(), "lengths", &[u32::MAX, 0, sorted]),
            length_index: 2,
            order: &buffers::storage_with(gpu(), "order", &self.order),
            rectangles: &buffers::storage_with(gpu(), "rectangles", &self.rectangles),
            limits: None,
        };
        let particles = self.order.len() as u32;
        let size = ListSize { tiles: self.tiles, particles, bin_entries, tile_entries };
        let lists = pass.lists(gpu(), &scan, size, &inputs);
        // What is written where nothing belongs shows.
        let marks = vec![UNTOUCHED; tile_entries as usize];
        gpu().queue.write_buffer(&lists.tile_entries, 0, bytemuck::cast_slice(&marks));
        submit(|compute| pass.encode(compute, &scan, &lists));
        lists
    }
}

const UNTOUCHED: u32 = 0xabad_cafe;

fn words(buffer: &wgpu::Buffer, count: u64) -> Vec<u32> {
    gpu().read_buffer(buffer, count as usize).expect("words")
}

fn check(case: &Case, sorted: u32) {
    let twin = cpu::tile_lists::lists(case.tiles, &case.order[..sorted as usize], &case.rectangles);
    let total: usize = twin.iter().map(Vec::len).sum();
    let lists = case.run(sorted, 1 << 18, total as u32 + 5);
    let mut offsets = words(&lists.tile_offsets, lists.tile_total_index() + 1 + LENGTHS);
    let longest = offsets.split_off(offsets.len() - LENGTHS as usize);
    assert_eq!(longest[0] as usize, twin.iter().map(Vec::len).max().unwrap_or(0));
    assert!(longest[1] >= longest[0] && longest[1] <= sorted, "{longest:?}");
    let entries = words(&lists.tile_entries, total as u64 + 5);
    for (tile, expected) in twin.iter().enumerate() {
        let found = &entries[offsets[tile] as usize..offsets[tile + 1] as usize];
        assert_eq!(found, expected, "tile {tile} of {:?}, {sorted} particles", case.tiles);
    }
    assert_eq!(offsets[offsets.len() - 1] as usize, total);
    assert_eq!(entries[total..], [UNTOUCHED; 5]);
}

#[test]
fn tiles_list_the_rectangles_that_touch_them_in_order() {
    let mut random = Random(60);
    // One tile; one bin exactly; just over one bin; the screen of a small picture; many chunks.
    for (tiles, particles, widest) in [
        ([1, 1], 10, 1),
        ([8, 8], 255, 8),
        ([9, 17], 257, 5),
        ([26, 15], 1000, 4),
        ([80, 45], 3000, 9),
        ([3, 200], 513, 200),
    ] {
        let case = Case::new(tiles, particles, widest, &mut random);
        for sorted in [particles, particles / 2, 1, 0] {
            check(&case, sorted);
        }
    }
}

#[test]
fn many_bins_get_long_chunks() {
    // Pictures of 8192 x 8192 pixels: 16384 bins. With chunks of 256 these particles would need more workgroups
    // than can be dispatched, and more turns of the scan's loops than some drivers take.
    check(&Case::new([1024, 1024], 70_000, 3, &mut Random(62)), 70_000);
}

#[test]
fn bins_may_hold_more_than_a_driver_takes_turns() {
    // Of 150,000 particles 133,000 are in the one bin.
    check(&Case::new([8, 8], 150_000, 2, &mut Random(63)), 150_000);
}

/// Entries of all bins of 8 x 8 tiles.
fn bin_entries(case: &Case) -> usize {
    let bins = case.tiles.map(|t| t.div_ceil(8));
    let coarse: Vec<[u32; 2]> = case
        .rectangles
        .iter()
        .map(|[first, past]| {
            let (x, y) = (first & 0xffff, first >> 16);
            let (past_x, past_y) = ((past & 0xffff).div_ceil(8), (past >> 16).div_ceil(8));
            [(x / 8) | (y / 8) << 16, past_x | past_y << 16]
        })
        .collect();
    cpu::tile_lists::lists(bins, &case.order, &coarse).iter().map(Vec::len).sum()
}

#[test]
fn too_little_room_is_reported_and_kept_to() {
    let case = Case::new([26, 15], 1000, 6, &mut Random(61));
    let sorted = case.order.len() as u32;
    let twin = cpu::tile_lists::lists(case.tiles, &case.order, &case.rectangles);
    let flat: Vec<u32> = twin.concat();
    let (bins, total) = (bin_entries(&case), flat.len());

    // Tiles: what fits is right and the wish is known. The buffer has no slack: devices drop what is
    // written behind it or put it in the last place, where it would be seen.
    let room = total as u32 / 2;
    let lists = case.run(sorted, bins as u32, room);
    let wanted = words(&lists.tile_offsets, lists.tile_total_index() + 1);
    assert_eq!(wanted[wanted.len() - 1] as usize, total);
    assert_eq!(words(&lists.tile_entries, room.into()), flat[..room as usize]);
    let wanted = words(&lists.bin_offsets, lists.bin_total_index() + 1);
    assert_eq!(wanted[wanted.len() - 1] as usize, bins);

    // Bins: the wish is known too; the lists of tiles lose entries but gain none.
    let lists = case.run(sorted, bins as u32 / 3, total as u32);
    let wanted = words(&lists.bin_offsets, lists.bin_total_index() + 1);
    assert_eq!(wanted[wanted.len() - 1] as usize, bins, "what a cut list reports");
    let offsets = words(&lists.tile_offsets, lists.tile_total_index() + 1);
    let entries = words(&lists.tile_entries, total as u64);
    for (tile, whole) in twin.iter().enumerate() {
        let found = &entries[offsets[tile] as usize..offsets[tile + 1] as usize];
        let mut rest = whole.iter();
        assert!(found.iter().all(|f| rest.any(|w| w == f)), "tile {tile}: {found:?} of {whole:?}");
    }
    assert!(entries[offsets[offsets.len() - 1] as usize..].iter().all(|w| *w == UNTOUCHED));
}
