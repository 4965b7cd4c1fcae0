//! What any table must satisfy, on a small one that bakes in a second or two.

use std::sync::OnceLock;

use super::*;
use crate::tables::Silent;

/// Small and noisy, but made by the same solver.
fn small_options() -> ScatteringOptions {
    ScatteringOptions {
        resolution: [8, 8, 8, 24],
        optical_radius: [0.05, 100.0],
        remainder: 1e-3,
        ..Default::default()
    }
}

/// One small table for all tests.
pub fn small_table() -> &'static ScatteringTable {
    static TABLE: OnceLock<ScatteringTable> = OnceLock::new();
    TABLE.get_or_init(|| {
        let phase = Phase::hg(0.85).expect("in range");
        ScatteringTable::bake(phase, 1.0, &small_options(), &Silent).expect("bakes")
    })
}

#[test]
fn same_bytes_whatever_the_number_of_threads() {
    let options =
        ScatteringOptions { resolution: [3, 4, 4, 8], remainder: 1e-3, ..small_options() };
    let phase = Phase::hg(0.5).expect("in range");
    let bake = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| ScatteringTable::bake(phase, 1.0, &options, &Silent).expect("bakes"))
    };
    let one = bake(1);
    assert_eq!(one, bake(3));
    assert!(one.values().iter().any(|v| v.to_f32() != 0.0));
}

#[test]
fn single_precision_is_what_half_precision_is_rounded_from() {
    let options = ScatteringOptions { resolution: [2, 4, 4, 6], ..small_options() };
    let phase = Phase::hg(0.5).expect("in range");
    let [half, single] = [Precision::F16, Precision::F32].map(|precision| {
        let options = ScatteringOptions { precision, ..options.clone() };
        ScatteringTable::bake(phase, 1.0, &options, &Silent).expect("bakes")
    });
    assert!(half.precise_values().is_none() && single.precise_values().is_some());
    // An f64 rounded twice may end one step beside an f64 rounded once.
    let steps = half.values().iter().zip(single.values());
    let steps = steps.map(|(a, b)| (i32::from(a.to_bits()) - i32::from(b.to_bits())).abs());
    assert!(steps.max() <= Some(1));
    assert_eq!(single.rounded().precise_values(), None);
    let geometry = mapping::Geometry { incidence: 0.63, azimuth: 1.1, view_sun: 0.7 };
    let lookup = |table: &ScatteringTable| table.lookup_geometry(&geometry, 7.0);
    let (a, b, c) = (lookup(&half), lookup(&single), lookup(&single.rounded()));
    assert_eq!(b[0], c[0], "order 1 is not tabulated");
    assert_ne!(b[1], c[1], "the finer digits are used");
    // 2^-11 of logarithms up to 8.
    assert!((b[1] / a[1] - 1.0).abs() < 4e-3, "{a:?} {b:?}");
}

#[test]
fn albedo_zero_scatters_nothing() {
    let options =
        ScatteringOptions { resolution: [2, 3, 3, 6], remainder: 1e-3, ..small_options() };
    let phase = Phase::hg(0.5).expect("in range");
    let table = ScatteringTable::bake(phase, 0.0, &options, &Silent).expect("bakes");
    let geometry = mapping::Geometry { incidence: 0.7, azimuth: 1.0, view_sun: 1.0 };
    let [single, multiple] = table.lookup_geometry(&geometry, 3.0);
    assert_eq!(single, 0.0);
    // The logarithm has a floor.
    assert!(multiple < 1e-11);
}

#[test]
fn furnace_is_exact_for_every_chord() {
    // Uniform light from everywhere: the sphere is invisible. The table keeps this at its nodes
    // by construction; between them the interpolation's curvature remains.
    let table = small_table();
    let furnace = bake::Furnace::new(table.phase(), &table.map, table.resolution());
    for optical_radius in [0.02, 0.3, 2.7, 11.0] {
        for incidence in [0.02, 0.35, 0.66, 0.97, 1.0] {
            let [single, multiple] = furnace.integrals(|azimuth, view_sun| {
                let angle = |place: &bake::Place| place.sine.atan2(place.cosine);
                let (azimuth, view_sun) = (angle(azimuth), angle(view_sun));
                let ray = mapping::Geometry { incidence, azimuth, view_sun };
                table.lookup_geometry(&ray, optical_radius)
            });
            let sum = single + multiple;
            // Eight nodes of incidence and of optical radius: 7 %; the default table has a
            // third of the spacing and a tenth of the error.
            assert!((sum - 1.0).abs() < 0.08, "R {optical_radius} m {incidence}: {sum}");
        }
    }
}

#[test]
fn bad_parts_are_refused_with_a_sentence() {
    let good = small_table();
    let rebuild = |resolution, range, values: Vec<f16>, albedo| {
        let report = good.report().clone();
        ScatteringTable::from_parts(*good.phase(), albedo, resolution, range, values, report)
    };
    let (shape, range) = (good.resolution(), good.optical_radius_range());
    let values = good.values().to_vec();
    assert_eq!(rebuild(shape, range, values.clone(), 1.0).as_ref().ok(), Some(good));
    let with = |index: usize, value: f32| {
        let mut changed = values.clone();
        changed[index] = f16::from_f32(value);
        changed
    };
    let bad = [
        rebuild(shape, range, values[1..].to_vec(), 1.0),
        rebuild(shape, range, with(0, f32::NAN), 1.0),
        rebuild(shape, range, with(1, f32::INFINITY), 1.0),
        rebuild(shape, range, with(2, -65.0), 1.0),
        rebuild(shape, range, with(2, 65.0), 1.0),
        rebuild([usize::MAX, 8, 8, 24], range, values.clone(), 1.0),
        rebuild([128, 128, 8, 24], range, values.clone(), 1.0),
        rebuild([1, 64, 8, 24], range, values.clone(), 1.0),
        rebuild(shape, [0.0, 1.0], values.clone(), 1.0),
        rebuild(shape, [f64::NAN, 1.0], values.clone(), 1.0),
        rebuild(shape, [2.0, 1.0], values.clone(), 1.0),
        rebuild(shape, range, values.clone(), 1.1),
        rebuild(shape, range, values.clone(), f64::NAN),
    ];
    for (i, result) in bad.into_iter().enumerate() {
        let message = result.err().unwrap_or_else(|| panic!("case {i} was accepted")).to_string();
        assert!(message.contains("expected"), "{message}");
    }
}
