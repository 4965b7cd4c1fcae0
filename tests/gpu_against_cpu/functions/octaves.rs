//! Octaves of light.

use cumuli::frame::cpu::octaves::{
    henyey_greenstein, octave_sources, octave_sunlight, octave_transmittance,
};

use super::{Function, Random, magnitude, many, one};

const MODULE: &str = "#import cumuli::octaves::{henyey_greenstein, octave_sources, octave_sunlight, octave_transmittance}";

/// Cosines, the ends included; mean cosines of clouds and less, backward ones too.
fn angles(random: &mut Random) -> [f32; 2] {
    let cosine = match random.bits() % 8 {
        0 => 1.0,
        1 => -1.0,
        _ => random.between(-1.0, 1.0) as f32,
    };
    [cosine, random.between(-0.9, 0.95) as f32]
}

#[test]
fn octaves_of_light() {
    let inputs = many(171, angles);
    Function::new(
        "octaves::henyey_greenstein",
        MODULE,
        "henyey_greenstein(x[0], vec4(x[1], 0.5 * x[1], 0.0, 0.0))",
    )
    // Near straight on 1 - cosine has lost digits, which the condition counts.
    .agrees(&inputs, 8.0, |[cosine, g]| {
        [g, 0.5 * g, 0.0, 0.0].map(|g| henyey_greenstein(cosine, g))
    });

    let sources = many(172, |r| {
        let [cosine, g] = angles(r);
        [magnitude(r, 1e-3, 10.0), cosine, g, r.uniform() as f32]
    });
    let call = "vec4(octave_sources(x[0], x[1], x[2], x[3]).low.xyz, octave_sources(x[0], x[1], x[2], x[3]).high.w)";
    Function::new("octaves::octave_sources", MODULE, call).agrees(&sources, 8.0, |[a, b, c, d]| {
        let all = octave_sources(a, b, c, d);
        [all[0], all[1], all[2], all[7]]
    });

    // Depths to the sun and of a piece from nothing to what f32 loses all light in.
    let pieces = many(173, |r| {
        let [cosine, g] = angles(r);
        let mut depth = || if r.bits() % 8 == 0 { 0.0 } else { magnitude(r, 1e-4, 80.0) };
        [cosine, g, depth(), depth(), depth()]
    });
    let call = "vec4(octave_sunlight(octave_sources(1.0, x[0], x[1], 1.0), x[2], x[3], x[4]), 0.0, 0.0, 0.0)";
    Function::new("octaves::octave_sunlight", MODULE, call)
        // exp of 80 in f32 is off by 80 steps, which the condition counts; where depths of the piece and to the sun
        // nearly cancel, the mean of what is left keeps five digits (`guards::sunlight_over_a_piece`).
        .agrees(&pieces, 80.0, |[cosine, g, front, back, tau]| {
            one(octave_sunlight(&octave_sources(1.0, cosine, g, 1.0), front, back, tau))
        });

    let depths = many(174, |r| [if r.bits() % 8 == 0 { 0.0 } else { magnitude(r, 1e-4, 1e3) }]);
    let call = "vec4(octave_transmittance(x[0]), 0.0, 0.0, 0.0)";
    Function::new("octaves::octave_transmittance", MODULE, call)
        .agrees(&depths, 8.0, |[depth]| one(octave_transmittance(depth)));
}
