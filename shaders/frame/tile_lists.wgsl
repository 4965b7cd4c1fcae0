// Tile lists: for each tile of a picture (the screen's, the sun's) the particles
// that touch it, in sorted order, but for those behind all that is opaque in it (LIMITED). Two levels: bins of 8x8 tiles
// first, so that a tile walks its bin's list and not all particles. Twin: src/frame/cpu/tile_lists.rs.
//
// Workgroup contract: one invocation owns one (run of bins in a row, chunk of sorted particles) in the bin
// passes, one tile in the tile passes. Each level counts, is scanned, then writes: the order in a
// list is the sorted order whatever the timing, and nothing is written beyond the capacity.

struct ListUniforms {
    tiles: vec2<u32>,
    bins: vec2<u32>,
    chunks: u32,         // of `chunk` sorted particles
    bin_capacity: u32,   // entries in bin_entries
    tile_capacity: u32,  // entries in tile_entries
    length_index: u32,   // word of `lengths` that holds the number of sorted particles
    chunk: u32,          // sorted particles that one invocation tests against a bin
    padding_a: u32,
}

@group(0) @binding(0) var<uniform> params: ListUniforms;
@group(0) @binding(1) var<storage, read> lengths: array<u32>;
@group(0) @binding(2) var<storage, read> order: array<u32>;
@group(0) @binding(3) var<storage, read> rectangles: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
@group(0) @binding(5) var<storage, read> bin_offsets: array<u32>;
@group(0) @binding(6) var<storage, read_write> bin_entries: array<u32>;
@group(0) @binding(7) var<storage, read_write> tile_entries: array<u32>;
#ifdef LIMITED
@group(0) @binding(8) var<storage, read> nearest: array<u32>; // keys of particles, as the limits'
@group(0) @binding(9) var tile_limits: texture_2d<u32>;       // keys beyond which a tile lists nothing
@group(0) @binding(10) var bin_limits: texture_2d<u32>;
#endif

const BIN: u32 = 8u; // tiles a side
const NO_LIMIT: u32 = 0xffffffffu;

fn touches(rectangle: vec2<u32>, first: vec2<u32>, last: vec2<u32>) -> bool {
    let low = vec2(rectangle.x & 0xffffu, rectangle.x >> 16u);
    let high = vec2(rectangle.y & 0xffffu, rectangle.y >> 16u);
    return all(low < last) && all(high > first);
}

fn limit_of_tile(tile: vec2<u32>) -> u32 {
#ifdef LIMITED
    return textureLoad(tile_limits, tile, 0).r;
#else
    return NO_LIMIT;
#endif
}

fn limit_of_bin(bin: vec2<u32>) -> u32 {
#ifdef LIMITED
    return textureLoad(bin_limits, bin, 0).r;
#else
    return NO_LIMIT;
#endif
}

fn is_before(particle: u32, limit: u32) -> bool {
#ifdef LIMITED
    return nearest[particle] <= limit;
#else
    return true;
#endif
}

// Bins that one invocation of the bin passes owns, beside each other in a row: a particle is read once for all of them.
const BIN_RUN: u32 = 8u;

// A run of bins and a chunk of the sorted particles.
struct BinRun {
    first: vec2<u32>, // bin
    bins: u32,        // that there are of it
    begin: u32,       // sorted particles
    end: u32,
    counts: u32,      // place of its first bin's count; the next bin's is `params.chunks` further
    limits: array<vec4<u32>, 2>,
}

fn runs_of_bins() -> u32 {
    return (params.bins.x + BIN_RUN - 1u) / BIN_RUN;
}

fn is_a_run(index: u32) -> bool {
    return index < runs_of_bins() * params.bins.y * params.chunks;
}

// Neighbours have other bins and the same chunk, so that they read the same particles at a time.
fn bin_run(index: u32) -> BinRun {
    let runs = runs_of_bins();
    let place = index % (runs * params.bins.y);
    let chunk = index / (runs * params.bins.y);
    var run: BinRun;
    run.first = vec2((place % runs) * BIN_RUN, place / runs);
    run.bins = min(BIN_RUN, params.bins.x - run.first.x);
    run.begin = chunk * params.chunk;
    run.end = min(run.begin + params.chunk, lengths[params.length_index]);
    run.counts = (run.first.y * params.bins.x + run.first.x) * params.chunks + chunk;
    for (var i = 0u; i < BIN_RUN; i++) {
        run.limits[i / 4u][i % 4u] = limit_of_bin(run.first + vec2(i, 0u));
    }
    return run;
}

const BITS: vec4<u32> = vec4(1u, 2u, 4u, 8u);

// Which of a run's bins a particle is in, a bit each.
fn bins_of(rectangle: vec2<u32>, particle: u32, run: ptr<function, BinRun>) -> u32 {
    let low = vec2(rectangle.x & 0xffffu, rectangle.x >> 16u);
    let high = vec2(rectangle.y & 0xffffu, rectangle.y >> 16u);
    let first = (*run).first;
    let begin = min(max(low.x / BIN, first.x) - first.x, BIN_RUN);
    let end = min(max((high.x + BIN - 1u) / BIN, first.x) - first.x, (*run).bins);
    let is_in_row = low.y < (first.y + 1u) * BIN && high.y > first.y * BIN;
    let bits = select(0u, ((1u << end) - 1u) & ~((1u << begin) - 1u), is_in_row);
#ifdef LIMITED
    let nearest_of_it = vec4(nearest[particle]);
    let before = select(vec4(0u), BITS, nearest_of_it <= (*run).limits[0]) | select(vec4(0u), BITS << vec4(4u), nearest_of_it <= (*run).limits[1]);
    return bits & (before.x | before.y | before.z | before.w);
#else
    return bits;
#endif
}

@compute @workgroup_size(64)
fn count_bins(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_a_run(id.x) {
        return;
    }
    var run = bin_run(id.x);
    var found: array<vec4<u32>, 2>;
    for (var i = run.begin; i < run.end; i++) {
        let particle = order[i];
        let bits = vec4(bins_of(rectangles[particle], particle, &run));
        found[0] += min(bits & BITS, vec4(1u));
        found[1] += min((bits >> vec4(4u)) & BITS, vec4(1u));
    }
    for (var i = 0u; i < run.bins; i++) {
        counts[run.counts + i * params.chunks] = found[i / 4u][i % 4u];
    }
}

@compute @workgroup_size(64)
fn write_bins(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_a_run(id.x) {
        return;
    }
    var run = bin_run(id.x);
    var slots: array<u32, BIN_RUN>;
    for (var i = 0u; i < run.bins; i++) {
        slots[i] = bin_offsets[run.counts + i * params.chunks];
    }
    for (var i = run.begin; i < run.end; i++) {
        let particle = order[i];
        var bits = bins_of(rectangles[particle], particle, &run);
        while bits != 0u {
            let bin = firstTrailingBit(bits);
            bits &= bits - 1u;
            if slots[bin] < params.bin_capacity {
                bin_entries[slots[bin]] = particle;
            }
            slots[bin]++;
        }
    }
}

struct BinList {
    begin: u32,
    end: u32,
}

fn bin_list(tile: vec2<u32>) -> BinList {
    let bin = (tile.y / BIN) * params.bins.x + tile.x / BIN;
    var list: BinList;
    list.begin = min(bin_offsets[bin * params.chunks], params.bin_capacity);
    list.end = min(bin_offsets[(bin + 1u) * params.chunks], params.bin_capacity);
    return list;
}

// Entries that a tile looks at in a turn of its loop, one after the other: some drivers end loops after a
// number of turns that the bins of a million particles pass (MOST_TURNS in src/frame/tile_lists.rs).
const TURN_ENTRIES: u32 = 16u;

// Whether a particle is in a tile's list.
fn is_in(particle: u32, tile: vec2<u32>, limit: u32) -> bool {
    return touches(rectangles[particle], tile, tile + 1u) && is_before(particle, limit);
}

// 1 where the bin's entry at this place, before its end, is in the tile's list.
fn hit(at: u32, end: u32, tile: vec2<u32>, limit: u32) -> u32 {
    if at >= end {
        return 0u;
    }
    return select(0u, 1u, is_in(bin_entries[at], tile, limit));
}

// Four of them.
fn hits(at: u32, end: u32, tile: vec2<u32>, limit: u32) -> u32 {
    return hit(at, end, tile, limit) + hit(at + 1u, end, tile, limit) + hit(at + 2u, end, tile, limit) + hit(at + 3u, end, tile, limit);
}

@compute @workgroup_size(8, 8)
fn count_tiles(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.tiles) {
        return;
    }
    let list = bin_list(id.xy);
    let limit = limit_of_tile(id.xy);
    var found = 0u;
    for (var i = list.begin; i < list.end; i += TURN_ENTRIES) {
        found += hits(i, list.end, id.xy, limit) + hits(i + 4u, list.end, id.xy, limit);
        found += hits(i + 8u, list.end, id.xy, limit) + hits(i + 12u, list.end, id.xy, limit);
    }
    counts[id.y * params.tiles.x + id.x] = found;
}

// Writes the bin's entry at this place into the tile's list if it belongs there; returns where the next
// goes.
fn write(at: u32, end: u32, tile: vec2<u32>, limit: u32, slot: u32) -> u32 {
    if at >= end {
        return slot;
    }
    let particle = bin_entries[at];
    if !is_in(particle, tile, limit) {
        return slot;
    }
    if slot < params.tile_capacity {
        tile_entries[slot] = particle;
    }
    return slot + 1u;
}

fn write_four(at: u32, end: u32, tile: vec2<u32>, limit: u32, slot: u32) -> u32 {
    let second = write(at, end, tile, limit, slot);
    let third = write(at + 1u, end, tile, limit, second);
    let fourth = write(at + 2u, end, tile, limit, third);
    return write(at + 3u, end, tile, limit, fourth);
}

// `counts` holds the scanned offsets of the tiles here.
@compute @workgroup_size(8, 8)
fn write_tiles(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.tiles) {
        return;
    }
    let list = bin_list(id.xy);
    let limit = limit_of_tile(id.xy);
    var slot = counts[id.y * params.tiles.x + id.x];
    for (var i = list.begin; i < list.end; i += TURN_ENTRIES) {
        slot = write_four(i, list.end, id.xy, limit, slot);
        slot = write_four(i + 4u, list.end, id.xy, limit, slot);
        slot = write_four(i + 8u, list.end, id.xy, limit, slot);
        slot = write_four(i + 12u, list.end, id.xy, limit, slot);
    }
}

const MEASURE_WORKGROUP: u32 = 256u;
var<workgroup> longest: array<vec2<u32>, MEASURE_WORKGROUP>;

// Lengths of the longest list of a tile and of the longest of a bin, behind the offsets of the tiles.
// One workgroup; each invocation owns every so many lists. `counts` holds the offsets here too.
@compute @workgroup_size(MEASURE_WORKGROUP)
fn measure(@builtin(local_invocation_index) local: u32) {
    let tiles = params.tiles.x * params.tiles.y;
    let bins = params.bins.x * params.bins.y;
    var most = vec2(0u);
    for (var tile = local; tile < tiles; tile += MEASURE_WORKGROUP) {
        most.x = max(most.x, counts[tile + 1u] - counts[tile]);
    }
    for (var bin = local; bin < bins; bin += MEASURE_WORKGROUP) {
        most.y = max(most.y, bin_offsets[(bin + 1u) * params.chunks] - bin_offsets[bin * params.chunks]);
    }
    longest[local] = most;
    workgroupBarrier();
    if local == 0u {
        for (var other = 1u; other < MEASURE_WORKGROUP; other++) {
            most = max(most, longest[other]);
        }
        counts[tiles + 1u] = most.x;
        counts[tiles + 2u] = most.y;
    }
}
