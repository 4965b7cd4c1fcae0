// Light grid: discrete ordinates on nested grids around the camera. Sunlight is followed from every cell
// through the matter of the others (light_grid_matter.wgsl); then light is scattered in every cell and swept along
// some directions, in turns, from the coarsest level to the finest. A finer level begins with the
// light of the coarser and takes from it what flows in at its border.
// Twin: src/frame/cpu/light_grid.rs, where the method is told.
//
// Workgroup contract: `sunlight` and `scatter` one invocation a slot, `begin` one a slot and direction. In `sweep` one
// invocation owns one slanted plane of cells along one direction, every cell is in one of them, and
// light that leaves its plane sideways leaves the level: it reads only what it wrote itself, and
// extinctions and sources, which `sweep` does not write.
#import cumuli::light_grid_data::{Crossing, EMPTY_CELL, GridLevel, GridStage, LightGridUniforms, NO_SLOT, crossing, grid_direction, grid_index, grid_phase, light_under_sky, pack_light, slot_of, unpack_light}
#import cumuli::numerics::{mean_transmittance, opacity, unfolded}

@group(0) @binding(0) var<uniform> grid: LightGridUniforms;
@group(0) @binding(1) var<uniform> stage: GridStage;
@group(0) @binding(2) var<storage, read> cells: array<u32>;                   // slots (light_grid_slots.wgsl); behind them extinctions by slot, 1/m
@group(0) @binding(3) var<storage, read> cell_of: array<u32>;                 // by slot
@group(0) @binding(4) var<storage, read> matter_offsets: array<u32>;          // slots with matter before each word of cells
@group(0) @binding(5) var<storage, read> empty_offsets: array<u32>;           // and without
@group(0) @binding(6) var<storage, read_write> sun_mean: array<f32>;          // by slot: sunlight, mean over a cell
// Lights are means over a cell. Behind them, for `sweep`: what flowed out of the cells of a slanted
// plane in the row before, [direction][cell along the row][slanted plane].
#ifdef ABSORBING
@group(0) @binding(7) var<storage, read_write> sources: array<vec2<u32>>;     // [direction][slot with matter]
@group(0) @binding(8) var<storage, read_write> lights: array<vec2<u32>>;      // [direction][slot]
#else
@group(0) @binding(7) var<storage, read_write> sources: array<u32>;           // [direction][slot with matter]
@group(0) @binding(8) var<storage, read_write> lights: array<u32>;            // [direction][slot]
#endif

const PI: f32 = 3.14159265;
// Cells within the border of a level where it counts as outside: borders of levels may coincide, and
// a rounding shall not decide.
const BORDER: f32 = 1e-3;
const SWEEP_WORKGROUP: u32 = 32u;

fn cell_in(index: u32, size: vec3<u32>) -> vec3<u32> {
    return vec3(index % size.x, (index / size.x) % size.y, index / (size.x * size.y));
}

// Whether all cells that want a slot have one. Else the host makes room and this light is made again.
fn has_room() -> bool {
    let matter = matter_offsets[grid.words];
    return (matter <= grid.matter_room) & (matter + empty_offsets[grid.words] <= grid.kept_room);
}

// The level's first slot and the one behind its last, of cells with matter or of the others; none without room.
fn slots_of(level: u32, empty: bool) -> vec2<u32> {
    let first = u32(grid.level[level].cell.w);
    let last = select(grid.words, u32(grid.level[min(level + 1u, 9u)].cell.w), level + 1u < grid.levels);
    var offsets = vec2(matter_offsets[first], matter_offsets[last]);
    if empty {
        offsets = matter_offsets[grid.words] + vec2(empty_offsets[first], empty_offsets[last]);
    }
    return select(vec2(0u), offsets, has_room());
}

// Extinction of the cell of an entry of `cells`, 1/m.
fn extinction_of(entry: u32) -> f32 {
    if entry < EMPTY_CELL {
        return bitcast<f32>(cells[grid.cells + entry]);
    }
    return 0.0;
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
    return unfolded(grid.levels, arrayLength(&cells) == 0u);
}

fn axes() -> u32 {
    return unfolded(grid.axes, arrayLength(&cells) == 0u);
}

fn direction(index: u32) -> vec3<f32> {
    return grid_direction(grid.axis[index >> 1u], index);
}

// Light from outside of all levels along a direction.
fn from_sky(index: u32) -> vec3<f32> {
    let axis = index >> 1u;
    return light_under_sky(direction(index), grid.sky[axis >> 2u][axis & 3u]);
}

// Share of a corner of a look-up in the light along a direction there.
fn corner_light(direction_index: u32, outer: GridLevel, place: GridPlace, corner: u32) -> vec3<f32> {
    let entry = cells[grid_index(outer, corner_of(place, corner))];
    var light = from_sky(direction_index);
    if entry != NO_SLOT {
        light = unpack_light(lights[direction_index * grid.kept_room + slot_of(entry)]);
    }
    return corner_weight(place, corner) * light;
}

// Light along a direction at a point outside of level `inner`: from the coarser level, or from
// outside of all.
fn inflow(inner: u32, direction_index: u32, point: vec3<f32>) -> vec3<f32> {
    if inner + 1u < levels() {
        let outer = grid.level[inner + 1u];
        let place = grid_place(outer, point);
        if place.inside {
            var sum = vec3(0.0);
            // Four by four: turns of loops are few (job.rs).
            for (var corner = 0u; corner < 8u; corner += 4u) {
                sum += corner_light(direction_index, outer, place, corner);
                sum += corner_light(direction_index, outer, place, corner + 1u);
                sum += corner_light(direction_index, outer, place, corner + 2u);
                sum += corner_light(direction_index, outer, place, corner + 3u);
            }
            return sum;
        }
    }
    return from_sky(direction_index);
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

// Length of a ray from a point to the sides of a level, m.
fn to_sides(level: GridLevel, origin: vec3<f32>, rate: vec3<f32>) -> f32 {
    let at = (origin - level.low.xyz) / level.cell.xyz;
    let size = vec3<f32>(level.size.xyz);
    let left = to_borders(at / size, rate / size);
    return min(left.x, left.z);
}

// Optical depth towards the sun from where a ray through the middle of a cell leaves it: from cell to cell
// (Amanatides and Woo 1987), and on through the coarser levels of a field beside. Above and below a level of a field there is
// no matter but of listed particles, only that which coarser cells spread to there.
fn sun_depth(inner: u32, own: vec3<u32>) -> f32 {
    let sun = grid.sun.xyz;
    let origin = cell_centre(grid.level[inner], vec3<f32>(own));
    var depth = 0.0;
    var t = 0.0;
    let widest = select(max(inner, min(grid.widest, levels() - 1u)), inner, grid.of_list != 0u);
    for (var l = inner; l <= widest && t < NEVER; l++) {
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
                depth += extinction_of(cells[grid_index(level, vec3<u32>(cell))]) * max(leave - t, 0.0);
            }
            t = max(t, leave);
            // One axis at a time: across an edge there is a cell of no length.
            let x = next.x <= leave;
            let y = !x && next.y <= leave;
            let goes = vec3(x, y, !x && !y);
            cell += select(vec3(0), turn, goes);
            next += select(vec3(0.0), across, goes);
        }
        t = max(t, select(to_sides(level, origin, rate), 0.0, grid.has_above != 0u));
    }
    return depth;
}

// Mean over a cell of the sunlight that reaches it through the matter of the cells. Cells without matter are
// not asked for it, but those by which light falls to the ground.
@compute @workgroup_size(64)
fn sunlight(@builtin(global_invocation_id) id: vec3<u32>) {
    let level = grid.level[stage.level];
    let with_matter = slots_of(stage.level, false);
    let without = slots_of(stage.level, true);
    let count = with_matter.y - with_matter.x;
    var slot = with_matter.x + id.x;
    if id.x >= count {
        slot = without.x + id.x - count;
        if slot >= without.y {
            return;
        }
    }
    let cell = cell_in(cell_of[slot] - level.size.w, level.size.xyz);
    var reached = 0.0;
    if id.x < count || cell.y == 0u {
        var extinction = 0.0;
        if id.x < count {
            extinction = extinction_of(slot);
        }
        let chord = 2.0 * least(to_borders(vec3(0.5), grid.sun.xyz / level.cell.xyz));
        reached = exp(-sun_depth(stage.level, cell)) * mean_transmittance(extinction * chord);
    }
    sun_mean[slot] = reached;
}

// First light of a level, where there is matter: the coarser level's, or what comes from outside. Elsewhere the
// light of before is not asked for.
@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3<u32>) {
    let slots = slots_of(stage.level, false);
    let slot = slots.x + id.x;
    if slot >= slots.y {
        return;
    }
    let level = grid.level[stage.level];
    let cell = cell_in(cell_of[slot] - level.size.w, level.size.xyz);
    let light = inflow(stage.level, id.y, cell_centre(level, vec3<f32>(cell)));
    lights[id.y * grid.kept_room + slot] = pack_light(light);
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

// Light of a cell as a phase function of degree 2 needs it: its mean, its mean by direction, and the mean of the
// products of directions' components, which is symmetric.
struct Moments {
    mean: vec3<f32>,
    first: mat3x3<f32>,    // x, y, z of the direction
    squares: mat3x3<f32>,  // xx, yy, zz
    products: mat3x3<f32>, // yz, zx, xy
}

fn moments_of(slot: u32) -> Moments {
    var result: Moments;
    for (var axis = 0u; axis < axes(); axis++) {
        let along = unpack_light(lights[2u * axis * grid.kept_room + slot]);
        let against = unpack_light(lights[(2u * axis + 1u) * grid.kept_room + slot]);
        let d = grid.axis[axis].xyz;
        let both = grid.axis[axis].w * (along + against);
        let odd = grid.axis[axis].w * (along - against);
        let around = d.yzx * d.zxy;
        result.mean += both;
        result.first += mat3x3(odd * d.x, odd * d.y, odd * d.z);
        result.squares += mat3x3(both * (d.x * d.x), both * (d.y * d.y), both * (d.z * d.z));
        result.products += mat3x3(both * around.x, both * around.y, both * around.z);
    }
    return result;
}

// Scatters the light of a cell.
@compute @workgroup_size(64)
fn scatter(@builtin(global_invocation_id) id: vec3<u32>) {
    let slots = slots_of(stage.level, false);
    let slot = slots.x + id.x;
    if slot >= slots.y {
        return;
    }
    let light = moments_of(slot);
    let moments = vec2(grid.moment_first, grid.moment_second);
    let sun = sun_mean[slot] / (4.0 * PI);
    let is_last = unfolded(stage.is_last, arrayLength(&sources) == 0u) != 0u;
    var sum = vec3(0.0);
    var kept = vec3(0.0);
    for (var axis = 0u; axis < axes(); axis++) {
        let d = grid.axis[axis].xyz;
        let second = light.squares * (d * d) + 2.0 * (light.products * (d.yzx * d.zxy));
        let same = light.mean + 5.0 * moments.y * (1.5 * second - 0.5 * light.mean);
        let turned = 3.0 * moments.x * (light.first * d);
        let cosine = -dot(d, grid.sun.xyz);
        let along = grid.albedo * (same + turned + vec3(sun * grid_phase(moments, cosine), 0.0, 0.0));
        let against = grid.albedo * (same - turned + vec3(sun * grid_phase(moments, -cosine), 0.0, 0.0));
        let at = 2u * axis * grid.matter_room + slot;
        let pair = array(relaxed(at, along), relaxed(at + grid.matter_room, against));
        sum += grid.axis[axis].w * (pair[0] + pair[1]);
        kept += grid.axis[axis].w * (max(pair[0], vec3(0.0)) + max(pair[1], vec3(0.0)));
        sources[at] = pack_light(pair[0]);
        sources[at + grid.matter_room] = pack_light(pair[1]);
    }
    if is_last {
        // A phase function of degree 2 is negative at some angles: in the end there is no light there,
        // and the other directions give what that adds. Where nothing is negative nothing changes,
        // to the bit.
        let balance = select(max(sum, vec3(0.0)) / max(kept, vec3(LEAST_KEPT)), vec3(1.0), sum >= kept);
        for (var d = 0u; d < 2u * axes(); d++) {
            let at = d * grid.matter_room + slot;
            sources[at] = pack_light(balance * max(unpack_light(sources[at]), vec3(0.0)));
        }
    }
}

// A cell next to the one that is worked on.
struct Neighbour {
    extinction: f32,     // 1/m; 0 outside of the level
    source: vec3<f32>,   // 0 without matter
}

// The cell of this index; nothing where it is not in the level.
fn neighbour(is_there: bool, index: i32, direction_index: u32) -> Neighbour {
    var result: Neighbour;
    if is_there {
        let entry = cells[index];
        if entry < EMPTY_CELL {
            result.extinction = extinction_of(entry);
            result.source = unpack_light(sources[direction_index * grid.matter_room + entry]);
        }
    }
    return result;
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

// Optical depth of a cell that has less: matter of next to no extinction may be none in f32, and then sends nothing.
const LEAST_TAU: f32 = 1e-30;

// Carries light along one direction through a level. What flows out of a cell flows into the two
// that it faces in the next row of its slanted plane: the one after it, and the one beside that; the
// walk along a row goes so that the latter comes next.
@compute @workgroup_size(32)
fn sweep(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let level = grid.level[stage.level];
    let c = crossing(direction(group.y), level.cell.xyz);
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
    if (number >= planes + abs(farthest)) | !has_room() {
        return;
    }
    let first_plane = number - max(farthest, 0);
    let share = abs(slope);
    let main_step = select(-steps[c.main], steps[c.main], c.forward);
    // Upstream beside is at higher numbers: from high to low.
    let falling = slope > 0.0;
    let row_step = select(1, -1, falling) * steps[row_axis];
    let origin = i32(level.size.w)
        + select(rows - 1, 0, c.forward) * steps[c.main]
        + select(0, width - 1, falling) * steps[row_axis];
    let flow_stride = i32(2u * grid.longest);
    let flow = i32(2u * grid.axes * grid.kept_room + group.y * grid.longest * 2u * grid.longest) + number;
    let end_row = min(rows, i32(stage.end_row));
    let stays = unfolded(stage.is_last, arrayLength(&cells) == 0u) != 0u;
    for (var r = i32(stage.first_row); r < end_row; r++) {
        let plane = first_plane + moved(drift, r);
        if plane < 0 || plane >= planes {
            continue;
        }
        let plane_before = first_plane + moved(drift, r - 1);
        let plane_after = first_plane + moved(drift, r + 1);
        let has_before = (r > 0) & (plane_before >= 0) & (plane_before < planes);
        let has_after = (r + 1 < rows) & (plane_after >= 0) & (plane_after < planes);
        let main_before = f32(select(rows - r, r - 1, c.forward));
        let to_before = (plane_before - plane) * steps[plane_axis] - main_step;
        let to_after = (plane_after - plane) * steps[plane_axis] + main_step;
        var here = origin + r * main_step + plane * steps[plane_axis];
        // What flows in from outside of the level: beside the row, and, of the first row of a plane, before it.
        var outside = vec3(0.0);
        outside[c.main] = main_before;
        outside[row_axis] = f32(select(-1, width, falling));
        // Into the first row by the direction itself, not by whole cells.
        outside[plane_axis] = select(f32(plane_before), f32(plane) - drift, r == 0);
        var flows_beside = inflow(stage.level, group.y, cell_centre(level, outside));
        let entering = select(width, 0, has_before);
        for (var k = 0; k < entering; k++) {
            outside[row_axis] += f32(select(1, -1, falling));
            lights[flow + k * flow_stride] = pack_light(inflow(stage.level, group.y, cell_centre(level, outside)));
        }
        var k = 0;
        while k < width {
            // Up to the next cell with matter light flows on: each invocation walks there by itself, since a driver
            // may work through what all of a group's branches hold.
            var entry = NO_SLOT;
            var flows_straight: vec3<f32>;
            var flows_in: vec3<f32>;
            while k < width {
                entry = cells[here];
                flows_straight = unpack_light(lights[flow + k * flow_stride]);
                flows_in = mix(flows_straight, flows_beside, share);
                if entry < EMPTY_CELL {
                    break;
                }
                if (entry != NO_SLOT) & stays {
                    lights[group.y * grid.kept_room + slot_of(entry)] = pack_light(flows_in);
                }
                lights[flow + k * flow_stride] = pack_light(flows_in);
                flows_beside = flows_straight;
                here += row_step;
                k++;
            }
            if k < width {
                let matter = extinction_of(entry);
                let tau = matter * c.path;
                let source = unpack_light(sources[group.y * grid.matter_room + entry]);
                let before = neighbour(has_before, here + to_before, group.y);
                let before_beside = neighbour(has_before && k > 0, here + to_before - row_step, group.y);
                let after = neighbour(has_after, here + to_after, group.y);
                let after_beside = neighbour(has_after && k + 1 < width, here + to_after + row_step, group.y);
                let change = face_source(source, matter, after, after_beside, share)
                    - face_source(source, matter, before, before_beside, share);
                // Nowhere in the cell below 0.
                let slope_of_source = clamp(change, -2.0 * abs(source), 2.0 * abs(source));
                let opaque = opacity(tau);
                let clear = mean_transmittance(tau);
                // What a source that grows downstream by 1 about its mean adds at the end.
                let skew = select(1.0 - 0.5 * opaque - clear, tau * tau * (2.0 - tau) / 24.0, tau < SKEW_SERIES_BELOW);
                let flows_out = flows_in * (1.0 - opaque) + source * opaque + slope_of_source * skew;
                // So that flows_out - flows_in = tau * (source - mean).
                let mean = flows_in * clear + source * (1.0 - clear) - slope_of_source * (skew / max(tau, LEAST_TAU));
                lights[group.y * grid.kept_room + entry] = pack_light(mean);
                lights[flow + k * flow_stride] = pack_light(flows_out);
                flows_beside = flows_straight;
                here += row_step;
                k++;
            }
        }
    }
}
