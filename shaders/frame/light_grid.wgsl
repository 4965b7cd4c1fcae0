// Light grid: discrete ordinates on nested grids around the camera. Sunlight is followed from every cell
// through the matter of the others (light_grid_matter.wgsl); then light is scattered in every cell and swept along
// twelve directions, in turns, from the coarsest level to the finest. A finer level begins with the
// light of the coarser and takes from it what flows in at its border.
// Twin: src/frame/cpu/light_grid.rs, where the method is told.
//
// Workgroup contract: `sunlight` and `scatter` one invocation a cell, `begin` one a cell and direction. In `sweep` one
// invocation owns one slanted plane of cells along one direction, every cell is in one of them, and
// light that leaves its plane sideways leaves the level: it reads only what it wrote itself, and
// extinctions and sources, which `sweep` does not write.
#import cumuli::light_grid_data::{Crossing, DIRECTIONS, GridLevel, GridStage, LightGridUniforms, crossing, grid_direction, grid_index, grid_phase, light_from_outside, pack_light, unpack_light}
#import cumuli::numerics::{mean_transmittance, opacity, unfolded}

@group(0) @binding(0) var<uniform> grid: LightGridUniforms;
@group(0) @binding(1) var<uniform> stage: GridStage;
@group(0) @binding(2) var<storage, read> extinction: array<f32>;              // 1/m
@group(0) @binding(3) var<storage, read_write> sun_mean: array<f32>;       // sunlight, mean over a cell
// Lights are means over a cell. Behind them, for `sweep`: what flowed out of the cells of a slanted
// plane in the row before, [direction][cell along the row][slanted plane].
#ifdef ABSORBING
@group(0) @binding(4) var<storage, read_write> sources: array<vec2<u32>>;     // [direction][cell]
@group(0) @binding(5) var<storage, read_write> lights: array<vec2<u32>>;      // [direction][cell]
#else
@group(0) @binding(4) var<storage, read_write> sources: array<u32>;           // [direction][cell]
@group(0) @binding(5) var<storage, read_write> lights: array<u32>;            // [direction][cell]
#endif

const PI: f32 = 3.14159265;
// Cells within the border of a level where it counts as outside: borders of levels may coincide, and
// a rounding shall not decide.
const BORDER: f32 = 1e-3;
const SWEEP_WORKGROUP: u32 = 32u;

fn cell_of(index: u32, size: vec3<u32>) -> vec3<u32> {
    return vec3(index % size.x, (index / size.x) % size.y, index / (size.x * size.y));
}

fn cell_centre(level: GridLevel, cell: vec3<f32>) -> vec3<f32> {
    return level.low.xyz + (cell + 0.5) * level.cell.xyz;
}

// Where a coarser level is sampled: the corner cell and the fractions.
struct GridPlace {
    cell: vec3<u32>,
    next: vec3<u32>,
    fraction: vec3<f32>,
    inside: bool,
}

fn grid_place(level: GridLevel, point: vec3<f32>) -> GridPlace {
    var result: GridPlace;
    let at = (point - level.low.xyz) / level.cell.xyz;
    let size = vec3<f32>(level.size.xyz);
    result.inside = all(at >= vec3(BORDER)) && all(at <= size - BORDER);
    let centred = clamp(at - 0.5, vec3(0.0), size - 1.0);
    let low = floor(centred);
    result.cell = vec3<u32>(low);
    result.next = min(result.cell + 1u, level.size.xyz - 1u);
    result.fraction = centred - low;
    return result;
}

fn corner_of(place: GridPlace, corner: u32) -> vec3<u32> {
    return vec3(
        select(place.cell.x, place.next.x, (corner & 1u) != 0u),
        select(place.cell.y, place.next.y, (corner & 2u) != 0u),
        select(place.cell.z, place.next.z, (corner & 4u) != 0u),
    );
}

fn corner_weight(place: GridPlace, corner: u32) -> f32 {
    let f = place.fraction;
    return select(1.0 - f.x, f.x, (corner & 1u) != 0u)
        * select(1.0 - f.y, f.y, (corner & 2u) != 0u)
        * select(1.0 - f.z, f.z, (corner & 4u) != 0u);
}

fn levels() -> u32 {
    return unfolded(grid.levels, arrayLength(&extinction) == 0u);
}

// Light along a direction at a point outside of level `inner`: from the coarser level, or from
// outside of all.
fn inflow(inner: u32, direction_index: u32, point: vec3<f32>) -> vec3<f32> {
    if inner + 1u < levels() {
        let outer = grid.level[inner + 1u];
        let place = grid_place(outer, point);
        if place.inside {
            var sum = vec3(0.0);
            for (var corner = 0u; corner < 8u; corner++) {
                let index = direction_index * grid.cells + grid_index(outer, corner_of(place, corner));
                sum += corner_weight(place, corner) * unpack_light(lights[index]);
            }
            return sum;
        }
    }
    return light_from_outside(grid_direction(direction_index));
}

// Optical depth beyond which no sunlight counts: what is left rounds to nothing in a light of f16.
const DEEPEST: f32 = 20.0;
// Where a ray never leaves a cell, m.
const NEVER: f32 = 1e30;
// Lengths of a ray from fractions of a cell to its borders along each axis, forward; m.
fn to_borders(fraction: vec3<f32>, rate: vec3<f32>) -> vec3<f32> {
    let left = select(fraction, 1.0 - fraction, rate > vec3(0.0));
    return select(vec3(NEVER), left / abs(rate), abs(rate) > vec3(1.0 / NEVER));
}

fn least(v: vec3<f32>) -> f32 {
    return min(v.x, min(v.y, v.z));
}

// Optical depth towards the sun from where a ray through the middle of a cell leaves it: from cell to cell
// (Amanatides and Woo 1987), and on through the coarser levels.
fn sun_depth(inner: u32, own: vec3<u32>) -> f32 {
    let sun = grid.sun.xyz;
    let origin = cell_centre(grid.level[inner], vec3<f32>(own));
    var depth = 0.0;
    var t = 0.0;
    for (var l = inner; l < levels(); l++) {
        let level = grid.level[l];
        let size = vec3<i32>(level.size.xyz);
        let rate = sun / level.cell.xyz;
        let turn = select(vec3(-1), vec3(1), rate > vec3(0.0));
        let across = to_borders(vec3(0.0), abs(rate));
        var cell = vec3<i32>(own);
        var at = vec3(0.5);
        if t > 0.0 {
            let place = (origin + t * sun - level.low.xyz) / level.cell.xyz;
            cell = vec3<i32>(floor(place));
            at = place - floor(place);
        }
        var next = t + to_borders(at, rate);
        while all(cell >= vec3(0)) && all(cell < size) && depth < DEEPEST {
            let leave = least(next);
            // The cell itself is left out.
            if t > 0.0 {
                depth += extinction[grid_index(level, vec3<u32>(cell))] * max(leave - t, 0.0);
            }
            t = max(t, leave);
            // One axis at a time: across an edge there is a cell of no length.
            let x = next.x <= leave;
            let y = !x && next.y <= leave;
            let goes = vec3(x, y, !x && !y);
            cell += select(vec3(0), turn, goes);
            next += select(vec3(0.0), across, goes);
        }
    }
    return depth;
}

// Mean over a cell of the sunlight that reaches it through the matter of the cells. Cells without matter are
// not asked for it, but those by which light falls to the ground.
@compute @workgroup_size(64)
fn sunlight(@builtin(global_invocation_id) id: vec3<u32>) {
    let level = grid.level[stage.level];
    if id.x >= level.size.x * level.size.y * level.size.z {
        return;
    }
    let index = level.size.w + id.x;
    let cell = cell_of(id.x, level.size.xyz);
    var reached = 0.0;
    if extinction[index] > 0.0 || cell.y == 0u {
        let chord = 2.0 * least(to_borders(vec3(0.5), grid.sun.xyz / level.cell.xyz));
        reached = exp(-sun_depth(stage.level, cell)) * mean_transmittance(extinction[index] * chord);
    }
    sun_mean[index] = reached;
}

// First light of a level: the coarser level's, or what comes from outside.
@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3<u32>) {
    let level = grid.level[stage.level];
    let count = level.size.x * level.size.y * level.size.z;
    if id.x >= count {
        return;
    }
    // Elsewhere the light of before is not asked for.
    if extinction[level.size.w + id.x] <= 0.0 {
        return;
    }
    let cell = cell_of(id.x, level.size.xyz);
    let light = inflow(stage.level, id.y, cell_centre(level, vec3<f32>(cell)));
    lights[id.y * grid.cells + grid_index(level, cell)] = pack_light(light);
}

// A step from the source of before towards the one that the cell's light asks for.
fn relaxed(at: u32, wanted: vec3<f32>) -> vec3<f32> {
    // A full step does not look at the source of before, which may never have been made.
    if (at < arrayLength(&sources)) & (stage.relaxation == 1.0) {
        return wanted;
    }
    return mix(unpack_light(sources[at]), wanted, stage.relaxation);
}

// Light below this is none: where no direction has any, nothing is divided by 0.
const LEAST_KEPT: f32 = 1e-30;

// Scatters the light of a cell: a phase function of degree 2 needs of the light its even part, by
// pairs of opposite directions, and the first moment of its odd part.
@compute @workgroup_size(64)
fn scatter(@builtin(global_invocation_id) id: vec3<u32>) {
    let level = grid.level[stage.level];
    let count = level.size.x * level.size.y * level.size.z;
    if id.x >= count {
        return;
    }
    let index = level.size.w + id.x;
    if extinction[index] <= 0.0 {
        return;
    }
    var even: array<vec3<f32>, 6>;
    var total = vec3(0.0);
    var odd = mat3x3<f32>();
    for (var axis = 0u; axis < DIRECTIONS / 2u; axis++) {
        let along = unpack_light(lights[2u * axis * grid.cells + index]);
        let against = unpack_light(lights[(2u * axis + 1u) * grid.cells + index]);
        even[axis] = along + against;
        total += even[axis];
        let d = grid_direction(2u * axis);
        odd[0] += (along - against) * d.x;
        odd[1] += (along - against) * d.y;
        odd[2] += (along - against) * d.z;
    }
    let first = grid.moment_first;
    let second = grid.moment_second;
    var scattered: array<vec3<f32>, DIRECTIONS>;
    var sum = vec3(0.0);
    var kept = vec3(0.0);
    let sun = sun_mean[index] / (4.0 * PI);
    for (var axis = 0u; axis < DIRECTIONS / 2u; axis++) {
        let d = grid_direction(2u * axis);
        let same = (1.0 - second) / f32(DIRECTIONS) * total + 0.5 * second * even[axis];
        let turned = 0.25 * first * (odd[0] * d.x + odd[1] * d.y + odd[2] * d.z);
        let cosine = -dot(d, grid.sun.xyz);
        let moments = vec2(first, second);
        let along = grid.albedo * (same + turned + vec3(sun * grid_phase(moments, cosine), 0.0, 0.0));
        let against = grid.albedo * (same - turned + vec3(sun * grid_phase(moments, -cosine), 0.0, 0.0));
        let at = 2u * axis * grid.cells + index;
        scattered[2u * axis] = relaxed(at, along);
        scattered[2u * axis + 1u] = relaxed(at + grid.cells, against);
    }
    if unfolded(stage.is_last, arrayLength(&sources) == 0u) != 0u {
        for (var d = 0u; d < DIRECTIONS; d++) {
            sum += scattered[d];
            kept += max(scattered[d], vec3(0.0));
        }
        // A phase function of degree 2 is negative at some angles: in the end there is no light there,
        // and the other directions give what that adds. Where nothing is negative nothing changes,
        // to the bit.
        let balance = select(max(sum, vec3(0.0)) / max(kept, vec3(LEAST_KEPT)), vec3(1.0), sum >= kept);
        for (var d = 0u; d < DIRECTIONS; d++) {
            scattered[d] = balance * max(scattered[d], vec3(0.0));
        }
    }
    for (var d = 0u; d < DIRECTIONS; d++) {
        sources[d * grid.cells + index] = pack_light(scattered[d]);
    }
}

// A cell next to the one that is worked on.
struct Neighbour {
    light: vec3<f32>,    // that flows out of it
    extinction: f32,     // 1/m; 0 outside of the level
    source: vec3<f32>,   // 0 without matter
}

// Source on the face towards two neighbours of these shares: the value with which light diffuses
// equally fast up to the face and on from it. None of it is known of an empty neighbour.
fn face_source(own: vec3<f32>, own_extinction: f32, near: Neighbour, beside: Neighbour, share: f32) -> vec3<f32> {
    let held = vec2((1.0 - share) * near.extinction, share * beside.extinction);
    let other = held.x + held.y;
    if other <= 0.0 {
        return own;
    }
    let source = (held.x * near.source + held.y * beside.source) / other;
    return (own * other + source * own_extinction) / (own_extinction + other);
}

// Planes that a slanted plane has moved by in a row of cells; the same for both signs.
fn moved(drift: f32, row: i32) -> i32 {
    let planes = i32(floor(abs(drift) * (f32(row) + 0.5)));
    return select(planes, -planes, drift < 0.0);
}

// Optical depth below which `skew` is a series: there both are wrong by 4e-4, the series by what it
// leaves out, the formula by cancelled digits.
const SKEW_SERIES_BELOW: f32 = 0.05;

// Carries light along one direction through a level. What flows out of a cell flows into the two
// that it faces in the next row of its slanted plane: the one after it, and the one beside that; the
// walk along a row goes so that the latter comes next.
@compute @workgroup_size(32)
fn sweep(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let level = grid.level[stage.level];
    let c = crossing(grid_direction(group.y), level.cell.xyz);
    let steps = vec3<i32>(1, i32(level.size.x), i32(level.size.x * level.size.y));
    // Between planes the direction changes least: there it goes by whole cells.
    let turned = abs(c.slope.x) < abs(c.slope.y);
    let plane_axis = select(c.third, c.second, turned);
    let row_axis = select(c.second, c.third, turned);
    let slope = select(c.slope.x, c.slope.y, turned);
    let drift = -select(c.slope.y, c.slope.x, turned);
    let planes = i32(level.size[plane_axis]);
    let rows = i32(level.size[c.main]);
    let width = i32(level.size[row_axis]);
    let farthest = moved(drift, rows - 1);
    // Never more than twice the longest side: a direction moves no farther than along its main axis.
    let number = i32(group.x * SWEEP_WORKGROUP + local);
    if number >= planes + abs(farthest) {
        return;
    }
    let first_plane = number - max(farthest, 0);
    let share = abs(slope);
    let main_step = select(-steps[c.main], steps[c.main], c.forward);
    // Upstream beside is at higher numbers: from high to low.
    let falling = slope > 0.0;
    let row_step = select(1, -1, falling) * steps[row_axis];
    let base = i32(group.y * grid.cells);
    let origin = i32(level.size.w)
        + select(rows - 1, 0, c.forward) * steps[c.main]
        + select(0, width - 1, falling) * steps[row_axis];
    let flow_stride = i32(2u * grid.longest);
    let flow = i32(DIRECTIONS * grid.cells + group.y * grid.longest * 2u * grid.longest) + number;
    for (var r = 0; r < rows; r++) {
        let plane = first_plane + moved(drift, r);
        if plane < 0 || plane >= planes {
            continue;
        }
        let plane_before = first_plane + moved(drift, r - 1);
        let plane_after = first_plane + moved(drift, r + 1);
        let has_before = r > 0 && plane_before >= 0 && plane_before < planes;
        let has_after = r + 1 < rows && plane_after >= 0 && plane_after < planes;
        let main_before = f32(select(rows - r, r - 1, c.forward));
        let to_before = (plane_before - plane) * steps[plane_axis] - main_step;
        let to_after = (plane_after - plane) * steps[plane_axis] + main_step;
        var here = origin + r * main_step + plane * steps[plane_axis];
        var before_beside: Neighbour;
        var after: Neighbour;
        for (var k = -1; k < width; k++) {
            var before: Neighbour;
            if has_before && k >= 0 {
                let there = here + to_before;
                before.light = unpack_light(lights[flow + k * flow_stride]);
                before.extinction = extinction[there];
                if before.extinction > 0.0 {
                    before.source = unpack_light(sources[base + there]);
                }
            } else {
                var cell = vec3(0.0);
                cell[c.main] = main_before;
                cell[row_axis] = f32(select(k, width - 1 - k, falling));
                // Into the first row by the direction itself, not by whole cells.
                cell[plane_axis] = select(f32(plane_before), f32(plane) - drift, r == 0);
                before.light = inflow(stage.level, group.y, cell_centre(level, cell));
            }
            var after_beside: Neighbour;
            if has_after && k + 1 < width {
                let there = here + to_after + select(0, row_step, k >= 0);
                after_beside.extinction = extinction[there];
                if after_beside.extinction > 0.0 {
                    after_beside.source = unpack_light(sources[base + there]);
                }
            }
            if k >= 0 {
                let flows_in = mix(before.light, before_beside.light, share);
                var flows_out = flows_in;
                var mean = flows_in;
                let matter = extinction[here];
                if matter > 0.0 {
                    let tau = matter * c.path;
                    let source = unpack_light(sources[base + here]);
                    let change = face_source(source, matter, after, after_beside, share)
                        - face_source(source, matter, before, before_beside, share);
                    // Nowhere in the cell below 0.
                    let slope_of_source = clamp(change, -2.0 * abs(source), 2.0 * abs(source));
                    let opaque = opacity(tau);
                    let clear = mean_transmittance(tau);
                    // What a source that grows downstream by 1 about its mean adds at the end.
                    let skew = select(1.0 - 0.5 * opaque - clear, tau * tau * (2.0 - tau) / 24.0, tau < SKEW_SERIES_BELOW);
                    flows_out = flows_in * (1.0 - opaque) + source * opaque + slope_of_source * skew;
                    // So that flows_out - flows_in = tau * (source - mean).
                    mean = flows_in * clear + source * (1.0 - clear) - slope_of_source * (skew / tau);
                }
                lights[base + here] = pack_light(mean);
                lights[flow + k * flow_stride] = pack_light(flows_out);
                here += row_step;
            }
            before_beside = before;
            after = after_beside;
        }
    }
}
