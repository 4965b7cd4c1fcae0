//! Coordinates of the scattering table.
//!
//! A ray through the sphere and the sun's direction are four numbers once the sphere's symmetry is
//! used: the angle of incidence at the entry, the angle between view and sun,
//! the azimuth of the entry point about the view direction, and the optical radius. The light's
//! forward lobe sits at view-sun angle 0 for every ray, so the nodes can crowd there; with the
//! entry's zenith and a local view direction as axes the lobe wanders through the grid and no
//! grading follows it.

use glam::DVec3;

use crate::medium::Phase;

/// Share of the view-sun nodes that is spaced by the logarithm of the angle, for the lobe; the
/// rest is spread evenly over all angles.
const LOBE_SHARE: f64 = 0.5;
/// Bounds of the angle where logarithmic spacing begins, as half-angle sines: the narrowest lobe
/// of any accepted phase function is wider than the first, and above the second there is no lobe.
const LOBE_SCALE: [f64; 2] = [5e-4, 1.0];
/// Share of the incidence nodes that is spread by the rays' length, the rest by their distance
/// from the centre, and the cosine below which rays count as grazing. Evenly spread nodes leave
/// twice the error at optical radius 20, all of it in rays with cosines below 0.4. Furnace of the
/// chord that is furthest off, Mie 20 um, optical radius 10 / 48, 28 nodes: 0.59 / 0.73 % with a scale
/// of 0.2, 0.56 / 0.42 % with 0.15, 0.60 / 0.31 % with 0.1, 0.71 / 0.37 % with 0.07; where it was 0.5,
/// 0.77 % in place of 0.21 % with 0.2 (HG 0.85, optical radius 30).
const GRAZING_SHARE: f64 = 0.6;
const GRAZING_SCALE: f64 = 0.13;
/// Below this product of sines the azimuth has no effect and its value is arbitrary.
const DEGENERATE: f64 = 1e-5;

/// The table's coordinates of a ray, each in 0..1 from the first node to the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinates {
    /// Angle of incidence at the entry: 0 along the surface, 1 towards the centre.
    pub incidence: f64,
    /// Azimuth of the entry about the view direction: 0 where the entry lies towards the sun.
    pub azimuth: f64,
    /// Angle between view and sun: 0 where the eye looks into the sun.
    pub view_sun: f64,
    /// Optical radius between the ends of the table.
    pub optical_radius: f64,
}

/// A ray and the sun in physical terms. Half the chord is the cosine of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Cosine of incidence, 0..1.
    pub incidence: f64,
    /// Azimuth of the entry about the view direction, rad, 0..pi.
    pub azimuth: f64,
    /// Angle between view direction and sun, rad, 0..pi.
    pub view_sun: f64,
}

/// Grading of the view-sun axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSunMap {
    /// Sine of half the angle at which logarithmic spacing begins.
    pub lobe_scale: f64,
}

impl ViewSunMap {
    /// The grading for a phase function: begins at its narrowest lobe.
    pub fn for_phase(phase: &Phase) -> Self {
        // 1 + g^2 - 2 g cos = (1 - g)^2 + 4 g sin^2(angle / 2).
        let width = phase.peak_angle();
        let scale = 0.5 * width / (1.0 - width).max(DEGENERATE).sqrt();
        Self { lobe_scale: scale.clamp(LOBE_SCALE[0], LOBE_SCALE[1]) }
    }

    /// Factor of the logarithmic part.
    pub fn lobe_factor(&self) -> f64 {
        LOBE_SHARE / (1.0 / self.lobe_scale).asinh()
    }

    /// Factor of the even part.
    pub fn even_factor(&self) -> f64 {
        0.5 * (1.0 - LOBE_SHARE)
    }

    /// Coordinate in 0..1 from the sine of half the angle, 0..1.
    pub fn coordinate(&self, half_sine: f64) -> f64 {
        let half_cosine = (1.0 - half_sine * half_sine).max(0.0).sqrt();
        self.lobe_factor() * (half_sine / self.lobe_scale).asinh()
            + self.even_factor() * (1.0 + half_sine - half_cosine)
    }

    /// Angle in rad, 0..pi, from the coordinate in 0..1: inverse of [`Self::coordinate`].
    pub fn angle(&self, coordinate: f64) -> f64 {
        let (mut low, mut high) = (0.0, std::f64::consts::FRAC_PI_2);
        // The coordinate rises with the angle; 60 halvings exhaust f64.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.coordinate(f64::sin(middle)) < coordinate {
                low = middle
            } else {
                high = middle
            }
        }
        low + high
    }
}

/// Coordinate in 0..1 of the cosine of incidence, 0..1. Central rays differ by their distance from
/// the centre, which is the sine; grazing rays by their length, which is the cosine, and the more
/// the shorter they are.
pub fn incidence_coordinate(cosine: f64) -> f64 {
    let length = cosine * (1.0 + GRAZING_SCALE) / (cosine + GRAZING_SCALE);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    GRAZING_SHARE * length + (1.0 - GRAZING_SHARE) * (1.0 - sine)
}

/// Cosine of incidence: inverse of [`incidence_coordinate`].
pub fn incidence_cosine(coordinate: f64) -> f64 {
    let (mut low, mut high) = (0.0, std::f64::consts::FRAC_PI_2);
    // The coordinate rises with the angle from the surface; 60 halvings exhaust f64.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if incidence_coordinate(f64::sin(middle)) < coordinate {
            low = middle
        } else {
            high = middle
        }
    }
    (0.5 * (low + high)).sin()
}

/// The axis of optical radii: even steps in the logarithm of the radius plus 1. Thin spheres change
/// linearly with their radius, thick ones with its logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadiusMap {
    /// Least and greatest optical radius.
    pub range: [f64; 2],
}

impl RadiusMap {
    /// Coordinate in 0..1; beyond the range that of its end.
    pub fn coordinate(&self, optical_radius: f64) -> f64 {
        let [low, high] = self.range;
        ((optical_radius.clamp(low, high) + 1.0) / (low + 1.0)).ln()
            / ((high + 1.0) / (low + 1.0)).ln()
    }

    /// Optical radius: inverse of [`Self::coordinate`].
    pub fn optical_radius(&self, coordinate: f64) -> f64 {
        let [low, high] = self.range;
        ((low + 1.0) * ((high + 1.0) / (low + 1.0)).powf(coordinate) - 1.0).clamp(low, high)
    }
}

/// Coordinate in 0..1 of an azimuth given by its cosine: within 20 % of even spacing, without an
/// inverse cosine.
pub fn azimuth_coordinate(cosine: f64) -> f64 {
    let half_sine = (0.5 * (1.0 - cosine)).max(0.0).sqrt();
    let half_cosine = (0.5 * (1.0 + cosine)).max(0.0).sqrt();
    0.5 * (1.0 + half_sine - half_cosine)
}

/// Azimuth in rad, 0..pi: inverse of [`azimuth_coordinate`].
pub fn azimuth_angle(coordinate: f64) -> f64 {
    // sin(a/2) - cos(a/2) = sqrt(2) sin(a/2 - pi/4).
    let turned = ((2.0 * coordinate - 1.0) * std::f64::consts::FRAC_1_SQRT_2).asin();
    (2.0 * turned + std::f64::consts::FRAC_PI_2).clamp(0.0, std::f64::consts::PI)
}

impl Geometry {
    /// Of a ray that enters the unit sphere at `entry` and travels along `dir`, with the sun
    /// towards `sun` (unit vectors).
    pub fn of(entry: DVec3, dir: DVec3, sun: DVec3) -> Self {
        let incidence = (-entry.dot(dir)).clamp(0.0, 1.0);
        let cosine = dir.dot(sun).clamp(-1.0, 1.0);
        let product = ((1.0 - incidence * incidence) * (1.0 - cosine * cosine)).max(0.0).sqrt();
        let along = entry.dot(sun) + incidence * cosine;
        let azimuth_cosine = (along / product.max(DEGENERATE)).clamp(-1.0, 1.0);
        // |dir - sun| = 2 sin(half the angle) keeps its digits where the angle is small.
        let half_sine = (0.5 * (dir - sun).length()).min(1.0);
        Self { incidence, azimuth: azimuth_cosine.acos(), view_sun: 2.0 * half_sine.asin() }
    }

    /// Height of the entry point over the plane through the centre that faces the sun.
    pub fn elevation(&self) -> f64 {
        let across = (1.0 - self.incidence * self.incidence).max(0.0).sqrt();
        across * self.view_sun.sin() * self.azimuth.cos() - self.incidence * self.view_sun.cos()
    }

    /// One ray with this geometry: entry, direction and sun; the sun is on the z axis.
    pub fn ray(&self) -> (DVec3, DVec3, DVec3) {
        let (sin_v, cos_v) = self.view_sun.sin_cos();
        let (sin_a, cos_a) = self.azimuth.sin_cos();
        let dir = DVec3::new(sin_v, 0.0, cos_v);
        let towards_sun = DVec3::new(-cos_v, 0.0, sin_v);
        let across = (1.0 - self.incidence * self.incidence).max(0.0).sqrt();
        let entry = -self.incidence * dir + across * (cos_a * towards_sun + sin_a * DVec3::Y);
        (entry, dir, DVec3::Z)
    }
}

/// Evenly spaced node of an axis with `count` nodes as a coordinate in 0..1.
pub fn node(index: usize, count: usize) -> f64 {
    if count > 1 { index as f64 / (count - 1) as f64 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn maps() -> Vec<ViewSunMap> {
        ["hg:0", "hg:0.85", "hg:-0.5", "mie:5um", "mie:50um", "hg:0.999"]
            .iter()
            .map(|t| ViewSunMap::for_phase(&t.parse().expect(t)))
            .collect()
    }

    proptest! {
        #[test]
        fn view_sun_map_and_inverse_agree(which in 0usize..6, u in 0.0f64..=1.0) {
            let map = maps()[which];
            let half = 0.5 * map.angle(u);
            let back = map.coordinate(half.sin());
            // The sine is flat at the back: one ulp of it is that over the cosine of half the angle, and
            // at the very back the root of an ulp.
            let sine = 4.0 * f64::EPSILON / half.cos().max(f64::EPSILON.sqrt());
            prop_assert!((back - u).abs() < 1e-12 + sine, "{u} {back}");
        }

        #[test]
        fn incidence_map_and_inverse_agree(v in 0.0f64..=1.0) {
            let back = incidence_coordinate(incidence_cosine(v));
            // The cosine is flat towards the centre: half the digits are lost there.
            prop_assert!((back - v).abs() < 1e-8, "{v} {back}");
        }

        #[test]
        fn radius_map_and_inverse_agree(v in 0.0f64..=1.0, low in 1e-3f64..1.0) {
            let map = RadiusMap { range: [low, 100.0] };
            prop_assert!((map.coordinate(map.optical_radius(v)) - v).abs() < 1e-12);
        }

        #[test]
        fn azimuth_map_and_inverse_agree(v in 0.0f64..=1.0) {
            let back = azimuth_coordinate(azimuth_angle(v).cos());
            // The cosine is flat at both ends: half the digits are lost there.
            prop_assert!((back - v).abs() < 1e-8, "{v} {back}");
        }

        #[test]
        fn geometry_and_ray_agree(
            m in 0.0f64..0.999, azimuth in 0.01f64..3.13, view_sun in 0.001f64..3.1,
        ) {
            let geometry = Geometry { incidence: m, azimuth, view_sun };
            let (entry, dir, sun) = geometry.ray();
            prop_assert!((entry.length() - 1.0).abs() < 1e-12 && (dir.length() - 1.0).abs() < 1e-12);
            let back = Geometry::of(entry, dir, sun);
            prop_assert!((back.incidence - m).abs() < 1e-12);
            prop_assert!((back.view_sun - view_sun).abs() < 1e-9);
            prop_assert!((back.azimuth - azimuth).abs() < 1e-6);
            prop_assert!((geometry.elevation() - entry.dot(sun)).abs() < 1e-12);
        }
    }

    #[test]
    fn ends_of_the_axes_are_the_ends_of_the_angles() {
        for map in maps() {
            assert!(map.angle(0.0).abs() < 1e-12);
            assert!((map.angle(1.0) - std::f64::consts::PI).abs() < 1e-7);
        }
        assert!(incidence_cosine(0.0).abs() < 1e-12);
        assert!((incidence_cosine(1.0) - 1.0).abs() < 1e-12);
        assert!(azimuth_angle(0.0).abs() < 1e-12);
        assert!((azimuth_angle(1.0) - std::f64::consts::PI).abs() < 1e-12);
    }
}
