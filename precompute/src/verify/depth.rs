//! Optical depth of chords and of their parts against integration of the density in f64.

use cumuli::medium::{Shape, ShapeSpec};
use cumuli::reference::Random;
use cumuli::tables::TableSet;
use cumuli::{Error, Result};
use glam::DVec3;
use rayon::prelude::*;

use super::Effort;
use super::draws::{chord, on_sphere};
use super::row::{Row, Worst};

/// Optical depths of the mean chord through the centre at which transmittances are compared.
const CENTRAL_DEPTHS: [f64; 3] = [1.0, 10.0, 50.0];
/// Targets at central optical depth 10, whole chords: root mean square and 99th percentile of the
/// error of transmittance; parts of chords: root mean square. They are asked of depth 1 too. At depth
/// 50 no target is set: there the errors have only to be those that the bake recorded.
const TARGET_DEPTH: f64 = 10.0;
const WHOLE_RMS: f64 = 0.005;
const WHOLE_P99: f64 = 0.02;
const PART_RMS: f64 = 0.01;
/// Exchanging the ends of a chord changes nothing: transmittances at this central optical depth
/// may differ by a tenth of what parts of chords may be off, by rounding and by quantisation.
const EXCHANGE_DEPTH: f64 = 10.0;
const EXCHANGE: f64 = 0.001;
/// `chord_fraction` is 0 at 0 and 1 at 1, and falls nowhere, to two roundings of f32.
const ROUNDING: f64 = 2.0 * f32::EPSILON as f64;
/// The recorded mean density is that of the shape to the last digits.
const MEAN_DENSITY: f64 = 1e-9;
/// Recorded errors were measured on other chords: of 40,000 with a kurtosis of 20 the root mean
/// square is known to 1 %; five standard deviations of both together, and twice that in a quick run.
const RECORDED: f64 = 0.1;
/// Places on a chord at which `chord_fraction` is looked at.
const STEPS: u32 = 128;
/// Directions over which the matter along chords through the centre is averaged.
const DIRECTIONS: u64 = 2000;
/// Pieces in which a chord is integrated, each with two points a volume cell or more.
const PIECES: usize = 8;

/// One chord, exact and by the tables.
struct Compared {
    length: f64,
    /// Mean density of the whole: exact, looked up.
    whole: [f64; 2],
    /// Matter of a part over the chord's length.
    part: [f64; 2],
    /// Evenly drawn: counts for the mean errors.
    even: bool,
    ends: Worst,
    falls: Worst,
    exchange: Worst,
    wrong: u64,
}

/// All rows of one shape.
pub fn rows(tables: &TableSet, name: &str, effort: &Effort) -> Result<Vec<Row>> {
    let spec: ShapeSpec = name.parse()?;
    let index = tables
        .shape_index(name)
        .ok_or_else(|| Error::Failed(format!("the tables have lost the shape {name}")))?;
    let shape = Shape::new(spec);
    let central = central_matter(&shape);
    let compared: Vec<Compared> = (0..effort.chords)
        .into_par_iter()
        .map(|number| {
            let extinction = EXCHANGE_DEPTH / central;
            compare(tables, (index, &shape), extinction, number, effort.seed)
        })
        .collect();
    let mut rows = vec![Row::absolute(
        format!("mean density, {name}"),
        shape.mean_density(),
        tables.mean_density(index),
        MEAN_DENSITY,
    )];
    let recorded = tables.optical_depth().iter().find(|table| table.spec() == spec);
    for depth in CENTRAL_DEPTHS {
        let [rms, p99, part] = errors(&compared, depth / central);
        let row = |what: &str, error: f64, tolerance: f64| {
            let name = format!("{what}, {name}, depth {depth}");
            Row::measured(name, [0.0, error], error, tolerance)
        };
        if depth <= TARGET_DEPTH {
            rows.push(row("transmittance RMS error", rms, WHOLE_RMS));
            rows.push(row("transmittance 99th percentile error", p99, WHOLE_P99));
            rows.push(row("transmittance of parts RMS error", part, PART_RMS));
        }
        let old =
            recorded.and_then(|t| t.errors().depths.iter().find(|d| d.central_depth == depth));
        if let Some(old) = old {
            let name = format!("transmittance RMS error as recorded, {name}, depth {depth}");
            let tolerance = if effort.quick { 2.0 * RECORDED } else { RECORDED };
            rows.push(Row::relative(name, rms, old.rms, tolerance));
        }
    }
    let worst = |of: fn(&Compared) -> Worst| compared.iter().map(of).fold(Worst::NONE, Worst::or);
    rows.push(worst(|c| c.ends).row(format!("chord_fraction at 0 and 1, {name}")));
    rows.push(worst(|c| c.falls).row(format!("chord_fraction never falls, {name}")));
    rows.push(worst(|c| c.exchange).row(format!("reciprocity of chords, {name}")));
    let wrong: u64 = compared.iter().map(|c| c.wrong).sum();
    rows.push(Row::absolute(format!("lookups out of range, {name}"), 0.0, wrong as f64, 0.0));
    Ok(rows)
}

/// Mean over directions of the matter along a chord through the centre, radii.
fn central_matter(shape: &Shape) -> f64 {
    let mut random = Random::new(0, 0, 0);
    let sum: f64 = (0..DIRECTIONS)
        .map(|_| {
            let end = on_sphere(&mut random);
            2.0 * integral(shape, end, -end)
        })
        .sum();
    sum / DIRECTIONS as f64
}

/// Mean density between two points of the closed unit sphere.
fn integral(shape: &Shape, from: DVec3, to: DVec3) -> f64 {
    let mut pieces = [0.0; PIECES];
    shape.segment_means(from, to, &mut pieces);
    pieces.iter().sum::<f64>() / PIECES as f64
}

fn compare(
    tables: &TableSet,
    (index, shape): (u32, &Shape),
    extinction: f64,
    number: u64,
    seed: u64,
) -> Compared {
    let mut random = Random::new(seed, 1, number);
    let [entry, exit] = chord(number, &mut random);
    let (a, b) = (random.unit(), random.unit());
    let [from, to] = [a.min(b), a.max(b)];
    let profile = tables.chord_profile(index, entry, exit);
    let back = tables.chord_profile(index, exit, entry);
    let fraction = |t: f64| f64::from(profile.fraction(t as f32));
    let mean = f64::from(profile.mean_density);
    let exact_part = integral(shape, entry.lerp(exit, from), entry.lerp(exit, to)) * (to - from);
    let mut compared = Compared {
        length: entry.distance(exit),
        whole: [integral(shape, entry, exit), mean],
        part: [exact_part, mean * (fraction(to) - fraction(from))],
        even: number % 32 > 3,
        ends: Worst::NONE,
        falls: Worst::NONE,
        exchange: Worst::NONE,
        wrong: u64::from(!(0.0..=1.0).contains(&mean)),
    };
    for (t, expected) in [(0.0, 0.0), (1.0, 1.0)] {
        let got = fraction(t);
        compared.ends.add([expected, got], (got - expected).abs(), ROUNDING);
    }
    let there = f64::from(back.mean_density);
    let exchange = |matter: [f64; 2], worst: &mut Worst| {
        let passed = matter.map(|m| (-extinction * entry.distance(exit) * m).exp());
        worst.add(passed, (passed[1] - passed[0]).abs(), EXCHANGE);
    };
    let mut last = fraction(0.0);
    for k in 1..=STEPS {
        let t = f64::from(k) / f64::from(STEPS);
        let next = fraction(t);
        compared.falls.add([last, next], (last - next).max(0.0), ROUNDING);
        let rest = there * (1.0 - f64::from(back.fraction((1.0 - t) as f32)));
        exchange([mean * next, rest], &mut compared.exchange);
        compared.wrong += u64::from(!(0.0..=1.0).contains(&next));
        last = next;
    }
    exchange([mean, there], &mut compared.exchange);
    compared
}

/// Errors of transmittance at an extinction per radius: whole chords RMS and 99th percentile,
/// parts RMS.
fn errors(compared: &[Compared], extinction: f64) -> [f64; 3] {
    let mut whole = Vec::with_capacity(compared.len());
    let (mut square, mut part) = (0.0, 0.0);
    for chord in compared.iter().filter(|c| c.even) {
        let passed = |matter: f64| (-extinction * chord.length * matter).exp();
        let difference = |[exact, got]: [f64; 2]| passed(got) - passed(exact);
        let error = difference(chord.whole);
        whole.push(error.abs());
        square += error * error;
        part += difference(chord.part).powi(2);
    }
    let n = whole.len().max(1) as f64;
    whole.sort_by(f64::total_cmp);
    let p99 = whole.get((0.99 * n) as usize).copied().unwrap_or(f64::NAN);
    [(square / n).sqrt(), p99, (part / n).sqrt()]
}
