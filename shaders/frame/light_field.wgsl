// Light field: what every cell of the light grid sends towards the eye by scattering, as a texture
// that the blend filters. Twin: src/frame/cpu/light_grid.rs. The fourth channel of the two lowest layers of
// cells holds what of the ground's light is left below a column (light_ground.wgsl).
//
// Workgroup contract: one invocation owns one cell of one level.
#import cumuli::light_grid_data::{DIRECTIONS, GridEye, LightGridUniforms, grid_direction, grid_index, grid_phase, unpack_light}

@group(0) @binding(0) var<uniform> eye: GridEye;
@group(0) @binding(1) var<uniform> grid: LightGridUniforms;
#ifdef ABSORBING
@group(0) @binding(2) var<storage, read> lights: array<vec2<u32>>; // [direction][cell]
#else
@group(0) @binding(2) var<storage, read> lights: array<u32>;       // [direction][cell]
#endif
@group(0) @binding(3) var<storage, read> shares: array<vec2<f32>>; // by level and column
@group(0) @binding(4) var field: texture_storage_3d<rgba16float, write>;

// Distance from the eye, in cells, within which the direction to it is not that of the cell's
// centre alone.
const NEAR: f32 = 1.0;
// Distance of a cell that holds the eye at its middle, m: the moments, which alone know the direction, are
// 0 there.
const LEAST_DISTANCE: f32 = 1e-6;

@compute @workgroup_size(64)
fn light_field(@builtin(global_invocation_id) id: vec3<u32>) {
    let level = grid.level[id.y];
    if id.y >= grid.levels || id.x >= level.size.x * level.size.y * level.size.z {
        return;
    }
    let cell = vec3(id.x % level.size.x, (id.x / level.size.x) % level.size.y, id.x / (level.size.x * level.size.y));
    let centre = level.low.xyz + (vec3<f32>(cell) + 0.5) * level.cell.xyz - eye.position.xyz;
    let distance = length(centre);
    // Light that reaches the eye travels against its view.
    let view = centre / max(distance, LEAST_DISTANCE);
    // Around the eye the views of a cell's parts differ: the moments shrink to those of a wide cone.
    let sharp = smoothstep(0.0, NEAR, distance / max(level.cell.x, max(level.cell.y, level.cell.z)));
    let moments = vec2(grid.moment_first, grid.moment_second) * sharp;
    var sum = vec3(0.0);
    let index = grid_index(level, cell);
    for (var d = 0u; d < DIRECTIONS; d++) {
        let weight = grid_phase(moments, -dot(grid_direction(d), view)) / 12.0;
        sum += weight * unpack_light(lights[d * grid.cells + index]);
    }
#ifndef ABSORBING
    // Exactly: the sum of the weights is 1 but for rounding.
    sum.z = 1.0;
#endif
    // A part of it: weights are negative at some angles, and rounded.
    sum.y = min(sum.y, sum.z);
    var share = 0.0;
    if cell.y < 2u {
        var column = cell.z * level.size.x + cell.x;
        for (var l = 0u; l < id.y; l++) {
            column += grid.level[l].size.x * grid.level[l].size.z;
        }
        share = select(shares[column].x, shares[column].y, cell.y == 1u);
    }
    let slice = grid.level[id.y].low.w;
    textureStore(field, vec3(cell.xy, cell.z + u32(slice)), vec4(grid.albedo * max(sum, vec3(0.0)), share));
}
