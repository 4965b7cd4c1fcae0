//! Radiance of lookups against paths traced backwards from the eye.

use cumuli::reference::Random;
use cumuli::tables::ScatteringTable;
use cumuli::tables::sample::SampleRay;
use cumuli::tables::scattering::reference::{Ray, sphere_radiance};
use rayon::prelude::*;

use super::row::{Row, Worst};
use super::{Effort, draws};

/// Radiance of a ray: target 1 % of its total, or the noise of the reference where that is larger.
const RADIANCE: f64 = 0.01;

/// Radiance that passes for none: a table of logarithms has no 0.
const DARK: f64 = 1e-9;

/// All rows of one medium; `step` is called after each ray.
pub fn rows(table: &ScatteringTable, effort: &Effort, step: impl Fn() + Sync) -> Vec<Row> {
    let radii = effort.radii(table);
    let of_radius = |radius: f64| {
        let rays = (0..effort.traced_rays).into_par_iter().map(|number| {
            let worst = compare(table, radius, number, effort);
            step();
            worst
        });
        let worst = rays.reduce(|| Worst::NONE, Worst::or);
        let medium = super::medium(table);
        worst.row(format!("radiance against Monte Carlo, {medium}, optical radius {radius}"))
    };
    radii.into_iter().map(of_radius).collect()
}

/// Radiance of a ray by traced paths, and its standard error.
pub fn traced(table: &ScatteringTable, ray: &SampleRay, paths: u64, seed: u64) -> [f64; 2] {
    let &SampleRay { entry, dir, sun, optical_radius, .. } = ray;
    let ray = Ray { entry, dir, sun, optical_radius };
    let total = sphere_radiance(table.phase(), table.albedo(), &ray, paths, seed).total();
    [total.mean, total.error]
}

fn compare(table: &ScatteringTable, radius: f64, number: u64, effort: &Effort) -> Worst {
    let phase = table.phase();
    let mut random = Random::new(effort.seed, 3, number);
    let ray = draws::lit_ray(phase, radius, number, &mut random);
    let seed = effort.seed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ radius.to_bits();
    let [expected, noise] = traced(table, &ray, effort.paths, seed);
    let opaque = -(2.0 * radius * ray.entry.dot(ray.dir)).exp_m1();
    let [once, more] = table.lookup(ray.entry, ray.dir, ray.sun, radius);
    let got = opaque * (phase.eval(ray.dir.dot(ray.sun)) * once + more);
    let mut worst = Worst::NONE;
    if expected > 0.0 {
        let tolerance = RADIANCE.max(effort.deviations * noise / expected);
        worst.add([expected, got], (got / expected - 1.0).abs(), tolerance);
    } else {
        // Albedo 0: no light, and none may be invented.
        worst.add([0.0, got], got.abs(), DARK);
    }
    worst
}
