//! Random rays and chords, the same for the same seed.

use std::f64::consts::{PI, TAU};

use cumuli::medium::Phase;
use cumuli::reference::Random;
use cumuli::tables::sample::SampleRay;
use glam::DVec3;

/// Largest impact parameter of rays whose radiance is compared: the range. Further out the
/// chord, and with it the radiance, goes to 0.
const MOST_IMPACT: f64 = 0.95;

/// A point of the unit sphere.
pub fn on_sphere(random: &mut Random) -> DVec3 {
    let z = 2.0 * random.unit() - 1.0;
    let (sin, cos) = (TAU * random.unit()).sin_cos();
    let across = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(across * cos, across * sin, z)
}

/// A ray through the unit sphere by the cosine of its incidence, the angle from its direction to
/// the sun, and the azimuth of its entry about its direction, 0 towards the sun. The sun is at +z.
pub fn ray(incidence: f64, view_sun: f64, azimuth: f64) -> SampleRay {
    let (sin, cos) = view_sun.sin_cos();
    let dir = DVec3::new(sin, 0.0, cos);
    let towards_sun = DVec3::new(-cos, 0.0, sin);
    let across = (1.0 - incidence * incidence).max(0.0).sqrt();
    let (sin, cos) = azimuth.sin_cos();
    let entry = -incidence * dir + across * (cos * towards_sun + sin * DVec3::Y);
    SampleRay { entry, dir, sun: DVec3::Z, optical_radius: 1.0, part: [0.0, 1.0] }
}

/// A ray whose radiance is compared: evenly over the disc up to [`MOST_IMPACT`]; every second one
/// looks evenly into all directions, the others crowd around the sun, where the phase function
/// does.
pub fn lit_ray(phase: &Phase, optical_radius: f64, number: u64, random: &mut Random) -> SampleRay {
    let impact = MOST_IMPACT * random.unit().sqrt();
    let even = 2.0 * (1.0 - random.unit()).sqrt().asin();
    let view_sun = if number.is_multiple_of(2) {
        even
    } else {
        // Evenly over the logarithm of the angle from the narrowest lobe to pi.
        let least = phase.peak_angle().clamp(1e-3, 1.0);
        least * (PI / least).powf(random.unit())
    };
    let azimuth = PI * random.unit();
    SampleRay { optical_radius, ..ray((1.0 - impact * impact).sqrt(), view_sun, azimuth) }
}

/// Two ends of a chord: mostly independent points of the sphere (isotropic lines); one in eight is
/// very short, through the centre, or along an axis, where mappings have their edges.
pub fn chord(number: u64, random: &mut Random) -> [DVec3; 2] {
    let (entry, exit) = (on_sphere(random), on_sphere(random));
    match number % 32 {
        0 => [entry, (entry + 1e-4 * exit).normalize()],
        1 => [entry, -entry],
        2 => [entry, DVec3::new(entry.x, entry.y, -entry.z)],
        3 => [entry, DVec3::new(-entry.x, entry.y, entry.z)],
        _ => [entry, exit],
    }
}
