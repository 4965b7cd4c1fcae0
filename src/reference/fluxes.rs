//! Fluxes through a slab, photon by photon.

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::geometry::{Ray, first_collision};
use super::random::Random;
use super::slab::Slab;
use super::statistics::Estimate;
use super::transport::{Matter, scatter};

/// Where the light that falls on a slab goes: fractions of the incoming flux.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SlabFluxes {
    /// Out of the lit face.
    pub reflected: Estimate,
    /// Out of the far face after at least one scattering.
    pub diffuse: Estimate,
    /// Out of the far face without any.
    pub direct: Estimate,
}

/// Most scatterings of a photon that falls on a deep slab without absorption, in the mean and per optical
/// depth: the mean radiance times 4 pi falls evenly from sqrt(3) H(1) = 5.04 times the incoming flux of a
/// sun in the zenith (Chandrasekhar, Radiative Transfer, chapter 3) to nothing at the far face.
const SCATTERINGS_PER_DEPTH: f64 = 2.52;

/// About how often a photon scatters in a slab, at most.
pub fn scatterings(optical_depth: f64, albedo: f64) -> f64 {
    (1.0 + SCATTERINGS_PER_DEPTH * optical_depth).min(1.0 / (1.0 - albedo))
}

/// Photons of one stream of random numbers.
const BATCH: u64 = 1 << 12;

/// How a photon ended.
#[derive(Clone, Copy, PartialEq)]
enum End {
    Reflected,
    Diffuse,
    Direct,
    Absorbed,
}

/// Sends photons into a slab whose face they meet at the cosine `mu0` from its normal.
pub fn slab_fluxes(slab: &Slab, matter: &Matter, mu0: f64, photons: u64, seed: u64) -> SlabFluxes {
    let batches = photons.div_ceil(BATCH).max(1);
    let counts = (0..batches)
        .into_par_iter()
        .map(|batch| {
            let mut random = Random::new(seed, 0, batch);
            let mut counts = [0u64; 3];
            for _ in 0..BATCH.min(photons - batch * BATCH) {
                match photon(slab, matter, mu0, &mut random).0 {
                    End::Reflected => counts[0] += 1,
                    End::Diffuse => counts[1] += 1,
                    End::Direct => counts[2] += 1,
                    End::Absorbed => {}
                }
            }
            counts
        })
        .reduce(|| [0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
    let [reflected, diffuse, direct] = counts.map(|n| Estimate::of_share(n, photons));
    SlabFluxes { reflected, diffuse, direct }
}

/// How a photon ended, and how often it was scattered before.
fn photon(slab: &Slab, matter: &Matter, mu0: f64, random: &mut Random) -> (End, u64) {
    let sine = (1.0 - mu0 * mu0).max(0.0).sqrt();
    let mut ray =
        Ray { origin: DVec3::new(0.0, slab.top(), 0.0), dir: DVec3::new(sine, -mu0, 0.0) };
    let mut scattered = 0;
    while let Some(t) = first_collision(slab, &ray, f64::INFINITY, random) {
        if random.unit() >= matter.albedo {
            return (End::Absorbed, scattered);
        }
        scattered += 1;
        // Only the altitude matters: staying near the axis keeps its digits.
        let origin = DVec3::new(0.0, ray.at(t).y, 0.0);
        ray = Ray { origin, dir: scatter(&matter.phase, ray.dir, random) };
    }
    let end = match (ray.dir.y > 0.0, scattered > 0) {
        (true, _) => End::Reflected,
        (false, true) => End::Diffuse,
        (false, false) => End::Direct,
    };
    (end, scattered)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::medium::Phase;

    /// What a photon may cost, counted: the mean of photons that all come from the zenith, and fewer where
    /// they come askew.
    #[test]
    fn photons_scatter_as_often_as_stated() {
        const PHOTONS: u32 = 20_000;
        const DEPTH: f64 = 60.0;
        let slab = Slab::new(DEPTH, 1.0);
        let mean = |g: f64, mu0: f64| {
            let matter = Matter { phase: Phase::Hg { g }.prepare(), albedo: 1.0 };
            let mut random = Random::new(5, 0, 0);
            let all: u64 = (0..PHOTONS).map(|_| photon(&slab, &matter, mu0, &mut random).1).sum();
            all as f64 / f64::from(PHOTONS) / scatterings(DEPTH, 1.0)
        };
        // The numbers of photons spread by about their mean: 1 %. At the far face the light falls to
        // nothing only 0.7 / (1 - g) beyond it, which is 1 to 5 % more here.
        assert!((mean(0.0, 1.0) - 1.01).abs() < 0.05, "{}", mean(0.0, 1.0));
        assert!((mean(0.75, 1.0) - 1.03).abs() < 0.06, "{}", mean(0.75, 1.0));
        assert!(mean(0.0, 0.2) < 0.6, "{}", mean(0.0, 0.2));
        // With absorption every collision ends the 10th photon.
        assert_eq!(scatterings(DEPTH, 0.9).round(), 10.0);
    }
}
