//! Values for linear interpolation: the least squares in place of the function at the nodes.
//!
//! Between nodes a curved function lies to one side of the chord. Moving each node by a twelfth of
//! the second difference puts the error's mean over each cell to zero and its root mean square to
//! 40 % of what it was: 1/sqrt(120) of the curvature becomes sqrt(1/120 - 1/144).

/// Share of the second difference that leaves the least root mean square of the error.
pub const LEAST_SQUARES: f64 = 1.0 / 12.0;
/// The share that leaves the least greatest error: a parabola is then off by as much at the nodes as
/// between them, a third less than the other leaves at the nodes.
pub const LEAST_GREATEST: f64 = 1.0 / 16.0;

/// Moves the values of a table along the named axes by a share of their second differences; they are
/// in layout order.
pub fn between_chords(values: &mut [f64], resolution: [usize; 4], axes: &[usize], share: f64) {
    let original = values.to_vec();
    for &axis in axes {
        let count = resolution[axis];
        if count < 3 {
            continue;
        }
        let stride = resolution[axis + 1..].iter().product::<usize>();
        for (at, value) in values.iter_mut().enumerate() {
            let index = at / stride % count;
            // At the ends the curvature of the next cell goes on.
            let middle = at - index * stride + index.clamp(1, count - 2) * stride;
            let bend =
                original[middle - stride] - 2.0 * original[middle] + original[middle + stride];
            *value -= share * bend;
        }
    }
}

/// Makes rays whose azimuth has no meaning independent of it: those through the centre, into the
/// sun and away from it. The light is, but moving the nodes by their neighbours is not.
pub fn join_azimuths(values: &mut [f64], [radii, incidences, azimuths, views]: [usize; 4]) {
    let at =
        |i: usize, j: usize, k: usize, l: usize| ((i * incidences + j) * azimuths + k) * views + l;
    for i in 0..radii {
        for j in 0..incidences {
            for l in (0..views).filter(|l| j + 1 == incidences || *l == 0 || l + 1 == views) {
                let sum: f64 = (0..azimuths).map(|k| values[at(i, j, k, l)]).sum();
                for k in 0..azimuths {
                    values[at(i, j, k, l)] = sum / azimuths as f64;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parabolas_are_met_in_the_mean() {
        let (count, f) = (5usize, |x: f64| 3.0 + 0.5 * x - 0.2 * x * x);
        let mut values: Vec<f64> = (0..count).map(|i| f(i as f64)).collect();
        between_chords(&mut values, [1, count, 1, 1], &[1], LEAST_SQUARES);
        for cell in 0..count - 1 {
            let mean = 0.5 * (values[cell] + values[cell + 1]);
            let (a, b) = (cell as f64, cell as f64 + 1.0);
            let integral = |x: f64| 3.0 * x + 0.25 * x * x - 0.2 * x.powi(3) / 3.0;
            assert!((mean - (integral(b) - integral(a))).abs() < 1e-12);
        }
    }

    #[test]
    fn azimuths_join_where_they_have_no_meaning() {
        let [incidences, azimuths, views] = [2, 3, 4];
        let mut values: Vec<f64> =
            (0..incidences * azimuths * views).map(|i| (i * i) as f64).collect();
        let before = values.clone();
        join_azimuths(&mut values, [1, incidences, azimuths, views]);
        for at in 0..values.len() {
            let (j, l) = (at / (azimuths * views), at % views);
            let joined = j == 1 || l == 0 || l == 3;
            let first = at - at / views % azimuths * views;
            assert!(!joined || values[at] == values[first]);
            assert!(joined || values[at] == before[at]);
        }
    }

    #[test]
    fn straight_lines_stay() {
        let mut values: Vec<f64> = (0..24).map(f64::from).collect();
        let before = values.clone();
        between_chords(&mut values, [2, 3, 4, 1], &[0, 1, 2], LEAST_SQUARES);
        for (v, b) in values.iter().zip(before) {
            assert!((v - b).abs() < 1e-12);
        }
    }
}
