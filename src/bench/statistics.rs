//! Medians, quantiles, ratios and their noise.

use super::record::{Ratio, Spread};
use crate::reference::Random;

/// Median absolute deviation to standard deviation, for normal noise: 1 / the 75th percentile.
const MAD_TO_DEVIATION: f64 = 1.482_602_218_505_602;
/// Resamples of a bootstrap: the ends of an interval of 95 % then stand on 50 of them.
const RESAMPLES: usize = 2000;
/// Share of the resamples on each side of an interval.
const TAIL: f64 = 0.025;

/// The value below which a share of sorted values lies, between neighbours by straight lines.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let low = place as usize;
    let high = (low + 1).min(last);
    sorted[low] + (sorted[high] - sorted[low]) * (place - low as f64)
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// The median.
pub fn median(values: &[f64]) -> f64 {
    quantile(&sorted(values), 0.5)
}

impl Spread {
    /// Of values; none where there are none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let sorted = sorted(values);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let median = quantile(&sorted, 0.5);
        let off: Vec<f64> = sorted.iter().map(|v| (v - median).abs()).collect();
        Some(Self {
            median,
            p95: quantile(&sorted, 0.95),
            p99: quantile(&sorted, 0.99),
            min,
            max,
            spread: MAD_TO_DEVIATION * self::median(&off),
        })
    }
}

/// How two rows of times are drawn anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Draw {
    /// Each by itself: runs that have nothing to do with each other.
    Apart,
    /// The same frames of both: frames that were made in turn, on a machine that drifts.
    InPairs,
}

/// The ratio of the medians of two rows of times (ms), the second over the first, with its interval
/// by bootstrap (Efron, 1979). The same rows give the same interval. None where a row is empty or
/// holds zeros only.
pub fn ratio(case: &str, what: &str, old: &[f64], new: &[f64], draw: Draw) -> Option<Ratio> {
    let (old_ms, new_ms) = (median(old), median(new));
    // None of them is so for NaN.
    if !(old_ms > 0.0 && new_ms > 0.0) {
        return None;
    }
    let mut random = Random::new(0, old.len() as u64, new.len() as u64);
    let pick = |random: &mut Random, n: usize| ((random.unit() * n as f64) as usize).min(n - 1);
    let mut ratios: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let first: Vec<usize> = old.iter().map(|_| pick(&mut random, old.len())).collect();
            let second: Vec<usize> = match draw {
                Draw::InPairs if old.len() == new.len() => first.clone(),
                _ => new.iter().map(|_| pick(&mut random, new.len())).collect(),
            };
            let of = |values: &[f64], at: &[usize]| {
                median(&at.iter().map(|i| values[*i]).collect::<Vec<_>>())
            };
            of(new, &second) / of(old, &first)
        })
        .filter(|ratio| ratio.is_finite())
        .collect();
    ratios.sort_by(f64::total_cmp);
    let interval = [quantile(&ratios, TAIL), quantile(&ratios, 1.0 - TAIL)];
    let (case, what) = (case.to_owned(), what.to_owned());
    Some(Ratio { case, what, old_ms, new_ms, ratio: new_ms / old_ms, interval })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_by_hand() {
        let spread = Spread::of(&[3.0, 1.0, 2.0, 5.0, 4.0]).expect("values");
        assert_eq!((spread.min, spread.median, spread.max), (1.0, 3.0, 5.0));
        assert!((spread.p95 - 4.8).abs() < 1e-12 && (spread.p99 - 4.96).abs() < 1e-12);
        // Distances from 3 are 2, 2, 1, 1, 0.
        assert_eq!(spread.spread, MAD_TO_DEVIATION);
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(Spread::of(&[7.0]).map(|s| (s.p99, s.spread)), Some((7.0, 0.0)));
    }

    /// Of 200 pairs of rows of the same noise, 5 % are told apart by chance; 10 % of change in 3 %
    /// of noise is always seen.
    #[test]
    fn noise_is_told_from_change() {
        let mut random = Random::new(5, 0, 0);
        let mut row = |mean: f64| -> Vec<f64> {
            let mut normal = || (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
            (0..24).map(|_| mean * (1.0 + 0.03 * normal())).collect()
        };
        let changed = |old: &[f64], new: &[f64]| {
            ratio("", "wall", old, new, Draw::Apart).expect("times").is_change()
        };
        let false_alarms = (0..200).filter(|_| changed(&row(10.0), &row(10.0))).count();
        // Medians of 24 have uneven noise; 200 draws of 5 % spread by 3.
        assert!((1..=20).contains(&false_alarms), "{false_alarms}");
        assert!((0..50).all(|_| changed(&row(10.0), &row(11.0))));
    }

    /// A drift that both rows share hides a change of 5 % from rows taken apart, not from pairs.
    #[test]
    fn pairs_see_through_drift() {
        let old: Vec<f64> = (0..20).map(|i| 10.0 + f64::from(i)).collect();
        let new: Vec<f64> = old.iter().map(|v| 1.05 * v).collect();
        let pairs = ratio("", "wall", &old, &new, Draw::InPairs).expect("times");
        assert!(pairs.is_change() && (pairs.ratio - 1.05).abs() < 1e-12);
        assert!(pairs.interval.iter().all(|v| (v - 1.05).abs() < 1e-9));
        assert!(!ratio("", "wall", &old, &new, Draw::Apart).expect("times").is_change());
        assert_eq!(ratio("", "wall", &[], &new, Draw::Apart), None);
        assert_eq!(ratio("", "wall", &[0.0], &new, Draw::Apart), None);
    }
}
