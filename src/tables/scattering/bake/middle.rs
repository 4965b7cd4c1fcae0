//! Values for linear interpolation: the least squares in place of the function at the nodes.
//!
//! Between nodes a curved function lies to one side of the chord. Moving each node by a twelfth of
//! the second difference puts the error's mean over each cell to zero and its root mean square to
//! 40 % of what it was: 1/sqrt(120) of the curvature becomes sqrt(1/120 - 1/144).

use super::super::CHANNELS;

/// Share of the second difference.
const SHARE: f64 = 1.0 / 12.0;

/// Moves the logarithms of a table along the named axes; its values are in layout order with all
/// channels. The paths of order 1 stay as they are: along the axis of the sun their closed form has
/// a kink, which the second difference takes for a curve, and which nodes meet exactly.
pub fn between_chords(values: &mut [f64], resolution: [usize; 4], axes: &[usize]) {
    let original = values.to_vec();
    for &axis in axes {
        let count = resolution[axis];
        if count < 3 {
            continue;
        }
        let stride = resolution[axis + 1..].iter().product::<usize>() * CHANNELS;
        for (at, value) in values.iter_mut().enumerate().skip(1).step_by(CHANNELS) {
            let index = at / stride % count;
            // At the ends the curvature of the next cell goes on.
            let middle = at - index * stride + index.clamp(1, count - 2) * stride;
            let bend =
                original[middle - stride] - 2.0 * original[middle] + original[middle + stride];
            *value -= SHARE * bend;
        }
    }
}

/// Makes rays whose azimuth has no meaning independent of it: those through the centre, into the
/// sun and away from it. The light is, but moving the nodes by their neighbours is not.
pub fn join_azimuths(values: &mut [f64], [radii, incidences, azimuths, views]: [usize; 4]) {
    let at = |i: usize, j: usize, k: usize, l: usize| {
        (((i * incidences + j) * azimuths + k) * views + l) * CHANNELS + 1
    };
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
        let mut values: Vec<f64> = (0..count).flat_map(|i| [f(i as f64), f(i as f64)]).collect();
        between_chords(&mut values, [1, count, 1, 1], &[1]);
        for cell in 0..count - 1 {
            let mean = 0.5 * (values[2 * cell + 1] + values[2 * cell + 3]);
            let (a, b) = (cell as f64, cell as f64 + 1.0);
            let integral = |x: f64| 3.0 * x + 0.25 * x * x - 0.2 * x.powi(3) / 3.0;
            assert!((mean - (integral(b) - integral(a))).abs() < 1e-12);
            assert_eq!(values[2 * cell], f(cell as f64), "the path stays");
        }
    }

    #[test]
    fn azimuths_join_where_they_have_no_meaning() {
        let [incidences, azimuths, views] = [2, 3, 4];
        let mut values: Vec<f64> =
            (0..incidences * azimuths * views * CHANNELS).map(|i| (i * i) as f64).collect();
        let before = values.clone();
        join_azimuths(&mut values, [1, incidences, azimuths, views]);
        for at in 0..values.len() {
            let entry = at / CHANNELS;
            let (j, l) = (entry / (azimuths * views), entry % views);
            let joined = at % CHANNELS == 1 && (j == 1 || l == 0 || l == 3);
            let first = at - entry / views % azimuths * views * CHANNELS;
            assert!(!joined || values[at] == values[first]);
            assert!(joined || values[at] == before[at]);
        }
    }

    #[test]
    fn straight_lines_stay() {
        let mut values: Vec<f64> = (0..24).map(f64::from).collect();
        let before = values.clone();
        between_chords(&mut values, [2, 3, 2, 1], &[0, 1, 2]);
        for (v, b) in values.iter().zip(before) {
            assert!((v - b).abs() < 1e-12);
        }
    }
}
