//! What light meets: a medium described by pieces of a ray with an upper bound of the extinction
//! on each, and a lower one. Delta tracking (Woodcock 1965) and residual ratio tracking (Novak,
//! Selle and Jarosz 2014) on these pieces are unbiased whatever the bounds are.

use std::ops::ControlFlow;

use glam::DVec3;

use super::random::Random;

/// A ray: points `origin + t * dir`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// m.
    pub origin: DVec3,
    /// Unit vector.
    pub dir: DVec3,
}

impl Ray {
    /// The point at a distance, m.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.dir * t
    }
}

/// A piece of a ray on which the extinction lies between two bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// m along the ray.
    pub begin: f64,
    /// m along the ray.
    pub end: f64,
    /// 1/m; the extinction is nowhere below it.
    pub minorant: f64,
    /// 1/m; above 0, and the extinction is nowhere above it.
    pub majorant: f64,
    /// Where the medium finds what the piece holds.
    pub cell: usize,
}

/// A scattering medium.
pub trait Medium: Sync {
    /// Hands the pieces of a ray from 0 to `limit` (m) that are not empty to `visit`, in order,
    /// until it breaks.
    fn pieces(&self, ray: &Ray, limit: f64, visit: &mut impl FnMut(Piece) -> ControlFlow<()>);

    /// Extinction at a point of a piece, 1/m; in 0..=majorant.
    fn extinction(&self, cell: usize, point: DVec3) -> f64;

    /// Unbiased estimate, 0 to 1, of how far the extinction at a point of a piece is from its lower bound
    /// on the way to the upper one.
    fn share(&self, piece: &Piece, point: DVec3, _random: &mut Random) -> f64 {
        (self.extinction(piece.cell, point) - piece.minorant) / (piece.majorant - piece.minorant)
    }
}

/// Distance to the first collision before `limit`, by delta tracking.
pub fn first_collision(
    medium: &impl Medium,
    ray: &Ray,
    limit: f64,
    random: &mut Random,
) -> Option<f64> {
    let mut found = None;
    medium.pieces(ray, limit, &mut |piece| {
        let mut t = piece.begin;
        loop {
            t += random.exponential() / piece.majorant;
            if t >= piece.end {
                return ControlFlow::Continue(());
            }
            // What is left of an even number below its part is even again.
            let level = random.unit() * piece.majorant - piece.minorant;
            let residual = piece.majorant - piece.minorant;
            if level < 0.0 || level < residual * medium.share(&piece, ray.at(t), random) {
                found = Some(t);
                return ControlFlow::Break(());
            }
        }
    });
    found
}

/// Below this transmittance an estimate plays Russian roulette: most of what follows would cost as
/// much as bright light and add next to nothing.
const ROULETTE_BELOW: f64 = 0.1;
/// Its chance to go on.
const ROULETTE_SURVIVAL: f64 = 0.25;

/// Roulette of an estimate that has become small; false when it has ended.
fn goes_on(estimate: &mut f64, random: &mut Random) -> bool {
    if *estimate < ROULETTE_BELOW {
        if random.unit() >= ROULETTE_SURVIVAL {
            *estimate = 0.0;
        }
        *estimate /= ROULETTE_SURVIVAL;
    }
    *estimate > 0.0
}

/// Unbiased estimate of the transmittance up to `limit`, by residual ratio tracking with roulette.
pub fn transmittance(medium: &impl Medium, ray: &Ray, limit: f64, random: &mut Random) -> f64 {
    let mut estimate = 1.0;
    medium.pieces(ray, limit, &mut |piece| {
        let Piece { begin, end, minorant, majorant, .. } = piece;
        if minorant > 0.0 {
            estimate *= (-minorant * (end - begin)).exp();
            if !goes_on(&mut estimate, random) {
                return ControlFlow::Break(());
            }
        }
        let residual = majorant - minorant;
        let mut t = begin;
        loop {
            t += random.exponential() / residual;
            // Without a residual the step is infinite.
            if t >= end || t.is_nan() {
                return ControlFlow::Continue(());
            }
            estimate *= (1.0 - medium.share(&piece, ray.at(t), random)).max(0.0);
            if !goes_on(&mut estimate, random) {
                return ControlFlow::Break(());
            }
        }
    });
    estimate
}
