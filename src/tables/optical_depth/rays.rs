//! Chords at random places of every cell, integrated through the density volume.

use glam::{DVec4, Vec3};
use rayon::prelude::*;

use super::fit::{Sample, Samples, Target};
use super::grid::Grid;
use super::mapping::ChordMapping;
use super::random::Stream;
use crate::medium::Shape;
use crate::medium::shape::{VOLUME_CELL, VOLUME_NODES};
use crate::tables::progress::Progress;

/// Step of the integration, in cells of the density volume. Midpoints at three quarters of a cell
/// are off by 2.5e-4 of density RMS, a twentieth of what interpolation between nodes costs.
const STEP_CELLS: f32 = 0.75;

/// Step of the additive recurrence R4 (Roberts 2018), the generalised golden ratio in 4 dimensions:
/// the points of a cell lie evenly.
const R4: [f64; 4] = [
    0.856_674_883_854_502_9,
    0.733_891_856_627_125_9,
    0.628_706_721_037_813_3,
    0.538_597_257_223_611_2,
];

/// What of a chord's density a table needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Mean density, 0..1.
    pub mean: f32,
    /// Where the middle of the matter lies, as a fraction of the length.
    pub centre: f32,
    /// Mean square distance of the matter from its middle, in squared lengths of the chord.
    pub variance: f32,
}

/// The moments of the density along a chord, by midpoints in f32.
pub(super) fn moments(volume: &[f32], entry: Vec3, exit: Vec3) -> Moments {
    let scale = 1.0 / VOLUME_CELL as f32;
    let chord = (exit - entry) * scale;
    let steps = (chord.length() / STEP_CELLS).ceil().max(1.0);
    let step = chord / steps;
    let mut p = (entry + 1.0) * scale + step * 0.5;
    // Sums of density times 1, t and t^2 with t from the middle of the chord, in steps.
    let (mut sum, mut first, mut second) = (0.0, 0.0, 0.0);
    let mut t = 0.5 - 0.5 * steps;
    for _ in 0..steps as usize {
        let density = trilinear(volume, p);
        sum += density;
        first += density * t;
        second += density * t * t;
        p += step;
        t += 1.0;
    }
    if sum <= 0.0 {
        return Moments { mean: 0.0, centre: 0.5, variance: 0.0 };
    }
    let centre = first / sum;
    let variance = (second / sum - centre * centre).max(0.0);
    Moments {
        mean: sum / steps,
        centre: 0.5 + centre / steps,
        variance: variance / (steps * steps),
    }
}

/// Trilinear filtering at a place in cells of the volume.
fn trilinear(volume: &[f32], p: Vec3) -> f32 {
    const N: usize = VOLUME_NODES;
    let last = (N - 2) as f32;
    let cell = p.clamp(Vec3::ZERO, Vec3::splat(last)).floor();
    let f = p - cell;
    let base = cell.x as usize + N * (cell.y as usize + N * cell.z as usize);
    // One bounds check for all eight corners.
    let Some(v) = volume.get(base..base + N * N + N + 2) else { return 0.0 };
    let row = |i: usize| v[i] + f.x * (v[i + 1] - v[i]);
    let near = row(0) + f.y * (row(N) - row(0));
    let far = row(N * N) + f.y * (row(N * N + N) - row(N * N));
    near + f.z * (far - near)
}

/// One integrated chord.
pub struct Ray {
    /// Length, in radii.
    pub length: f32,
    /// Its density, in the table's direction.
    pub density: Moments,
    /// Measure of isotropic lines per volume of the 4-cube.
    pub measure: f32,
}

/// Which random chords.
#[derive(Clone, Copy, Debug)]
pub struct Draws {
    /// The grid in whose cells they lie.
    pub grid: Grid,
    /// How many in each cell.
    pub per_cell: usize,
    /// Seed of their places.
    pub seed: u64,
}

impl Draws {
    /// Rows of cells along the first axis: the steps of [`gather`].
    pub fn rows(&self) -> usize {
        self.grid.nodes[1..].iter().map(|n| n - 1).product()
    }
}

/// Integrates random chords in every cell; `encode` makes of each the channels it wants of the
/// table and its weight.
pub fn gather(
    shape: &Shape,
    mapping: &dyn ChordMapping,
    draws: &Draws,
    encode: impl Fn(&Ray) -> Target + Sync,
    progress: &dyn Progress,
) -> Samples {
    let Draws { grid, per_cell, seed } = *draws;
    let cells = grid.nodes.map(|n| n - 1);
    let row = cells[0];
    let mut list = vec![Sample::default(); draws.rows() * row * per_cell];
    list.par_chunks_mut(row * per_cell).enumerate().for_each(|(index, samples)| {
        for (k, samples) in samples.chunks_mut(per_cell).enumerate() {
            let cell_index = index * row + k;
            let mut stream = Stream::new(seed, cell_index as u64);
            let mut fraction: [f64; 4] = std::array::from_fn(|_| stream.uniform());
            let mut rest = cell_index;
            let corner = cells.map(|n| {
                let i = rest % n;
                rest /= n;
                i as f64
            });
            for sample in samples {
                for (f, step) in fraction.iter_mut().zip(R4) {
                    *f = (*f + step).fract();
                }
                let at = std::array::from_fn(|a| (corner[a] + fraction[a]) / cells[a] as f64);
                sample.fraction = DVec4::from_array(fraction).as_vec4();
                let Some([entry, exit]) = mapping.chord(at) else { continue };
                let ray = Ray {
                    length: (exit - entry).length() as f32,
                    density: moments(shape.volume(), entry.as_vec3(), exit.as_vec3()),
                    measure: mapping.density(at) as f32,
                };
                sample.wanted = encode(&ray);
            }
        }
        progress.advance(1);
    });
    Samples { grid, per_cell, list }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_agree_with_fine_integration() {
        let shape = Shape::new("pyroclastic-1".parse().expect("a shape"));
        const CHORDS: u64 = 2000;
        let mut square = [0.0; 3];
        for i in 0..CHORDS {
            let mut random = Stream::new(4, i);
            let (entry, exit) = (random.on_sphere(), random.on_sphere());
            const PARTS: usize = 64;
            let mut parts = [0.0; PARTS];
            shape.segment_means(entry, exit, &mut parts);
            let place = |i: usize| (i as f64 + 0.5) / PARTS as f64;
            let sum: f64 = parts.iter().sum();
            let about = |f: &dyn Fn(f64) -> f64| {
                parts.iter().enumerate().map(|(i, d)| d * f(place(i))).sum::<f64>() / sum
            };
            let mean = sum / PARTS as f64;
            let got = moments(shape.volume(), entry.as_vec3(), exit.as_vec3());
            square[0] += (f64::from(got.mean) - mean).powi(2);
            // Shares of next to nothing are anything.
            if mean > 0.01 {
                let centre = about(&|t| t);
                let variance = about(&|t| (t - centre).powi(2));
                square[1] += (f64::from(got.centre) - centre).powi(2);
                square[2] += (f64::from(got.variance) - variance).powi(2);
            }
        }
        let rms = square.map(|s| (s / CHORDS as f64).sqrt());
        println!("{rms:?}");
        // A tenth of the best tables' error of the mean density, 0.005, and of what a step of
        // the stored 10 bits is.
        assert!(rms[0] < 5e-4 && rms[1] < 5e-4 && rms[2] < 5e-4, "{rms:?}");
    }
}
