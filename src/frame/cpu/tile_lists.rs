//! Twin of `shaders/frame/tile_lists.wgsl`.

/// For each tile, row by row, the particles whose rectangle contains it, in the order given. A
/// rectangle is its first tile and one past its last, x in the low half of the word.
pub fn lists(tiles: [u32; 2], order: &[u32], rectangles: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let mut lists = vec![Vec::new(); tiles[0] as usize * tiles[1] as usize];
    for &particle in order {
        let [first, past] = rectangles[particle as usize].map(|w| [w & 0xffff, w >> 16]);
        for y in first[1]..past[1].min(tiles[1]) {
            for x in first[0]..past[0].min(tiles[0]) {
                lists[(y * tiles[0] + x) as usize].push(particle);
            }
        }
    }
    lists
}
