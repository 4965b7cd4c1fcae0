//! One comparison: what was expected, what came, how far apart they may be.

use serde::Serialize;

/// One row of the report.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What is compared.
    pub name: String,
    /// The value from outside of the tables.
    pub expected: f64,
    /// The tables' value.
    pub got: f64,
    /// How far apart they are, in the measure of the tolerance.
    pub error: f64,
    /// The largest error that passes.
    pub tolerance: f64,
    /// Whether it passes.
    pub pass: bool,
}

impl Row {
    /// A row whose error is measured otherwise than as a plain difference.
    pub fn measured(name: String, [expected, got]: [f64; 2], error: f64, tolerance: f64) -> Self {
        // Not the other way round: NaN must not pass.
        Self { name, expected, got, error, tolerance, pass: error <= tolerance }
    }

    /// A row whose error is the absolute difference.
    pub fn absolute(name: String, expected: f64, got: f64, tolerance: f64) -> Self {
        Self::measured(name, [expected, got], (got - expected).abs(), tolerance)
    }

    /// A row whose error is the difference relative to what is expected.
    pub fn relative(name: String, expected: f64, got: f64, tolerance: f64) -> Self {
        Self::measured(name, [expected, got], (got / expected - 1.0).abs(), tolerance)
    }
}

/// The worst of several comparisons of one kind: that which uses most of its tolerance.
#[derive(Clone, Copy, Debug)]
pub struct Worst {
    values: [f64; 2],
    error: f64,
    tolerance: f64,
    used: f64,
}

impl Worst {
    /// Nothing compared yet: fails where it stays so.
    pub const NONE: Self =
        Self { values: [f64::NAN; 2], error: f64::NAN, tolerance: 0.0, used: -1.0 };

    /// One comparison more: expected and got, error, tolerance.
    pub fn add(&mut self, values: [f64; 2], error: f64, tolerance: f64) {
        // An error that is no number is the worst there can be.
        let used = if error.is_nan() { f64::INFINITY } else { error / tolerance };
        if used > self.used {
            *self = Self { values, error, tolerance, used };
        }
    }

    /// The worst of both.
    pub fn or(self, other: Self) -> Self {
        if other.used > self.used { other } else { self }
    }

    /// As a row.
    pub fn row(self, name: String) -> Row {
        Row::measured(name, self.values, self.error, self.tolerance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_fails() {
        assert!(!Row::absolute(String::new(), 1.0, f64::NAN, 0.1).pass);
        assert!(!Row::relative(String::new(), 0.0, 0.0, 0.1).pass);
        assert!(!Worst::NONE.row(String::new()).pass, "nothing compared is nothing shown");
        let mut worst = Worst::NONE;
        worst.add([1.0, f64::NAN], f64::NAN, 0.1);
        worst.add([1.0, 1.0], 0.0, 0.1);
        assert!(!worst.row(String::new()).pass);
    }

    #[test]
    fn the_worst_is_relative_to_its_tolerance() {
        let mut worst = Worst::NONE;
        worst.add([1.0, 1.5], 0.5, 1.0);
        worst.add([1.0, 1.02], 0.02, 0.01);
        worst.add([1.0, 1.1], 0.1, 1.0);
        let row = worst.row("x".to_owned());
        assert_eq!((row.error, row.tolerance, row.pass), (0.02, 0.01, false));
    }
}
