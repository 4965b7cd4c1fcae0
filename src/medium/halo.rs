//! Light around the sun: paths that are scattered within the forward peak only.
//!
//! Along a path of optical depth `m` in peak scatterings, `n` of them happen with the Poisson
//! probability of mean `m`, and each multiplies the light's Legendre moments by those of the peak,
//! `q_l` (small angles). Taken together, and per unit of optical depth as a source at the place of
//! one of them:
//!
//! ```text
//! H_l(m) = (exp(-m (1 - q_l)) - exp(-m)) / m        q_l for m = 0
//! ```
//!
//! in place of `q_l`, which is what the exact phase function in a delta-M scaled medium has (the TMS
//! correction of Nakajima and Tanaka 1988; the first term of the series in `m` is their IMS).
//! Without it the rim of a cloud before the sun is half as bright again as it should be.
//! [`Halo`] tabulates the factor by which this changes the phase function, by angle and `m`.

use std::f64::consts::PI;

use super::{Phase, Truncation};

/// Rows of the table: angle from the sun, even in the square root of its half's sine.
pub const HALO_ROWS: usize = 96;
/// Columns: even in `ln(1 + m / HALO_DEPTH)`.
pub const HALO_COLUMNS: usize = 32;
/// Peak optical depth of the scale of the columns.
pub const HALO_DEPTH: f64 = 0.05;
/// Peak optical depth of the last column: what is scattered deeper is dark.
pub const HALO_DEEPEST: f64 = 60.0;
/// Nodes of the integrals over the peak.
const NODES: usize = 4000;
/// Sums end where a moment's share of all is below this.
const LEAST_MOMENT: f64 = 1e-7;
/// Most moments: those of the narrowest fit (droplets of 50 micrometres, g = 0.998).
const MOST_MOMENTS: usize = 6000;

/// Factors on the phase function, row after row.
#[derive(Clone, Debug, PartialEq)]
pub struct Halo {
    /// `HALO_ROWS` x `HALO_COLUMNS`; 1 in the first column.
    pub factors: Vec<f32>,
}

/// Column of a peak optical depth, fractional.
pub fn halo_column(depth: f64) -> f64 {
    let last = (HALO_COLUMNS - 1) as f64;
    let scale = last / (1.0 + HALO_DEEPEST / HALO_DEPTH).ln();
    ((1.0 + depth.max(0.0) / HALO_DEPTH).ln() * scale).min(last)
}

/// Row of an angle given by the sine of its half, fractional.
pub fn halo_row(half_sine: f64) -> f64 {
    half_sine.clamp(0.0, 1.0).sqrt() * (HALO_ROWS - 1) as f64
}

impl Halo {
    /// Of a phase function and its split.
    pub fn new(phase: &Phase, truncation: &Truncation) -> Self {
        let ones = Self { factors: vec![1.0; HALO_ROWS * HALO_COLUMNS] };
        if truncation.peak <= 0.0 {
            return ones;
        }
        let whole = phase.prepare();
        let rest = 1.0 - truncation.peak;
        let peak = |c: f64| (whole.eval(c) - rest * truncation.smooth(c)) / truncation.peak;
        // The peak proper ends where it falls to 0; beyond, single scattering stays as it is.
        let scan = (1..).map(|i| f64::from(i) * 1e-3).take_while(|t| *t < PI);
        let end = scan.into_iter().find(|t| peak(t.cos()) <= 0.0).unwrap_or(PI);
        // Even in the square root of the angle: narrow lobes get their nodes.
        let nodes: Vec<[f64; 2]> = (0..NODES)
            .map(|i| {
                let u = (i as f64 + 0.5) / NODES as f64;
                let angle = end * u * u * u;
                let width = 3.0 * end * u * u / NODES as f64;
                [angle.cos(), peak(angle.cos()) * 2.0 * PI * angle.sin() * width]
            })
            .collect();
        let moments = legendre_moments(&nodes);
        let depths: Vec<Blur> = (0..HALO_COLUMNS)
            .map(|c| {
                let scale = (1.0 + HALO_DEEPEST / HALO_DEPTH).ln() / (HALO_COLUMNS - 1) as f64;
                Blur::new(&moments, HALO_DEPTH * (c as f64 * scale).exp_m1())
            })
            .collect();
        let mut factors = Vec::with_capacity(ones.factors.len());
        for row in 0..HALO_ROWS {
            let half_sine = (row as f64 / (HALO_ROWS - 1) as f64).powi(2);
            let cosine = 1.0 - 2.0 * half_sine * half_sine;
            let alone = if cosine > end.cos() { peak(cosine) } else { 0.0 };
            let all = whole.eval(cosine);
            for depth in &depths {
                let blurred = depth.at(alone, cosine);
                let factor = 1.0 + truncation.peak * (blurred - alone) / all;
                factors.push(factor.max(0.0) as f32);
            }
        }
        Self { factors }
    }

    /// The factor at an angle (sine of its half) and a peak optical depth: twin of `halo_factor` in
    /// `shaders/shared/lighting.wgsl`.
    pub fn factor(&self, half_sine: f64, depth: f64) -> f64 {
        let split = |at: f64, count: usize| {
            let low = (at as usize).min(count - 2);
            (low, at - low as f64)
        };
        let (row, u) = split(halo_row(half_sine), HALO_ROWS);
        let (column, v) = split(halo_column(depth), HALO_COLUMNS);
        let at = |r: usize, c: usize| f64::from(self.factors[r * HALO_COLUMNS + c]);
        let along = |r: usize| at(r, column) + (at(r, column + 1) - at(r, column)) * v;
        along(row) + (along(row + 1) - along(row)) * u
    }
}

/// Moments of what the nodes hold (cosine, weight).
fn legendre_moments(nodes: &[[f64; 2]]) -> Vec<f64> {
    let mut moments = Vec::new();
    let mut values: Vec<[f64; 2]> = nodes.iter().map(|[x, _]| [1.0, *x]).collect();
    for l in 0..MOST_MOMENTS {
        let moment: f64 = nodes.iter().zip(&values).map(|([_, w], [p, _])| w * p).sum();
        moments.push(moment);
        if moment.abs() < LEAST_MOMENT {
            break;
        }
        let l = l as f64;
        for ([x, _], [p, q]) in nodes.iter().zip(&mut values) {
            let next = ((2.0 * l + 3.0) * x * *q - (l + 1.0) * *p) / (l + 2.0);
            (*p, *q) = (*q, next);
        }
    }
    moments
}

/// The peak after the scatterings of a path.
struct Blur {
    /// Share of paths with one scattering only: they keep the peak's exact shape.
    once: f64,
    /// Legendre coefficients of the other paths, which end early.
    more: Vec<f64>,
}

impl Blur {
    /// Of a path of peak optical depth `m`.
    fn new(moments: &[f64], m: f64) -> Self {
        if m <= 0.0 {
            return Self { once: 1.0, more: Vec::new() };
        }
        let once = (-m).exp();
        let coefficient = |(l, q): (usize, &f64)| {
            let more = ((-m * (1.0 - q)).exp() - once - once * m * q) / m;
            (2.0 * l as f64 + 1.0) / (4.0 * PI) * more
        };
        Self { once, more: moments.iter().enumerate().map(coefficient).collect() }
    }

    /// Value at a cosine where the peak itself has the value `alone`.
    fn at(&self, alone: f64, cosine: f64) -> f64 {
        let mut sum = 0.0;
        let (mut p, mut q) = (1.0, cosine);
        for (l, coefficient) in self.more.iter().enumerate() {
            sum += coefficient * p;
            let l = l as f64;
            let next = ((2.0 * l + 3.0) * cosine * q - (l + 1.0) * p) / (l + 2.0);
            (p, q) = (q, next);
        }
        sum + self.once * alone
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_peak_scattering_changes_nothing() {
        for phase in [Phase::Hg { g: 0.85 }, Phase::Mie { diameter_um: 20.0 }] {
            let halo = Halo::new(&phase, &Truncation::new(&phase));
            for half_sine in [0.0, 1e-3, 0.1, 0.7, 1.0] {
                assert!((halo.factor(half_sine, 0.0) - 1.0).abs() < 1e-6);
            }
            assert!(halo.factors.iter().all(|f| f.is_finite() && *f >= 0.0));
            // Far from the sun single scattering stays as it is.
            assert!((halo.factor(0.95, 3.0) - 1.0).abs() < 0.05, "{phase}");
            // Towards the sun light is taken away.
            assert!(halo.factor(0.0, 3.0) < 0.5, "{phase}");
        }
    }

    /// Light is only moved around: a path of peak optical depth m holds 1 - exp(-m) of it, if the
    /// peak holds all its light within its end.
    #[test]
    fn the_blur_keeps_the_light() {
        let width: f64 = 0.02;
        // A narrow Gaussian of weight 1.
        let nodes: Vec<[f64; 2]> = (0..2000)
            .map(|i| {
                let t = (i as f64 + 0.5) * 1e-4;
                let density = (-0.5 * (t / width).powi(2)).exp() / (2.0 * PI * width * width);
                [t.cos(), density * 2.0 * PI * t.sin() * 1e-4]
            })
            .collect();
        let moments = legendre_moments(&nodes);
        for m in [0.1, 1.0, 5.0] {
            let step = 5e-4;
            let sum: f64 = (0..1000)
                .map(|i| {
                    let t = (i as f64 + 0.5) * step;
                    let alone = (-0.5 * (t / width).powi(2)).exp() / (2.0 * PI * width * width);
                    Blur::new(&moments, m).at(alone, t.cos()) * 2.0 * PI * t.sin() * step
                })
                .sum();
            let expected = -(-m).exp_m1() / m;
            // The tails beyond the end of the sum hold less.
            assert!((sum / expected - 1.0).abs() < 2e-3, "{m}: {sum} {expected}");
        }
    }
}
