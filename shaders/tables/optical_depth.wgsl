// How much matter lies on a chord of a particle, and where on it. What the table holds and why is
// told in src/tables/optical_depth/. Twins: mapping.rs and lookup.rs there.
#define_import_path cumuli::optical_depth

#import cumuli::table_sampler::table_sampler

// Shapes other than the uniform one stand in one 3D texture: along x the first axis of the place
// on the disc, one tile for each node of the second axis of the direction; along y the second axis
// of the place, one tile for each shape; along z the first axis of the direction.
struct OpticalDepthParams {
    disc_nodes: f32,            // along each of the two axes of the disc
    direction_nodes: f32,       // along each of the two axes of the direction
    inverse_width: f32,         // 1 / texels along x
    inverse_height: f32,        // 1 / texels along y
}

struct ChordProfile {
    mean_density: f32,
    start: f32,                 // where the matter begins, fraction of the length from the entry on
    inverse_extent: f32,        // 1 / fraction of the length that it takes
    smoothness: f32,            // 0: spread evenly there, 1: following a smooth step
}

@group(1) @binding(0) var optical_depth_texture: texture_3d<f32>;
@group(1) @binding(3) var<uniform> optical_depth_params: OpticalDepthParams;

// Radii; a shorter chord has no direction in f32.
const SHORTEST_CHORD: f32 = 1e-6;
// Least fraction of a chord's length that its matter takes.
const LEAST_EXTENT: f32 = 1e-3;

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

// Entry and exit are points of the unit sphere in the particle's own axes; shape 0 is uniform.
fn chord_profile(shape: u32, entry: vec3<f32>, exit: vec3<f32>) -> ChordProfile {
    if shape == 0u {
        return ChordProfile(1.0, 0.0, 1.0, 0.0);
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
    return ChordProfile(channels.x * channels.x, start, 1.0 / max(extent.y - start, LEAST_EXTENT), 1.0);
}

// Share of the chord's matter before the fraction t of its length: 0 at 0, 1 at 1, never falling.
fn chord_fraction(profile: ChordProfile, t: f32) -> f32 {
    let x = saturate((t - profile.start) * profile.inverse_extent);
    return mix(x, x * x * (3.0 - 2.0 * x), profile.smoothness);
}
