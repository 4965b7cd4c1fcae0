//! Ways to tabulate a shape's optical depth, measured against each other at equal bytes.

use glam::Vec4;

use super::alternatives::{LinearAngles, TwoPoints};
use super::bake::weight;
use super::encoding::{encode, pack, unpack};
use super::fit::Target;
use super::grid::{Grid, filtered};
use super::lookup::ChordStep;
use super::mapping::{ChordMapping, HemisphereDisc};
use super::measure::{Answer, DepthErrors, TestChord, errors};
use super::rays::{Draws, Ray, gather, moments};
use crate::medium::Shape;
use crate::tables::progress::Silent;

/// A way to answer for chords.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// The original: linear angles, plain mean densities in f16 (no second number), sampled at the
    /// nodes; parts of chords shared by length.
    Original,
    /// A mapping with the texels of the table files.
    Table(Mapping, Values),
    /// No 4D table: so many steps through the density volume, in f16.
    March(usize),
}

/// The mappings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mapping {
    /// [`LinearAngles`].
    LinearAngles,
    /// [`TwoPoints`].
    TwoPoints,
    /// [`HemisphereDisc`], that of the table files.
    HemisphereDisc,
}

/// Where the values at the nodes come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Values {
    /// The chord of the node itself.
    Sampled,
    /// Least squares to random chords, as in the table files.
    Fitted,
}

/// Bytes of a texel of the table files, of a density of the original, of a value of the volume.
const TEXEL_BYTES: usize = 4;
const HALF_BYTES: usize = 2;
/// As in the default bake.
const ITERATIONS: usize = 10;
const SEED: u64 = 1;

/// One result.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Bytes of the table, at most those asked for.
    pub bytes: usize,
    /// Nodes along each axis; none for a march.
    pub nodes: Option<[usize; 4]>,
    /// Errors of transmittance.
    pub errors: Vec<DepthErrors>,
}

impl Way {
    /// All ways, the original first and that of the table files last.
    pub const ALL: [Self; 10] = [
        Self::Original,
        Self::March(4),
        Self::March(8),
        Self::March(16),
        Self::Table(Mapping::LinearAngles, Values::Sampled),
        Self::Table(Mapping::LinearAngles, Values::Fitted),
        Self::Table(Mapping::TwoPoints, Values::Sampled),
        Self::Table(Mapping::TwoPoints, Values::Fitted),
        Self::Table(Mapping::HemisphereDisc, Values::Sampled),
        Self::Table(Mapping::HemisphereDisc, Values::Fitted),
    ];

    /// In a few words.
    pub fn name(&self) -> String {
        match self {
            Self::Original => "linear angles, densities".to_owned(),
            Self::March(steps) => format!("{steps} steps, no table"),
            Self::Table(mapping, values) => {
                let values = match values {
                    Values::Sampled => "sampled",
                    Values::Fitted => "fitted",
                };
                format!("{}, {values}", mapping.mapping().name())
            }
        }
    }

    /// Measures the way with at most this many bytes, `per_cell` random chords a cell where it
    /// fits, on these chords.
    pub fn measure(
        &self,
        shape: &Shape,
        bytes: usize,
        per_cell: usize,
        chords: &[TestChord],
        central_matter: f64,
    ) -> Outcome {
        let outcome = |texel_bytes: usize, grid: Grid, errors| Outcome {
            bytes: grid.len() * texel_bytes,
            nodes: Some(grid.nodes),
            errors,
        };
        match *self {
            Self::March(steps) => Outcome {
                bytes: shape.volume().len() * HALF_BYTES,
                nodes: None,
                errors: errors(chords, central_matter, |chord| march(shape, steps, chord)),
            },
            Self::Original => {
                let grid = Mapping::LinearAngles.grid(bytes / HALF_BYTES);
                let sampled = sample(shape, &LinearAngles, grid, |m| {
                    Vec4::splat(half::f16::from_f32(m.mean).to_f32())
                });
                let answer = |chord: &TestChord| {
                    let at = LinearAngles.place(chord.entry, chord.exit).at;
                    let mean = f64::from(filtered(&grid, at, |node| sampled[node]).x);
                    Answer { mean, part_matter: mean * (chord.part[1] - chord.part[0]) }
                };
                outcome(HALF_BYTES, grid, errors(chords, central_matter, answer))
            }
            Self::Table(name, values) => {
                let grid = name.grid(bytes / TEXEL_BYTES);
                let mapping = name.mapping();
                let channels = match values {
                    Values::Sampled => sample(shape, mapping, grid, encode),
                    Values::Fitted => fitted(shape, mapping, grid, per_cell, central_matter),
                };
                let channels: Vec<Vec4> = channels.into_iter().map(|c| unpack(pack(c))).collect();
                let answer = |chord: &TestChord| {
                    let place = mapping.place(chord.entry, chord.exit);
                    let found = filtered(&grid, place.at, |node| channels[node]);
                    Answer::of_step(&ChordStep::decode(found, place.reversed), chord)
                };
                outcome(TEXEL_BYTES, grid, errors(chords, central_matter, answer))
            }
        }
    }
}

impl Mapping {
    fn mapping(self) -> &'static dyn ChordMapping {
        match self {
            Self::LinearAngles => &LinearAngles,
            Self::TwoPoints => &TwoPoints,
            Self::HemisphereDisc => &HemisphereDisc,
        }
    }

    /// The largest grid of at most this many nodes, in the mapping's best proportions: those of
    /// the original, four equal axes, and those of the default tables.
    fn grid(self, most: usize) -> Grid {
        let grid = |n: usize| Grid {
            nodes: match self {
                Self::LinearAngles => [n, 2 * n, n, 2 * n],
                Self::TwoPoints => [n; 4],
                Self::HemisphereDisc => {
                    // 32 to 17, as in the default tables.
                    let disc = (n as f64 * 32.0 / 17.0).round() as usize;
                    [disc, disc, n, n]
                }
            },
        };
        let mut n = 2;
        while grid(n + 1).len() <= most {
            n += 1;
        }
        // One axis more, where it fits: sizes come close to what was asked for.
        let mut best = grid(n);
        for axis in 0..4 {
            let mut more = best;
            more.nodes[axis] += 1;
            if more.len() <= most {
                best = more;
            }
        }
        best
    }
}

/// The values of the nodes' own chords; 0 where a node has none.
fn sample(
    shape: &Shape,
    mapping: &dyn ChordMapping,
    grid: Grid,
    encode: impl Fn(&super::rays::Moments) -> Vec4 + Sync,
) -> Vec<Vec4> {
    use rayon::prelude::*;
    let nodes = (0..grid.len()).into_par_iter();
    nodes
        .map(|node| {
            mapping.chord(grid.place(node)).map_or(Vec4::ZERO, |[entry, exit]| {
                encode(&moments(shape.volume(), entry.as_vec3(), exit.as_vec3()))
            })
        })
        .collect()
}

fn fitted(
    shape: &Shape,
    mapping: &dyn ChordMapping,
    grid: Grid,
    per_cell: usize,
    central_matter: f64,
) -> Vec<Vec4> {
    let target = |ray: &Ray| {
        let value = encode(&ray.density);
        Target { value, weight: weight(ray, value, central_matter as f32) }
    };
    let draws = Draws { grid, per_cell, seed: SEED };
    gather(shape, mapping, &draws, target, &Silent).fit(ITERATIONS, || ())
}

/// Midpoints of equal steps, of the whole and of the part.
fn march(shape: &Shape, steps: usize, chord: &TestChord) -> Answer {
    let mean = |from: f64, to: f64| {
        let place = |i: usize| from + (to - from) * (i as f64 + 0.5) / steps as f64;
        let points = (0..steps).map(|i| chord.entry.lerp(chord.exit, place(i)));
        points.map(|p| shape.density(p)).sum::<f64>() / steps as f64
    };
    let [from, to] = chord.part;
    Answer { mean: mean(0.0, 1.0), part_matter: mean(from, to) * (to - from) }
}
