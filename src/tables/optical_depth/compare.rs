//! Ways to tabulate a shape's optical depth, measured against each other at equal bytes.

use glam::Vec4;

use super::alternatives::{LinearAngles, TwoPoints};
use super::bake::weight;
use super::encoding::{encode, pack, unpack};
use super::fit::Target;
use super::grid::{Grid, filtered};
use super::lookup::{BINS, ChordStep};
use super::mapping::{ChordMapping, HemisphereDisc};
use super::measure::{Answer, DepthErrors, TestChord, errors};
use super::rays::{Draws, Ray, gather, moments};
use super::volume::DensityVolume;
use crate::medium::Shape;
use crate::tables::progress::Silent;

/// A way to answer for chords.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// The original: linear angles, plain mean densities in f16 (no second number), sampled at the
    /// nodes; parts of chords shared by length.
    Original,
    /// A mapping with the texels of the table files: the mean and where the matter begins and ends.
    Table(Mapping, Values),
    /// So many steps through the density volume, which has one size; parts by the same steps.
    March(usize),
    /// The exact mean density, and one smooth step with the first two moments of the matter for
    /// parts: the best that the texels could do.
    ExactStep,
    /// The exact mean densities of so many equal parts.
    ExactParts(usize),
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
    /// Nodes along each axis; none where nothing is tabulated.
    pub nodes: Option<[usize; 4]>,
    /// Errors of transmittance.
    pub errors: Vec<DepthErrors>,
}

impl Way {
    /// All tables, the original first and that of the table files last.
    pub const TABLES: [Self; 7] = [
        Self::Original,
        Self::Table(Mapping::LinearAngles, Values::Sampled),
        Self::Table(Mapping::LinearAngles, Values::Fitted),
        Self::Table(Mapping::TwoPoints, Values::Sampled),
        Self::Table(Mapping::TwoPoints, Values::Fitted),
        Self::Table(Mapping::HemisphereDisc, Values::Sampled),
        Self::Table(Mapping::HemisphereDisc, Values::Fitted),
    ];

    /// Ways without a choice of size; the march of the frame last.
    pub const OTHERS: [Self; 10] = [
        Self::ExactStep,
        Self::ExactParts(4),
        Self::ExactParts(8),
        Self::ExactParts(12),
        Self::ExactParts(21),
        Self::March(4),
        Self::March(8),
        Self::March(12),
        Self::March(16),
        Self::March(BINS),
    ];

    /// Fetches from 3D textures for one chord, as the frame would do it; none where only an answer
    /// without table errors is of interest.
    pub fn fetches(&self) -> Option<usize> {
        match *self {
            Self::Original | Self::Table(..) => Some(2),
            Self::March(steps) => Some(steps),
            Self::ExactStep | Self::ExactParts(_) => None,
        }
    }

    /// In a few words.
    pub fn name(&self) -> String {
        match self {
            Self::Original => "linear angles, densities".to_owned(),
            Self::March(steps) => format!("march of {steps} steps"),
            Self::ExactStep => "exact, parts by one smooth step".to_owned(),
            Self::ExactParts(parts) => format!("exact, {parts} equal parts"),
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
            Self::March(steps) => {
                let volume = DensityVolume::of(shape);
                Outcome {
                    bytes: volume.bytes().len(),
                    nodes: Some([volume.nodes(), volume.nodes(), volume.nodes(), 1]),
                    errors: errors(chords, central_matter, |chord| {
                        let density = |t| volume.density(chord.entry.lerp(chord.exit, t).as_vec3());
                        by_parts(chord, steps, |bin| {
                            density((bin as f64 + 0.5) / steps as f64).into()
                        })
                    }),
                }
            }
            Self::ExactParts(parts) => Outcome {
                bytes: 0,
                nodes: None,
                errors: errors(chords, central_matter, |chord| {
                    let mut means = vec![0.0; parts];
                    shape.segment_means(chord.entry, chord.exit, &mut means);
                    by_parts(chord, parts, |bin| means[bin])
                }),
            },
            Self::ExactStep => Outcome {
                bytes: 0,
                nodes: None,
                errors: errors(chords, central_matter, |chord| {
                    let [entry, exit] = [chord.entry, chord.exit].map(|p| p.as_vec3());
                    let step = encode(&moments(shape.volume(), entry, exit));
                    let share = Answer::of_step(&ChordStep::decode(step, false), chord);
                    let part = share.part_matter * chord.mean / share.mean.max(1e-9);
                    Answer { mean: chord.mean, part_matter: part }
                }),
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

/// Most random chords of a fit, 48 bytes each: larger tables get fewer a cell, at least
/// [`LEAST_PER_CELL`]; of 8 and 4 a cell at 4 MiB the error differs by 3 %.
const MOST_RAYS: usize = 12_000_000;
const LEAST_PER_CELL: usize = 3;

fn fitted(
    shape: &Shape,
    mapping: &dyn ChordMapping,
    grid: Grid,
    per_cell: usize,
    central_matter: f64,
) -> Vec<Vec4> {
    let per_cell = per_cell.min((MOST_RAYS / grid.len()).max(LEAST_PER_CELL));
    let target = |ray: &Ray| {
        let value = encode(&ray.density);
        Target { value, weight: weight(ray, value, central_matter as f32) }
    };
    let draws = Draws { grid, per_cell, seed: SEED };
    gather(shape, mapping, &draws, target, &Silent).fit(ITERATIONS, || ())
}

/// The matter of a chord and of its part from the mean densities of so many equal parts.
fn by_parts(chord: &TestChord, parts: usize, mean: impl Fn(usize) -> f64) -> Answer {
    let [from, to] = chord.part.map(|t| t * parts as f64);
    let mut answer = Answer::default();
    for bin in 0..parts {
        let density = mean(bin) / parts as f64;
        let covered = |t: f64| (t - bin as f64).clamp(0.0, 1.0);
        answer.mean += density;
        answer.part_matter += density * (covered(to) - covered(from));
    }
    answer
}
