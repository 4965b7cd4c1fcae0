//! The sun's place by the time of day.

use std::f64::consts::TAU;

use super::angles::Angles;

/// Tilt of the Earth's axis, degrees.
const OBLIQUITY: f64 = 23.44;
/// The day of the year of the northern spring's equinox, and days of a year.
const EQUINOX: f64 = 81.0;
const YEAR: f64 = 365.0;

/// A moment at a place, in the sun's own time: it is in the south, or in the north, at 12.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Day {
    /// 0 to 24.
    pub hour: f64,
    /// Degrees, north is positive.
    pub latitude: f64,
    /// 1 to 365.
    pub day: f64,
}

impl Default for Day {
    /// Noon of midsummer in the middle of Europe.
    fn default() -> Self {
        Self { hour: 12.0, latitude: 48.0, day: 172.0 }
    }
}

impl Day {
    /// Where the sun is; north is -Z. The orbit is taken for a circle: within 2 degrees.
    pub fn sun(self) -> Angles {
        let declination =
            (OBLIQUITY.to_radians().sin() * (TAU * (self.day - EQUINOX) / YEAR).sin()).asin();
        let (sin_lat, cos_lat) = self.latitude.to_radians().sin_cos();
        let (sin_dec, cos_dec) = declination.sin_cos();
        let (sin_hour, cos_hour) = (TAU * (self.hour - 12.0) / 24.0).sin_cos();
        let up = sin_lat * sin_dec + cos_lat * cos_dec * cos_hour;
        let north = cos_lat * sin_dec - sin_lat * cos_dec * cos_hour;
        let east = -cos_dec * sin_hour;
        Angles::of(glam::DVec3::new(east, up, -north))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_goes_from_east_over_south_to_west() {
        let at = |hour: f64| Day { hour, latitude: 48.0, day: EQUINOX }.sun();
        for (hour, azimuth, elevation) in
            [(6.0, 90.0, 0.0), (12.0, 180.0, 42.0), (18.0, 270.0, 0.0)]
        {
            let sun = at(hour);
            assert!((sun.azimuth - azimuth).abs() < 1e-9, "{hour} {sun:?}");
            assert!((sun.elevation - elevation).abs() < 1e-9, "{hour} {sun:?}");
        }
        assert!((at(0.0).elevation + 42.0).abs() < 1e-9, "as deep at midnight as high at noon");
    }

    #[test]
    fn seasons_and_hemispheres() {
        let noon = |latitude: f64, day: f64| Day { hour: 12.0, latitude, day }.sun();
        // A quarter of a year after the equinox, rounded to a day: 1/4 degree at most.
        assert!((noon(48.0, 172.0).elevation - (42.0 + OBLIQUITY)).abs() < 0.25);
        assert!((noon(48.0, 355.0).elevation - (42.0 - OBLIQUITY)).abs() < 0.25);
        let south = noon(-35.0, EQUINOX);
        assert!(south.azimuth.min(360.0 - south.azimuth) < 1e-9, "in the north: {south:?}");
        assert!(noon(80.0, 355.0).elevation < 0.0, "polar night");
    }
}
