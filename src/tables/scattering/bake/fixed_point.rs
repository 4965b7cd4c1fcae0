//! Fixed points by Anderson's acceleration (1965): successive scattering orders converge slowly in
//! thick spheres; mixing the last few iterates so that their residuals cancel takes tens of steps
//! where the plain series takes thousands.

use rayon::prelude::*;

/// Iterates that are mixed.
const DEPTH: usize = 6;
/// Relative size of the diagonal term that keeps the small least-squares problem regular.
const REGULARISATION: f64 = 1e-10;

/// What became of an iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Convergence {
    /// Steps taken.
    pub steps: usize,
    /// Root mean square of the last residual, in the weighted norm.
    pub residual: f64,
}

/// Differences between successive iterates.
struct Change {
    residual: Vec<f32>,
    image: Vec<f32>,
}

/// Iterates `x <- step(x)` until the root mean square of `weight * (step(x) - x)` over all values
/// is below `tolerance`, or `most` steps are done. Returns the last `step(x)`. `weights` gives one
/// weight for each run of equally many values.
pub fn iterate(
    mut x: Vec<f32>,
    step: impl Fn(&[f32]) -> Vec<f32>,
    weights: impl Fn(&[f32]) -> Vec<f32>,
    tolerance: f64,
    most: usize,
) -> (Vec<f32>, Convergence) {
    let mut changes: Vec<Change> = Vec::new();
    let mut before: Option<Change> = None;
    for steps in 1.. {
        let image = step(&x);
        let residual = difference(&image, &x);
        let weight = weights(&image);
        let size = (dot(&residual, &residual, &weight) / x.len() as f64).sqrt();
        // What is no number stays so.
        if size < tolerance || size.is_nan() || steps >= most {
            return (image, Convergence { steps, residual: size });
        }
        if let Some(before) = before {
            if changes.len() == DEPTH {
                changes.remove(0);
            }
            changes.push(Change {
                residual: difference(&residual, &before.residual),
                image: difference(&image, &before.image),
            });
        }
        let shares = shares(&changes, &residual, &weight);
        x.clone_from(&image);
        for (change, share) in changes.iter().zip(shares) {
            let share = share as f32;
            x.par_iter_mut().zip(&change.image).for_each(|(x, c)| *x -= share * c);
        }
        before = Some(Change { residual, image });
    }
    unreachable!("the loop ends by its own bound")
}

/// Shares of the changes that make the mixed residual least.
fn shares(changes: &[Change], residual: &[f32], weight: &[f32]) -> Vec<f64> {
    let n = changes.len();
    let mut matrix = vec![vec![0.0; n + 1]; n];
    for i in 0..n {
        for j in 0..=i {
            let product = dot(&changes[i].residual, &changes[j].residual, weight);
            matrix[i][j] = product;
            matrix[j][i] = product;
        }
        matrix[i][n] = dot(&changes[i].residual, residual, weight);
    }
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] *= 1.0 + REGULARISATION;
    }
    solve(matrix)
}

/// Solves a small positive system given as rows with the right-hand side last.
fn solve(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let n = rows.len();
    for pivot in 0..n {
        let scale = rows[pivot][pivot];
        if scale <= 0.0 {
            continue;
        }
        for row in pivot + 1..n {
            let factor = rows[row][pivot] / scale;
            let (above, below) = rows.split_at_mut(row);
            for (to, from) in below[0][pivot..].iter_mut().zip(&above[pivot][pivot..]) {
                *to -= factor * from;
            }
        }
    }
    let mut solution = vec![0.0; n];
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|k| rows[row][k] * solution[k]).sum();
        if rows[row][row] > 0.0 {
            solution[row] = (rows[row][n] - known) / rows[row][row];
        }
    }
    solution
}

fn difference(a: &[f32], b: &[f32]) -> Vec<f32> {
    a.par_iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Weighted product, summed in an order that does not depend on threads.
fn dot(a: &[f32], b: &[f32], weights: &[f32]) -> f64 {
    let run = a.len() / weights.len();
    let parts: Vec<f64> = a
        .par_chunks(run)
        .zip(b.par_chunks(run))
        .zip(weights)
        .map(|((a, b), w)| {
            let sum: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            f64::from(sum) * f64::from(*w) * f64::from(*w)
        })
        .collect();
    parts.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_series_are_summed_in_few_steps() {
        // x = 1 + M x with a spectral radius of 0.999: the plain series needs 7000 terms.
        let n = 64;
        let rate = |i: usize| 0.999 * (i as f32 + 1.0) / n as f32;
        let step = |x: &[f32]| (0..n).map(|i| 1.0 + rate(i).powi(8) * x[i]).collect();
        let (x, convergence) = iterate(vec![0.0; n], step, |_| vec![1.0; 4], 1e-5, 100);
        assert!(convergence.steps < 60, "{convergence:?}");
        for (i, x) in x.iter().enumerate() {
            let want = 1.0 / (1.0 - rate(i).powi(8));
            // The residual divided by the distance of the rate from 1.
            assert!((x / want - 1.0).abs() < 2e-3, "{i} {x} {want}");
        }
    }

    #[test]
    fn too_few_steps_are_told() {
        let (_, convergence) =
            iterate(vec![0.0; 4], |x| x.iter().map(|x| 1.0 + x).collect(), |_| vec![1.0], 1e-9, 3);
        assert_eq!(convergence.steps, 3);
        assert!(convergence.residual > 0.5);
    }
}
