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
    /// A moment and a place where the sun is there, so that a day goes on from where a scene's sun
    /// is: midsummer at the latitude nearest to the usual one, or an equinox where the sun never
    /// comes there in midsummer.
    pub fn of(sun: Angles) -> Self {
        let usual = Self::default();
        let [east, up, south] = sun.direction().to_array();
        let north = -south;
        // The sine of the declination is up * sin(latitude) + north * cos(latitude).
        let (reach, phase) = (up.hypot(north), north.atan2(up).to_degrees());
        let at = |day: f64| {
            let sine = declination(day).sin();
            let turned = if reach > 0.0 { (sine / reach).clamp(-1.0, 1.0) } else { 0.0 };
            let first = turned.asin().to_degrees();
            let whole = |latitude: f64| (latitude - phase + 180.0).rem_euclid(360.0) - 180.0;
            let found = [whole(first), whole(180.0 - first)].into_iter();
            let nearer = |a: &f64, b: &f64| {
                (a - usual.latitude).abs().total_cmp(&(b - usual.latitude).abs())
            };
            let latitude = found.filter(|l| l.abs() <= 90.0).min_by(nearer)?;
            (sine.abs() <= reach).then_some((day, latitude))
        };
        let (day, latitude) =
            at(usual.day).or_else(|| at(EQUINOX)).unwrap_or((EQUINOX, usual.latitude));
        let (sin_lat, cos_lat) = latitude.to_radians().sin_cos();
        let angle = (-east).atan2(up * cos_lat - north * sin_lat);
        Self { hour: (12.0 + 24.0 * angle / TAU).rem_euclid(24.0), latitude, day }
    }

    /// Where the sun is; north is -Z. The orbit is taken for a circle: within 2 degrees.
    pub fn sun(self) -> Angles {
        let (sin_lat, cos_lat) = self.latitude.to_radians().sin_cos();
        let (sin_dec, cos_dec) = declination(self.day).sin_cos();
        let (sin_hour, cos_hour) = (TAU * (self.hour - 12.0) / 24.0).sin_cos();
        let up = sin_lat * sin_dec + cos_lat * cos_dec * cos_hour;
        let north = cos_lat * sin_dec - sin_lat * cos_dec * cos_hour;
        let east = -cos_dec * sin_hour;
        Angles::of(glam::DVec3::new(east, up, -north))
    }
}

/// How far the sun is north of the equator, rad.
fn declination(day: f64) -> f64 {
    (OBLIQUITY.to_radians().sin() * (TAU * (day - EQUINOX) / YEAR).sin()).asin()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_day_is_found_for_every_sun() {
        for elevation in [-90.0, -40.0, -5.0, 0.0, 4.0, 30.0, 52.0, 89.0, 90.0] {
            for azimuth in [0.0, 14.5, 79.7, 90.0, 135.0, 180.0, 270.0, 359.0] {
                let sun = Angles { azimuth, elevation };
                let day = Day::of(sun);
                assert!(day.latitude.abs() <= 90.0 && (0.0..=24.0).contains(&day.hour), "{day:?}");
                let off = day.sun().direction().distance(sun.direction());
                // Where a solution is a double one, rounding counts by its root: 1e-16 is 1e-8.
                assert!(off < 1e-7, "{sun:?} {day:?} {:?}", day.sun());
            }
        }
        // What the usual place has is found there.
        let morning = Day { hour: 8.0, ..Day::default() };
        let found = Day::of(morning.sun());
        assert!(
            (found.hour - 8.0).abs() < 1e-9 && (found.latitude - 48.0).abs() < 1e-9,
            "{found:?}"
        );
    }

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
