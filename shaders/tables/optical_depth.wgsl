// How much matter lies on a chord of a particle, and where on it. What the tables hold and why is
// told in src/tables/optical_depth/. Twins: mapping.rs, lookup.rs and table.rs there.
#define_import_path cumuli::optical_depth

#import cumuli::table_sampler::table_sampler

// Shapes other than the uniform one stand in one 3D texture: along x the first axis of the place
// on the disc, one tile for each node of the second axis of the direction; along y the second axis
// of the place, one tile for each shape; along z the first axis of the direction.
//
// Density volumes stand one behind the other along z and, when that is full, beside each other
// along x; next to each, along x, its filtered copies, each of half the size of the one before.
struct OpticalDepthParams {
    disc_nodes: f32,            // along each of the two axes of the disc
    direction_nodes: f32,       // along each of the two axes of the direction
    inverse_width: f32,         // 1 / texels along x
    inverse_height: f32,        // 1 / texels along y
    inverse_volumes: vec4<f32>, // 1 / texels of the volumes along x, y, z
}

// How the matter of a chord is spread.
struct ChordProfile {
    mean_density: f32,
    inverse_sum: f32,           // 1 / sum of the bins; 0 where there is no matter
    // Densities of 21 equal parts of the length up to a common factor: three bins of 7 bits from
    // the lowest on, above them the sum of all bins of the words before.
    // Not an array: memory that is indexed costs more than the march.
    low: vec4<u32>,             // the first four words
    high: vec4<u32>,            // the other three
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
// Bins of a profile, and the bits of a bin and below the sum.
const BINS: f32 = 21.0;
const BIN_BITS: u32 = 7u;
const BIN_MASK: u32 = 127u;
const SUM_SHIFT: u32 = 21u;
// The number that stands for density 1: the most for which 18 bins fit into the sum's 11 bits.
const FULL: f32 = 113.0;
// A largest density below this is none.
const LEAST_DENSITY: f32 = 4e-6;
// Nodes along each edge of a density volume, and volumes along z.
const VOLUME_NODES: f32 = 64.0;
const VOLUMES_DEEP: u32 = 32u;
// Radii on screen, in pixels, below which the first and the second filtered copy of thin matter are
// read, and the optical radii at which they are half of that; the twin tells why.
const COPY_PIXELS = vec2<f32>(11.0, 5.0);
const COPY_DEPTHS = vec2<f32>(12.0, 2.0);

// Square root of the mean density, start and end of the matter in the table's direction.
fn table_channels(shape: u32, disc: vec2<f32>, direction: vec2<f32>) -> vec3<f32> {
    let p = optical_depth_params;
    let place = saturate(0.5 + 0.5 * disc) * (p.disc_nodes - 1.0) + 0.5;
    let turned = saturate(0.5 + 0.5 * direction) * (p.direction_nodes - 1.0);
    let tile = min(floor(turned.y), p.direction_nodes - 2.0);
    let at = vec3(
        (place.x + p.disc_nodes * tile) * p.inverse_width,
        (place.y + p.disc_nodes * f32(shape - 1u)) * p.inverse_height,
        (turned.x + 0.5) / p.direction_nodes,
    );
    let next = vec3(at.x + p.disc_nodes * p.inverse_width, at.yz);
    return mix(
        textureSampleLevel(optical_depth_texture, table_sampler, at, 0.0).rgb,
        textureSampleLevel(optical_depth_texture, table_sampler, next, 0.0).rgb,
        turned.y - tile,
    );
}

// A quick answer. Entry and exit are points of the unit sphere in the particle's own axes; shape 0
// is uniform.
fn chord_step(shape: u32, entry: vec3<f32>, exit: vec3<f32>) -> ChordStep {
    if shape == 0u {
        return ChordStep(1.0, 0.0, 1.0, 0.0);
    }
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
    let channels = table_channels(shape, disc, direction);
    let extent = select(channels.yz, 1.0 - channels.zy, reversed);
    // Keeps the step inside the chord where its extent is widened to the least.
    let start = min(extent.x, 1.0 - LEAST_EXTENT);
    return ChordStep(channels.x * channels.x, start, 1.0 / max(extent.y - start, LEAST_EXTENT), 1.0);
}

// Share of the chord's matter before the fraction t of its length: 0 at 0, 1 at 1, never falling.
fn step_fraction(profile: ChordStep, t: f32) -> f32 {
    let x = saturate((t - profile.start) * profile.inverse_extent);
    return mix(x, x * x * (3.0 - 2.0 * x), profile.smoothness);
}

// A word from its bins and the sum of all before.
fn pack_bins(densities: vec3<f32>, sum: u32) -> u32 {
    let rounded = vec3<u32>(densities + 0.5);
    return rounded.x | (rounded.y << BIN_BITS) | (rounded.z << (2u * BIN_BITS)) | (sum << SUM_SHIFT);
}

// The sum of all bins of a word and before.
fn sum_after(word: u32) -> u32 {
    return (word >> SUM_SHIFT) + (word & BIN_MASK) + ((word >> BIN_BITS) & BIN_MASK) + ((word >> (2u * BIN_BITS)) & BIN_MASK);
}

// A profile from the densities of each word's bins.
fn pack_profile(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, d: vec3<f32>, e: vec3<f32>, f: vec3<f32>, g: vec3<f32>) -> ChordProfile {
    // The largest bin takes all its bits, so that no chord loses what little it has.
    let most = max(max(max(a, b), max(c, d)), max(max(e, f), g));
    let factor = FULL / max(max(most.x, max(most.y, most.z)), LEAST_DENSITY);
    var result: ChordProfile;
    result.mean_density = dot(a + b + c + d + e + f + g, vec3(1.0 / BINS));
    result.low.x = pack_bins(a * factor, 0u);
    result.low.y = pack_bins(b * factor, sum_after(result.low.x));
    result.low.z = pack_bins(c * factor, sum_after(result.low.y));
    result.low.w = pack_bins(d * factor, sum_after(result.low.z));
    result.high.x = pack_bins(e * factor, sum_after(result.low.w));
    result.high.y = pack_bins(f * factor, sum_after(result.high.x));
    result.high.z = pack_bins(g * factor, sum_after(result.high.y));
    let sum = sum_after(result.high.z);
    result.inverse_sum = select(0.0, 1.0 / f32(sum), sum > 0u);
    return result;
}

// Densities in the bins of a word, whose first one lies at this texture place.
fn march_bins(at: vec3<f32>, step: vec3<f32>) -> vec3<f32> {
    return vec3(
        textureSampleLevel(density_texture, table_sampler, at, 0.0).r,
        textureSampleLevel(density_texture, table_sampler, at + step, 0.0).r,
        textureSampleLevel(density_texture, table_sampler, at + 2.0 * step, 0.0).r,
    );
}

// Where a march runs through the texture of the densities, and its step.
struct March {
    at: vec3<f32>,
    step: vec3<f32>,
}

// Through a shape's density, or a filtered copy of it (0 is the density itself): the place in radii
// where the march begins, and its step.
fn march_from(shape: u32, begin: vec3<f32>, along: vec3<f32>, copy: u32) -> March {
    let inverse = optical_depth_params.inverse_volumes.xyz;
    let size = VOLUME_NODES / f32(1u << copy);
    let column = f32((shape - 1u) / VOLUMES_DEEP);
    let row = f32((shape - 1u) % VOLUMES_DEEP);
    // Copies stand behind one another: half, three quarters, ... of a volume's size further on.
    let first = vec3(2.0 * VOLUME_NODES * (column + 1.0) - 2.0 * size, 0.0, VOLUME_NODES * row);
    // The outermost nodes lie on the faces of the cube.
    let scale = 0.5 * (size - 1.0);
    return March((first + 0.5 * size + begin * scale) * inverse, along * scale * inverse);
}

// Density at a place in radii, of a shape or a filtered copy of it; 0 outside of the cube around the sphere.
fn density_at(shape: u32, place: vec3<f32>, copy: u32) -> f32 {
    if any(abs(place) > vec3(1.0)) {
        return 0.0;
    }
    if shape == 0u {
        return select(0.0, 1.0, dot(place, place) <= 1.0);
    }
    return textureSampleLevel(density_texture, table_sampler, march_from(shape, place, vec3(0.0), copy).at, 0.0).r;
}

// Over the bins of a chord.
fn march_between(shape: u32, entry: vec3<f32>, exit: vec3<f32>, copy: u32) -> March {
    let step = (exit - entry) / BINS;
    return march_from(shape, entry + 0.5 * step, step, copy);
}

// Densities after these numbers of steps, where they are wanted.
fn densities(m: March, places: vec4<f32>, wanted: vec4<bool>) -> vec4<f32> {
    var found = vec4(0.0);
    if wanted.x {
        found.x = textureSampleLevel(density_texture, table_sampler, m.at + places.x * m.step, 0.0).r;
    }
    if wanted.y {
        found.y = textureSampleLevel(density_texture, table_sampler, m.at + places.y * m.step, 0.0).r;
    }
    if wanted.z {
        found.z = textureSampleLevel(density_texture, table_sampler, m.at + places.z * m.step, 0.0).r;
    }
    if wanted.w {
        found.w = textureSampleLevel(density_texture, table_sampler, m.at + places.w * m.step, 0.0).r;
    }
    return found;
}

// The best answer. Entry and exit are points of the unit sphere in the particle's own axes; shape
// 0 is uniform.
fn chord_profile(shape: u32, entry: vec3<f32>, exit: vec3<f32>, copy: u32) -> ChordProfile {
    if shape == 0u {
        let full = vec3(1.0);
        return pack_profile(full, full, full, full, full, full, full);
    }
    let m = march_between(shape, entry, exit, copy);
    let a = march_bins(m.at, m.step);
    let b = march_bins(m.at + 3.0 * m.step, m.step);
    let c = march_bins(m.at + 6.0 * m.step, m.step);
    let d = march_bins(m.at + 9.0 * m.step, m.step);
    let e = march_bins(m.at + 12.0 * m.step, m.step);
    let f = march_bins(m.at + 15.0 * m.step, m.step);
    let g = march_bins(m.at + 18.0 * m.step, m.step);
    return pack_profile(a, b, c, d, e, f, g);
}

// The same without packing, for single chords: x the mean density, y and z the shares of the
// matter before the fractions `begin` and `end` of the length.
fn chord_part(shape: u32, entry: vec3<f32>, exit: vec3<f32>, begin: f32, end: f32) -> vec3<f32> {
    if shape == 0u {
        return vec3(1.0, begin, end);
    }
    let m = march_between(shape, entry, exit, 0u);
    var sums = vec3(0.0);
    for (var bin = 0.0; bin < BINS; bin += 1.0) {
        let density = textureSampleLevel(density_texture, table_sampler, m.at + bin * m.step, 0.0).r;
        sums += density * vec3(1.0, saturate(begin * BINS - bin), saturate(end * BINS - bin));
    }
    return vec3(sums.x / BINS, select(vec2(begin, end), min(sums.yz / sums.x, vec2(1.0)), sums.x > 0.0));
}

// Pixels in a radian around a ray, in a picture of so many pixels across half of which is `tangent` wide; `cosine`
// is that of the ray's angle to the view axis. A rectilinear picture stretches things by 1 / cosine along circles
// around its middle and by the square of that across them: here the mean by area.
fn pixels_per_radian(width: u32, tangent: f32, cosine: f32) -> f32 {
    return 0.5 * f32(width) / (tangent * cosine * sqrt(cosine));
}

// The copy for a particle of this radius on screen, in pixels, and this optical depth of its mean
// density over a radius.
fn copy_for(radius_pixels: f32, optical_radius: f32) -> u32 {
    let serves = radius_pixels * (1.0 + optical_radius / COPY_DEPTHS) < COPY_PIXELS;
    return select(0u, 1u, serves.x) + select(0u, 1u, serves.y);
}

// Sum of a profile's bins before the fraction t of the chord's length.
fn bins_before(low: vec4<u32>, high: vec4<u32>, t: f32) -> f32 {
    let place = t * BINS;
    let bin = min(u32(place), u32(BINS) - 1u);
    let index = bin / 3u;
    let word = select(low[index & 3u], high[index & 3u], index > 3u);
    let shift = BIN_BITS * (bin - 3u * index);
    let before = word & ((1u << shift) - 1u);
    let sum = (word >> SUM_SHIFT) + (before & BIN_MASK) + (before >> BIN_BITS);
    let own = (word >> shift) & BIN_MASK;
    return f32(sum) + (place - f32(bin)) * f32(own);
}

// Share of the chord's matter before the fraction t of its length: 0 at 0, 1 at 1, never falling.
// Where there is no matter, it is the share of the length.
fn chord_fraction(profile: ChordProfile, t: f32) -> f32 {
    return select(bins_before(profile.low, profile.high, t) * profile.inverse_sum, t, profile.inverse_sum == 0.0);
}
