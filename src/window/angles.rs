//! Directions as two angles: what people turn, and what sliders show.

use glam::DVec3;

/// A direction by compass and height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Angles {
    /// Clockwise seen from above, degrees: 0 is -Z, 90 is +X.
    pub azimuth: f64,
    /// Above the horizon, degrees, -90 to 90.
    pub elevation: f64,
}

impl Angles {
    /// The angles of a direction of any length. Straight up or down has no azimuth; it is 0.
    pub fn of(direction: DVec3) -> Self {
        let level = direction.x.hypot(direction.z);
        Self {
            azimuth: direction.x.atan2(-direction.z).to_degrees().rem_euclid(360.0),
            elevation: direction.y.atan2(level).to_degrees(),
        }
    }

    /// The unit vector.
    pub fn direction(self) -> DVec3 {
        let (sin, cos) = self.azimuth.to_radians().sin_cos();
        let (up, level) = self.elevation.to_radians().sin_cos();
        DVec3::new(sin * level, up, -cos * level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_compass() {
        for (azimuth, elevation, direction) in [
            (0.0, 0.0, DVec3::NEG_Z),
            (90.0, 0.0, DVec3::X),
            (180.0, 0.0, DVec3::Z),
            (270.0, 0.0, DVec3::NEG_X),
            (0.0, 90.0, DVec3::Y),
            (0.0, -90.0, DVec3::NEG_Y),
        ] {
            let angles = Angles { azimuth, elevation };
            // Sines and cosines of right angles are exact to rounding.
            assert!((angles.direction() - direction).length() < 1e-15, "{angles:?}");
            assert_eq!(Angles::of(3.0 * direction).elevation, elevation);
        }
    }

    #[test]
    fn angles_come_back() {
        for azimuth in [0.0, 1.0, 89.0, 135.0, 200.0, 359.5] {
            for elevation in [-89.0, -30.0, 0.0, 4.0, 60.0, 89.0] {
                let angles = Angles { azimuth, elevation };
                let back = Angles::of(angles.direction());
                // At 89 degrees the level part is 0.017 long: rounding counts 60 times as much.
                assert!((back.azimuth - azimuth).abs() < 1e-11, "{angles:?} {back:?}");
                assert!((back.elevation - elevation).abs() < 1e-11, "{angles:?} {back:?}");
            }
        }
    }
}
