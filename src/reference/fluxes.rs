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

/// Mean number of scatterings of a photon that falls on a slab without absorption, per optical depth:
/// the mean radiance times 4 pi falls evenly from about 5.1 times the incoming flux at the lit face to
/// nothing at the far one, whatever the phase function.
const SCATTERINGS_PER_DEPTH: f64 = 2.5;

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
                match photon(slab, matter, mu0, &mut random) {
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

fn photon(slab: &Slab, matter: &Matter, mu0: f64, random: &mut Random) -> End {
    let sine = (1.0 - mu0 * mu0).max(0.0).sqrt();
    let mut ray =
        Ray { origin: DVec3::new(0.0, slab.top(), 0.0), dir: DVec3::new(sine, -mu0, 0.0) };
    let mut scattered = false;
    while let Some(t) = first_collision(slab, &ray, f64::INFINITY, random) {
        if random.unit() >= matter.albedo {
            return End::Absorbed;
        }
        scattered = true;
        // Only the altitude matters: staying near the axis keeps its digits.
        let origin = DVec3::new(0.0, ray.at(t).y, 0.0);
        ray = Ray { origin, dir: scatter(&matter.phase, ray.dir, random) };
    }
    match (ray.dir.y > 0.0, scattered) {
        (true, _) => End::Reflected,
        (false, true) => End::Diffuse,
        (false, false) => End::Direct,
    }
}
