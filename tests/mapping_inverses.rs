//! Each table mapping against its inverse.

use cumuli::tables::optical_depth::mapping::{ChordMapping, HemisphereDisc};
use cumuli::tables::optical_depth::random::Stream;
use glam::DVec3;

const COUNT: u64 = 20_000;

/// f64 through a dozen operations, square roots near the rim of the disc among them.
const ROUNDING: f64 = 1e-12;

#[test]
fn places_of_chords_are_inverse_to_chords_of_places() {
    let mut inside = 0;
    for i in 0..COUNT {
        let mut random = Stream::new(1, i);
        let at = [0; 4].map(|_| random.uniform());
        let Some([entry, exit]) = HemisphereDisc.chord(at) else { continue };
        inside += 1;
        assert!((entry.length() - 1.0).abs() < ROUNDING && (exit.length() - 1.0).abs() < ROUNDING);
        let place = HemisphereDisc.place(entry, exit);
        assert!(!place.reversed);
        // A short chord loses digits of its direction.
        let tolerance = 4.0 * ROUNDING / (exit - entry).length();
        for (a, b) in at.iter().zip(place.at) {
            assert!((a - b).abs() < tolerance, "{at:?} {place:?}");
        }
    }
    // The disc is pi/4 of its square: 20,000 draws tell that to 1 %.
    let share = f64::from(inside) / COUNT as f64;
    assert!((share - std::f64::consts::FRAC_PI_4).abs() < 0.02, "{share}");
}

#[test]
fn chords_of_places_are_inverse_to_places_of_chords() {
    for i in 0..COUNT {
        let mut random = Stream::new(2, i);
        let (entry, exit) = (random.on_sphere(), random.on_sphere());
        let place = HemisphereDisc.place(entry, exit);
        let [mut a, mut b] = HemisphereDisc.chord(place.at).expect("a chord has a place");
        if place.reversed {
            (a, b) = (b, a);
        }
        // Half the chord comes from 1 - x^2 - y^2, so rounding grows as it shrinks.
        let tolerance = 4.0 * ROUNDING / (exit - entry).length();
        assert!((a - entry).length() < tolerance && (b - exit).length() < tolerance, "{place:?}");
        let back = HemisphereDisc.place(exit, entry);
        assert_eq!(back.reversed, !place.reversed, "one line, two directions");
        assert_eq!(back.at, place.at, "one line, one place");
    }
}

#[test]
fn odd_chords_have_places_too() {
    let points = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
    for entry in points {
        for exit in points {
            let place = HemisphereDisc.place(entry, exit);
            assert!(place.at.iter().all(|c| (0.0..=1.0).contains(c)), "{entry} {exit} {place:?}");
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
    let mut drawn = vec![0.0; BOXES.pow(4)];
    let mut expected = vec![0.0; BOXES.pow(4)];
    const DRAWS: u64 = 400_000;
    for i in 0..DRAWS {
        let mut random = Stream::new(3, i);
        drawn[index(HemisphereDisc.place(random.on_sphere(), random.on_sphere()).at)] += 1.0;
        let at = [0; 4].map(|_| random.uniform());
        if HemisphereDisc.chord(at).is_some() {
            expected[index(at)] += HemisphereDisc.density(at);
        }
    }
    let total: f64 = expected.iter().sum();
    for (count, weight) in drawn.iter().zip(expected) {
        let mean = weight / total * DRAWS as f64;
        // Both sides are counts of about `mean`; 81 boxes at 5 standard deviations: one false
        // alarm in 20,000 seeds, and the seed is fixed. Weights within a box vary by up to 5.
        assert!((count - mean).abs() < 5.0 * (4.0 * mean).sqrt(), "{count} {mean}");
    }
}
