// Light field: what every cell of the light grid that keeps light sends towards the eye by scattering, as a
// texture that the blend filters. Twin: src/frame/cpu/light_grid.rs. The fourth channel of the two lowest layers of
// cells holds what of the ground's light is left below a column (light_ground.wgsl).
//
// Workgroup contract: in `light_field` one invocation owns one slot, in `field_outside` one cell of one level: that
// writes those that keep no light, which no eye changes, once for a solution.
#import cumuli::light_grid_data::{DIRECTIONS, GridEye, LightGridUniforms, NO_SLOT, grid_direction, grid_phase, unpack_light}
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

// What of the ground's light is left below a column, in the layers that hold it: lit by the sun, by the sky.
fn share_of(layer: u32, column: u32) -> f32 {
    if layer > 1u {
        return 0.0;
    }
    return select(shares[column].x, shares[column].y, layer == 1u);
}

@compute @workgroup_size(64)
fn field_outside(@builtin(global_invocation_id) id: vec3<u32>) {
    let level = grid.level[id.y];
    if id.y >= grid.levels || id.x >= level.size.x * level.size.y * level.size.z {
        return;
    }
    if cells[level.size.w + id.x] == NO_SLOT {
        let cell = vec3(id.x % level.size.x, (id.x / level.size.x) % level.size.y, id.x / (level.size.x * level.size.y));
        var column = cell.z * level.size.x + cell.x;
        for (var l = 0u; l < id.y; l++) {
            column += grid.level[l].size.x * grid.level[l].size.z;
        }
        let share = share_of(cell.y, column);
        textureStore(field, vec3(cell.xy, cell.z + u32(level.low.w)), vec4(grid.albedo * OUTSIDE, share));
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
    for (var d = 0u; d < DIRECTIONS; d++) {
        let weight = grid_phase(moments, -dot(grid_direction(d), view)) / 12.0;
        sum += weight * unpack_light(lights[d * grid.kept_room + id.x]);
    }
#ifndef ABSORBING
    // Exactly: the sum of the weights is 1 but for rounding.
    sum.z = 1.0;
#endif
    // A part of it: weights are negative at some angles, and rounded.
    sum.y = min(sum.y, sum.z);
    let share = share_of(cell.y, first_column + cell.z * level.size.x + cell.x);
    textureStore(field, vec3(cell.xy, cell.z + u32(level.low.w)), vec4(grid.albedo * max(sum, vec3(0.0)), share));
}
