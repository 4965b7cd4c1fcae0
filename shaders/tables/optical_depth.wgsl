// How much matter lies on a chord of a particle, and where on it. What the tables hold and why is
// told in src/tables/optical_depth/. Twins: mapping.rs, lookup.rs and table.rs there.
#define_import_path cumuli::optical_depth

#import cumuli::table_sampler::table_sampler

// A 4D table or one of its filtered copies.
struct DepthLevel {
    disc_nodes: f32,            // along each of the two axes of the disc
    direction_nodes: f32,       // along each of the two axes of the direction
    first_column: f32,          // texels along x before the level
    most_pixels: f32,           // radius on screen up to which it is read
}

// Shapes other than the uniform one stand in one 3D texture: along x all levels one after the
// other, in each the first axis of the place on the disc, one tile for each node of the second axis
// of the direction; along y the second axis of the place, one tile for each shape; along z the
// first axis of the direction. Density volumes stand one behind the other along z and, when that
// is full, beside each other along x.
struct OpticalDepthParams {
    levels: array<DepthLevel, 3>,
    inverse_size: vec4<f32>,        // 1 / texels of the 4D tables along x, y, z
    inverse_volume_size: vec4<f32>, // 1 / texels of the volumes along x, y, z
}

// How the matter of a chord is spread.
struct ChordProfile {
    mean_density: f32,
    inverse_sum: f32,           // 1 / sum of the bins; 0: the matter is spread evenly
    // Densities of 21 equal parts of the length up to a common factor: three bins of 7 bits from
    // the lowest on, above them the sum of all bins of the words before.
    words: array<u32, 7>,
}

// The mean density of a chord, and where its matter begins and ends.
struct ChordStep {
    mean_density: f32,
    start: f32,                 // fraction of the length from the entry on
    inverse_extent: f32,        // 1 / fraction of the length that it takes
    smoothness: f32,            // 0: spread evenly there, 1: following a smooth step
}

@group(1) @binding(0) var optical_depth_texture: texture_3d<f32>;
@group(1) @binding(3) var<uniform> optical_depth_params: OpticalDepthParams;
@group(1) @binding(5) var density_texture: texture_3d<f32>;

// Radii; a shorter chord has no direction in f32.
const SHORTEST_CHORD: f32 = 1e-6;
// Least fraction of a chord's length that its matter takes.
const LEAST_EXTENT: f32 = 0.1;
// Words of a profile, its bins, and the bits of a bin and below the sum.
const WORDS: u32 = 7u;
const BINS: f32 = 21.0;
const BIN_BITS: u32 = 7u;
const BIN_MASK: u32 = 127u;
const SUM_SHIFT: u32 = 21u;
// The number that stands for density 1: the most for which 18 bins fit into the sum's 11 bits.
const FULL: f32 = 113.0;
// Nodes along each edge of a density volume, and volumes along z.
const VOLUME_NODES: f32 = 64.0;
const VOLUMES_DEEP: u32 = 32u;
// Least radius on screen, in pixels, at which a particle is marched through.
const MARCH_PIXELS: f32 = 24.0;

// Square root of the mean density, start and end of the matter in the table's direction.
fn table_channels(shape: u32, disc: vec2<f32>, direction: vec2<f32>, level: DepthLevel) -> vec3<f32> {
    let inverse = optical_depth_params.inverse_size.xyz;
    let place = saturate(0.5 + 0.5 * disc) * (level.disc_nodes - 1.0) + 0.5;
    let turned = saturate(0.5 + 0.5 * direction) * (level.direction_nodes - 1.0);
    let tile = min(floor(turned.y), level.direction_nodes - 2.0);
    let at = vec3(
        level.first_column + place.x + level.disc_nodes * tile,
        place.y + optical_depth_params.levels[0].disc_nodes * f32(shape - 1u),
        turned.x + 0.5,
    ) * inverse;
    let next = vec3(at.x + level.disc_nodes * inverse.x, at.yz);
    return mix(
        textureSampleLevel(optical_depth_texture, table_sampler, at, 0.0).rgb,
        textureSampleLevel(optical_depth_texture, table_sampler, next, 0.0).rgb,
        turned.y - tile,
    );
}

fn level_step(shape: u32, entry: vec3<f32>, exit: vec3<f32>, level: DepthLevel) -> ChordStep {
    let chord = exit - entry;
    let chord_length = length(chord);
    // The shortest chords take any direction: their place decides.
    let ray = select(vec3(0.0, 0.0, 1.0), chord / max(chord_length, SHORTEST_CHORD), chord_length > SHORTEST_CHORD);
    let reversed = ray.z < 0.0;
    let d = select(ray, -ray, reversed);
    let middle = 0.5 * (entry + exit);
    let disc = middle.xy - d.xy * (middle.z / (1.0 + d.z));
    let folded = d.xy / (abs(d.x) + abs(d.y) + d.z);
    let direction = vec2(folded.x + folded.y, folded.x - folded.y);
    let channels = table_channels(shape, disc, direction, level);
    let extent = select(channels.yz, 1.0 - channels.zy, reversed);
    // Keeps the step inside the chord where its extent is widened to the least.
    let start = min(extent.x, 1.0 - LEAST_EXTENT);
    return ChordStep(channels.x * channels.x, start, 1.0 / max(extent.y - start, LEAST_EXTENT), 1.0);
}

// A quick answer. Entry and exit are points of the unit sphere in the particle's own axes; shape 0
// is uniform.
fn chord_step(shape: u32, entry: vec3<f32>, exit: vec3<f32>) -> ChordStep {
    if shape == 0u {
        return ChordStep(1.0, 0.0, 1.0, 0.0);
    }
    return level_step(shape, entry, exit, optical_depth_params.levels[0]);
}

// Share of the chord's matter before the fraction t of its length: 0 at 0, 1 at 1, never falling.
fn step_fraction(profile: ChordStep, t: f32) -> f32 {
    let x = saturate((t - profile.start) * profile.inverse_extent);
    return mix(x, x * x * (3.0 - 2.0 * x), profile.smoothness);
}

fn even_profile() -> ChordProfile {
    return ChordProfile(1.0, 0.0, array<u32, 7>(0u, 0u, 0u, 0u, 0u, 0u, 0u));
}

// A word from the rounded densities of its bins and the sum of all before.
fn pack_bins(rounded: vec3<u32>, sum: u32) -> u32 {
    return rounded.x | (rounded.y << BIN_BITS) | (rounded.z << (2u * BIN_BITS)) | (sum << SUM_SHIFT);
}

fn step_profile(profile: ChordStep) -> ChordProfile {
    var result = even_profile();
    result.mean_density = profile.mean_density;
    var sum = 0u;
    for (var word = 0u; word < WORDS; word++) {
        let middles = (vec3(0.5, 1.5, 2.5) + f32(3u * word)) / BINS;
        let x = saturate((middles - profile.start) * profile.inverse_extent);
        // The density of a smooth step, up to a factor.
        let rounded = vec3<u32>(4.0 * x * (1.0 - x) * FULL + 0.5);
        result.words[word] = pack_bins(rounded, sum);
        sum += rounded.x + rounded.y + rounded.z;
    }
    result.inverse_sum = 1.0 / f32(sum);
    return result;
}

// The best answer. Entry and exit are points of the unit sphere in the particle's own axes; shape
// 0 is uniform.
fn chord_profile(shape: u32, entry: vec3<f32>, exit: vec3<f32>) -> ChordProfile {
    var result = even_profile();
    if shape == 0u {
        return result;
    }
    let inverse = optical_depth_params.inverse_volume_size.xyz;
    let column = (shape - 1u) / VOLUMES_DEEP;
    let row = (shape - 1u) % VOLUMES_DEEP;
    let first = vec3(f32(column), 0.0, f32(row)) * VOLUME_NODES + 0.5 + 0.5 * (VOLUME_NODES - 1.0);
    let scale = 0.5 * (VOLUME_NODES - 1.0);
    let step = (exit - entry) * (scale / BINS) * inverse;
    var at = (first + entry * scale) * inverse + 0.5 * step;
    var total = 0.0;
    var sum = 0u;
    for (var word = 0u; word < WORDS; word++) {
        let densities = vec3(
            textureSampleLevel(density_texture, table_sampler, at, 0.0).r,
            textureSampleLevel(density_texture, table_sampler, at + step, 0.0).r,
            textureSampleLevel(density_texture, table_sampler, at + 2.0 * step, 0.0).r,
        );
        at += 3.0 * step;
        total += densities.x + densities.y + densities.z;
        let rounded = vec3<u32>(densities * FULL + 0.5);
        result.words[word] = pack_bins(rounded, sum);
        sum += rounded.x + rounded.y + rounded.z;
    }
    result.mean_density = total / BINS;
    result.inverse_sum = select(0.0, 1.0 / f32(sum), sum > 0u);
    return result;
}

// The answer for a particle of this radius on screen, in pixels.
fn seen_profile(shape: u32, entry: vec3<f32>, exit: vec3<f32>, radius_pixels: f32) -> ChordProfile {
    if shape == 0u || radius_pixels >= MARCH_PIXELS {
        return chord_profile(shape, entry, exit);
    }
    var level = optical_depth_params.levels[0];
    for (var i = 1u; i < 3u; i++) {
        if radius_pixels <= optical_depth_params.levels[i].most_pixels {
            level = optical_depth_params.levels[i];
        }
    }
    return step_profile(level_step(shape, entry, exit, level));
}

// Which word of a profile holds the bin that a fraction of the length lies in.
fn word_at(t: f32) -> u32 {
    return min(u32(t * BINS), u32(BINS) - 1u) / 3u;
}

// Share of the chord's matter before the fraction t of its length: 0 at 0, 1 at 1, never falling.
// `word` is the one that holds the bin of t.
fn chord_fraction(word: u32, inverse_sum: f32, t: f32) -> f32 {
    let place = t * BINS;
    let bin = min(u32(place), u32(BINS) - 1u);
    let shift = BIN_BITS * (bin % 3u);
    let before = word & ((1u << shift) - 1u);
    let sum = (word >> SUM_SHIFT) + (before & BIN_MASK) + (before >> BIN_BITS);
    let own = (word >> shift) & BIN_MASK;
    let share = (f32(sum) + (place - f32(bin)) * f32(own)) * inverse_sum;
    return select(share, t, inverse_sum == 0.0);
}
