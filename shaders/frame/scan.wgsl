// Scan: exclusive prefix sums of u32 counts; the total goes behind the last.
// Twin: src/frame/cpu/scan.rs.
//
// Workgroup contract: one workgroup does the whole array; each invocation owns a run of it.

struct ScanUniforms {
    length: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: ScanUniforms;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read_write> offsets: array<u32>;

const THREADS: u32 = 256u;
var<workgroup> totals: array<u32, THREADS>;

@compute @workgroup_size(THREADS)
fn scan(@builtin(local_invocation_id) local: vec3<u32>) {
    let run = (params.length + THREADS - 1u) / THREADS;
    let begin = min(local.x * run, params.length);
    let end = min(begin + run, params.length);
    var sum = 0u;
    for (var i = begin; i < end; i++) {
        sum += counts[i];
    }
    totals[local.x] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var t = 0u; t < local.x; t++) {
        before += totals[t];
    }
    for (var i = begin; i < end; i++) {
        offsets[i] = before;
        before += counts[i];
    }
    if local.x == THREADS - 1u {
        offsets[params.length] = before;
    }
}
