//! Mappings that were measured and not taken; `precompute compare` measures them again.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3};

use super::mapping::{ChordMapping, Place, octahedral_density};

/// Yusov's original: zenith and azimuth of the entry, zenith and azimuth of the direction in the
/// frame of the entry, all linear. Lines are held twice, the frame turns over at the poles, and
/// grazing rays get few nodes.
#[derive(Clone, Copy, Debug, Default)]
pub struct LinearAngles;

/// Entry and exit, each on an octahedral square. No frame is needed; lines are held twice.
#[derive(Clone, Copy, Debug, Default)]
pub struct TwoPoints;

/// The axes of the local frame at a point of the sphere: along growing zenith, along growing
/// azimuth, and inwards.
fn frame(zenith: f64, azimuth: f64) -> [DVec3; 3] {
    let ((st, ct), (sp, cp)) = (zenith.sin_cos(), azimuth.sin_cos());
    [DVec3::new(ct * cp, ct * sp, -st), DVec3::new(-sp, cp, 0.0), -DVec3::new(st * cp, st * sp, ct)]
}

impl ChordMapping for LinearAngles {
    fn name(&self) -> &'static str {
        "linear angles"
    }

    fn place(&self, entry: DVec3, exit: DVec3) -> Place {
        let zenith = entry.z.clamp(-1.0, 1.0).acos();
        let azimuth = entry.y.atan2(entry.x).rem_euclid(TAU);
        let [along, across, inwards] = frame(zenith, azimuth);
        let d = (exit - entry).normalize_or(inwards);
        let local_zenith = d.dot(inwards).clamp(0.0, 1.0).acos();
        let local_azimuth = d.dot(across).atan2(d.dot(along)).rem_euclid(TAU);
        let at = [local_zenith / FRAC_PI_2, local_azimuth / TAU, zenith / PI, azimuth / TAU];
        Place { at: at.map(|c| c.clamp(0.0, 1.0)), reversed: false }
    }

    fn chord(&self, at: [f64; 4]) -> Option<[DVec3; 2]> {
        let [along, across, inwards] = frame(at[2] * PI, at[3] * TAU);
        let (s, c) = (at[0] * FRAC_PI_2).sin_cos();
        let (sa, ca) = (at[1] * TAU).sin_cos();
        let d = inwards * c + (along * ca + across * sa) * s;
        let entry = -inwards;
        // The far end of the chord: twice the cosine along the direction.
        Some([entry, (entry + d * (2.0 * c)).normalize()])
    }

    fn density(&self, at: [f64; 4]) -> f64 {
        // Solid angle of the entry, projected solid angle of the direction.
        let local = at[0] * FRAC_PI_2;
        (at[2] * PI).sin() * local.sin() * local.cos()
    }
}

/// Octahedral map of the sphere to the square -1..1.
fn to_square(d: DVec3) -> DVec2 {
    let p = d.truncate() / (d.x.abs() + d.y.abs() + d.z.abs());
    if d.z >= 0.0 { p } else { (DVec2::ONE - DVec2::new(p.y, p.x).abs()) * sign(p) }
}

/// Inverse of [`to_square`].
fn from_square(s: DVec2) -> DVec3 {
    let z = 1.0 - s.x.abs() - s.y.abs();
    let p = if z >= 0.0 { s } else { (DVec2::ONE - DVec2::new(s.y, s.x).abs()) * sign(s) };
    p.extend(z).normalize()
}

/// 1 for 0 too, so that the fold has no hole.
fn sign(p: DVec2) -> DVec2 {
    DVec2::new(1f64.copysign(p.x), 1f64.copysign(p.y))
}

impl ChordMapping for TwoPoints {
    fn name(&self) -> &'static str {
        "two octahedral points"
    }

    fn place(&self, entry: DVec3, exit: DVec3) -> Place {
        let (a, b) = (to_square(entry), to_square(exit));
        let at = [a.x, a.y, b.x, b.y].map(|c| (0.5 + 0.5 * c).clamp(0.0, 1.0));
        Place { at, reversed: false }
    }

    fn chord(&self, at: [f64; 4]) -> Option<[DVec3; 2]> {
        let [a, b, c, d] = at.map(|c| 2.0 * c - 1.0);
        Some([from_square(DVec2::new(a, b)), from_square(DVec2::new(c, d))])
    }

    fn density(&self, at: [f64; 4]) -> f64 {
        // Two independent points of the sphere make isotropic lines.
        let [a, b, c, d] = at.map(|c| 2.0 * c - 1.0);
        octahedral_density(from_square(DVec2::new(a, b)))
            * octahedral_density(from_square(DVec2::new(c, d)))
    }
}
