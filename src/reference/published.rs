//! The path tracer against published numbers, by z-test: the rows of the DISORT distribution's
//! test problems 1 and 3 (which go back to van de Hulst), the critical spheres of Sood, Forster
//! and Parsons (LA-13511), the escape probability from an absorbing sphere.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DQuat, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::fluxes::slab_fluxes;
use super::geometry::{Medium, Ray, first_collision, transmittance};
use super::grid::ParticleGrid;
use super::particles::WorldParticle;
use super::random::Random;
use super::slab::Slab;
use super::statistics::{Estimate, Moments};
use super::transport::{Matter, look, turned};
use super::uniform_sky::{SunDisc, UniformSky};
use crate::Result;
use crate::medium::{Phase, Shape, ShapeSpec};

/// Largest difference that passes, in standard errors: with the 40 values compared here a right
/// program fails one of them at some seed in 1 of 400 (two-sided normal).
pub const MOST_Z: f64 = 4.0;

/// One published number beside what was computed.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// What is compared.
    pub name: String,
    /// The published value.
    pub expected: f64,
    /// What the path tracer says.
    pub got: Estimate,
    /// Difference in standard errors, those of published digits included.
    pub z: f64,
    /// Whether it passes.
    pub pass: bool,
}

impl Check {
    /// `digits`: half a unit of the last published digit.
    fn new(name: String, got: Estimate, expected: f64, digits: f64) -> Self {
        let z = (got.value - expected) / got.standard_error.hypot(digits).max(1e-300);
        Self { name, expected, got, z, pass: z.abs() <= MOST_Z }
    }
}

struct SlabRow {
    name: &'static str,
    phase: Phase,
    optical_depth: f64,
    mu0: f64,
    /// Irradiance of the beam across it, of pi over the cosine or of pi.
    beam: f64,
    down: f64,
    up: f64,
    direct: f64,
    /// Cosine (upwards at the top, downwards at the base) and radiance.
    radiances: &'static [(f64, f64)],
}

const ISOTROPIC: Phase = Phase::Hg { g: 0.0 };
const FORWARD: Phase = Phase::Hg { g: 0.75 };

const SLABS: [SlabRow; 4] = [
    SlabRow {
        name: "1b",
        phase: ISOTROPIC,
        optical_depth: 0.03125,
        mu0: 0.1,
        beam: PI / 0.1,
        down: 0.420233,
        up: 0.422922,
        direct: 2.29844,
        radiances: &[],
    },
    SlabRow {
        name: "1e",
        phase: ISOTROPIC,
        optical_depth: 32.0,
        mu0: 0.1,
        beam: PI / 0.1,
        down: 0.0676954,
        up: 3.07390,
        direct: 0.0,
        radiances: &[],
    },
    SlabRow {
        name: "3a",
        phase: FORWARD,
        optical_depth: 1.0,
        mu0: 1.0,
        beam: PI,
        down: 1.73849,
        up: 0.247374,
        direct: 1.15573,
        radiances: &[
            (0.1, 0.151159),
            (0.5, 0.101103),
            (1.0, 0.0395460),
            (-1.0, 3.05855),
            (-0.5, 0.266648),
            (-0.1, 0.213750),
        ],
    },
    SlabRow {
        name: "3b",
        phase: FORWARD,
        optical_depth: 8.0,
        mu0: 1.0,
        beam: PI,
        down: 1.54958,
        up: 1.59096,
        direct: 0.00105389,
        radiances: &[
            (0.1, 0.379740),
            (0.5, 0.519598),
            (1.0, 0.493302),
            (-1.0, 0.669581),
            (-0.5, 0.422350),
            (-0.1, 0.236362),
        ],
    },
];

/// Half a unit of the sixth digit.
fn six_digits(value: f64) -> f64 {
    0.5 * 10f64.powf(value.abs().max(1e-9).log10().floor() - 5.0)
}

/// Runs all comparisons with about `samples` paths each.
pub fn verify(samples: u64, seed: u64) -> Result<Vec<Check>> {
    let mut checks = Vec::new();
    for row in &SLABS {
        slab_checks(row, samples, seed, &mut checks);
    }
    for t in [0.5, 1.0, 2.0, 5.0, 14.0] {
        checks.push(escape_check(t, samples, seed));
    }
    critical_checks(
        1.9853434324,
        1.40,
        [0.93538006, 0.75575352, 0.49884364],
        samples,
        seed,
        &mut checks,
    );
    critical_checks(
        2.4248249802,
        1.30,
        [0.93244907, 0.74553332, 0.48095413],
        samples,
        seed,
        &mut checks,
    );
    Ok(checks)
}

fn slab_checks(row: &SlabRow, samples: u64, seed: u64, checks: &mut Vec<Check>) {
    let matter = Matter { phase: row.phase.prepare(), albedo: 1.0 };
    let slab = Slab::new(row.optical_depth, 1.0);
    let fluxes = slab_fluxes(&slab, &matter, row.mu0, samples, seed);
    let incoming = row.beam * row.mu0;
    for (what, got, expected) in [
        ("flux down at the base", fluxes.diffuse, row.down),
        ("flux up at the top", fluxes.reflected, row.up),
        ("direct flux at the base", fluxes.direct, row.direct),
    ] {
        let got = Estimate {
            value: got.value * incoming,
            // No photon of so many came through: fewer than three in a million million would have.
            standard_error: got
                .standard_error
                .max(1.0 / samples as f64 * f64::from(got.value == 0.0))
                * incoming,
        };
        let name = format!("slab {}: {what}", row.name);
        checks.push(Check::new(name, got, expected, six_digits(expected)));
    }
    let sine = (1.0 - row.mu0 * row.mu0).max(0.0).sqrt();
    let sun = SunDisc::new(DVec3::new(-sine, row.mu0, 0.0), DVec3::splat(row.beam), 0.0);
    let sky = UniformSky { radiance: DVec3::ZERO, sun: Some(sun), ground: None, sea: None };
    for &(mu, expected) in row.radiances {
        // The ray of the eye runs against the light.
        let dir = DVec3::new((1.0 - mu * mu).sqrt(), -mu, 0.0);
        let origin = DVec3::new(0.0, if mu > 0.0 { slab.top() } else { 0.0 }, 0.0);
        let ray = Ray { origin, dir };
        let got = mean(samples, seed, |random| look_scattered(&slab, &sky, &matter, ray, random));
        let side = if mu > 0.0 { "up at the top" } else { "down at the base" };
        let name = format!("slab {}: radiance {side}, mu {}", row.name, mu.abs());
        checks.push(Check::new(name, got, expected, six_digits(expected)));
    }
}

/// Radiance without the beam itself.
fn look_scattered(
    medium: &impl Medium,
    sky: &UniformSky,
    matter: &Matter,
    ray: Ray,
    random: &mut Random,
) -> f64 {
    let seen = look(medium, sky, matter, ray, random);
    if seen.transmittance > 0.0 { 0.0 } else { seen.radiance.x }
}

/// A ball of radius 1 and this extinction around the origin.
fn ball(extinction: f64) -> ParticleGrid {
    ParticleGrid::new(vec![WorldParticle {
        centre: DVec3::ZERO,
        radius: 1.0,
        extinction,
        to_own: DQuat::IDENTITY,
        shape: Arc::new(Shape::new(ShapeSpec::UNIFORM)),
    }])
}

fn isotropic(random: &mut Random) -> DVec3 {
    turned(DVec3::Y, 2.0 * random.unit() - 1.0, TAU * random.unit())
}

fn escape_check(t: f64, samples: u64, seed: u64) -> Check {
    let medium = ball(t);
    let got = mean(samples, seed, |random| {
        let origin = isotropic(random) * random.unit().cbrt();
        transmittance(&medium, &Ray { origin, dir: isotropic(random) }, f64::INFINITY, random)
    });
    let e = (-2.0 * t).exp();
    let squared = 1.0 / (2.0 * t * t);
    let expected = 3.0 / (4.0 * t) * (1.0 - squared + (1.0 / t + squared) * e);
    Check::new(format!("escape probability, optical radius {t}"), got, expected, 1e-9)
}

/// Collisions of a chain before its places follow the fundamental mode. The next mode decays to
/// about 2/3 of it with each: 12 collisions leave a bias of 0.3 %, 20 of 1e-4.
const GENERATIONS: u32 = 20;
/// Chains for each path of the other rows: few survive so many collisions.
const CHAINS: u64 = 16;

/// In an isotropically scattering ball a chain of collisions from a place survives n of them with
/// a probability that tends to the fundamental mode at that place times (1/c)^n.
fn critical_checks(
    radius: f64,
    c: f64,
    profile: [f64; 3],
    samples: u64,
    seed: u64,
    checks: &mut Vec<Check>,
) {
    let medium = ball(radius);
    let chains = samples * CHAINS;
    let [centre, quarter, half, three_quarters] = [0.0, 0.25, 0.5, 0.75].map(|r| {
        let origin = DVec3::new(r, 0.0, 0.0);
        survivors(&medium, origin, chains, seed)
    });
    let ratio = share(centre[1], centre[0]);
    checks.push(Check::new(
        format!("critical sphere {radius:.4}: ratio of orders"),
        ratio,
        1.0 / c,
        5e-7,
    ));
    for ((r, survived), expected) in
        [(0.25, quarter), (0.5, half), (0.75, three_quarters)].into_iter().zip(profile)
    {
        let name = format!("critical sphere {radius:.4}: mean intensity at {r}");
        checks.push(Check::new(name, quotient(survived[0], centre[0]), expected, 5e-9));
    }
}

/// Chains that reach the second to last and the last generation.
fn survivors(medium: &ParticleGrid, start: DVec3, chains: u64, seed: u64) -> [u64; 2] {
    batches(chains)
        .map(|(batch, count)| {
            let mut random = Random::new(seed, start.x.to_bits(), batch);
            let mut reached = [0u64; 2];
            for _ in 0..count {
                let mut origin = start;
                for generation in 1..=GENERATIONS {
                    let ray = Ray { origin, dir: isotropic(&mut random) };
                    let Some(t) = first_collision(medium, &ray, f64::INFINITY, &mut random) else {
                        break;
                    };
                    origin = ray.at(t);
                    if generation + 1 == GENERATIONS {
                        reached[0] += 1;
                    } else if generation == GENERATIONS {
                        reached[1] += 1;
                    }
                }
            }
            reached
        })
        .reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
}

/// A binomial share.
fn share(part: u64, whole: u64) -> Estimate {
    Estimate::of_share(part, whole)
}

/// Quotient of two independent counts.
fn quotient(a: u64, b: u64) -> Estimate {
    let (x, y) = (a.max(1) as f64, b.max(1) as f64);
    let value = x / y;
    Estimate { value, standard_error: value * (1.0 / x + 1.0 / y).sqrt() }
}

/// Paths of one stream of random numbers.
const BATCH: u64 = 1 << 12;

fn batches(samples: u64) -> impl ParallelIterator<Item = (u64, u64)> {
    (0..samples.div_ceil(BATCH).max(1))
        .into_par_iter()
        .map(move |batch| (batch, BATCH.min(samples - batch * BATCH)))
}

/// Mean of independent samples; the same for any number of threads.
fn mean(samples: u64, seed: u64, sample: impl Fn(&mut Random) -> f64 + Sync) -> Estimate {
    let parts: Vec<Moments> = batches(samples)
        .map(|(batch, count)| {
            let mut random = Random::new(seed, 1, batch);
            let mut moments = Moments::default();
            for _ in 0..count {
                moments.add(sample(&mut random));
            }
            moments
        })
        .collect();
    parts.into_iter().fold(Moments::default(), Moments::merged).estimate()
}
