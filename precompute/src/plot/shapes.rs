//! What a shape lets through, from several sides: exact, by the march that the eye takes, by the 4D
//! table that light takes, and the differences.

use cumuli::Result;
use cumuli::medium::Shape;
use cumuli::tables::TableSet;
use glam::DVec3;
use rayon::prelude::*;

use super::canvas::{Canvas, Tile, grey, signed};

/// Optical depth of the mean chord through the centre.
const CENTRAL_DEPTH: f64 = 10.0;
/// Difference of transmittance that is shown in full colour.
const FULL_COLOUR: f64 = 0.1;
/// Directions of travel of the eye's rays, and their names.
const SIDES: [(&str, DVec3); 6] = [
    ("along x", DVec3::X),
    ("along y", DVec3::Y),
    ("along z", DVec3::Z),
    ("along 1 1 1", DVec3::ONE),
    ("along 1 -2 1", DVec3::new(1.0, -2.0, 1.0)),
    ("along -3 1 2", DVec3::new(-3.0, 1.0, 2.0)),
];
/// Part of the chord: whole, and its nearer half.
const PARTS: [(&str, f64); 2] = [("whole chords", 1.0), ("nearer half of each chord", 0.5)];

const SIDE: u32 = 170;
const GAP: u32 = 10;
const LEFT: u32 = 170;
const TOP: u32 = 70;
/// Rows of a part, and a line of words.
const ROWS: [&str; 5] = ["exact", "march (eye)", "difference", "4D table (light)", "difference"];
const BLOCK: u32 = ROWS.len() as u32 * (SIDE + GAP) + 40;

/// The picture of one shape.
pub fn picture(tables: &TableSet, index: u32, shape: &Shape) -> Result<Canvas> {
    let width = LEFT + SIDES.len() as u32 * (SIDE + GAP);
    let mut canvas = Canvas::new([width, TOP + PARTS.len() as u32 * BLOCK]);
    let name = shape.name();
    let matter = cumuli::tables::optical_depth::measure::central_matter(shape);
    let extinction = CENTRAL_DEPTH / matter;
    let title = format!(
        "Transmittance of {name}, optical depth through the centre {CENTRAL_DEPTH} on average"
    );
    canvas.text(&title, [GAP, 10], 22)?;
    for (block, (part, to)) in PARTS.into_iter().enumerate() {
        let top = TOP + block as u32 * BLOCK;
        for (row, label) in ROWS.into_iter().enumerate() {
            let y = top + row as u32 * (SIDE + GAP) + SIDE / 2;
            canvas.text(label, [GAP, y], 18)?;
        }
        canvas.text("black 0, white 1", [GAP, top + SIDE / 2 + 24], 14)?;
        let colours = format!("red +{FULL_COLOUR}, blue -{FULL_COLOUR}");
        for row in [2, 4] {
            canvas.text(&colours, [GAP, top + row * (SIDE + GAP) + SIDE / 2 + 24], 14)?;
        }
        let part = format!("{part}; below, RMS errors of march and 4D table");
        canvas.text(&part, [LEFT, top - 24], 16)?;
        for (column, (side, dir)) in SIDES.into_iter().enumerate() {
            let view = View { tables, index, shape, extinction, dir: dir.normalize(), to };
            let x = LEFT + column as u32 * (SIDE + GAP);
            let tile = |row: u32| Tile { x, y: top + row * (SIDE + GAP), side: SIDE };
            let found = view.grid();
            // The same pixels for all three: the function is asked at their middles.
            let at = |u: f64, v: f64| {
                let index = |x: f64| (0.5 * (1.0 + x) * f64::from(SIDE)) as usize;
                found.get(index(-v) * SIDE as usize + index(u)).copied().flatten()
            };
            let outside = [0.9, 0.9, 0.95];
            canvas.fill(tile(0), 1, |u, v| at(u, v).map_or(outside, |found| grey(found[0])));
            for (way, row) in [(1, 1), (2, 3)] {
                canvas
                    .fill(tile(row), 1, |u, v| at(u, v).map_or(outside, |found| grey(found[way])));
                canvas.fill(tile(row + 1), 1, |u, v| {
                    let difference =
                        |found: [f64; 3]| signed((found[way] - found[0]) / FULL_COLOUR);
                    at(u, v).map_or(outside, difference)
                });
            }
            let words = format!("{side}: {:.4}, {:.4}", rms(&found, 1), rms(&found, 2));
            canvas.text(&words, [x, top + ROWS.len() as u32 * (SIDE + GAP) - 4], 14)?;
        }
    }
    Ok(canvas)
}

/// Parallel rays through a shape.
struct View<'a> {
    tables: &'a TableSet,
    index: u32,
    shape: &'a Shape,
    extinction: f64,
    dir: DVec3,
    to: f64,
}

impl View<'_> {
    /// Transmittance exact, by the march, and by the 4D table; none beside the sphere.
    fn all(&self, u: f64, v: f64) -> Option<[f64; 3]> {
        let half = (1.0 - u * u - v * v).max(0.0).sqrt();
        if half <= 0.0 {
            return None;
        }
        let (right, up) = self.dir.any_orthonormal_pair();
        let middle = u * right + v * up;
        let (entry, exit) = (middle - half * self.dir, middle + half * self.dir);
        let mut mean = [0.0; 2];
        self.shape.segment_means(entry, entry.lerp(exit, self.to), &mut mean);
        let exact = 0.5 * (mean[0] + mean[1]) * self.to;
        let profile = self.tables.chord_profile(self.index, entry, exit);
        let step = self.tables.chord_step(self.index, entry, exit);
        let to = self.to as f32;
        let march = f64::from(profile.mean_density) * f64::from(profile.fraction(to));
        let table = f64::from(step.mean_density) * f64::from(step.fraction(to));
        Some([exact, march, table].map(|matter| (-2.0 * half * self.extinction * matter).exp()))
    }

    /// All for every pixel of a tile, row by row from the top.
    fn grid(&self) -> Vec<Option<[f64; 3]>> {
        let side = SIDE as usize;
        let place = |i: usize| 2.0 * (i as f64 + 0.5) / side as f64 - 1.0;
        let pixels = (0..side * side).into_par_iter();
        pixels.map(|i| self.all(place(i % side), -place(i / side))).collect()
    }
}

/// Root mean square over the disc of what a way differs by.
fn rms(found: &[Option<[f64; 3]>], way: usize) -> f64 {
    let all = found.iter().flatten();
    let (sum, count) = all.fold((0.0, 0.0), |(sum, count), found| {
        (sum + (found[way] - found[0]).powi(2), count + 1.0)
    });
    f64::sqrt(sum / f64::max(count, 1.0))
}
