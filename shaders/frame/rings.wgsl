// Rings: cells around the camera become particles. Integer cell coordinates and their hash decide
// everything about a particle, so nothing changes when the camera moves, and nothing degrades far
// from the origin. Twin: src/frame/cpu/rings.rs.
//
// Workgroup contract: one invocation owns one column of cells (all layers above one square of one
// ring). `count` writes its number of particles; after the scan `write` puts them at its offset,
// so their order never depends on timing.
#import cumuli::gpu_data::{CloudUniforms, Particle, ParticleCount, Ring}
#import cumuli::noise::{gradient_noise, hash, hash_combine, unit_float}
#import cumuli::numerics::unfolded
#import cumuli::quaternion::uniform_rotation
#import cumuli::weather::{Weather, has_map, map_excess, weather_at}

@group(0) @binding(0) var<uniform> clouds: CloudUniforms;
@group(0) @binding(1) var<storage, read_write> column_counts: array<u32>;
@group(0) @binding(2) var<storage, read> column_offsets: array<u32>;
@group(0) @binding(3) var<storage, read_write> particles: array<Particle>;
@group(0) @binding(4) var<storage, read_write> particle_count: ParticleCount;

// Amplitude of an octave of the coverage noise relative to the one twice as long.
const PERSISTENCE: f32 = 0.5;
// Growth (0 to 1) below which a particle is left out, and above which it is fully dense.
const GROWTH_SEEN: f32 = 0.2;
const GROWTH_DENSE: f32 = 0.45;
// Radius of the smallest fully grown particle relative to the largest.
const SMALLEST_RADIUS: f32 = 0.7;
// Largest radius relative to the height of the cloud at the place.
const RIM_RADIUS: f32 = 0.6;
// Radius below which a particle is left out, and above which it is fully dense, relative to the
// largest.
const LEAST_RADIUS: f32 = 0.25;
const DENSE_RADIUS: f32 = 0.5;
// Share of a layer's height over which a particle's centre varies.
const HEIGHT_JITTER: f32 = 0.7;
// Centre of a particle at the cloud base above the base, in radii: less than 1 since the outermost
// shell of a shaped particle is nearly empty.
const BASE_LIFT: f32 = 0.75;

// A place in the cloud field: `cell` in innermost cells, plus `offset` cells.
struct FieldPlace {
    cell: vec2<i32>,
    offset: vec2<f32>,
}

// For `unfolded`: cells, beyond every offset; beyond every column.
const NOWHERE: f32 = 1e30;
const NO_COLUMN: u32 = 0xffffffffu;

// Largest value of gradient noise (shared/noise.wgsl).
const MOST_NOISE: f32 = 1.5;
// What a sum of noise that is not finished has to lack, beyond what octaves can add, to be given up: far more than
// is rounded in sums of 3 and in `least_noise`.
const NOISE_MARGIN: f32 = 1e-3;
// Less than any noise.
const NO_NOISE: f32 = -1e30;

// Sum of octaves of gradient noise over the horizontal plane and time; or a part of it that is below `least`, where
// the octaves that are left cannot lift it above that.
fn coverage_noise(place: FieldPlace, least: f32) -> f32 {
    var sum = 0.0;
    var amplitude = 1.0;
    let octaves = unfolded(clouds.octaves, place.offset.x > NOWHERE);
    let last = exp2(1.0 - f32(octaves)); // amplitude
    for (var octave = 0u; octave < octaves && sum + MOST_NOISE * (2.0 * amplitude - last) > least - NOISE_MARGIN; octave++) {
        let shift = clouds.largest_shift - octave;
        let wavelength = i32(1u << shift);
        let within = vec2<f32>(place.cell & vec2(wavelength - 1)) + place.offset;
        let scaled = within / f32(wavelength);
        let whole = floor(scaled);
        let lattice = (place.cell >> vec2(shift)) + vec2<i32>(whole);
        let cell = vec3(lattice.x, clouds.evolution_cell[octave].x, lattice.y);
        let fraction = scaled - whole;
        let f = vec3(fraction.x, clouds.evolution[octave].x, fraction.y);
        sum += amplitude * gradient_noise(hash_combine(clouds.seed, octave), cell, f);
        amplitude *= PERSISTENCE;
    }
    return sum;
}

// Height of the cloud (m above its base) where the coverage noise rises so far above its threshold,
// 0 to 1; 0 is clear.
fn cloud_height(excess: f32) -> f32 {
    // A dome: it rises from the rim at a finite slope and is rounded on top.
    return clouds.thickness * excess * (2.0 - excess);
}

// Coverage noise below which nothing grows at an altitude (m above the base) in a ring, where no map says what
// covers the sky. `height`: factor on the height of clouds.
fn least_noise(ring: Ring, altitude: f32, height: f32) -> f32 {
    let grown = altitude - (0.5 - GROWTH_SEEN) * ring.layer_height;
    let large = LEAST_RADIUS / RIM_RADIUS * clouds.particle_size * ring.cell_size;
    let share = max(grown, large) / (clouds.thickness * height);
    let excess = 1.0 - sqrt(max(1.0 - share, 0.0)); // of `cloud_height`
    return clouds.threshold + excess / clouds.inverse_range;
}

fn fade(begin_end: vec2<f32>, distance: f32) -> f32 {
    return smoothstep(begin_end.x, begin_end.y, distance);
}

struct Candidate {
    alive: bool,
    particle: Particle,
}

fn candidate(ring_index: u32, ring: Ring, cell_in_ring: vec2<u32>, layer: u32) -> Candidate {
    var result: Candidate;
    result.alive = false;
    let cell = ring.first_cell + vec2<i32>(cell_in_ring);
    let cell_bits = bitcast<vec2<u32>>(cell);
    let column = hash_combine(hash_combine(hash_combine(clouds.seed, 0x51ed0u + ring_index), cell_bits.x), cell_bits.y);
    let id = hash_combine(column, layer);
    let h1 = hash(id ^ 0x1b873593u);
    let h2 = hash(h1);
    let h3 = hash(h2);
    let h4 = hash(h3);
    let jitter = vec3(unit_float(id), unit_float(h1), unit_float(h2));

    let horizontal = ring.corner + (vec2<f32>(cell_in_ring) + jitter.xz) * ring.cell_size;
    let distance = length(horizontal);
    let weight = fade(ring.fade_in, distance) * (1.0 - fade(ring.fade_out, distance));
    if weight <= 0.0 {
        return result;
    }
    var place: FieldPlace;
    place.cell = cell * i32(1u << ring_index);
    place.offset = jitter.xz * f32(1u << ring_index);
    var weather = Weather(1.0, 1.0, 1.0);
    let mapped = has_map();
    if mapped {
        weather = weather_at(clouds.map, ring, cell_in_ring, place.offset);
        if weather.coverage <= 0.0 || weather.extinction <= 0.0 {
            return result;
        }
    }
    let altitude = (f32(layer) + 0.5 + HEIGHT_JITTER * (jitter.y - 0.5)) * ring.layer_height;
    // A map's coverage has thresholds of its own.
    let noise = coverage_noise(place, select(least_noise(ring, altitude, weather.height), NO_NOISE, mapped));
    var excess = clamp((noise - clouds.threshold) * clouds.inverse_range, 0.0, 1.0);
    if mapped {
        excess = map_excess(clouds.map, noise, weather.coverage);
    }
    let height = cloud_height(excess) * weather.height;
    // Grown up where the cloud reaches half a layer above the centre.
    let growth = clamp((height - altitude) / ring.layer_height + 0.5, 0.0, 1.0);
    if growth <= GROWTH_SEEN {
        return result;
    }
    let largest = clouds.particle_size * ring.cell_size;
    // Where the cloud is low, at its rim, particles are small: scud instead of balls.
    let radius = min(largest * mix(SMALLEST_RADIUS, 1.0, unit_float(h3)) * sqrt(growth), RIM_RADIUS * height);
    if radius < LEAST_RADIUS * largest {
        return result;
    }
    let entry = clouds.shape_list[h4 % clouds.shapes];
    result.particle.radius = radius;
    result.particle.centre = vec3(horizontal.x, clouds.base + max(altitude, BASE_LIFT * radius), horizontal.y);
    result.particle.orientation = uniform_rotation(vec3(unit_float(hash(h4)), unit_float(hash(h4 ^ 0x68bc21ebu)), unit_float(hash(h4 ^ 0x02e5be93u))));
    result.particle.extinction = clouds.extinction * weather.extinction * weight * smoothstep(GROWTH_SEEN, GROWTH_DENSE, growth)
        * smoothstep(LEAST_RADIUS * largest, DENSE_RADIUS * largest, radius);
    result.particle.shape = entry.x;
    result.particle.id = id;
    result.particle.optical_radius = result.particle.extinction * radius * bitcast<f32>(entry.y);
    result.alive = true;
    return result;
}

struct Column {
    ring: u32,
    cell: vec2<u32>,
}

fn column_of(index: u32) -> Column {
    var column: Column;
    column.ring = 0u;
    let rings = unfolded(clouds.rings, index == NO_COLUMN);
    for (var r = 1u; r < rings; r++) {
        if index >= clouds.ring[r].first_column {
            column.ring = r;
        }
    }
    let local = index - clouds.ring[column.ring].first_column;
    column.cell = vec2(local % clouds.cells, local / clouds.cells);
    return column;
}

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= clouds.columns {
        return;
    }
    let column = column_of(id.x);
    let ring = clouds.ring[column.ring];
    var found = 0u;
    for (var layer = 0u; layer < ring.layers; layer++) {
        let made = candidate(column.ring, ring, column.cell, layer);
        found += select(0u, 1u, made.alive);
    }
    column_counts[id.x] = found;
}

@compute @workgroup_size(64)
fn write(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= clouds.columns {
        return;
    }
    let column = column_of(id.x);
    let ring = clouds.ring[column.ring];
    var slot = clouds.first_slot + column_offsets[id.x];
    // Most columns are clear.
    let layers = select(ring.layers, 0u, column_offsets[id.x + 1u] == column_offsets[id.x]);
    for (var layer = 0u; layer < layers; layer++) {
        let made = candidate(column.ring, ring, column.cell, layer);
        if made.alive {
            if slot < clouds.capacity {
                particles[slot] = made.particle;
            }
            slot++;
        }
    }
    if id.x == 0u {
        let wanted = clouds.first_slot + column_offsets[clouds.columns];
        particle_count.wanted = wanted;
        particle_count.particles = min(wanted, clouds.capacity);
    }
}
