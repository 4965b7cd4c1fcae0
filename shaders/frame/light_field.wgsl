// Light field: what every cell of the light grid that keeps light sends towards the eye by scattering, as a
// texture that the blend filters. Twin: src/frame/cpu/light_grid.rs. Light is kept times a weight, which is the fourth
// channel and grows with the matter in a cell: between cells matter counts, so that the light in a cloud's surface
// is that of the cloud and not half that of the space before it. Behind the last layer of cells and an empty one, a row holds what of
// the ground's light is left below each column (light_ground.wgsl).
//
// Workgroup contract: in `light_field` one invocation owns one slot, in `field_outside` one cell of one level: that
// writes those that keep no light, which no eye changes, once for a solution.
#import cumuli::light_grid_data::{GridEye, LightGridUniforms, NO_SLOT, grid_direction, grid_phase, most_from_above, unpack_light}
#import cumuli::numerics::unfolded

@group(0) @binding(0) var<uniform> eye: GridEye;
@group(0) @binding(1) var<uniform> grid: LightGridUniforms;
#ifdef ABSORBING
@group(0) @binding(2) var<storage, read> lights: array<vec2<u32>>; // [direction][slot]
#else
@group(0) @binding(2) var<storage, read> lights: array<u32>;       // [direction][slot]
#endif
@group(0) @binding(3) var<storage, read> shares: array<vec2<f32>>; // by level and column
@group(0) @binding(4) var field: texture_storage_3d<rgba16float, write>;
@group(0) @binding(5) var<storage, read> cells: array<u32>;        // slots
@group(0) @binding(6) var<storage, read> cell_of: array<u32>;      // by slot
@group(0) @binding(7) var<storage, read> matter_offsets: array<u32>;
@group(0) @binding(8) var<storage, read> empty_offsets: array<u32>;

// Distance from the eye, in cells, within which the direction to it is not that of the cell's
// centre alone.
const NEAR: f32 = 1.0;
// Distance of a cell that holds the eye at its middle, m: the moments, which alone know the direction, are
// 0 there.
const LEAST_DISTANCE: f32 = 1e-6;
// Light where none is kept, far from matter: no sunlight is scattered, half of all sides lies above.
const OUTSIDE = vec3<f32>(0.0, 0.5, 1.0);

// Weight of a cell by its optical depth from bottom to top: of one without matter 1. Those of thicker cells are all alike, and
// light times the largest is within f16.
const WEIGHT_OF_DEPTH: f32 = 50.0;
const DEEPEST_WEIGHED: f32 = 20.0;

fn cell_weight(tau: f32) -> f32 {
    return 1.0 + WEIGHT_OF_DEPTH * min(tau, DEEPEST_WEIGHED);
}

// What of the ground's light is left below a column, lit by the sun, by the sky: kept with its lowest cell's light.
fn store_share(cell: vec3<u32>, slice: u32, column: u32) {
    if cell.y == 0u {
        let row = textureDimensions(field).y - 1u;
        textureStore(field, vec3(cell.x, row, cell.z + slice), vec4(shares[column], 0.0, 0.0));
    }
}

@compute @workgroup_size(64)
fn field_outside(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    // Groups along z go on with the cells: there may be more than those along x may be.
    let own = id.z * groups.x * 64u + id.x;
    let level = grid.level[id.y];
    if id.y >= grid.levels || own >= level.size.x * level.size.y * level.size.z {
        return;
    }
    if cells[level.size.w + own] == NO_SLOT {
        let cell = vec3(own % level.size.x, (own / level.size.x) % level.size.y, own / (level.size.x * level.size.y));
        var column = cell.z * level.size.x + cell.x;
        for (var l = 0u; l < id.y; l++) {
            column += grid.level[l].size.x * grid.level[l].size.z;
        }
        store_share(cell, u32(level.low.w), column);
        textureStore(field, vec3(cell.xy, cell.z + u32(level.low.w)), vec4(grid.albedo * OUTSIDE, 1.0));
    }
}

@compute @workgroup_size(64)
fn light_field(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= min(matter_offsets[grid.words] + empty_offsets[grid.words], grid.kept_room) {
        return;
    }
    let at = cell_of[id.x];
    var l = 0u;
    var first_column = 0u;
    let last = unfolded(grid.levels, at == NO_SLOT) - 1u;
    while l < last && at >= grid.level[l + 1u].size.w {
        first_column += grid.level[l].size.x * grid.level[l].size.z;
        l++;
    }
    let level = grid.level[l];
    let own = at - level.size.w;
    let cell = vec3(own % level.size.x, (own / level.size.x) % level.size.y, own / (level.size.x * level.size.y));
    let centre = level.low.xyz + (vec3<f32>(cell) + 0.5) * level.cell.xyz - eye.position.xyz;
    let distance = length(centre);
    // Light that reaches the eye travels against its view.
    let view = centre / max(distance, LEAST_DISTANCE);
    // Around the eye the views of a cell's parts differ: the moments shrink to those of a wide cone.
    let sharp = smoothstep(0.0, NEAR, distance / max(level.cell.x, max(level.cell.y, level.cell.z)));
    let moments = vec2(grid.moment_first, grid.moment_second) * sharp;
    var sum = vec3(0.0);
    let directions = unfolded(2u * grid.axes, at == NO_SLOT);
    for (var d = 0u; d < directions; d++) {
        let axis = grid.axis[d >> 1u];
        let weight = axis.w * grid_phase(moments, -dot(grid_direction(axis, d), view));
        sum += weight * unpack_light(lights[d * grid.kept_room + id.x]);
    }
#ifndef ABSORBING
    // Exactly: the sum of the weights is 1 but for rounding.
    sum.z = 1.0;
#endif
    // No more of it than there may be: weights are negative at some angles, and rounded.
    sum.y = min(sum.y, most_from_above(grid.sky) * sum.z);
    store_share(cell, u32(level.low.w), first_column + cell.z * level.size.x + cell.x);
    var extinction = 0.0;
    if id.x < matter_offsets[grid.words] {
        extinction = bitcast<f32>(cells[grid.cells + id.x]);
    }
    let light = vec4(grid.albedo * max(sum, vec3(0.0)), 1.0);
    textureStore(field, vec3(cell.xy, cell.z + u32(level.low.w)), cell_weight(extinction * level.cell.y) * light);
}
