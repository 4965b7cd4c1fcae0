//! Least squares: the node values whose linear filtering comes closest to samples everywhere in
//! the cells. A table sampled at its nodes is right at the nodes, where no ray ever falls, and
//! biased between them.
//!
//! The normal equations are solved by conjugate gradients with the diagonal as preconditioner,
//! without forming a matrix. Every sum runs in a fixed order, so the bits do not depend on the
//! number of threads: cells are walked slab by slab along the last axis, first the even slabs,
//! whose corners share no node, then the odd ones.

use rayon::prelude::*;

use super::grid::{CHANNELS, CORNERS, Grid, weights};

/// What one ray wants.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Coordinates in its cell, 0..1.
    pub fraction: [f32; 4],
    /// What filtering should give there.
    pub target: [f32; CHANNELS],
    /// How much it counts; 0 for a place without a chord.
    pub weight: f32,
}

/// The samples of all cells: the same number in each, cells in the order of their base node with
/// the first axis fastest.
pub struct Samples {
    /// The grid whose cells they are in.
    pub grid: Grid,
    /// Samples in each cell.
    pub per_cell: usize,
    /// `per_cell` of each cell.
    pub list: Vec<Sample>,
}

type Value = [f32; CHANNELS];

/// Nodes summed at a stretch in dot products: fixed, so that sums do not depend on threads.
const CHUNK: usize = 4096;

impl Samples {
    /// Solves for the node values in `iterations` steps from the weighted mean of each node's
    /// samples; nodes that no sample touches stay 0.
    pub fn fit(&self, iterations: usize) -> Vec<Value> {
        let (diagonal, mut x) = self.start();
        let zero = vec![[0.0; CHANNELS]; x.len()];
        // Residual A^T W (b - A x).
        let mut r = self.apply(&x, true);
        let mut p: Vec<Value> = precondition(&r, &diagonal);
        let mut rz = dot(&r, &p);
        let mut z = zero;
        for _ in 0..iterations {
            let q = self.apply(&p, false);
            let pq = dot(&p, &q);
            let alpha: [f64; CHANNELS] = ratio(rz, pq);
            x.par_iter_mut().zip(&p).for_each(|(x, p)| add(x, p, alpha));
            r.par_iter_mut().zip(&q).for_each(|(r, q)| add(r, q, alpha.map(|a| -a)));
            z.clone_from(&precondition(&r, &diagonal));
            let next = dot(&r, &z);
            let beta = ratio(next, rz);
            rz = next;
            p.par_iter_mut().zip(&z).for_each(|(p, z)| {
                for c in 0..CHANNELS {
                    p[c] = z[c] + (beta[c] as f32) * p[c];
                }
            });
        }
        x
    }

    /// Diagonal of the normal equations, and a first guess.
    fn start(&self) -> (Vec<f32>, Vec<Value>) {
        // Channels: diagonal, sum of weights; the guess needs four more.
        let sums = self.scatter(|sample, w| [w * w * sample.weight, w * sample.weight, 0.0, 0.0]);
        let guess = self.scatter(|sample, w| sample.target.map(|t| w * sample.weight * t));
        let x = guess
            .iter()
            .zip(&sums)
            .map(|(g, s)| g.map(|g| if s[1] > 0.0 { g / s[1] } else { 0.0 }))
            .collect();
        (sums.iter().map(|s| s[0]).collect(), x)
    }

    /// A^T W A x, or with `residual` A^T W (b - A x).
    fn apply(&self, x: &[Value], residual: bool) -> Vec<Value> {
        self.slabs(|samples, base, corners, out| {
            let local: [Value; CORNERS] =
                std::array::from_fn(|i| x.get(base + corners[i]).copied().unwrap_or_default());
            for sample in samples.iter().filter(|s| s.weight > 0.0) {
                let w = weights(sample.fraction);
                let mut value = [0.0f32; CHANNELS];
                for (w, v) in w.iter().zip(&local) {
                    for c in 0..CHANNELS {
                        value[c] += w * v[c];
                    }
                }
                if residual {
                    for c in 0..CHANNELS {
                        value[c] = sample.target[c] - value[c];
                    }
                }
                for c in &mut value {
                    *c *= sample.weight;
                }
                for (o, w) in out.iter_mut().zip(&w) {
                    for c in 0..CHANNELS {
                        o[c] += w * value[c];
                    }
                }
            }
        })
    }

    fn scatter(&self, term: impl Fn(&Sample, f32) -> Value + Sync) -> Vec<Value> {
        self.slabs(|samples, _, _, out| {
            for sample in samples.iter().filter(|s| s.weight > 0.0) {
                for (o, w) in out.iter_mut().zip(weights(sample.fraction)) {
                    for (o, t) in o.iter_mut().zip(term(sample, w)) {
                        *o += t;
                    }
                }
            }
        })
    }

    /// Walks all cells and adds what `cell` puts on their corners.
    fn slabs(
        &self,
        cell: impl Fn(&[Sample], usize, &[usize; CORNERS], &mut [Value; CORNERS]) + Sync,
    ) -> Vec<Value> {
        let [na, nb, nc, nd] = self.grid.nodes;
        let plane = na * nb * nc;
        let corners = self.grid.corners();
        let cells_in_slab = (na - 1) * (nb - 1) * (nc - 1);
        let mut sum = vec![[0.0; CHANNELS]; self.grid.len()];
        for parity in 0..2 {
            let from = (parity * plane).min(sum.len());
            sum[from..].par_chunks_mut(2 * plane).enumerate().for_each(|(pair, nodes)| {
                let slab = 2 * pair + parity;
                if slab + 1 >= nd || nodes.len() < 2 * plane {
                    return;
                }
                for index in 0..cells_in_slab {
                    let (a, rest) = (index % (na - 1), index / (na - 1));
                    let (b, c) = (rest % (nb - 1), rest / (nb - 1));
                    let local = a + na * (b + nb * c);
                    let first = (slab * cells_in_slab + index) * self.per_cell;
                    let samples = &self.list[first..first + self.per_cell];
                    let mut out = [[0.0; CHANNELS]; CORNERS];
                    cell(samples, slab * plane + local, &corners, &mut out);
                    for (offset, value) in corners.iter().zip(out) {
                        for (n, v) in nodes[local + offset].iter_mut().zip(value) {
                            *n += v;
                        }
                    }
                }
            });
        }
        sum
    }
}

fn add(x: &mut Value, p: &Value, factor: [f64; CHANNELS]) {
    for c in 0..CHANNELS {
        x[c] += factor[c] as f32 * p[c];
    }
}

fn precondition(r: &[Value], diagonal: &[f32]) -> Vec<Value> {
    r.par_iter().zip(diagonal).map(|(r, d)| r.map(|r| if *d > 0.0 { r / d } else { 0.0 })).collect()
}

/// Dot product of each channel.
fn dot(a: &[Value], b: &[Value]) -> [f64; CHANNELS] {
    let parts: Vec<[f64; CHANNELS]> = a
        .par_chunks(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .map(|(a, b)| {
            let mut sum = [0.0; CHANNELS];
            for (a, b) in a.iter().zip(b) {
                for c in 0..CHANNELS {
                    sum[c] += f64::from(a[c]) * f64::from(b[c]);
                }
            }
            sum
        })
        .collect();
    let mut sum = [0.0; CHANNELS];
    for part in parts {
        for c in 0..CHANNELS {
            sum[c] += part[c];
        }
    }
    sum
}

/// a / b, 0 where a channel has come to rest.
fn ratio(a: [f64; CHANNELS], b: [f64; CHANNELS]) -> [f64; CHANNELS] {
    std::array::from_fn(|c| if b[c] > 0.0 { a[c] / b[c] } else { 0.0 })
}
