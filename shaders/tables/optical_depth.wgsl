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
    shares: vec3<f32>,          // of the matter in each third of the chord, from the entry on
    end_slope: f32,             // of the cumulative share at both ends, per third
}

@group(1) @binding(0) var optical_depth_texture: texture_3d<f32>;
@group(1) @binding(3) var<uniform> optical_depth_params: OpticalDepthParams;

// Radii; a shorter chord has no direction in f32.
const SHORTEST_CHORD: f32 = 1e-6;
// Below this mean density shares are rounding errors.
const EMPTY_DENSITY: f32 = 1e-5;

// Mean densities of the three thirds, along the table's direction of the line.
fn part_densities(shape: u32, disc: vec2<f32>, direction: vec2<f32>) -> vec3<f32> {
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
    let roots = mix(
        textureSampleLevel(optical_depth_texture, table_sampler, at, 0.0).rgb,
        textureSampleLevel(optical_depth_texture, table_sampler, next, 0.0).rgb,
        turned.y - tile,
    );
    return roots * roots;
}

// Entry and exit are points of the unit sphere in the particle's own axes; shape 0 is uniform.
fn chord_profile(shape: u32, entry: vec3<f32>, exit: vec3<f32>) -> ChordProfile {
    var profile = ChordProfile(1.0, vec3(1.0 / 3.0), 1.0 / 3.0);
    if shape == 0u {
        return profile;
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
    var parts = part_densities(shape, disc, direction);
    parts = select(parts, parts.zyx, reversed);

    let sum = parts.x + parts.y + parts.z;
    profile.mean_density = sum / 3.0;
    if profile.mean_density >= EMPTY_DENSITY {
        profile.shares = parts / sum;
        // The density of a noise shape ends at the surface of its sphere.
        profile.end_slope = 0.0;
    }
    return profile;
}

// Share of the chord's matter before the fraction t of its length: a cubic in each third with
// slopes that continue, limited so that it never falls (Fritsch and Carlson 1980).
fn chord_fraction(profile: ChordProfile, t: f32) -> f32 {
    let s = profile.shares;
    let joints = min(0.5 * (s.xy + s.yz), 3.0 * min(s.xy, s.yz));
    let x = saturate(t) * 3.0;
    let second = x >= 1.0;
    let third = x >= 2.0;
    let before = select(0.0, s.x, second) + select(0.0, s.y, third);
    let share = select(select(s.x, s.y, second), s.z, third);
    let slope_in = select(select(profile.end_slope, joints.x, second), joints.y, third);
    let slope_out = select(select(joints.x, joints.y, second), profile.end_slope, third);
    let u = x - select(0.0, 1.0, second) - select(0.0, 1.0, third);
    let v = 1.0 - u;
    let value = before + share * u * u * (3.0 - 2.0 * u) + u * v * (slope_in * v - slope_out * u);
    return saturate(value);
}
