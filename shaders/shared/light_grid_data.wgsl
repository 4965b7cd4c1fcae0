// The grid of scattered light: where its cells lie, its directions, how a cell's light is packed.
// Host: src/frame/light_grid/. Twin: src/frame/cpu/light_grid/cells.rs.
//
// Levels go from fine (0) to coarse; a coarser one surrounds or holds the finer. Positions are
// relative to the grid's anchor. A cell's light has three parts, all per unit of what they come
// from: x scattered sunlight per unit irradiance, y light that came from the upper hemisphere at
// mean radiance 1, z light from all sides at radiance 1 (from below: z - y). With albedo 1, z is 1
// everywhere and not stored: uniform light stays uniform to the last bit.
// Only cells in or near matter keep light, in slots (light_grid_slots.wgsl).
#define_import_path cumuli::light_grid_data

struct GridLevel {
    low: vec4<f32>,   // xyz: m, lowest corner; w: first slice of the level in the field texture
    cell: vec4<f32>,  // xyz: m, side of a cell; w: index of its first word among all levels'
    size: vec4<u32>,  // xyz: cells; w: index of its first cell among all levels'
}

struct LightGridUniforms {
    sun: vec4<f32>,       // xyz: towards the sun; w: height of the ground relative to the anchor, m
    levels: u32,
    cells: u32,           // of all levels
    moment_first: f32,    // of the scaled phase function: Legendre moments 1 and 2
    moment_second: f32,
    albedo: f32,          // scaled
    quantum: f32,         // 1/m: extinction of one count of `matter`
    spreads: u32,         // entries of `spread`
    longest: u32,         // most cells along an axis of a level
    words: u32,           // of 32 cells of a row
    matter_room: u32,     // slots of cells with matter that there are buffers for
    kept_room: u32,       // of all cells that keep light, with these
    axes: u32,            // pairs of opposite directions of travel
    widest: u32,          // last level whose light is looked up
    has_above: u32,       // 1: there may be matter above and below the clouds of a field, of listed particles
    of_list: u32,         // 1: levels of listed particles alone, all of which the finest one holds
    padding_a: u32,
    sky: array<vec4<f32>, 4>,   // light from above by pairs of directions, over that of an even sky, less 1
    axis: array<vec4<f32>, 16>, // xyz: the first of a pair; w: share of the sphere that each of both stands for
    level: array<GridLevel, 10>,
}

// Which level a dispatch works on.
struct GridStage {
    level: u32,
    relaxation: f32,      // step from the sources of before towards the new ones
    is_last: u32,         // 1: the last turn of the level
    first_row: u32,       // of `sweep`: rows of slanted planes, and the one behind the last
    end_row: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

// The eye that the light field is made for.
struct GridEye {
    position: vec4<f32>, // xyz: m, relative to the anchor
}

// A cell's entry is its slot, of cells without matter with this bit, or, where it keeps no light, `NO_SLOT`.
const EMPTY_CELL: u32 = 0x80000000u;
const NO_SLOT: u32 = 0xffffffffu;

// Direction of travel of this number, of the pair that `axis` is: of opposite ones, which are neighbours in number.
fn grid_direction(axis: vec4<f32>, index: u32) -> vec3<f32> {
    return select(axis.xyz, -axis.xyz, (index & 1u) != 0u);
}

#ifdef ABSORBING
fn unpack_light(packed: vec2<u32>) -> vec3<f32> {
    return vec3(unpack2x16float(packed.x), unpack2x16float(packed.y).x);
}

fn pack_light(light: vec3<f32>) -> vec2<u32> {
    return vec2(pack2x16float(light.xy), pack2x16float(vec2(light.z, 0.0)));
}
#else
fn unpack_light(packed: u32) -> vec3<f32> {
    return vec3(unpack2x16float(packed), 1.0);
}

fn pack_light(light: vec3<f32>) -> u32 {
    return pack2x16float(light.xy);
}
#endif

// Index of a cell among all levels'.
fn grid_index(level: GridLevel, cell: vec3<u32>) -> u32 {
    return level.size.w + (cell.z * level.size.y + cell.y) * level.size.x + cell.x;
}

// Words of 32 cells in a row of so many.
fn row_words(cells: u32) -> u32 {
    return (cells + 31u) / 32u;
}

// Slot of a cell that keeps light, by its entry.
fn slot_of(entry: u32) -> u32 {
    return entry & ~EMPTY_CELL;
}

// Light that comes in from outside of all levels along a direction of travel, under a sky as bright everywhere.
fn light_from_outside(direction: vec3<f32>) -> vec3<f32> {
    let above = select(0.0, 1.0, direction.y < 0.0);
    return vec3(0.0, above, 1.0);
}

// The same under a sky as uneven as this along the direction.
fn light_under_sky(direction: vec3<f32>, uneven: f32) -> vec3<f32> {
    return light_from_outside(direction) * vec3(1.0, 1.0 + uneven, 1.0);
}

// The most that such a sky sends along a direction, over that of an even one.
fn most_from_above(sky: array<vec4<f32>, 4>) -> f32 {
    let most = max(max(sky[0], sky[1]), max(sky[2], sky[3]));
    return 1.0 + max(max(max(most.x, most.y), max(most.z, most.w)), 0.0);
}

// Scaled phase function between unit vectors of this cosine, times 4 pi: degree 2.
fn grid_phase(grid_moments: vec2<f32>, cosine: f32) -> f32 {
    return 1.0 + 3.0 * grid_moments.x * cosine + 5.0 * grid_moments.y * (1.5 * cosine * cosine - 0.5);
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
