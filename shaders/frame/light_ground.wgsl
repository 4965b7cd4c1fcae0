// Light ground: how much of the light of sun and sky reaches the ground through the clouds, and how
// much of the ground's light that leaves for the columns of cells above it. `fall` takes the mean light
// of the lowest cells, which are nearly empty, and the beam that leaves them; `rise` gathers it as a cloud in
// the middle of a column sees it. The beam goes on from the height of the column's own level, also where it
// comes from a level whose lowest cells lie elsewhere.
// Twin: src/frame/cpu/light_grid/ground.rs.
//
// Workgroup contract: one invocation owns one column of cells of one level. `rise` reads what `fall`
// wrote: it is a dispatch of its own.
#import cumuli::light_grid_data::{GridLevel, LightGridUniforms, NO_SLOT, EMPTY_CELL, crossing, grid_direction, grid_index, light_under_sky, slot_of, unpack_light}
#import cumuli::numerics::{mean_transmittance, unfolded}

@group(0) @binding(0) var<uniform> grid: LightGridUniforms;
@group(0) @binding(1) var<storage, read> sun_mean: array<f32>;
@group(0) @binding(2) var<storage, read> cells: array<u32>;      // slots; behind them extinctions by slot, 1/m
#ifdef ABSORBING
@group(0) @binding(3) var<storage, read> lights: array<vec2<u32>>; // [direction][slot]
#else
@group(0) @binding(3) var<storage, read> lights: array<u32>;       // [direction][slot]
#endif
// Below a column: share of the sun's beam that is left, irradiance from its scattered light per unit of the
// beam's, and irradiance from the sky over that of a bare one.
@group(0) @binding(4) var<storage, read_write> fallen: array<vec4<f32>>;
// Light of the ground as a column sees it over that of bare ground: lit by the sun, by the sky.
@group(0) @binding(5) var<storage, read_write> shares: array<vec2<f32>>;

const PI: f32 = 3.14159265;
// Directions in which a column looks at the ground: equal in the cosine of the angle, and in azimuth.
const ZENITHS: u32 = 3u;
const AZIMUTHS: u32 = 4u;
// Least sine of the sun's height: below it a beam hardly lights the ground.
const LEAST_SUN: f32 = 0.01;
// Largest share: with the sun at that height, what clouds send down outshines what it does itself.
const MOST_SHARE: f32 = 100.0;

// For `unfolded`: beyond every column; m, beyond every place.
const NO_COLUMN: u32 = 0xffffffffu;
const NOWHERE: f32 = 1e30;

struct Column {
    level: u32,
    x: u32,
    z: u32,
    inside: bool,
}

fn column_of(index: u32) -> Column {
    var rest = index;
    let levels = unfolded(grid.levels, index == NO_COLUMN);
    for (var l = 0u; l < levels; l++) {
        let size = grid.level[l].size;
        if rest < size.x * size.z {
            return Column(l, rest % size.x, rest / size.x, true);
        }
        rest -= size.x * size.z;
    }
    return Column(0u, 0u, 0u, false);
}

@compute @workgroup_size(64)
fn fall(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = column_of(id.x);
    if !column.inside {
        return;
    }
    let level = grid.level[column.level];
    // All cells of this layer keep light.
    let entry = cells[grid_index(level, vec3(column.x, 0u, column.z))];
    if entry == NO_SLOT {
        fallen[id.x] = vec4(1.0, 0.0, 1.0, 0.0);
        return;
    }
    let at = slot_of(entry);
    var sum = vec3(0.0);
    var all = 0.0;
    var bare = 0.0; // from the sky
    let directions = unfolded(2u * grid.axes, entry == NO_SLOT);
    for (var d = 0u; d < directions; d++) {
        let axis = d >> 1u;
        let direction = grid_direction(grid.axis[axis], d);
        let down = grid.axis[axis].w * max(-direction.y, 0.0);
        sum += down * unpack_light(lights[d * grid.kept_room + at]);
        all += down;
        bare += down * light_under_sky(direction, grid.sky[axis >> 2u][axis & 3u]).y;
    }
    // From the cell's mean to what leaves it.
    var extinction = 0.0;
    if entry < EMPTY_CELL {
        extinction = bitcast<f32>(cells[grid.cells + at]);
    }
    let tau = extinction * crossing(-grid.sun.xyz, level.cell.xyz).path;
    let beam = sun_mean[at] * exp(-tau) / mean_transmittance(tau);
    fallen[id.x] = vec4(beam, PI * sum.x / all, sum.y / bare, 0.0);
}

// What has fallen at a place, by the finest level over it; outside of all there are no clouds.
fn fallen_at(place: vec2<f32>) -> vec3<f32> {
    var first = 0u;
    let levels = unfolded(grid.levels, place.x > NOWHERE);
    for (var l = 0u; l < levels; l++) {
        let level = grid.level[l];
        let at = floor((place - level.low.xz) / level.cell.xz);
        if all(at >= vec2(0.0)) && all(at < vec2<f32>(level.size.xz)) {
            return fallen[first + u32(at.y) * level.size.x + u32(at.x)].xyz;
        }
        first += level.size.x * level.size.z;
    }
    return vec3(1.0, 0.0, 1.0);
}

@compute @workgroup_size(64)
fn rise(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = column_of(id.x);
    if !column.inside {
        return;
    }
    let level = grid.level[column.level];
    let place = level.low.xz + (vec2(f32(column.x), f32(column.z)) + 0.5) * level.cell.xz;
    // Over the ground, m: of the level's lowest and of its middle.
    let lowest = max(level.low.y - grid.sun.w, 0.0);
    let middle = lowest + 0.5 * f32(level.size.y) * level.cell.y;
    let sun_sine = max(grid.sun.y, LEAST_SUN);
    let from_sun = grid.sun.xz * (lowest / sun_sine);
    var sum = vec2(0.0);
    for (var i = 0u; i < ZENITHS; i++) {
        let cosine = (f32(i) + 0.5) / f32(ZENITHS);
        let away = middle * sqrt(1.0 - cosine * cosine) / cosine;
        for (var j = 0u; j < AZIMUTHS; j++) {
            let azimuth = 2.0 * PI * (f32(j) + f32(i) / f32(ZENITHS)) / f32(AZIMUTHS);
            let seen = place + away * vec2(cos(azimuth), sin(azimuth));
            let diffuse = fallen_at(seen);
            sum += vec2(fallen_at(seen + from_sun).x + diffuse.y / sun_sine, diffuse.z);
        }
    }
    shares[id.x] = min(sum / f32(ZENITHS * AZIMUTHS), vec2(MOST_SHARE));
}
