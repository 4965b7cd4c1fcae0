//! Run time against error: which points lie on the front, and how two curves compare.

/// Which points no other point beats: one that is at most as slow and as wrong, and better in one
/// of the two. What is no number beats nothing and is not on the front.
pub fn front(points: &[Option<[f64; 2]>]) -> Vec<bool> {
    let beats = |a: [f64; 2], b: [f64; 2]| a[0] <= b[0] && a[1] <= b[1] && a != b;
    points
        .iter()
        .map(|point| {
            point.is_some_and(|p| {
                p.iter().all(|v| v.is_finite())
                    && !points.iter().flatten().any(|other| beats(*other, p))
            })
        })
        .collect()
}

/// The time at which a curve of (time, error) points comes to an error, between its points by
/// straight lines in logarithms: of the points that come that far, the quickest. None where none
/// does.
pub fn time_at(curve: &[[f64; 2]], error: f64) -> Option<f64> {
    let mut points: Vec<[f64; 2]> =
        curve.iter().copied().filter(|p| p.iter().all(|v| *v > 0.0 && v.is_finite())).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let reached = points.iter().position(|p| p[1] <= error)?;
    let [time, reached_error] = points[reached];
    let Some([before, before_error]) = reached.checked_sub(1).map(|i| points[i]) else {
        return Some(time);
    };
    let share = (before_error / error).ln() / (before_error / reached_error).ln();
    Some(before * (time / before).powf(share.clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_beaten_are_left_out() {
        let points = [
            [1.0, 9.0],
            [2.0, 4.0],
            [2.0, 5.0],
            [3.0, 4.0],
            [9.0, 1.0],
            [9.5, 1.0],
            [f64::NAN, 0.0],
        ];
        let mut points: Vec<_> = points.map(Some).into();
        points.push(None);
        assert_eq!(front(&points), [true, true, false, false, true, false, false, false]);
    }

    #[test]
    fn times_at_equal_error() {
        // Error falls as the square of the time.
        let curve = [[1.0, 1.0], [10.0, 0.01], [100.0, 1e-4]];
        let close = |error: f64, time: f64| {
            let found = time_at(&curve, error).expect("reached");
            assert!((found / time - 1.0).abs() < 1e-12, "{error}: {found}");
        };
        close(0.01, 10.0);
        close(0.04, 5.0);
        close(5.0, 1.0);
        assert_eq!(time_at(&curve, 1e-5), None);
        assert_eq!(time_at(&[], 1.0), None);
        // A curve whose error stays where it is never comes to a smaller one.
        assert_eq!(time_at(&[[1.0, 0.5], [9.0, 0.5]], 0.4), None);
    }
}
