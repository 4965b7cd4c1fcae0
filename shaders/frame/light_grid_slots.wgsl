// Slots of the light grid: which cells keep light, and where. Cells with matter do, for they scatter; cells
// beside them, for light is looked up between cells; the lowest layer, for it lights the ground; and cells
// around the border of a finer level, for they feed it. All others let light through and keep none of it: of ten
// cells nine. Cells with matter have the first slots, level after level, the others follow likewise.
// Twin: src/frame/cpu/light_grid/kept.rs.
//
// Workgroup contract: one invocation a word of 32 cells of a row. `keep` reads what `occupied` wrote, `place` the
// scans of what `keep` wrote: each is a dispatch of its own.
#import cumuli::light_grid_data::{EMPTY_CELL, GridLevel, LightGridUniforms, NO_SLOT, grid_index, row_words}
#import cumuli::numerics::unfolded

@group(0) @binding(0) var<uniform> grid: LightGridUniforms;
@group(0) @binding(1) var<storage, read_write> cells: array<u32>;         // counts of grid.quantum, then slots; behind them extinctions by slot
@group(0) @binding(2) var<storage, read_write> matter_bits: array<u32>;   // by word: cells with matter
@group(0) @binding(3) var<storage, read_write> kept_bits: array<u32>;     // by word: cells that keep light
@group(0) @binding(4) var<storage, read_write> matter_counts: array<u32>; // by word: their numbers
@group(0) @binding(5) var<storage, read_write> empty_counts: array<u32>;  // by word: of those that keep light and have no matter
@group(0) @binding(6) var<storage, read> matter_offsets: array<u32>;      // the same, of all words before; behind the last, of all
@group(0) @binding(7) var<storage, read> empty_offsets: array<u32>;
@group(0) @binding(8) var<storage, read_write> cell_of: array<u32>;       // by slot

const WORD: u32 = 32u;
// Cells of the finer level around its border in which `sweep` asks for what flows in: half a cell and the step
// from plane to plane, rounded up.
const FEED_CELLS: f32 = 2.0;
// Cells beyond the place of a look-up that it takes light of.
const LOOK_UP_CELLS: f32 = 1.0;
// Borders of levels may coincide with middles of cells: those that a rounding would decide keep light. In cells.
const ROUNDING: f32 = 1e-3;

// A word of cells: the first of them, in the level.
struct Word {
    level: u32,
    cell: vec3<u32>,
    inside: bool,
}

fn word_at(index: u32) -> Word {
    var rest = index;
    let levels = unfolded(grid.levels, index == NO_SLOT);
    for (var l = 0u; l < levels; l++) {
        let size = grid.level[l].size;
        let row = row_words(size.x);
        let words = row * size.y * size.z;
        if rest < words {
            let rows = rest / row;
            return Word(l, vec3(rest % row * WORD, rows % size.y, rows / size.y), true);
        }
        rest -= words;
    }
    return Word(0u, vec3(0u), false);
}

// Bits of the cells of a row that the word from `first` on holds of those from `low` to `high`.
fn bits_between(first: u32, low: f32, high: f32) -> u32 {
    let begin = u32(clamp(ceil(low) - f32(first), 0.0, f32(WORD)));
    let end = u32(clamp(floor(high) + 1.0 - f32(first), 0.0, f32(WORD)));
    let below_end = select((1u << (end & 31u)) - 1u, 0xffffffffu, end == WORD);
    let below_begin = select((1u << (begin & 31u)) - 1u, 0xffffffffu, begin == WORD);
    return below_end & ~below_begin;
}

@compute @workgroup_size(64)
fn occupied(@builtin(global_invocation_id) id: vec3<u32>) {
    let word = word_at(id.x);
    if !word.inside {
        return;
    }
    let level = grid.level[word.level];
    let first = grid_index(level, word.cell);
    let count = min(level.size.x - word.cell.x, WORD);
    var bits = 0u;
    for (var i = 0u; i < count; i++) {
        bits |= select(0u, 1u << i, cells[first + i] > 0u);
    }
    matter_bits[id.x] = bits;
    matter_counts[id.x] = countOneBits(bits);
}

// Cells of the word that feed the finer level.
fn feeding(word: Word) -> u32 {
    let level = grid.level[word.level];
    let inner = grid.level[word.level - 1u];
    // In cells of this level, so that the middle of cell i is at i.
    let low = (inner.low.xyz - level.low.xyz) / level.cell.xyz - 0.5;
    let high = low + vec3<f32>(inner.size.xyz) * inner.cell.xyz / level.cell.xyz;
    let out = FEED_CELLS * inner.cell.xyz / level.cell.xyz + LOOK_UP_CELLS + ROUNDING;
    let within = LOOK_UP_CELLS + ROUNDING;
    let at = vec3<f32>(word.cell);
    var bits = 0u;
    if all(at.yz >= (low - out).yz) && all(at.yz <= (high + out).yz) {
        bits = bits_between(word.cell.x, low.x - out.x, high.x + out.x);
        if all(at.yz >= low.yz + within) && all(at.yz <= high.yz - within) {
            bits &= ~bits_between(word.cell.x, low.x + within, high.x - within);
        }
    }
    return bits;
}

@compute @workgroup_size(64)
fn keep(@builtin(global_invocation_id) id: vec3<u32>) {
    let word = word_at(id.x);
    if !word.inside {
        return;
    }
    let level = grid.level[word.level];
    let row = row_words(level.size.x);
    let own = matter_bits[id.x];
    var bits = own;
    for (var dz = -1; dz <= 1; dz++) {
        for (var dy = -1; dy <= 1; dy++) {
            let at = vec2<i32>(word.cell.yz) + vec2(dy, dz);
            if any(at < vec2(0)) || any(at >= vec2<i32>(level.size.yz)) {
                continue;
            }
            let there = u32(i32(id.x) + (dz * i32(level.size.y) + dy) * i32(row));
            let near = matter_bits[there];
            bits |= near | (near << 1u) | (near >> 1u);
            if word.cell.x > 0u {
                bits |= matter_bits[there - 1u] >> 31u;
            }
            if word.cell.x + WORD < level.size.x {
                bits |= matter_bits[there + 1u] << 31u;
            }
        }
    }
    if word.cell.y == 0u {
        bits = 0xffffffffu;
    }
    if word.level > 0u {
        bits |= feeding(word);
    }
    bits &= bits_between(word.cell.x, 0.0, f32(level.size.x) - 1.0);
    kept_bits[id.x] = bits;
    empty_counts[id.x] = countOneBits(bits & ~own);
}

@compute @workgroup_size(64)
fn place(@builtin(global_invocation_id) id: vec3<u32>) {
    let word = word_at(id.x);
    if !word.inside {
        return;
    }
    let level = grid.level[word.level];
    let first = grid_index(level, word.cell);
    let count = min(level.size.x - word.cell.x, WORD);
    let matter = matter_bits[id.x];
    let kept = kept_bits[id.x];
    var of_matter = matter_offsets[id.x];
    var of_empty = matter_offsets[grid.words] + empty_offsets[id.x];
    for (var i = 0u; i < count; i++) {
        let bit = 1u << i;
        let here = first + i;
        var slot = NO_SLOT;
        if (matter & bit) != 0u {
            if of_matter < grid.matter_room {
                slot = of_matter;
                cells[grid.cells + slot] = bitcast<u32>(f32(cells[here]) * grid.quantum);
                cell_of[slot] = here;
            }
            of_matter++;
        } else if (kept & bit) != 0u {
            if of_empty < grid.kept_room {
                slot = of_empty | EMPTY_CELL;
                cell_of[of_empty] = here;
            }
            of_empty++;
        }
        cells[here] = slot;
    }
}
