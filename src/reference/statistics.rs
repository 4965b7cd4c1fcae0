//! Means with their standard errors.

use serde::Serialize;

/// A mean and how far it is likely to be off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Mean.
    pub value: f64,
    /// Standard error of the mean.
    pub standard_error: f64,
}

impl Estimate {
    /// Share of samples that hit. Where none or all of them do, the share is only known to within
    /// about one in `count`: the standard error is that of the share with one hit and one miss
    /// more, which differs where hits or misses are few.
    pub fn of_share(hits: u64, count: u64) -> Self {
        let (hits, count) = (hits as f64, count.max(1) as f64);
        let smoothed = (hits + 1.0) / (count + 2.0);
        let variance = smoothed * (1.0 - smoothed);
        Self { value: hits / count, standard_error: (variance / count).sqrt() }
    }

    /// Difference from a known value in standard errors. A standard error of 0 (every sample the
    /// same) leaves rounding: it counts as `rounding`, relative to the value.
    pub fn z(&self, expected: f64, rounding: f64) -> f64 {
        (self.value - expected) / self.standard_error.max(rounding * expected.abs()).max(1e-300)
    }
}

/// Sums from which mean and standard error follow.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Number of samples.
    pub count: f64,
    /// Their sum.
    pub sum: f64,
    /// Sum of their squares.
    pub squares: f64,
}

impl Moments {
    /// One more sample.
    pub fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    /// The samples of both.
    pub fn merged(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            sum: self.sum + other.sum,
            squares: self.squares + other.squares,
        }
    }

    /// Mean and standard error. Of fewer than two samples the error is unknown: infinite.
    pub fn estimate(&self) -> Estimate {
        if self.count < 1.0 {
            return Estimate { value: 0.0, standard_error: f64::INFINITY };
        }
        let value = self.sum / self.count;
        if self.count < 2.0 {
            return Estimate { value, standard_error: f64::INFINITY };
        }
        let variance =
            (self.squares / self.count - value * value).max(0.0) * self.count / (self.count - 1.0);
        Estimate { value, standard_error: (variance / self.count).sqrt() }
    }
}
