// Light field: what every cell of the light grid sends towards the eye by scattering, as a texture
// that the blend filters. Twin: src/frame/cpu/light_grid.rs.
//
// Workgroup contract: one invocation owns one cell of one level.
#import cumuli::light_grid_data::{DIRECTIONS, GridEye, LightGridUniforms, crossing, grid_direction, grid_index, grid_phase, unpack_light}

@group(0) @binding(0) var<uniform> eye: GridEye;
@group(0) @binding(1) var<uniform> grid: LightGridUniforms;
@group(0) @binding(2) var<storage, read> sun_transmittance: array<f32>;
#ifdef ABSORBING
@group(0) @binding(3) var<storage, read> lights: array<vec2<u32>>; // [direction][cell]
#else
@group(0) @binding(3) var<storage, read> lights: array<u32>;       // [direction][cell]
#endif
@group(0) @binding(4) var<storage, read> extinction: array<f32>; // 1/m
@group(0) @binding(5) var field: texture_storage_3d<rgba16float, write>; // light; a: optical depth to the sun

// Distance from the eye, in cells, within which the direction to it is not that of the cell's
// centre alone.
const NEAR: f32 = 1.0;
// Optical depth beyond which the sun is not there.
const DEEPEST: f32 = 80.0;
// The same as a transmittance, below exp(-DEEPEST): the logarithm of 0 stays finite, and is cut there.
const LEAST_TRANSMITTANCE: f32 = 1e-37;
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
    // The grid keeps what comes in; the light field tells the middle.
    let half_way = 0.5 * extinction[index] * crossing(-grid.sun.xyz, level.cell.xyz).path;
    // Sums of rounded weights may pass 1.
    let depth = clamp(half_way - log(max(sun_transmittance[index], LEAST_TRANSMITTANCE)), 0.0, DEEPEST);
    let slice = grid.level[id.y].low.w;
    textureStore(field, vec3(cell.xy, cell.z + u32(slice)), vec4(grid.albedo * max(sum, vec3(0.0)), depth));
}
