//! Each table mapping against its inverse.

use cumuli::tables::optical_depth::alternatives::{LinearAngles, TwoPoints};
use cumuli::tables::optical_depth::mapping::{ChordMapping, HemisphereDisc};
use cumuli::tables::optical_depth::random::Stream;
use glam::DVec3;

const MAPPINGS: [&dyn ChordMapping; 3] = [&HemisphereDisc, &LinearAngles, &TwoPoints];

const COUNT: u64 = 20_000;

/// f64 through a dozen operations, square roots near the rim of the disc among them.
const ROUNDING: f64 = 1e-12;

/// Distance to the closest of the places, where a circle closes, and of points of a square's rim,
/// where an octahedron is folded.
fn apart(mapping: &dyn ChordMapping, a: [f64; 4], b: [f64; 4]) -> f64 {
    let at = |i: usize| (a[i] - b[i]).abs();
    let around = |i: usize| at(i).min(1.0 - at(i));
    match mapping.name() {
        "linear angles" => at(0).max(around(1)).max(at(2)).max(around(3)),
        _ => at(0).max(at(1)).max(at(2)).max(at(3)),
    }
}

#[test]
fn places_of_chords_are_inverse_to_chords_of_places() {
    for mapping in MAPPINGS {
        let mut inside = 0;
        for i in 0..COUNT {
            let mut random = Stream::new(1, i);
            let at = [0; 4].map(|_| random.uniform());
            let Some([entry, exit]) = mapping.chord(at) else { continue };
            inside += 1;
            assert!((entry.length() - 1.0).abs() < ROUNDING);
            assert!((exit.length() - 1.0).abs() < ROUNDING);
            let place = mapping.place(entry, exit);
            assert!(!place.reversed);
            // A short chord loses digits of its direction, and so do angles next to a pole.
            let sine = (std::f64::consts::PI * at[2]).sin() * at[0].max(1e-9);
            let tolerance = 20.0 * ROUNDING / (exit - entry).length() / sine;
            let error = apart(mapping, at, place.at);
            assert!(error < tolerance, "{} {at:?} {place:?}", mapping.name());
        }
        let share = f64::from(inside) / COUNT as f64;
        // The disc is pi/4 of its square: 20,000 draws tell that to 1 %. The others are full.
        let full = mapping.name() != HemisphereDisc.name();
        let expected = if full { 1.0 } else { std::f64::consts::FRAC_PI_4 };
        assert!((share - expected).abs() < 0.02, "{} {share}", mapping.name());
    }
}

#[test]
fn chords_of_places_are_inverse_to_places_of_chords() {
    for mapping in MAPPINGS {
        for i in 0..COUNT {
            let mut random = Stream::new(2, i);
            let (entry, exit) = (random.on_sphere(), random.on_sphere());
            let place = mapping.place(entry, exit);
            let [mut a, mut b] = mapping.chord(place.at).expect("a chord has a place");
            if place.reversed {
                (a, b) = (b, a);
            }
            // Half the chord comes from 1 - x^2 - y^2, so rounding grows as it shrinks.
            let tolerance = 20.0 * ROUNDING / (exit - entry).length();
            let error = (a - entry).length().max((b - exit).length());
            assert!(error < tolerance, "{} {place:?} {error}", mapping.name());
        }
    }
}

#[test]
fn one_line_has_one_place() {
    for i in 0..COUNT {
        let mut random = Stream::new(2, i);
        let (entry, exit) = (random.on_sphere(), random.on_sphere());
        let (there, back) = (HemisphereDisc.place(entry, exit), HemisphereDisc.place(exit, entry));
        assert_eq!(back.reversed, !there.reversed, "one line, two directions");
        assert_eq!(back.at, there.at);
    }
}

#[test]
fn odd_chords_have_places_too() {
    let points = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
    for mapping in MAPPINGS {
        for entry in points {
            for exit in points {
                let place = mapping.place(entry, exit);
                let inside = place.at.iter().all(|c| (0.0..=1.0).contains(c));
                assert!(inside, "{} {entry} {exit} {place:?}", mapping.name());
            }
        }
    }
}

#[test]
fn the_measure_of_lines_is_what_random_lines_have() {
    // Shares of isotropic lines in boxes of the 4-cube, against the integral of the density.
    const BOXES: usize = 3;
    let index = |at: [f64; 4]| {
        at.iter().fold(0, |i, c| i * BOXES + ((c * BOXES as f64) as usize).min(BOXES - 1))
    };
    for mapping in MAPPINGS {
        let mut drawn = vec![0.0; BOXES.pow(4)];
        let mut expected = vec![0.0; BOXES.pow(4)];
        const DRAWS: u64 = 200_000;
        for i in 0..DRAWS {
            let mut random = Stream::new(3, i);
            drawn[index(mapping.place(random.on_sphere(), random.on_sphere()).at)] += 1.0;
            let at = [0; 4].map(|_| random.uniform());
            if mapping.chord(at).is_some() {
                expected[index(at)] += mapping.density(at);
            }
        }
        let total: f64 = expected.iter().sum();
        for (count, weight) in drawn.iter().zip(expected) {
            let mean = weight / total * DRAWS as f64;
            // Both sides are counts of about `mean`, one of them with weights that vary by up to
            // 5 within a box; 243 boxes at 5 standard deviations, and the seed is fixed.
            assert!(
                (count - mean).abs() < 5.0 * (4.0 * mean).sqrt(),
                "{} {count} {mean}",
                mapping.name()
            );
        }
    }
}
