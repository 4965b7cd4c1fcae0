// Scattered light towards the eye at a place, from the light field's texture.
// Twin: src/frame/cpu/light_grid.rs.
#define_import_path cumuli::light_field

#import cumuli::light_grid_data::{EMPTY_CELL, GridLevel, LightGridUniforms, grid_index}

@group(3) @binding(0) var<uniform> light_grid: LightGridUniforms;
@group(3) @binding(1) var light_field: texture_3d<f32>;
@group(3) @binding(2) var light_field_sampler: sampler;
@group(3) @binding(3) var<storage, read> halo_factors: array<f32>; // rows of HALO_COLUMNS

@group(3) @binding(4) var<storage, read> grid_cells: array<u32>;   // slots; behind them extinctions by slot, 1/m

// As in src/medium/halo.rs.
const HALO_ROWS: f32 = 96.0;
const HALO_COLUMNS: f32 = 32.0;
const HALO_DEPTH: f32 = 0.05;
const HALO_DEEPEST: f32 = 60.0;

// Row of the halo's table for the angle between two unit vectors.
fn halo_row(dir: vec3<f32>, sun: vec3<f32>) -> f32 {
    // From the difference: the cosine loses the digits of small angles.
    return sqrt(min(0.5 * length(dir - sun), 1.0)) * (HALO_ROWS - 1.0);
}

// Factor on the phase function after a path of this optical depth in peak scatterings.
fn halo_factor(row: f32, depth: f32) -> f32 {
    let last = HALO_COLUMNS - 1.0;
    let column = min(log(1.0 + depth / HALO_DEPTH) * (last / log(1.0 + HALO_DEEPEST / HALO_DEPTH)), last);
    let upper = min(floor(row), HALO_ROWS - 2.0);
    let left = min(floor(column), last - 1.0);
    let first = u32(upper * HALO_COLUMNS + left);
    let second = first + u32(HALO_COLUMNS);
    let along = column - left;
    let a = mix(halo_factors[first], halo_factors[first + 1u], along);
    let b = mix(halo_factors[second], halo_factors[second + 1u], along);
    return mix(a, b, row - upper);
}

// The coarsest level. lavapipe of Mesa 22.3 notes the uniforms that branches and loops depend on in an array
// that it indexes wrongly (lvp_inline_uniforms.c: by 32 a buffer, where there is room for 4), so that
// those of a shader's eighth uniform buffer and on overwrite whatever lies behind it on the heap. Of an
// expression it takes the operands in order up to the first that is no uniform: the number of cells, of
// which there are always more than levels, comes first.
fn last_level() -> u32 {
    return min(arrayLength(&grid_cells), light_grid.levels) - 1u;
}

// The last level whose light is looked up. Coarser ones over a field reach hardly farther, and have less of what clouds look like.
// Beyond it its outermost cells stand for what is there, below a field's clouds those of its lowest layer.
fn last_lit() -> u32 {
    return min(arrayLength(&grid_cells) - 1u, light_grid.widest);
}

// Cells at the border of a level over which it fades into the coarser one.
const FADE_CELLS: f32 = 3.0;

// Flags of the grid, in conditions: in the order of operands that `last_level` tells of.
fn is_of_list() -> bool {
    return min(arrayLength(&grid_cells), light_grid.of_list) != 0u;
}

// The last level in which matter is looked for: the finest of a list has all of it.
fn last_with_matter() -> u32 {
    return select(last_lit(), 0u, is_of_list());
}

// 1 well inside of a level's sides, 0 from half a cell within them on. All levels of a field have the same clouds between base
// and top: above and below a finer one there is none that a coarser one would know, unless listed particles float there. The finest level of listed particles has
// them all: that is 1 up to its border, and from there on light falls off as coarser cells know it.
fn level_weight(level: GridLevel, point: vec3<f32>) -> f32 {
    let at = (point - level.low.xyz) / level.cell.xyz;
    let margin = min(at, vec3<f32>(level.size.xyz) - at);
    let sides = min(margin.x, margin.z);
    let all = min(sides, margin.y);
    let has_above = min(arrayLength(&grid_cells), light_grid.has_above) != 0u;
    let inside = select(select(sides, all, has_above) - 0.5, all + FADE_CELLS, is_of_list());
    return saturate(inside / FADE_CELLS);
}

// Where a point lies in the texture, in texels.
fn texel_of(level: GridLevel, point: vec3<f32>) -> vec3<f32> {
    let size = vec3<f32>(level.size.xyz);
    let at = clamp((point - level.low.xyz) / level.cell.xyz, vec3(0.5), size - 0.5);
    return vec3(at.xy, at.z + level.low.w);
}

fn texels_at(texel: vec3<f32>) -> vec4<f32> {
    return textureSampleLevel(light_field, light_field_sampler, texel / vec3<f32>(textureDimensions(light_field)), 0.0);
}

// Weights that all are less than that of a cell without matter are those of no cell.
const LEAST_CELL_WEIGHT: f32 = 1e-3;

// Light of the cells around a point, those with more matter counting more (frame/light_field.wgsl).
fn level_light(level: GridLevel, point: vec3<f32>) -> vec3<f32> {
    let found = texels_at(texel_of(level, point));
    return found.xyz / max(found.w, LEAST_CELL_WEIGHT);
}

// Of a field, 1 well between base and top of a level, 0 from half a cell within them on.
fn height_weight(level: GridLevel, point: vec3<f32>) -> f32 {
    let at = (point.y - level.low.y) / level.cell.y;
    let margin = min(at, f32(level.size.y) - at) - 0.5;
    return select(saturate(margin / FADE_CELLS), 1.0, is_of_list());
}

// Light at a point relative to the grid's anchor; `afar` 1: as far above and below the clouds as coarser cells know it.
fn light_at(point: vec3<f32>, afar: f32) -> vec3<f32> {
    var sum = vec3(0.0);
    var left = 1.0;
    let last = last_lit();
    for (var l = 0u; l <= last; l++) {
        let level = light_grid.level[l];
        let within = level_weight(level, point) * mix(1.0, height_weight(level, point), afar);
        let weight = select(within, 1.0, l == last);
        if weight > 0.0 {
            sum += left * weight * level_light(level, point);
            left *= 1.0 - weight;
            if left <= 0.0 {
                break;
            }
        }
    }
    return sum;
}

// What droplets at a point relative to the grid's anchor scatter to the eye. x: per unit of sun irradiance, y: per radiance
// from above, z: per radiance from all sides.
fn scattered_light(point: vec3<f32>) -> vec3<f32> {
    return light_at(point, 0.0);
}

// The same in the air around clouds: what reaches it above and below them comes from many.
fn light_from_afar(point: vec3<f32>) -> vec3<f32> {
    return light_at(point, 1.0);
}

// What the clouds leave of the light of the ground below a point among them, over that of bare ground: lit by the
// sun, by the sky. It is kept in the texture's last row.
fn ground_shares(point: vec3<f32>) -> vec2<f32> {
    var sum = vec2(0.0);
    var left = 1.0;
    let last = last_lit();
    let row = f32(textureDimensions(light_field).y) - 0.5;
    for (var l = 0u; l <= last; l++) {
        let level = light_grid.level[l];
        let weight = select(level_weight(level, point), 1.0, l == last);
        if weight > 0.0 {
            let texel = texel_of(level, point);
            sum += left * weight * texels_at(vec3(texel.x, row, texel.z)).xy;
            left *= 1.0 - weight;
            if left <= 0.0 {
                break;
            }
        }
    }
    return sum;
}

// The finest level that holds a point to its sides, of those whose light is looked up; of a list also a little beyond it.
fn level_of(point: vec3<f32>) -> u32 {
    var chosen = 0u;
    while chosen < last_lit() && level_weight(light_grid.level[chosen], point) <= 0.0 {
        chosen++;
    }
    return chosen;
}

// A particle with less extinction than that, spread over a cell (1/m), is nothing: others crowd it.
const LEAST_EXTINCTION: f32 = 1e-30;

// Levels on which the matter around a particle is looked for: the finest that holds it, and coarser
// ones, also those whose light is not looked up, so that a particle just before a cloud counts as part of it.
const CROWD_LEVELS: u32 = 3u;

// Extinction of all matter around a point (1/m) over that of one particle if it were alone there: its
// extinction times volume (m^2) spread over its ball (m) or over a cell, whichever is larger. The
// largest of the levels.
fn crowding(point: vec3<f32>, mass: f32, ball: f32) -> f32 {
    var crowd = 0.0;
    let finest = level_of(point);
    for (var l = finest; l < min(finest + CROWD_LEVELS, last_level() + 1u); l++) {
        let level = light_grid.level[l];
        let own = mass / max(4.18879 * ball * ball * ball, level.cell.x * level.cell.y * level.cell.z);
        let at = clamp((point - level.low.xyz) / level.cell.xyz, vec3(0.0), vec3<f32>(level.size.xyz) - 1.0);
        let slot = grid_cells[grid_index(level, vec3<u32>(at))];
        if slot < EMPTY_CELL {
            let extinction = bitcast<f32>(grid_cells[light_grid.cells + slot]);
            crowd = max(crowd, extinction / max(own, LEAST_EXTINCTION));
        }
    }
    return crowd;
}
