// Weather maps: what an image says of the cloud field at a place. Twin: src/frame/cpu/weather.rs.
//
// Places on the map are whole texels and shares of them. Those of a cell follow from its number alone,
// with 32 bits each for the whole and the share, so they are the same wherever the camera is.
#define_import_path cumuli::weather

#import cumuli::gpu_data::{MapUniforms, Ring}

// Knots of the curve of thresholds (CURVE_KNOTS floats), of that of inverse ranges (as many), then the
// texels: bits 0 to 15 coverage, 16 to 23 height, 24 to 31 extinction. One word where there is no map.
@group(1) @binding(0) var<storage, read> weather_words: array<u32>;

// Knots of each curve, from coverage 0 to 1: as in src/frame/weather.rs.
const CURVE_KNOTS: u32 = 257u;
const CURVE_STEPS: f32 = 256.0;
// 2^-32 of a texel, the unit of shares.
const SHARE_UNIT: f32 = 2.3283064e-10;
// How the map goes on beyond its edges.
const REPEAT: u32 = 0u;
const CLEAR: u32 = 2u;

struct Weather {
    coverage: f32,   // 0 to 1
    height: f32,     // factor on the field's thickness
    extinction: f32, // factor on the field's extinction
}

fn has_map() -> bool {
    return arrayLength(&weather_words) > 2u * CURVE_KNOTS;
}

// Whole texel and share (2^-32) of the corner of a cell of a ring.
struct MapPlace {
    texel: vec2<i32>,
    share: vec2<u32>,
}

fn map_place(ring: Ring, cell_in_ring: vec2<u32>) -> MapPlace {
    // The product has 32 + 9 bits: in two halves, so that none is lost.
    let low = cell_in_ring * (ring.map_step_share & vec2(0xffffu));
    let high = cell_in_ring * (ring.map_step_share >> vec2(16u)) + (low >> vec2(16u));
    let share = (high << vec2(16u)) | (low & vec2(0xffffu));
    var place: MapPlace;
    place.share = ring.map_first_share + share;
    let carry = (high >> vec2(16u)) + select(vec2(0u), vec2(1u), place.share < share);
    place.texel = ring.map_first + vec2<i32>(cell_in_ring) * ring.map_step + vec2<i32>(carry);
    return place;
}

// Coverage, height and extinction of a texel, wherever it lies.
fn map_texel(map: MapUniforms, texel: vec2<i32>) -> vec3<f32> {
    let size = vec2<i32>(map.size);
    let around = ((texel % size) + size) % size;
    let within = clamp(texel, vec2(0), size - 1);
    let at = vec2<u32>(select(within, around, map.outside == REPEAT));
    let word = weather_words[2u * CURVE_KNOTS + at.y * map.size.x + at.x];
    let is_clear = any(texel != within) & (map.outside == CLEAR);
    let coverage = select(f32(word & 0xffffu) / 65535.0, 0.0, is_clear);
    return vec3(coverage, f32((word >> 16u) & 0xffu) / 255.0, f32(word >> 24u) / 255.0);
}

// What the map says `offset` innermost cells beside the corner of a cell.
fn weather_at(map: MapUniforms, ring: Ring, cell_in_ring: vec2<u32>, offset: vec2<f32>) -> Weather {
    let place = map_place(ring, cell_in_ring);
    let beside = vec2<f32>(place.share) * SHARE_UNIT + offset * map.texels;
    let whole = floor(beside);
    let fraction = beside - whole;
    let texel = place.texel + vec2<i32>(whole);
    let upper = mix(map_texel(map, texel), map_texel(map, texel + vec2(1, 0)), fraction.x);
    let lower = mix(
        map_texel(map, texel + vec2(0, 1)),
        map_texel(map, texel + vec2(1, 1)),
        fraction.x,
    );
    let value = mix(upper, lower, fraction.y);
    return Weather(map.coverage * value.x, value.y, value.z);
}

// How far the coverage noise rises above what leaves the sky clear where this share of it is covered,
// from 0 to 1 where it is highest; or the coverage itself, as far as the map does without noise.
fn map_excess(map: MapUniforms, noise: f32, coverage: f32) -> f32 {
    let at = clamp(coverage, 0.0, 1.0) * CURVE_STEPS;
    let knot = min(u32(at), CURVE_KNOTS - 2u);
    let t = at - f32(knot);
    let threshold = mix(bitcast<f32>(weather_words[knot]), bitcast<f32>(weather_words[knot + 1u]), t);
    let range = CURVE_KNOTS + knot;
    let inverse = mix(bitcast<f32>(weather_words[range]), bitcast<f32>(weather_words[range + 1u]), t);
    let excess = clamp((noise - threshold) * inverse, 0.0, 1.0);
    return mix(coverage, excess, map.noise);
}
