//! What a table's answers are worth: errors of transmittance against direct integration.

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::lookup::{ChordProfile, ChordStep};
use super::random::Stream;
use crate::medium::Shape;

/// Optical depths of the mean chord through the centre at which errors are measured.
pub const CENTRAL_DEPTHS: [f64; 3] = [1.0, 10.0, 50.0];

/// Errors of transmittance at one central optical depth, over isotropic random chords.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DepthErrors {
    /// Mean optical depth of chords through the centre.
    pub central_depth: f64,
    /// Root mean square error, whole chords.
    pub rms: f64,
    /// 99th percentile of the absolute error, whole chords.
    pub p99: f64,
    /// Root mean square error of random parts of chords.
    pub part_rms: f64,
    /// The same if the matter were shared by length.
    pub part_rms_by_length: f64,
}

/// Errors at all [`CENTRAL_DEPTHS`], of both answers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OpticalDepthErrors {
    /// Random chords they were measured on.
    pub rays: u64,
    /// Of the marched profiles: one for each central optical depth.
    pub depths: Vec<DepthErrors>,
    /// Of the 4D table: one for each central optical depth.
    pub table: Vec<DepthErrors>,
}

/// A random chord with its exact answers.
#[derive(Clone, Copy, Debug)]
pub struct TestChord {
    /// Where it enters the unit sphere.
    pub entry: DVec3,
    /// Where it leaves.
    pub exit: DVec3,
    /// Mean density of the whole.
    pub mean: f64,
    /// A random part of it, as fractions of the length.
    pub part: [f64; 2],
    /// Matter in that part: mean density of the part times its share of the length.
    pub part_matter: f64,
}

/// Isotropic random chords (two independent points on the sphere) and their exact answers.
pub fn test_chords(shape: &Shape, count: usize, seed: u64) -> Vec<TestChord> {
    (0..count as u64)
        .into_par_iter()
        .map(|i| {
            let mut random = Stream::new(seed, i);
            let (entry, exit) = (random.on_sphere(), random.on_sphere());
            let (a, b) = (random.uniform(), random.uniform());
            let part = [a.min(b), a.max(b)];
            let mean = |from: DVec3, to: DVec3| {
                let mut parts = [0.0];
                shape.segment_means(from, to, &mut parts);
                parts[0]
            };
            let inner = mean(entry.lerp(exit, part[0]), entry.lerp(exit, part[1]));
            TestChord {
                entry,
                exit,
                mean: mean(entry, exit),
                part,
                part_matter: inner * (part[1] - part[0]),
            }
        })
        .collect()
}

/// Mean over directions of the integral of the density along a chord through the centre, radii.
pub fn central_matter(shape: &Shape) -> f64 {
    // The spread over directions is a fifth of the mean: 2000 of them give it to half a percent.
    const DIRECTIONS: u64 = 2000;
    let sum: f64 = (0..DIRECTIONS)
        .map(|i| {
            let d = Stream::new(0, i).on_sphere();
            let mut parts = [0.0];
            shape.segment_means(d, -d, &mut parts);
            2.0 * parts[0]
        })
        .sum();
    sum / DIRECTIONS as f64
}

/// What somebody says about a chord.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// Mean density of the whole.
    pub mean: f64,
    /// Matter in the chord's random part, as [`TestChord::part_matter`].
    pub part_matter: f64,
}

impl Answer {
    /// By a profile of the chord.
    pub fn of(profile: &ChordProfile, chord: &TestChord) -> Self {
        Self::shared(profile.mean_density, chord, |t| profile.fraction(t))
    }

    /// By the 4D table.
    pub fn of_step(step: &ChordStep, chord: &TestChord) -> Self {
        Self::shared(step.mean_density, chord, |t| step.fraction(t))
    }

    fn shared(mean: f32, chord: &TestChord, fraction: impl Fn(f32) -> f32) -> Self {
        let [from, to] = chord.part.map(|t| fraction(t as f32));
        let mean = f64::from(mean);
        Self { mean, part_matter: mean * f64::from(to - from) }
    }
}

/// Errors of `answer` on these chords.
pub fn errors(
    chords: &[TestChord],
    central_matter: f64,
    answer: impl Fn(&TestChord) -> Answer + Sync + Send,
) -> Vec<DepthErrors> {
    let answers: Vec<Answer> = chords.par_iter().map(answer).collect();
    CENTRAL_DEPTHS
        .map(|central_depth| {
            // Extinction times radius.
            let scale = central_depth / central_matter;
            let mut whole = Vec::with_capacity(chords.len());
            let (mut square, mut part, mut by_length) = (0.0, 0.0, 0.0);
            for (chord, answer) in chords.iter().zip(&answers) {
                let extinction = scale * (chord.exit - chord.entry).length();
                let t = |matter: f64| (-extinction * matter).exp();
                let error = t(answer.mean) - t(chord.mean);
                whole.push(error.abs());
                square += error * error;
                let exact = t(chord.part_matter);
                part += (t(answer.part_matter) - exact).powi(2);
                let shared = answer.mean * (chord.part[1] - chord.part[0]);
                by_length += (t(shared) - exact).powi(2);
            }
            let n = chords.len().max(1) as f64;
            whole.sort_by(f64::total_cmp);
            let rank = (0.99 * n) as usize;
            DepthErrors {
                central_depth,
                rms: (square / n).sqrt(),
                p99: whole.get(rank).copied().unwrap_or(0.0),
                part_rms: (part / n).sqrt(),
                part_rms_by_length: (by_length / n).sqrt(),
            }
        })
        .to_vec()
}
