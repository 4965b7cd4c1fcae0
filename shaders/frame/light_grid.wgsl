// Light grid: discrete ordinates on nested grids around the camera. Matter of the particles is
// spread over cells; sunlight is followed through it; then light is scattered in every cell and
// swept along twelve directions, in turns, from the coarsest level to the finest. A finer level
// begins with the light of the coarser and takes from it what flows in at its border.
// Twin: src/frame/cpu/light_grid.rs, where the method is told.
//
// Workgroup contract: `splat` one invocation a particle (sums of integers: no order), `density` and
// `scatter` one a cell, `begin` one a cell and direction. `sunlight` is one workgroup: plane after
// plane downstream, with a barrier between planes. A direction of `sweep` stays within planes of
// cells: one invocation owns one such plane and walks it row after row downstream; it reads only
// what it wrote itself.
#import cumuli::gpu_data::{Particle, ParticleCount}
#import cumuli::light_grid_data::{DIRECTIONS, GridLevel, GridStage, LightGridUniforms, grid_direction, grid_index, grid_phase, light_from_outside, pack_light, unpack_light}
#import cumuli::numerics::opacity

@group(0) @binding(0) var<uniform> grid: LightGridUniforms;
@group(0) @binding(1) var<uniform> stage: GridStage;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> particle_count: ParticleCount;
@group(0) @binding(4) var<storage, read_write> matter: array<atomic<u32>>;  // counts of grid.quantum
@group(0) @binding(5) var<storage, read_write> extinction: array<f32>;     // 1/m
@group(0) @binding(6) var<storage, read_write> sun_transmittance: array<f32>;
#ifdef ABSORBING
@group(0) @binding(7) var<storage, read_write> sources: array<vec2<u32>>;  // [direction][cell]
@group(0) @binding(8) var<storage, read_write> lights: array<vec2<u32>>;   // [direction][cell]
#else
@group(0) @binding(7) var<storage, read_write> sources: array<u32>;        // [direction][cell]
@group(0) @binding(8) var<storage, read_write> lights: array<u32>;         // [direction][cell]
#endif
@group(0) @binding(9) var<storage, read> spread: array<f32>;               // by shape: radius of the even ball of the same moments

const PI: f32 = 3.14159265;
// Cells within the border of a level where it counts as outside: borders of levels may coincide, and
// a rounding shall not decide.
const BORDER: f32 = 1e-3;
// Of `sunlight`.
const WORKGROUP: u32 = 128u;

fn cell_of(index: u32, size: vec3<u32>) -> vec3<u32> {
    return vec3(index % size.x, (index / size.x) % size.y, index / (size.x * size.y));
}

fn cell_centre(level: GridLevel, cell: vec3<f32>) -> vec3<f32> {
    return level.low.xyz + (cell + 0.5) * level.cell.xyz;
}

// Share of a cell that a ball fills, roughly: linear in the distance between the centres over one
// cell's width. The sum over all cells is made exact by `splat`.
fn ball_share(ball: f32, offset: vec3<f32>, cell: vec3<f32>) -> f32 {
    let distance = length(offset);
    let width = max(dot(abs(offset), cell) / max(distance, 1e-6), min(cell.x, min(cell.y, cell.z)));
    return clamp((ball - distance) / width + 0.5, 0.0, 1.0);
}

@compute @workgroup_size(64)
fn splat(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= particle_count.particles {
        return;
    }
    let particle = particles[id.x];
    let ball = particle.radius * spread[min(particle.shape, grid.spreads - 1u)];
    // Extinction times volume, m^2.
    let mass = particle.optical_radius * particle.radius * particle.radius * (4.0 / 3.0 * PI);
    for (var l = 0u; l < grid.levels; l++) {
        let level = grid.level[l];
        let cell = level.cell.xyz;
        let place = (particle.centre - level.low.xyz) / cell;
        // At least the nearest cells, so that particles smaller than a cell are spread too.
        let reach = max(vec3(ball) / cell, vec3(0.5)) + 0.5;
        let last = vec3<f32>(level.size.xyz) - 1.0;
        if any(place + reach < vec3(0.0)) || any(place - reach > last + 1.0) {
            continue;
        }
        let first_cell = vec3<i32>(floor(place - reach));
        let last_cell = vec3<i32>(floor(place + reach));
        var total = 0.0;
        // Small balls: linear between the nearest cells.
        let small = ball < 0.75 * max(cell.x, max(cell.y, cell.z));
        for (var pass_index = 0u; pass_index < 2u; pass_index++) {
            let scale = mass / (max(total, 1e-20) * cell.x * cell.y * cell.z * grid.quantum);
            // The sum runs over the whole ball, also where it sticks out of the level.
            var begin_cell = first_cell;
            var end_cell = last_cell;
            if pass_index == 1u {
                begin_cell = max(first_cell, vec3(0));
                end_cell = min(last_cell, vec3<i32>(last));
            }
            for (var z = begin_cell.z; z <= end_cell.z; z++) {
                for (var y = begin_cell.y; y <= end_cell.y; y++) {
                    for (var x = begin_cell.x; x <= end_cell.x; x++) {
                        let away = place - vec3(f32(x), f32(y), f32(z)) - 0.5;
                        let hat = max(1.0 - abs(away), vec3(0.0));
                        let share = select(ball_share(ball, away * cell, cell), hat.x * hat.y * hat.z, small);
                        if pass_index == 0u {
                            total += share;
                        } else if share > 0.0 {
                            let index = grid_index(level, vec3<u32>(vec3(x, y, z)));
                            atomicAdd(&matter[index], u32(share * scale + 0.5));
                        }
                    }
                }
            }
        }
    }
}

@compute @workgroup_size(64)
fn density(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < grid.cells {
        extinction[id.x] = f32(atomicLoad(&matter[id.x])) * grid.quantum;
    }
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

// Light along a direction at a point outside of level `inner`: from the coarser level, or from
// outside of all.
fn inflow(inner: u32, direction_index: u32, point: vec3<f32>) -> vec3<f32> {
    if inner + 1u < grid.levels {
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

fn sun_inflow(inner: u32, point: vec3<f32>) -> f32 {
    if inner + 1u < grid.levels {
        let outer = grid.level[inner + 1u];
        let place = grid_place(outer, point);
        if place.inside {
            var sum = 0.0;
            for (var corner = 0u; corner < 8u; corner++) {
                sum += corner_weight(place, corner) * sun_transmittance[grid_index(outer, corner_of(place, corner))];
            }
            return sum;
        }
    }
    return 1.0;
}

// How a direction crosses the planes of cells: along its steepest axis, in cells.
struct Crossing {
    main: u32,       // axis across the planes
    second: u32,     // the two axes in a plane
    third: u32,
    forward: bool,
    slope: vec2<f32>,// cells upstream in the plane per plane, with sign
    path: f32,       // m between planes
}

fn crossing(direction: vec3<f32>, cell: vec3<f32>) -> Crossing {
    var result: Crossing;
    let rate = direction / cell;
    let steep = abs(rate);
    if steep.x >= steep.y && steep.x >= steep.z {
        result.main = 0u;
    } else if steep.y >= steep.z {
        result.main = 1u;
    } else {
        result.main = 2u;
    }
    result.second = (result.main + 1u) % 3u;
    result.third = (result.main + 2u) % 3u;
    result.forward = rate[result.main] > 0.0;
    result.slope = -vec2(rate[result.second], rate[result.third]) / steep[result.main];
    result.path = 1.0 / steep[result.main];
    return result;
}

fn cell_from(c: Crossing, main: i32, second: i32, third: i32) -> vec3<i32> {
    var cell = vec3(0);
    cell[c.main] = main;
    cell[c.second] = second;
    cell[c.third] = third;
    return cell;
}

@compute @workgroup_size(128)
fn sunlight(@builtin(local_invocation_index) local: u32) {
    let level = grid.level[stage.level];
    let c = crossing(-grid.sun.xyz, level.cell.xyz);
    let planes = i32(level.size[c.main]);
    let width = i32(level.size[c.second]);
    let count = u32(width) * level.size[c.third];
    let whole = floor(c.slope);
    let f = c.slope - whole;
    for (var p = 0; p < planes; p++) {
        let main = select(planes - 1 - p, p, c.forward);
        let before = select(main + 1, main - 1, c.forward);
        for (var i = local; i < count; i += WORKGROUP) {
            let second = i32(i) % width;
            let third = i32(i) / width;
            let here = grid_index(level, vec3<u32>(cell_from(c, main, second, third)));
            var light = 0.0;
            var matter_before = 0.0;
            for (var tap = 0u; tap < 4u; tap++) {
                let weight = select(1.0 - f.x, f.x, (tap & 1u) != 0u) * select(1.0 - f.y, f.y, (tap & 2u) != 0u);
                let cell = cell_from(c, before, second + i32(whole.x) + i32(tap & 1u), third + i32(whole.y) + i32(tap >> 1u));
                if all(cell >= vec3(0)) && all(cell < vec3<i32>(level.size.xyz)) {
                    let there = grid_index(level, vec3<u32>(cell));
                    light += weight * sun_transmittance[there];
                    matter_before += weight * extinction[there];
                } else if weight > 0.0 {
                    light += weight * sun_inflow(stage.level, cell_centre(level, vec3<f32>(cell)));
                }
            }
            let tau = 0.5 * (matter_before + extinction[here]) * c.path;
            sun_transmittance[here] = light * exp(-tau);
        }
        storageBarrier();
    }
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
    for (var axis = 0u; axis < 6u; axis++) {
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
    let sun = sun_transmittance[index] / (4.0 * PI);
    var scattered: array<vec3<f32>, 12>;
    var sum = vec3(0.0);
    var kept = vec3(0.0);
    for (var axis = 0u; axis < 6u; axis++) {
        let d = grid_direction(2u * axis);
        let same = (1.0 - second) / 12.0 * total + 0.5 * second * even[axis];
        let turned = 0.25 * first * (odd[0] * d.x + odd[1] * d.y + odd[2] * d.z);
        let cosine = -dot(d, grid.sun.xyz);
        let moments = vec2(first, second);
        let along = grid.albedo * (same + turned + vec3(sun * grid_phase(moments, cosine), 0.0, 0.0));
        let against = grid.albedo * (same - turned + vec3(sun * grid_phase(moments, -cosine), 0.0, 0.0));
        scattered[2u * axis] = along;
        scattered[2u * axis + 1u] = against;
        sum += along + against;
        kept += max(along, vec3(0.0)) + max(against, vec3(0.0));
    }
    // A phase function of degree 2 is negative at some angles: there is no light then, and the other
    // directions give what that adds. Where nothing is negative nothing changes, to the bit.
    let balance = select(sum / kept, vec3(1.0), sum >= kept);
    for (var d = 0u; d < DIRECTIONS; d++) {
        sources[d * grid.cells + index] = pack_light(balance * max(scattered[d], vec3(0.0)));
    }
}

// A cell before the one that is worked on.
struct Upstream {
    light: vec3<f32>,
    extinction: f32,     // 1/m; 0 outside of the level
    source: vec3<f32>,
}

// Carries light along one direction through a level: short characteristics between rows of cells
// with a source linear in optical depth (Kunasz and Auer 1988). Light comes from the cell before and
// from the one beside it upstream; the walk along a row goes so that the latter is the former of the
// cell worked on last.
@compute @workgroup_size(32)
fn sweep(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let level = grid.level[stage.level];
    let c = crossing(grid_direction(group.y), level.cell.xyz);
    let steps = vec3<i32>(1, i32(level.size.x), i32(level.size.x * level.size.y));
    // The axis along which the direction does not change is the one between planes.
    let turned = c.slope.x == 0.0;
    let plane_axis = select(c.third, c.second, turned);
    let row_axis = select(c.second, c.third, turned);
    let slope = select(c.slope.x, c.slope.y, turned);
    let plane = group.x * 32u + local;
    if plane >= level.size[plane_axis] {
        return;
    }
    let weight = abs(slope);
    let rows = i32(level.size[c.main]);
    let width = i32(level.size[row_axis]);
    let main_step = select(-steps[c.main], steps[c.main], c.forward);
    // Upstream beside is at higher numbers: from high to low.
    let falling = slope > 0.0;
    let walk = select(1, -1, falling);
    let row_step = walk * steps[row_axis];
    let base = i32(group.y * grid.cells);
    var row = i32(level.size.w) + i32(plane) * steps[plane_axis]
        + select(rows - 1, 0, c.forward) * steps[c.main]
        + select(0, width - 1, falling) * steps[row_axis];
    for (var r = 0; r < rows; r++) {
        let before = f32(select(rows - r, r - 1, c.forward));
        var here = row;
        var beside: Upstream;
        for (var k = -1; k < width; k++) {
            var up: Upstream;
            if r > 0 && k >= 0 {
                let there = here - main_step;
                up.light = unpack_light(lights[base + there]);
                up.extinction = extinction[there];
                if up.extinction > 0.0 {
                    up.source = unpack_light(sources[base + there]);
                }
            } else {
                var cell = vec3(0.0);
                cell[c.main] = before;
                cell[row_axis] = f32(select(k, width - 1 - k, falling));
                cell[plane_axis] = f32(plane);
                up.light = inflow(stage.level, group.y, cell_centre(level, cell));
                up.extinction = 0.0;
                up.source = vec3(0.0);
            }
            if k >= 0 {
                var light = mix(up.light, beside.light, weight);
                let held = vec2((1.0 - weight) * up.extinction, weight * beside.extinction);
                let matter_before = held.x + held.y;
                let matter_here = extinction[here];
                let tau = 0.5 * (matter_before + matter_here) * c.path;
                if tau > 0.0 {
                    var source_here = vec3(0.0);
                    if matter_here > 0.0 {
                        source_here = unpack_light(sources[base + here]);
                    }
                    // At the cloud's edge only one side has a source.
                    var source_before = source_here;
                    if matter_before > 0.0 {
                        source_before = (held.x * up.source + held.y * beside.source) / matter_before;
                    }
                    if matter_here <= 0.0 {
                        source_here = source_before;
                    }
                    let opaque = opacity(tau);
                    // Weight of the near end: 1 - opaque / tau.
                    let near = select(1.0 - opaque / max(tau, 1e-3), tau * (0.5 - tau / 6.0), tau < 1e-3);
                    light = light * (1.0 - opaque) + source_here * near + source_before * (opaque - near);
                }
                lights[base + here] = pack_light(light);
                here += row_step;
            }
            beside = up;
        }
        row += main_step;
    }
}
