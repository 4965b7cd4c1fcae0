//! Least squares: the node values whose linear filtering comes closest to samples everywhere in
//! the cells. A table sampled at its nodes is right at the nodes, where no ray ever falls, and
//! biased between them.
//!
//! The normal equations are solved by conjugate gradients with the diagonal as preconditioner,
//! without forming a matrix. Every sum runs in a fixed order, so the bits do not depend on the
//! number of threads: cells are walked slab by slab along the last axis, first the even slabs,
//! whose corners share no node, then the odd ones.

use glam::{DVec4, Vec4};
use rayon::prelude::*;

use super::grid::{CORNERS, Grid, weights};

/// What one ray wants of each channel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Target {
    /// What filtering should give.
    pub value: Vec4,
    /// How much it counts.
    pub weight: Vec4,
}

/// A target at a place; of weight 0 where there is no chord.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Coordinates in its cell, 0..1.
    pub fraction: Vec4,
    /// What is wanted there.
    pub wanted: Target,
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

/// Nodes summed at a stretch in dot products: fixed, so that sums do not depend on threads.
const CHUNK: usize = 4096;

impl Samples {
    /// Solves for the node values in `iterations` steps from the weighted mean of each node's
    /// samples; nodes that no sample touches stay 0. Channels are independent. `step` is called
    /// after each.
    pub fn fit(&self, iterations: usize, step: impl Fn()) -> Vec<Vec4> {
        let (diagonal, mut x) = self.start();
        // Residual A^T W (b - A x).
        let mut r = self.apply(&x, true);
        let mut p = precondition(&r, &diagonal);
        let mut rz = dot(&r, &p);
        for _ in 0..iterations {
            let q = self.apply(&p, false);
            let alpha = ratio(rz, dot(&p, &q));
            x.par_iter_mut().zip(&p).for_each(|(x, p)| *x += alpha * *p);
            r.par_iter_mut().zip(&q).for_each(|(r, q)| *r -= alpha * *q);
            let z = precondition(&r, &diagonal);
            let next = dot(&r, &z);
            let beta = ratio(next, rz);
            rz = next;
            p.par_iter_mut().zip(&z).for_each(|(p, z)| *p = *z + beta * *p);
            step();
        }
        x
    }

    /// Diagonal of the normal equations, and a first guess.
    fn start(&self) -> (Vec<Vec4>, Vec<Vec4>) {
        let diagonal = self.scatter(|wanted, w| wanted.weight * (w * w));
        let sums = self.scatter(|wanted, w| wanted.weight * w);
        let guess = self.scatter(|wanted, w| wanted.value * wanted.weight * w);
        let x = guess.iter().zip(&sums).map(|(g, s)| quotient(*g, *s)).collect();
        (diagonal, x)
    }

    /// A^T W A x, or with `residual` A^T W (b - A x).
    fn apply(&self, x: &[Vec4], residual: bool) -> Vec<Vec4> {
        self.slabs(|samples, base, corners, out| {
            let local: [Vec4; CORNERS] =
                std::array::from_fn(|i| x.get(base + corners[i]).copied().unwrap_or_default());
            for sample in samples.iter().filter(|s| s.wanted.weight != Vec4::ZERO) {
                let w = weights(sample.fraction);
                let mut value = Vec4::ZERO;
                for (w, v) in w.iter().zip(&local) {
                    value += *w * *v;
                }
                if residual {
                    value = sample.wanted.value - value;
                }
                value *= sample.wanted.weight;
                for (o, w) in out.iter_mut().zip(&w) {
                    *o += *w * value;
                }
            }
        })
    }

    fn scatter(&self, term: impl Fn(&Target, f32) -> Vec4 + Sync) -> Vec<Vec4> {
        self.slabs(|samples, _, _, out| {
            for sample in samples.iter().filter(|s| s.wanted.weight != Vec4::ZERO) {
                for (o, w) in out.iter_mut().zip(weights(sample.fraction)) {
                    *o += term(&sample.wanted, w);
                }
            }
        })
    }

    /// Walks all cells and adds what `cell` puts on their corners.
    fn slabs(
        &self,
        cell: impl Fn(&[Sample], usize, &[usize; CORNERS], &mut [Vec4; CORNERS]) + Sync,
    ) -> Vec<Vec4> {
        let [na, nb, nc, nd] = self.grid.nodes;
        let plane = na * nb * nc;
        let corners = self.grid.corners();
        let cells_in_slab = (na - 1) * (nb - 1) * (nc - 1);
        let mut sum = vec![Vec4::ZERO; self.grid.len()];
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
                    let mut out = [Vec4::ZERO; CORNERS];
                    cell(samples, slab * plane + local, &corners, &mut out);
                    for (offset, value) in corners.iter().zip(out) {
                        nodes[local + offset] += value;
                    }
                }
            });
        }
        sum
    }
}

fn precondition(r: &[Vec4], diagonal: &[Vec4]) -> Vec<Vec4> {
    r.par_iter().zip(diagonal).map(|(r, d)| quotient(*r, *d)).collect()
}

/// a / b in each channel, 0 where b is.
fn quotient(a: Vec4, b: Vec4) -> Vec4 {
    let some = b.cmpgt(Vec4::ZERO);
    Vec4::select(some, a / Vec4::select(some, b, Vec4::ONE), Vec4::ZERO)
}

/// Dot product of each channel.
fn dot(a: &[Vec4], b: &[Vec4]) -> DVec4 {
    let chunks = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK));
    let parts: Vec<DVec4> = chunks
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.as_dvec4() * b.as_dvec4()).sum())
        .collect();
    parts.into_iter().sum()
}

/// a / b, 0 where a channel has come to rest.
fn ratio(a: DVec4, b: DVec4) -> Vec4 {
    let moving = b.cmpgt(DVec4::ZERO);
    DVec4::select(moving, a / DVec4::select(moving, b, DVec4::ONE), DVec4::ZERO).as_vec4()
}
