// Sort: stable radix sort of (key, value) pairs of u32, 4 bits a pass. Twin: src/frame/cpu/sort.rs.
//
// Workgroup contract: one workgroup owns a block of BLOCK consecutive pairs, each invocation a run
// of RUN of them. `histogram` writes the block's 16 counts to histograms[digit * blocks + block];
// after the scan `scatter` moves the pairs. Ranks come from positions alone, never from atomics.

struct SortUniforms {
    length: u32,
    shift: u32,
    blocks: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: SortUniforms;
@group(0) @binding(1) var<storage, read> keys_in: array<u32>;
@group(0) @binding(2) var<storage, read> values_in: array<u32>;
@group(0) @binding(3) var<storage, read_write> keys_out: array<u32>;
@group(0) @binding(4) var<storage, read_write> values_out: array<u32>;
@group(0) @binding(5) var<storage, read_write> histograms: array<u32>;
@group(0) @binding(6) var<storage, read> offsets: array<u32>;

const DIGITS: u32 = 16u;
const THREADS: u32 = 64u;
const RUN: u32 = 8u;
const BLOCK: u32 = THREADS * RUN;

var<workgroup> digit_counts: array<u32, 1024>; // [digit][thread]

fn digit_of(key: u32) -> u32 {
    return (key >> params.shift) & (DIGITS - 1u);
}

fn count_run(thread: u32, begin: u32, end: u32) {
    var counts: array<u32, DIGITS>;
    for (var i = begin; i < end; i++) {
        counts[digit_of(keys_in[i])] += 1u;
    }
    for (var d = 0u; d < DIGITS; d++) {
        digit_counts[d * THREADS + thread] = counts[d];
    }
}

@compute @workgroup_size(THREADS)
fn histogram(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let begin = min(group.x * BLOCK + local.x * RUN, params.length);
    count_run(local.x, begin, min(begin + RUN, params.length));
    workgroupBarrier();
    if local.x < DIGITS {
        var sum = 0u;
        for (var t = 0u; t < THREADS; t++) {
            sum += digit_counts[local.x * THREADS + t];
        }
        histograms[local.x * params.blocks + group.x] = sum;
    }
}

@compute @workgroup_size(THREADS)
fn scatter(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let begin = min(group.x * BLOCK + local.x * RUN, params.length);
    let end = min(begin + RUN, params.length);
    count_run(local.x, begin, end);
    workgroupBarrier();
    if local.x < DIGITS {
        var place = offsets[local.x * params.blocks + group.x];
        for (var t = 0u; t < THREADS; t++) {
            let count = digit_counts[local.x * THREADS + t];
            digit_counts[local.x * THREADS + t] = place;
            place += count;
        }
    }
    workgroupBarrier();
    var places: array<u32, DIGITS>;
    for (var d = 0u; d < DIGITS; d++) {
        places[d] = digit_counts[d * THREADS + local.x];
    }
    for (var i = begin; i < end; i++) {
        let key = keys_in[i];
        let d = digit_of(key);
        keys_out[places[d]] = key;
        values_out[places[d]] = values_in[i];
        places[d] += 1u;
    }
}
