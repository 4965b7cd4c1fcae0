//! Integration rules of the checks, apart from those of the bake.

/// Points and weights of the Gauss-Legendre rule on 0..1.
pub fn gauss(points: usize) -> Vec<(f64, f64)> {
    let n = points as f64;
    (0..points)
        .map(|i| {
            // Newton's method from Tricomi's estimate of the root.
            let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..20 {
                let (mut before, mut p) = (1.0, x);
                for k in 2..=points {
                    let k = k as f64;
                    (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
                }
                slope = n * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            (0.5 + 0.5 * x, 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// A Gauss rule in each of so many equal panels of 0..1: for integrands with kinks, as tables are.
pub fn panels(count: usize, points: usize) -> Vec<(f64, f64)> {
    let rule = gauss(points);
    let scale = 1.0 / count as f64;
    let all = (0..count)
        .flat_map(|panel| rule.iter().map(move |&(x, w)| ((panel as f64 + x) * scale, w * scale)));
    all.collect()
}

/// The double exponential rule of Takahasi and Mori (1974) on 0..1, as distances from both ends and
/// weights: for integrands with roots or steep slopes at the ends.
pub fn double_exponential(half_points: i32) -> Vec<([f64; 2], f64)> {
    /// Beyond this the weights are below 1e-16.
    const REACH: f64 = 3.2;
    let step = REACH / f64::from(half_points);
    (-half_points..=half_points)
        .map(|k| {
            let t = f64::from(k) * step;
            let s = std::f64::consts::FRAC_PI_2 * t.sinh();
            // Both distances, not one minus the other: that would lose the digits next to the end.
            let near = 1.0 / (1.0 + (-2.0 * s).exp());
            let far = 1.0 / (1.0 + (2.0 * s).exp());
            let weight = step * std::f64::consts::FRAC_PI_2 * t.cosh() * 2.0 * near * far;
            ([near, far], weight)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_integrate_what_they_are_for() {
        for points in 1..=12 {
            let degree = 2 * points as i32 - 1;
            let sum: f64 = gauss(points).iter().map(|(x, w)| w * x.powi(degree)).sum();
            assert!((sum * f64::from(degree + 1) - 1.0).abs() < 1e-13, "{points}: {sum}");
        }
        let kink: f64 = panels(50, 3).iter().map(|(x, w)| w * (x - 0.313f64).abs()).sum();
        let exact = (0.313f64.powi(2) + 0.687f64.powi(2)) / 2.0;
        assert!((kink - exact).abs() < 2e-4 / 4.0, "{kink} {exact}");
        let root: f64 = double_exponential(60).iter().map(|([a, b], w)| w * (a * b).sqrt()).sum();
        assert!((root - std::f64::consts::PI / 8.0).abs() < 1e-12, "{root}");
    }
}
