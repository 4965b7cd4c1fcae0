//! Places for the names of points, so that none hides another.

/// A rectangle: left, top, right, bottom, pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect(pub [i32; 4]);

impl Rect {
    fn overlaps(&self, other: &Self) -> bool {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        a < g && e < c && b < h && f < d
    }

    fn holds(&self, other: &Self) -> bool {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        a <= e && b <= f && g <= c && h <= d
    }
}

/// Where a name stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its upper left corner.
    pub at: [i32; 2],
    /// The end of a line from the point, where the name is not beside it.
    pub line: Option<[i32; 2]>,
}

/// Half of what a point takes, pixels.
const POINT: i32 = 5;
/// From a point's middle to a name beside it, pixels.
const BESIDE: i32 = 8;
/// How far from a point its name may stand, pixels.
const RADII: [i32; 8] = [20, 32, 46, 62, 80, 100, 125, 155];
/// Directions that are tried at each.
const DIRECTIONS: u32 = 16;

/// Places for names of these sizes at these points, within a frame: the first is placed first. Where there is no room, a
/// name stands to the right of its point, over others.
pub fn placed(points: &[([i32; 2], [i32; 2])], frame: Rect) -> Vec<Place> {
    let around = |[x, y]: [i32; 2]| Rect([x - POINT, y - POINT, x + POINT, y + POINT]);
    let mut taken: Vec<Rect> = points.iter().map(|(at, _)| around(*at)).collect();
    let mut places = Vec::with_capacity(points.len());
    for (at, size) in points {
        let all: Vec<Place> = candidates(*at, *size).collect();
        let rect = |place: &Place| {
            let [x, y] = place.at;
            Rect([x, y, x + size[0], y + size[1]])
        };
        let free = |place: &&Place| {
            let own = rect(place);
            frame.holds(&own) && !taken.iter().any(|other| other.overlaps(&own))
        };
        let place = all.iter().find(free).unwrap_or(&all[0]);
        taken.push(rect(place));
        places.push(*place);
    }
    places
}

fn candidates([x, y]: [i32; 2], [width, height]: [i32; 2]) -> impl Iterator<Item = Place> {
    let beside = [
        [x + BESIDE, y - height / 2],
        [x - BESIDE - width, y - height / 2],
        [x - width / 2, y - BESIDE - height],
        [x - width / 2, y + BESIDE],
    ];
    let beside = beside.into_iter().map(|at| Place { at, line: None });
    let farther = RADII.into_iter().flat_map(move |radius| {
        (0..DIRECTIONS).map(move |i| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(DIRECTIONS);
            let (sin, cos) = angle.sin_cos();
            let end = [x + (f64::from(radius) * cos) as i32, y + (f64::from(radius) * sin) as i32];
            // The line ends in the middle of the name's nearer side.
            let left = if cos >= 0.0 { end[0] } else { end[0] - width };
            Place { at: [left, end[1] - height / 2], line: Some(end) }
        })
    });
    beside.chain(farther)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 names at nearly one place, as knobs are that change little: none hides another or a point.
    #[test]
    fn names_hide_nothing() {
        let size = [90, 14];
        let points: Vec<_> =
            (0..20).map(|i| ([400 + 3 * (i % 5), 250 + 4 * (i / 5)], size)).collect();
        let frame = Rect([0, 0, 900, 500]);
        let places = placed(&points, frame);
        let rects: Vec<_> =
            places.iter().map(|p| Rect([p.at[0], p.at[1], p.at[0] + 90, p.at[1] + 14])).collect();
        for (i, rect) in rects.iter().enumerate() {
            assert!(frame.holds(rect), "{i}: {rect:?}");
            assert!(!rects[..i].iter().any(|other| other.overlaps(rect)), "{i}: {rect:?}");
            let on_point = |(at, _): &([i32; 2], _)| {
                rect.overlaps(&Rect([at[0], at[1], at[0] + 1, at[1] + 1]))
            };
            assert!(!points.iter().any(on_point), "{i}: {rect:?}");
        }
        // A point with room around it has its name beside it; at the edge on the side where there is room.
        let lone = placed(&[([100, 100], size), ([880, 100], size)], frame);
        assert_eq!(lone[0], Place { at: [108, 93], line: None });
        assert_eq!(lone[1], Place { at: [880 - 8 - 90, 93], line: None });
    }
}
