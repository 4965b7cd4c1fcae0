//! Gauss-Legendre rules.

/// Nodes and weights of a rule on 0..1.
#[derive(Clone, Debug)]
pub struct GaussRule {
    /// Pairs of place and weight; the weights sum to 1.
    pub points: Vec<(f64, f64)>,
}

impl GaussRule {
    /// The rule with `count` points: exact for polynomials of degree `2 count - 1`.
    pub fn new(count: usize) -> Self {
        let n = count as f64;
        let points = (0..count)
            .map(|i| {
                // Newton's method on the Legendre polynomial from Tricomi's estimate of its root.
                let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
                let mut slope = 1.0;
                for _ in 0..20 {
                    let (value, derivative) = legendre(count, x);
                    slope = derivative;
                    let step = value / derivative;
                    x -= step;
                    if step.abs() < 1e-15 {
                        break;
                    }
                }
                (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
            })
            .collect();
        Self { points }
    }

    /// Integral of `f` over `from..to`.
    pub fn integrate(&self, from: f64, to: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
        let span = to - from;
        span * self.points.iter().map(|&(x, w)| w * f(from + span * x)).sum::<f64>()
    }
}

/// Legendre polynomial of this degree and its derivative, |x| < 1.
fn legendre(degree: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for k in 2..=degree {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
    }
    (value, degree as f64 * (x * value - before) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_exact_to_their_degree() {
        for count in [1usize, 2, 5, 8, 32] {
            let rule = GaussRule::new(count);
            for power in 0..2 * count {
                let got = rule.integrate(0.0, 1.0, |x| x.powi(power as i32));
                // Rounding of a sum of `count` terms.
                assert!((got * (power + 1) as f64 - 1.0).abs() < 1e-12, "{count} {power} {got}");
            }
        }
    }
}
