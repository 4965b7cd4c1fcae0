// Light of higher orders as octaves of attenuated light (Wrenninge, Kulla and Lundqvist, "Oz: The Great and
// Volumetric", SIGGRAPH 2013 Talks): octave i is scattered light of order 1 with extinction on the way to the sun,
// scattering and mean cosine each times OCTAVE^i. Twin: src/frame/cpu/octaves.rs.
//
// - The medium is delta-M scaled: octave 0 is order 1 with the whole phase function, the others' is that of Henyey and
//   Greenstein with the mean cosine of what the scaling leaves.
// - Sky and ground light are attenuated by the same sum, over what it is without matter, so that light from all sides
//   stays as bright in thin clouds: the mean of that along the two directions whose depths are known, sun and eye.
#define_import_path cumuli::octaves

#import cumuli::lighting::mean_sunlight

// From one octave to the next; as in the talk.
const OCTAVE: f32 = 0.5;
const FOUR_PI: f32 = 12.5663706;
// Least square of a distance on the unit circle: of a peak of Henyey and Greenstein without width.
const LEAST_BASE: f32 = 1e-12;
// What the first four octaves' extinctions and scattering are over the true ones, and the next four's.
const LOW_SHARES = vec4<f32>(1.0, OCTAVE, OCTAVE * OCTAVE, OCTAVE * OCTAVE * OCTAVE);
const HIGH_SHARES = OCTAVE * OCTAVE * OCTAVE * OCTAVE * LOW_SHARES;
// (1 - OCTAVE) / (1 - OCTAVE^8): one over the sum of all shares.
const INVERSE_SHARES: f32 = 0.50196078;

// Sources of the octaves in undimmed sunlight, 1/sr.
struct Octaves {
    low: vec4<f32>,
    high: vec4<f32>,
}

// Phase functions of Henyey and Greenstein, 1/sr.
fn henyey_greenstein(cosine: f32, mean_cosines: vec4<f32>) -> vec4<f32> {
    let g = mean_cosines;
    let base = inverseSqrt(max((1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cosine), vec4(LEAST_BASE)));
    return (1.0 - g * g) * base * base * base / FOUR_PI;
}

// `first`: order 1 in undimmed sunlight; `mean_cosine`: of the scaled phase function.
fn octave_sources(first: f32, cosine: f32, mean_cosine: f32, albedo: f32) -> Octaves {
    let low = albedo * LOW_SHARES * henyey_greenstein(cosine, mean_cosine * LOW_SHARES);
    let high = albedo * HIGH_SHARES * henyey_greenstein(cosine, mean_cosine * HIGH_SHARES);
    return Octaves(vec4(first, low.yzw), high);
}

// Source of all octaves in a piece of optical depth `tau` where the depth to the sun goes from `front` to `back`.
fn octave_sunlight(sources: Octaves, front: f32, back: f32, tau: f32) -> f32 {
    var sum = 0.0;
    var share = 1.0;
    for (var i = 0u; i < 4u; i++) {
        sum += sources.low[i] * mean_sunlight(share * front, share * back, tau);
        share *= OCTAVE;
    }
    for (var i = 0u; i < 4u; i++) {
        sum += sources.high[i] * mean_sunlight(share * front, share * back, tau);
        share *= OCTAVE;
    }
    return sum;
}

// What comes through a depth of light from all sides, in all octaves, over the same without matter.
fn octave_transmittance(depth: f32) -> f32 {
    let sum = dot(LOW_SHARES, exp(-depth * LOW_SHARES)) + dot(HIGH_SHARES, exp(-depth * HIGH_SHARES));
    return INVERSE_SHARES * sum;
}
