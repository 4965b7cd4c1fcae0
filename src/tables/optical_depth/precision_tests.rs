//! What the 10 bits of the 4D table cost beside the f32 that they are rounded from, for every built-in shape at the
//! size that it has there.

use glam::{DVec3, Vec4};

use super::bake::fitted;
use super::encoding::{pack, unpack};
use super::grid::filtered;
use super::lookup::ChordStep;
use super::mapping::{ChordMapping, HemisphereDisc};
use super::measure::central_matter;
use super::random::Stream;
use crate::medium::Shape;
use crate::tables::{Silent, TableSet};

const CHORDS: u64 = 40_000;
/// Optical depth of the mean chord through the centre.
const CENTRAL_DEPTH: f64 = 10.0;
/// Half a step of 10 bits, and what f32 makes of 16 products.
const HALF_STEP: f64 = 0.5 / 1023.0 + 1e-6;

/// Isotropic chords; one in sixteen is short, through the centre, or along an axis.
fn chord(i: u64) -> [DVec3; 2] {
    let mut random = Stream::new(11, i);
    let (entry, exit) = (random.on_sphere(), random.on_sphere());
    match i % 64 {
        0 => [entry, (entry + 1e-3 * exit).normalize()],
        1 => [entry, -entry],
        2 => [entry, DVec3::new(entry.x, entry.y, -entry.z)],
        3 => [entry, DVec3::new(-entry.x, entry.y, entry.z)],
        _ => [entry, exit],
    }
}

/// Largest and root mean square.
#[derive(Default)]
struct Differences {
    largest: f64,
    squares: f64,
}

impl Differences {
    fn add(&mut self, [a, b]: [f64; 2]) {
        self.largest = self.largest.max((a - b).abs());
        self.squares += (a - b).powi(2);
    }

    fn of(&self) -> [f64; 2] {
        [self.largest, (self.squares / CHORDS as f64).sqrt()]
    }
}

#[test]
fn ten_bits_beside_single_precision() {
    let built_in = TableSet::embedded().expect("built-in tables");
    for table in built_in.optical_depth() {
        let shape = Shape::new(table.spec());
        let central = central_matter(&shape);
        let (grid, options) = (table.grid(), built_in.optical_depth_options());
        let single = fitted(&shape, central, grid, options, &Silent);
        let rounded: Vec<u32> = single.iter().map(|channels| pack(*channels)).collect();
        assert_eq!(rounded, table.texels(), "{}: baked anew", shape.spec());
        // A texture holds nothing beyond 0 and 1.
        let single: Vec<Vec4> = single.iter().map(|c| c.clamp(Vec4::ZERO, Vec4::ONE)).collect();
        let (mut mean, mut depth) = (Differences::default(), Differences::default());
        let (mut passed, mut parts) = (Differences::default(), Differences::default());
        for i in 0..CHORDS {
            let [entry, exit] = chord(i);
            let place = HemisphereDisc.place(entry, exit);
            let channels = [
                filtered(&grid, place.at, |node| single[node]),
                filtered(&grid, place.at, |node| unpack(table.texels()[node])),
            ];
            let apart = (channels[0] - channels[1]).abs().max_element();
            assert!(f64::from(apart) <= HALF_STEP, "{}: {apart} at {i}", shape.spec());
            let steps = channels.map(|c| ChordStep::decode(c, place.reversed));
            assert_eq!(steps[1], table.step(entry, exit));
            let means = steps.map(|s| f64::from(s.mean_density));
            let scale = CENTRAL_DEPTH / central * entry.distance(exit);
            mean.add(means);
            depth.add(means.map(|m| scale * m));
            passed.add(means.map(|m| (-scale * m).exp()));
            let t = Stream::new(12, i).uniform() as f32;
            let part = steps.map(|s| f64::from(s.mean_density * s.fraction(t)));
            parts.add(part.map(|m| (-scale * m).exp()));
        }
        println!(
            "{}: largest and RMS of mean density {:.1e}, optical depth {:.1e}, transmittance {:.1e}, of parts {:.1e}",
            shape.spec(),
            List(mean.of()),
            List(depth.of()),
            List(passed.of()),
            List(parts.of())
        );
        // A mean density is the square of a channel: two half steps of it at density 1, and so much light at most.
        assert!(mean.largest <= 2.0 * HALF_STEP, "{}", mean.largest);
        assert!(depth.largest <= 2.0 * CENTRAL_DEPTH / central * 2.0 * HALF_STEP);
        // Ten bits cost less than a tenth of what the table errs by.
        let errors = table.errors().table.iter().find(|e| e.central_depth == CENTRAL_DEPTH);
        let errors = errors.expect("measured at this depth");
        assert!(passed.of()[1] < 0.1 * errors.rms, "{:?} beside {}", passed.of(), errors.rms);
        assert!(parts.of()[1] < 0.1 * errors.part_rms, "{:?}", parts.of());
    }
}

/// Two numbers.
struct List([f64; 2]);

impl std::fmt::LowerExp for List {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::LowerExp::fmt(&self.0[0], f)?;
        f.write_str(" and ")?;
        std::fmt::LowerExp::fmt(&self.0[1], f)
    }
}
