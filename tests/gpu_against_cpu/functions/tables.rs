//! `phase.wgsl`, `optical_depth.wgsl`, `scattering.wgsl` and `light_lists.wgsl`, as far as they are functions of a few
//! numbers; chords and whole look-ups are compared beside their tables.

use cumuli::frame::cpu::light;
use cumuli::frame::gpu_data::Particle;
use cumuli::medium::Phase;
use cumuli::stress::MEDIA;
use cumuli::tables::optical_depth::volume;
use cumuli::tables::scattering::march;
use glam::{DQuat, DVec3};

use super::{Function, STEP, magnitude, many, one};
use crate::common::{Random, tables};
use crate::light::tables_on_device;

#[test]
fn phase_functions_of_all_media() {
    let cosines = many(161, |r| {
        [match r.bits() % 8 {
            0 => 1.0,
            1 => -1.0,
            2 => 1.0 - magnitude(r, 1e-7, 1e-2),
            _ => r.between(-1.0, 1.0) as f32,
        }]
    });
    let pairs = many(162, |r| {
        let (dir, sun) = (r.direction(), r.direction());
        let sign = if r.bits().is_multiple_of(2) { 1.0 } else { -1.0 };
        let near = (sign * sun + f64::from(magnitude(r, 1e-6, 1.0)) * dir).normalize();
        let dir = if r.bits().is_multiple_of(2) { near } else { dir };
        let ([a, b, c], [d, e, f]) = (dir.as_vec3().to_array(), sun.as_vec3().to_array());
        [a, b, c, d, e, f]
    });
    for (phase, _) in MEDIA {
        let p = phase.gpu_params();
        let params = format!(
            "const P = PhaseParams({:?}, {:?}, {:?}, {:?}, {:?}, {:?}, {:?}, {:?});",
            p.hg_scale,
            p.hg_base,
            p.hg_slope,
            p.hg_sign,
            p.draine_scale,
            p.draine_base,
            p.draine_slope,
            p.draine_alpha
        );
        let declarations = format!(
            "#import cumuli::phase::{{PhaseParams, phase_between, phase_function}}\n{params}"
        );
        let exact = phase.prepare();
        // The parameters are rounded themselves; the width of a lobe, (1 - g)^2, counts with its power of 3/2.
        Function::new(
            "phase::phase_function, phase_lobes",
            &declarations,
            "vec4(phase_function(P, x[0]), 0.0, 0.0, 0.0)",
        )
        .agrees(&cosines, 16.0, |[c]| one(exact.eval(c.clamp(-1.0, 1.0))));
        Function::new(
            "phase::phase_between",
            &declarations,
            "vec4(phase_between(P, vec3(x[0], x[1], x[2]), vec3(x[3], x[4], x[5])), 0.0, 0.0, 0.0)",
        )
        .agrees(&pairs, 16.0, |[a, b, c, d, e, f]| {
            let apart = DVec3::new(a, b, c) - DVec3::new(d, e, f);
            one(exact.eval(1.0 - 0.5 * apart.length_squared()))
        });
    }
}

#[test]
fn densities_of_shapes() {
    let (tables, on_device) = (tables(), tables_on_device());
    let shapes = tables.shape_names().count() as u64;
    let groups = [(on_device.layout(), on_device.bind_group())];
    let places = many(163, |r| {
        let p = (r.direction() * r.between(0.0, 1.2)).as_vec3();
        [(r.bits() % shapes) as f32, p.x, p.y, p.z, (r.bits() % 3) as f32]
    });
    let name = "optical_depth::density_at, march_from";
    let function = Function {
        name,
        declarations: "#import cumuli::optical_depth::density_at",
        call: "vec4(density_at(u32(x[0]), vec3(x[1], x[2], x[3]), u32(x[4])), 0.0, 0.0, 0.0)",
        groups: &groups,
        more: &[],
        least: 0.0,
    };
    // Filtering places to 1/256 of a texel on three axes, where neighbours differ by 1 at most.
    function.agrees(&places, 3.0 / 256.0 / STEP, |[shape, x, y, z, copy]| {
        let place = DVec3::new(x, y, z);
        let shape = shape.round() as u32;
        let inside = place.abs().max_element() <= 1.0 && (shape > 0 || place.length() <= 1.0);
        one(if inside { tables.density(shape, place, copy.round() as usize) } else { 0.0 })
    });
    let pixels = many(164, |r| {
        [1.0 + (r.bits() % 8192) as f32, magnitude(r, 1e-2, 115.0), magnitude(r, 1e-2, 1.0)]
    });
    Function::new(
        "optical_depth::pixels_per_radian",
        "#import cumuli::optical_depth::pixels_per_radian",
        "vec4(pixels_per_radian(u32(x[0]), x[1], x[2]), 0.0, 0.0, 0.0)",
    )
    .agrees(&pixels, 8.0, |[width, tangent, cosine]| {
        one(volume::pixels_per_radian(width.round() as u32, tangent, cosine))
    });
    let radii = many(165, |r| [magnitude(r, 0.1, 100.0), magnitude(r, 1e-3, 1e3)]);
    Function::new(
        "optical_depth::copy_for",
        "#import cumuli::optical_depth::copy_for",
        "vec4(f32(copy_for(x[0], x[1])), 0.0, 0.0, 0.0)",
    )
    .agrees(&radii, 8.0, |[radius, depth]| {
        // As README has it: below 11 over (1 + R/12) pixels, and below 5 over (1 + R/2).
        let first = radius < 11.0 / (1.0 + depth / 12.0);
        let second = radius < 5.0 / (1.0 + depth / 2.0);
        one(f64::from(u8::from(first)) + f64::from(u8::from(second)))
    });
    let steps = many(166, |r| {
        [
            r.uniform() as f32,
            1.0 + 9.0 * r.uniform() as f32,
            (r.bits() % 2) as f32,
            r.uniform() as f32,
        ]
    });
    Function::new(
        "optical_depth::step_fraction",
        "#import cumuli::optical_depth::{ChordStep, step_fraction}",
        "vec4(step_fraction(ChordStep(1.0, x[0], x[1], x[2]), x[3]), 0.0, 0.0, 0.0)",
    )
    .agrees(&steps, 16.0, |[start, inverse, smooth, t]| {
        let x = ((t - start) * inverse).clamp(0.0, 1.0);
        let smooth = smooth.round();
        one((1.0 - smooth) * x + smooth * x * x * (3.0 - 2.0 * x))
    });
    let words = many(167, |r| std::array::from_fn::<f32, 3, _>(|_| (r.bits() % 114) as f32));
    Function::new(
        "optical_depth::pack_bins, sum_after",
        "#import cumuli::optical_depth::{pack_bins, sum_after}",
        "vec4(f32(sum_after(pack_bins(vec3(x[0], x[1], x[2]), 1000u))), 0.0, 0.0, 0.0)",
    )
    .agrees(&words, 0.0, |bins| one(1000.0 + bins.map(f64::round).iter().sum::<f64>()));
}

/// Two points of the unit sphere: chords of any length above a thousandth, below which f32 loses the direction; through
/// the centre, along the axes, and where a line's direction turns over.
fn chord(random: &mut Random) -> [f32; 6] {
    let entry = random.direction();
    let exit = match random.bits() % 16 {
        0 => -entry,
        1 => DVec3::new(entry.x, entry.y, -entry.z),
        2 => DVec3::new(-entry.x, entry.y, entry.z),
        3 => (entry + f64::from(magnitude(random, 2e-3, 1.0)) * random.direction()).normalize(),
        _ => random.direction(),
    };
    let exit = if entry.distance(exit) < 1e-3 { -entry } else { exit };
    let ([a, b, c], [d, e, f]) = (entry.as_vec3().to_array(), exit.as_vec3().to_array());
    [a, b, c, d, e, f]
}

#[test]
fn chords_of_shapes() {
    let (tables, on_device) = (tables(), tables_on_device());
    let shapes = tables.shape_names().count() as u64;
    let groups = [(on_device.layout(), on_device.bind_group())];
    // A shape, then two ends.
    let chords = many(171, |r| {
        let ([a, b, c, d, e, f], shape) = (chord(r), r.bits() % shapes);
        [shape as f32, a, b, c, d, e, f]
    });
    let ends = |x: &[f64]| [DVec3::new(x[0], x[1], x[2]), DVec3::new(x[3], x[4], x[5])];
    // Neighbours in the table differ by half at most, on four axes of which one is blended in the shader.
    Function::new(
        "optical_depth::chord_step, table_channels",
        "#import cumuli::optical_depth::{ChordStep, chord_step}
        fn asked(x: array<f32, 7>) -> vec4<f32> {
            let found = chord_step(u32(x[0]), vec3(x[1], x[2], x[3]), vec3(x[4], x[5], x[6]));
            return vec4(found.mean_density, found.start, 1.0 / found.inverse_extent, found.smoothness);
        }",
        "asked(x)",
    )
    .reading(&groups)
    .of_terms(1.0)
    .agrees(&chords, 2.0 * 4.0 * 0.5 / 256.0 / STEP, |x| {
        let [entry, exit] = ends(&x[1..]);
        let step = tables.chord_step(x[0].round() as u32, entry, exit);
        [step.mean_density, step.start, 1.0 / step.inverse_extent, step.smoothness].map(f64::from)
    });
    // Three places between densities that differ by 1 at most.
    let parts = many(172, |r| {
        let ([a, b, c, d, e, f], shape) = (chord(r), r.bits() % shapes);
        let (begin, end) = (r.uniform() as f32, r.uniform() as f32);
        [shape as f32, a, b, c, d, e, f, begin.min(end), begin.max(end)]
    });
    Function::new(
        "optical_depth::chord_part",
        "#import cumuli::optical_depth::chord_part
        fn asked(x: array<f32, 9>) -> vec4<f32> {
            let part = chord_part(u32(x[0]), vec3(x[1], x[2], x[3]), vec3(x[4], x[5], x[6]), x[7], x[8]);
            return vec4(part.x, part.x * part.y, part.x * part.z, 0.0);
        }",
        "asked(x)",
    )
    .reading(&groups)
    .of_terms(1.0)
    .agrees(&parts, 3.0 / 256.0 / STEP, |x| {
        let [entry, exit] = ends(&x[1..7]);
        let profile = tables.chord_profile(x[0].round() as u32, entry, exit);
        let mean = f64::from(profile.mean_density);
        let before = [x[7], x[8]].map(|t| mean * f64::from(profile.fraction(t as f32)));
        [mean, before[0], before[1], 0.0]
    });
    let copies = many(173, |r| {
        let ([a, b, c, d, e, f], shape) = (chord(r), r.bits() % shapes);
        [shape as f32, a, b, c, d, e, f, (r.bits() % 3) as f32]
    });
    Function::new(
        "optical_depth::chord_profile, march_bins, march_between",
        "#import cumuli::optical_depth::chord_profile
        fn asked(x: array<f32, 8>) -> f32 {
            return chord_profile(u32(x[0]), vec3(x[1], x[2], x[3]), vec3(x[4], x[5], x[6]), u32(x[7])).mean_density;
        }",
        "vec4(asked(x), 0.0, 0.0, 0.0)",
    )
    .reading(&groups)
    .of_terms(1.0)
    .agrees(&copies, 3.0 / 256.0 / STEP, |x| {
        let [entry, exit] = ends(&x[1..7]);
        let (shape, copy) = (x[0].round() as u32, x[7].round() as usize);
        one(tables.copied_profile(shape, entry, exit, copy).mean_density.into())
    });
    // Noise shapes alone: the shader asks before it takes these. Every other place is not wanted.
    let marches = many(174, |r| {
        let begin = r.direction() * r.between(0.0, 0.7);
        let along = r.direction() * r.between(0.0, 0.3);
        let ([a, b, c], [d, e, f]) = (begin.as_vec3().to_array(), along.as_vec3().to_array());
        let shape = 1 + r.bits() % (shapes - 1);
        [shape as f32, a, b, c, d, e, f, (r.bits() % 3) as f32, r.uniform() as f32]
    });
    Function::new(
        "optical_depth::densities",
        "#import cumuli::optical_depth::{densities, march_from}
        fn asked(x: array<f32, 9>) -> vec4<f32> {
            let m = march_from(u32(x[0]), vec3(x[1], x[2], x[3]), vec3(x[4], x[5], x[6]), u32(x[7]));
            let even = fract(x[8] * 64.0) < 0.5;
            return densities(m, vec4(0.0, x[8], 1.0 - x[8], 1.0), vec4(even, !even, even, !even));
        }",
        "asked(x)",
    )
    .reading(&groups)
    .of_terms(1.0)
    .agrees(&marches, 3.0 / 256.0 / STEP, |x| {
        let [begin, along] = ends(&x[1..7]);
        let even = (x[8] * 64.0).fract() < 0.5;
        let at = |t: f64, wanted: bool| {
            let place = begin + t * along;
            let copy = x[7].round() as usize;
            if wanted { tables.density(x[0].round() as u32, place, copy) } else { 0.0 }
        };
        [at(0.0, even), at(x[8], !even), at(1.0 - x[8], even), at(1.0, !even)]
    });
}

#[test]
fn a_line_of_light_through_a_particle() {
    let (tables, on_device) = (tables(), tables_on_device());
    let shapes = tables.shape_names().count() as u64;
    let groups = [(on_device.layout(), on_device.bind_group())];
    let inputs = many(168, |r| {
        let turn = DQuat::from_axis_angle(r.direction(), r.between(0.0, 3.0)).as_quat();
        let towards = r.direction().as_vec3();
        let radius = magnitude(r, 1.0, 1e3);
        let point = (r.direction() * f64::from(radius) * r.between(0.0, 1.5)).as_vec3();
        let shape = (r.bits() % shapes) as f32;
        let [x, y, z, w] = turn.to_array();
        [radius, shape, x, y, z, w, towards.x, towards.y, towards.z, point.x, point.y, point.z]
    });
    let function = Function {
        name: "light_lists::particle_occlusion",
        declarations: "#import cumuli::gpu_data::Particle
            #import cumuli::light_lists::particle_occlusion
            fn asked(x: array<f32, 12>) -> vec2<f32> {
                var p: Particle;
                p.radius = x[0];
                p.shape = u32(x[1]);
                p.orientation = vec4(x[2], x[3], x[4], x[5]);
                p.extinction = 1.0 / x[0];
                let taken = particle_occlusion(p, vec3(x[6], x[7], x[8]), vec3(x[9], x[10], x[11]));
                return vec2(taken.front, taken.behind);
            }",
        call: "vec4(asked(x), 0.0, 0.0)",
        groups: &groups,
        more: &[],
        least: 0.0,
    };
    // An optical radius of 1: what filtering places by 1/256 of a texel on four axes, where the table's mean densities
    // differ by 0.5 from texel to texel at most, on chords of two radii; the same again of the matter's ends.
    function.agrees(&inputs, 4.0 * 2.0 / 256.0 / STEP, |v| {
        let particle = Particle {
            radius: v[0] as f32,
            shape: v[1].round() as u32,
            orientation: [v[2], v[3], v[4], v[5]].map(|q| q as f32),
            extinction: (1.0 / v[0]) as f32,
            ..bytemuck::Zeroable::zeroed()
        };
        let (towards, point) = (DVec3::new(v[6], v[7], v[8]), DVec3::new(v[9], v[10], v[11]));
        let taken = light::particle_occlusion(tables, &particle, towards, point);
        [taken.front, taken.behind, 0.0, 0.0]
    });
}

#[test]
fn order_1_along_a_chord() {
    let chords = many(169, |r| {
        // A point of the unit sphere, looked into, and lit from anywhere.
        let (entry, dir, sun) = (r.direction(), r.direction(), r.direction());
        let dir = if entry.dot(dir) > 0.0 { -dir } else { dir };
        let (incidence, height, climb) = (-entry.dot(dir), entry.dot(sun), dir.dot(sun));
        [2.0 * incidence as f32, height as f32, climb as f32, magnitude(r, 1e-6, 1e6)]
    });
    Function::new(
        "scattering::single_source",
        "#import cumuli::scattering::single_source",
        "vec4(single_source(x[0], x[1], x[2], x[3]), 0.0, 0.0, 0.0)",
    )
    .agrees(&chords, 160.0, |[chord, height, climb, optical_radius]| {
        one(march::ChordMarch::new(0.5 * chord, optical_radius).source(height, climb))
    });
    let places = many(170, |r| [r.uniform() as f32, 2.0 + (r.bits() % 100) as f32]);
    Function::new(
        "scattering::table_place",
        "#import cumuli::scattering::table_place",
        "vec4(table_place(x[0], x[1]), 0.0, 0.0, 0.0)",
    )
    .agrees(&places, 4.0, |[at, nodes]| one((at * (nodes - 1.0) + 0.5) / nodes));
}

/// Light that f32 may lose: it ends at 1e-38, before a phase function of up to 1e4.
const DARK: f64 = 1e-33;

/// Into the unit sphere, through its centre, along its surface; into the sun, away from it, and anywhere; then the
/// optical radius.
fn lit_ray(random: &mut Random) -> [f32; 10] {
    let (entry, any, sun) = (random.direction(), random.direction(), random.direction());
    let dir = match random.bits() % 16 {
        0 => -entry,
        1 => any.cross(entry).normalize(),
        _ if any.dot(entry) > 0.0 => -any,
        _ => any,
    };
    let sun = match random.bits() % 16 {
        0 => dir,
        1 => -dir,
        2 | 3 => (dir + 0.01 * sun).normalize(),
        _ => sun,
    };
    let [[a, b, c], [d, e, f], [g, h, i]] = [entry, dir, sun].map(|v| v.as_vec3().to_array());
    [a, b, c, d, e, f, g, h, i, magnitude(random, 1e-3, 1e3)]
}

#[test]
fn light_of_a_particle_alone() {
    let (tables, on_device) = (tables(), tables_on_device());
    let groups = [(on_device.layout(), on_device.bind_group())];
    let phase = Phase::hg(0.85).expect("a phase function");
    let table = tables.scattering_for(&phase, 1.0).expect("one of the built-in media");
    // Filters that keep 8 bits of the weights: neighbours differ by less than 1 in the logarithm, 4 are weighted.
    let filter = 0.01 / STEP;
    // Order 1 reads no table.
    let cases = [("order 1", 0, 512.0), ("terminator", 1, filter)];
    let rays = many(175, lit_ray);
    for (what, channel, most) in cases {
        let field = ["x", "y"][channel];
        let call = format!(
            "vec4(scattering_source(vec3(x[0], x[1], x[2]), vec3(x[3], x[4], x[5]), vec3(x[6], x[7], x[8]), x[9]).{field}, 0.0, 0.0, 0.0)"
        );
        let name = format!("scattering::scattering_source, {what}");
        Function::new(&name, "#import cumuli::scattering::scattering_source", &call)
            .reading(&groups)
            .of_terms(DARK / STEP)
            .agrees(&rays, most, |x| {
                let [entry, dir, sun] = [0, 3, 6].map(|i| DVec3::new(x[i], x[i + 1], x[i + 2]));
                one(table.lookup(entry, dir, sun, x[9])[channel])
            });
    }
}
