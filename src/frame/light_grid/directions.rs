//! Directions that the light grid's light travels in: corners of regular solids, so that sums over them are integrals
//! over the sphere for polynomials of a degree. Twelve know all moments that the scaled phase function asks for; what
//! more of them are better at is light that crosses the gaps between clouds.

use std::sync::LazyLock;

use glam::{DVec3, DVec4};
use serde::Serialize;

/// A set of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Directions {
    /// Corners of an icosahedron: degree 5.
    #[default]
    Twelve,
    /// Corners of a dodecahedron: degree 5, and half of the error in degree 6.
    Twenty,
    /// Both, with weights by which degree 6 cancels: degree 9 (McLaren 1963, Math. Comp. 17).
    ThirtyTwo,
}

/// Golden ratio.
const PHI: f64 = 1.618_033_988_749_895;
/// Weights of the corners of the two solids in the set of both, as shares of the sphere.
const OF_ICOSAHEDRON: f64 = 5.0 / 168.0;
const OF_DODECAHEDRON: f64 = 9.0 / 280.0;
/// Height of the four corners of the icosahedron next to the horizon: light along no direction stays in a layer of
/// clouds.
const TWELVE_LIFT: f64 = 1.0 / 6.0;
/// Turns about z, radians, with which the direction next to the horizon is as far from it as it can be: by 0.333 of
/// a dodecahedron, by 0.187 of both.
const TWENTY_TURN: f64 = 1.935_692_3;
const THIRTY_TWO_TURN: f64 = 2.588_044;

/// One of each pair of opposite corners.
fn icosahedron() -> Vec<DVec3> {
    cycled(DVec3::new(0.0, 1.0, PHI))
}

fn dodecahedron() -> Vec<DVec3> {
    let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let cube = signs.map(|[y, z]| DVec3::new(1.0, y, z).normalize());
    cube.into_iter().chain(cycled(DVec3::new(0.0, PHI, 1.0 / PHI))).collect()
}

/// The point with its axes in turn, and with either sign of the last but one of them that is not 0.
fn cycled(point: DVec3) -> Vec<DVec3> {
    let [_, a, b] = point.normalize().to_array();
    [a, -a]
        .into_iter()
        .flat_map(|a| [DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)])
        .collect()
}

fn turned(points: Vec<DVec3>, weight: f64, [cos, sin]: [f64; 2]) -> impl Iterator<Item = DVec4> {
    points
        .into_iter()
        .map(move |d| DVec3::new(d.x * cos - d.y * sin, d.x * sin + d.y * cos, d.z).extend(weight))
}

fn turn(angle: f64) -> [f64; 2] {
    [angle.cos(), angle.sin()]
}

static TWELVE: LazyLock<Vec<DVec4>> = LazyLock::new(|| {
    let sin = TWELVE_LIFT * (1.0 + PHI * PHI).sqrt() / PHI;
    turned(icosahedron(), 1.0 / 12.0, [(1.0 - sin * sin).sqrt(), sin]).collect()
});
static TWENTY: LazyLock<Vec<DVec4>> =
    LazyLock::new(|| turned(dodecahedron(), 1.0 / 20.0, turn(TWENTY_TURN)).collect());
static THIRTY_TWO: LazyLock<Vec<DVec4>> = LazyLock::new(|| {
    let turn = turn(THIRTY_TWO_TURN);
    turned(icosahedron(), OF_ICOSAHEDRON, turn)
        .chain(turned(dodecahedron(), OF_DODECAHEDRON, turn))
        .collect()
});

impl Directions {
    /// All sets.
    pub const ALL: [Self; 3] = [Self::Twelve, Self::Twenty, Self::ThirtyTwo];

    /// The set with so many axes.
    pub fn with_axes(axes: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|set| set.axes().len() == axes as usize)
    }

    /// How many there are.
    pub fn count(self) -> u32 {
        2 * self.axes().len() as u32
    }

    /// The first of each pair of opposite directions, and the share of the sphere that each of both stands for.
    pub fn axes(self) -> &'static [DVec4] {
        match self {
            Self::Twelve => &TWELVE,
            Self::Twenty => &TWENTY,
            Self::ThirtyTwo => &THIRTY_TWO,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::gpu_data::MOST_AXES;

    /// Mean of `x^a y^b z^c` over the sphere.
    fn moment([a, b, c]: [i32; 3]) -> f64 {
        if [a, b, c].iter().any(|n| n % 2 == 1) {
            return 0.0;
        }
        let odds = |n: i32| (1..n).step_by(2).map(f64::from).product::<f64>();
        odds(a) * odds(b) * odds(c) / (1..a + b + c + 2).step_by(2).map(f64::from).product::<f64>()
    }

    /// Largest error of a sum over the directions, of all products of powers of this degree.
    fn off(set: Directions, degree: i32) -> f64 {
        let mut largest = 0.0f64;
        for a in 0..=degree {
            for b in 0..=degree - a {
                let c = degree - a - b;
                let powers = |v: DVec3| v.x.powi(a) * v.y.powi(b) * v.z.powi(c);
                let pair =
                    |axis: &DVec4| axis.w * (powers(axis.truncate()) + powers(-axis.truncate()));
                let sum: f64 = set.axes().iter().map(pair).sum();
                largest = largest.max((sum - moment([a, b, c])).abs());
            }
        }
        largest
    }

    #[test]
    fn sums_are_integrals_up_to_their_degree() {
        for (set, degree) in
            [(Directions::Twelve, 5), (Directions::Twenty, 5), (Directions::ThirtyTwo, 9)]
        {
            for d in 0..=degree {
                // Roundings of a few products and 32 summands of at most 1.
                assert!(off(set, d) < 1e-15, "{set:?}, degree {d}: {}", off(set, d));
            }
            // The next degree is beyond them, by 0.001 to 0.02: the test can fail.
            assert!(off(set, degree + 1) > 5e-4, "{set:?}: {}", off(set, degree + 1));
        }
    }

    #[test]
    fn no_direction_is_horizontal() {
        for (set, least) in [
            (Directions::Twelve, 0.1666),
            (Directions::Twenty, 0.3333),
            (Directions::ThirtyTwo, 0.1875),
        ] {
            let lowest = set.axes().iter().map(|a| a.y.abs()).fold(1.0, f64::min);
            assert!(lowest > least, "{set:?}: {lowest}");
            assert!(set.axes().iter().all(|a| (a.truncate().length() - 1.0).abs() < 1e-15));
            assert!(set.axes().len() <= MOST_AXES);
        }
        let counts = Directions::ALL.map(Directions::count);
        assert_eq!(counts, [12, 20, 32]);
        assert_eq!(Directions::with_axes(10), Some(Directions::Twenty));
        assert_eq!(Directions::with_axes(7), None);
    }
}
