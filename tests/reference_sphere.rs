//! The path tracer against what is known of single spheres by other ways: an integral equation
//! solved on a grid, and the scattering tables.

use std::f64::consts::TAU;
use std::sync::Arc;

use cumuli::medium::{Phase, Shape, ShapeSpec};
use cumuli::reference::{
    Flight, Matter, Moments, ParticleGrid, Random, Ray, SunDisc, Surroundings, UniformSky,
    WorldParticle, look, radiance, scatter, turned,
};
use cumuli::tables::TableSet;
use glam::{DQuat, DVec3};
use rayon::prelude::*;

/// Spheres of radius 1 around the origin.
fn spheres(extinctions: &[f64]) -> ParticleGrid {
    let shape = Arc::new(Shape::new(ShapeSpec::UNIFORM));
    let sphere = |&extinction: &f64| WorldParticle {
        centre: DVec3::ZERO,
        radius: 1.0,
        extinction,
        to_own: DQuat::IDENTITY,
        shape: shape.clone(),
    };
    ParticleGrid::new(extinctions.iter().map(sphere).collect())
}

fn traced(
    medium: &ParticleGrid,
    sky: &impl Surroundings,
    matter: &Matter,
    ray: Ray,
    paths: u64,
) -> Moments {
    const BATCH: u64 = 4096;
    (0..paths / BATCH)
        .into_par_iter()
        .map(|batch| {
            let mut random = Random::new(5, 0, batch);
            let mut moments = Moments::default();
            for _ in 0..BATCH {
                moments.add(look(medium, sky, matter, ray, &mut random).radiance.x);
            }
            moments
        })
        .collect::<Vec<_>>()
        .into_iter()
        .fold(Moments::default(), Moments::merged)
}

/// Exponential integral of order 1: series below 1, continued fraction above.
fn e1(x: f64) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    if x < 1.0 {
        let (mut term, mut sum) = (1.0, -EULER - x.ln());
        for k in 1..40 {
            let k = f64::from(k);
            term *= -x / k;
            sum -= term / k;
        }
        sum
    } else {
        let tail = (1..200).rev().fold(0.0, |tail, k| {
            let k = f64::from(k);
            k / (1.0 + k / (x + tail))
        });
        (-x).exp() / (x + tail)
    }
}

fn e2(x: f64) -> f64 {
    if x <= 0.0 { 1.0 } else { (-x).exp() - x * e1(x) }
}

/// Radiance through the middle of an isotropically scattering sphere of this optical radius and
/// albedo in uniform light 1. Peierls' equation in its spherical form (Case and Zweifel 1967) for
/// r J(r), J being the mean intensity in the sphere, with r J even over small shells:
/// r J(r) = r J0(r) + albedo/2 int_0^R r' J(r') (E1(|r - r'|) - E1(r + r')) dr'.
fn furnace_sphere(radius: f64, albedo: f64) -> f64 {
    const SHELLS: usize = 400;
    let width = radius / SHELLS as f64;
    let middle = |i: usize| (i as f64 + 0.5) * width;
    // Mean over directions of what comes through unscattered.
    let unscattered = |r: f64| {
        const ANGLES: usize = 400;
        let of = |mu: f64| r.mul_add(mu, (radius * radius - r * r * (1.0 - mu * mu)).sqrt());
        (0..ANGLES).map(|k| (-of((2 * k + 1) as f64 / ANGLES as f64 - 1.0)).exp()).sum::<f64>()
            / ANGLES as f64
    };
    // The integral of E1 over a shell, by E2; the shell that holds r in two halves.
    let kernel = |r: f64, j: usize| {
        let (low, high) = (j as f64 * width, (j + 1) as f64 * width);
        let near = if r > low && r < high {
            2.0 - e2(r - low) - e2(high - r)
        } else {
            (e2((r - low).abs()) - e2((r - high).abs())).abs()
        };
        near - (e2(r + low) - e2(r + high))
    };
    let matrix: Vec<Vec<f64>> =
        (0..SHELLS).map(|i| (0..SHELLS).map(|j| kernel(middle(i), j)).collect()).collect();
    let source: Vec<f64> = (0..SHELLS).map(|i| middle(i) * unscattered(middle(i))).collect();
    let mut light = source.clone();
    // Each round adds a scattering order; the ratio of successive orders is below the albedo.
    for _ in 0..200 {
        light = (0..SHELLS)
            .map(|i| {
                let sum: f64 = matrix[i].iter().zip(&light).map(|(k, l)| k * l).sum();
                source[i] + 0.5 * albedo * sum
            })
            .collect();
    }
    // From the far side to the near one: shells outside in, then inside out.
    let gathered: f64 = (0..SHELLS)
        .map(|i| {
            let mean = albedo * light[i] / middle(i);
            let (low, high) = (i as f64 * width, (i + 1) as f64 * width);
            let near = (low - radius).exp() * ((high - low).exp() - 1.0);
            let far = (-radius - low).exp() * (1.0 - (low - high).exp());
            mean * (near + far)
        })
        .sum();
    (-2.0 * radius).exp() + gathered
}

/// In a furnace with absorption: one sphere, and the same matter in five spheres that overlap.
#[test]
fn an_absorbing_furnace_is_as_dark_as_the_integral_equation_says() {
    let sky = UniformSky { radiance: DVec3::ONE, sun: None, ground: None, sea: None };
    let ray = Ray { origin: DVec3::new(0.0, 0.0, 3.0), dir: DVec3::NEG_Z };
    assert!((furnace_sphere(1.0, 1.0) - 1.0).abs() < 1e-3, "albedo 1 is invisible");
    for (radius, albedo) in [(0.5, 0.9), (2.0, 0.9), (5.0, 0.9), (2.0, 0.3), (1.0, 0.0)] {
        let expected = furnace_sphere(radius, albedo);
        let matter = Matter { phase: Phase::Hg { g: 0.0 }.prepare(), albedo };
        let shares = [0.1, 0.15, 0.2, 0.25, 0.3].map(|share| share * radius);
        for (name, medium) in [("one", spheres(&[radius])), ("five", spheres(&shares))] {
            let estimate = traced(&medium, &sky, &matter, ray, 100_000).estimate();
            // The grid's own error: halving its shells changes the fourth digit.
            let allowed = 4.0 * estimate.standard_error + 3e-4;
            let off = estimate.value - expected;
            assert!(off.abs() < allowed, "{name} {radius} {albedo}: {estimate:?} {expected}");
            assert!(estimate.value < 1.0);
        }
    }
}

/// A uniform sphere in sunlight alone, from many sides: tables and paths have nothing in common
/// but the physics. Every path collides, at a distance drawn from those within the sphere.
#[test]
fn scattering_tables_agree() {
    const BATCH: u64 = 4096;
    const BATCHES: u64 = 25;
    // What the tables may be off, of the total: their target. Noise is 1 to 4 % for each value
    // and less than 1 % for all of them together.
    const TABLE: f64 = 0.01;
    let tables = TableSet::embedded().expect("tables");
    let towards = DVec3::Y;
    let sun = SunDisc::new(towards, DVec3::ONE, 0.0);
    let sky = UniformSky { radiance: DVec3::ZERO, sun: Some(sun), ground: None, sea: None };
    for name in ["hg:0.85", "mie:20um"] {
        let phase: Phase = name.parse().expect("a phase function");
        let table = tables.scattering_for(&phase, 1.0).expect("built in");
        let matter = Matter { phase: phase.prepare(), albedo: 1.0 };
        let mut random = Random::new(8, 8, 8);
        let (mut squares, mut sum, mut weights) = (0.0, 0.0, 0.0);
        const CASES: usize = 18;
        for case in 0..CASES {
            let optical_radius = [0.3, 2.0, 12.0][case % 3];
            let medium = spheres(&[optical_radius]);
            let dir = turned(DVec3::Y, 1.8 * random.unit() - 0.9, TAU * random.unit());
            let across = turned(dir, 0.0, TAU * random.unit()) * (0.95 * random.unit().sqrt());
            let half = (1.0 - across.length_squared()).sqrt();
            let entry = across - dir * half;
            let [once, more] = table.lookup(entry, dir, towards, optical_radius);
            let expected = phase.eval(dir.dot(towards)) * once + more;
            let opacity = -(-2.0 * half * optical_radius).exp_m1();
            let ray = Ray { origin: entry, dir };
            let got = (0..BATCHES)
                .into_par_iter()
                .map(|batch| {
                    let mut random = Random::new(5, case as u64, batch);
                    let mut moments = Moments::default();
                    for _ in 0..BATCH {
                        let first = -(-random.unit() * opacity).ln_1p() / optical_radius;
                        let flight = Flight::Collision(first);
                        let light = radiance(&medium, &sky, &matter, ray, flight, &mut random);
                        moments.add(light.x);
                    }
                    moments
                })
                .collect::<Vec<_>>()
                .into_iter()
                .fold(Moments::default(), Moments::merged)
                .estimate();
            let off = got.value / expected - 1.0;
            let variance = (got.standard_error / expected).powi(2) + TABLE * TABLE;
            println!("{name} {optical_radius} {:.2}: {off:.4} +- {:.4}", dir.y, variance.sqrt());
            assert!(
                off * off < 20.0 * variance,
                "{name} {optical_radius} {dir}: {got:?} {expected}"
            );
            squares += off * off / variance;
            sum += off / variance;
            weights += 1.0 / variance;
        }
        // 18 squares of normal numbers sum to 18, with a standard deviation of 6.
        assert!(squares < 18.0 + 4.0 * 6.0, "{name}: {squares}");
        let mean = sum / weights;
        println!("{name}: mean {mean:.4} +- {:.4}", weights.powf(-0.5));
        assert!(mean.abs() < 4.0 * weights.powf(-0.5), "{name}: {mean}");
    }
}

/// All sunlight that meets a sphere of albedo 1 leaves it again. Over all lines through the
/// sphere, alike in all directions, the mean radiance of scattered light is (1 - T) / (4 pi), T
/// being what a parallel beam loses nothing of: 2 int_0^1 exp(-2 R sqrt(1 - b^2)) b db. Narrow
/// lobes, for which paths are led towards the sun, must not change that.
#[test]
fn sunlight_is_conserved_whatever_the_lobe() {
    const BATCH: u64 = 4096;
    const BATCHES: u64 = 120;
    let towards = DVec3::new(0.48, 0.6, 0.64);
    let sky = UniformSky {
        radiance: DVec3::ZERO,
        sun: Some(SunDisc::new(towards, DVec3::ONE, 0.0093)),
        ground: None,
        sea: None,
    };
    for (name, radius) in [
        ("hg:0.5", 2.0f64),
        ("hg:0.95", 2.0),
        ("hg:-0.95", 2.0),
        ("mie:20um", 1.0),
        ("mie:20um", 6.0),
    ] {
        let phase: Phase = name.parse().expect("a phase function");
        let prepared = phase.prepare();
        let matter = Matter { phase: prepared, albedo: 1.0 };
        let medium = spheres(&[radius]);
        let direct = (1.0 - (1.0 + 2.0 * radius) * (-2.0 * radius).exp()) / (2.0 * radius * radius);
        let expected = (1.0 - direct) / (2.0 * TAU);
        let got = (0..BATCHES)
            .into_par_iter()
            .map(|batch| {
                let mut random = Random::new(9, 0, batch);
                let mut moments = Moments::default();
                for _ in 0..BATCH {
                    // Half of the lines lie where the phase function is large.
                    let dir = if random.unit() < 0.5 {
                        scatter(&prepared, towards, &mut random)
                    } else {
                        turned(towards, 2.0 * random.unit() - 1.0, TAU * random.unit())
                    };
                    let even = 1.0 / (2.0 * TAU);
                    let weight = even / (0.5 * (even + prepared.eval(dir.dot(towards))));
                    let across = turned(dir, 0.0, TAU * random.unit()) * random.unit().sqrt();
                    let half = (1.0 - across.length_squared()).sqrt();
                    let opacity = -(-2.0 * half * radius).exp_m1();
                    let first = -(-random.unit() * opacity).ln_1p() / radius;
                    let ray = Ray { origin: across - dir * half, dir };
                    let flight = Flight::Collision(first);
                    let light = radiance(&medium, &sky, &matter, ray, flight, &mut random);
                    moments.add(weight * opacity * light.x);
                }
                moments
            })
            .collect::<Vec<_>>()
            .into_iter()
            .fold(Moments::default(), Moments::merged)
            .estimate();
        let z = got.z(expected, 0.0);
        println!(
            "{name} {radius}: {:.5} {:.5} {z:.2}",
            got.value / expected,
            got.standard_error / expected
        );
        // Five comparisons: chance passes 4 once in 3000 runs of other seeds.
        assert!(z.abs() < 4.0, "{name} {radius}: {got:?} {expected}");
        assert!(got.standard_error < 0.02 * expected, "{name} {radius}: too noisy to tell");
    }
}
