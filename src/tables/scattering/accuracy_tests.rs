//! Errors of lookups against traced paths.
//!
//! [`survey`] is the instrument behind the figures in the README and in the solver's
//! documentation. For each phase function and optical radius it prints the errors of the solver
//! itself and of the table's lookups, so that one sees which of the two to better:
//! `PHASES=hg:0.85 RADII=1.6,6.4 cargo test --lib survey -- --ignored --nocapture`; `RAYS`, `PATHS`,
//! and `WORST` (rays to list one by one) are further knobs.

use rayon::prelude::*;

use super::mapping::Geometry;
use super::*;
use crate::tables::{Silent, TableSet};

/// Errors of one ray, relative to its total radiance.
struct Row {
    geometry: Geometry,
    /// One standard error of the reference.
    reference: f64,
    /// The solver's higher orders, at the ray itself, before they are balanced.
    solver: f64,
    /// The lookup's order 1.
    single: f64,
    /// The lookup.
    lookup: f64,
}

impl Row {
    /// Within 1 %, or 3 standard errors of the reference where that is larger.
    fn good(&self) -> bool {
        self.lookup.abs() < f64::max(0.01, 3.0 * self.reference)
    }
}

/// Ray of the survey: impact parameters 0 to 0.95; even numbers look evenly in all directions,
/// odd ones evenly in the logarithm of the angle from the sun from 0.005 rad on.
fn survey_ray(number: u64) -> Geometry {
    // Multiples of the powers of the plastic number of three dimensions.
    let share = |k: f64| ((number + 1) as f64 * 1.220_744_084_605_76_f64.powf(-k)).fract();
    let across = 0.95 * share(1.0).sqrt();
    let least: f64 = 0.005;
    Geometry {
        incidence: (1.0 - across * across).sqrt(),
        azimuth: std::f64::consts::PI * share(3.0),
        view_sun: if number.is_multiple_of(2) {
            (1.0 - 2.0 * share(2.0)).acos()
        } else {
            least * (std::f64::consts::PI / least).powf(share(2.0))
        },
    }
}

fn rows(table: &ScatteringTable, radius: f64, rays: u64, paths: u64) -> Vec<Row> {
    let phase = table.phase();
    let rays: Vec<Geometry> = (0..rays).map(survey_ray).collect();
    let (direct, _) = bake::sources(phase, table.albedo(), &rays, radius, 3e-4);
    rays.par_iter()
        .zip(direct)
        .enumerate()
        .map(|(i, (geometry, direct))| {
            let want = reference::trace(phase, table.albedo(), geometry, radius, paths, i as u64);
            let p = phase.eval(geometry.view_sun.cos());
            let total = p * want.single + want.multiple.mean;
            let got = table.lookup_geometry(geometry, radius);
            let single = p * (got[0] - want.single) / total;
            Row {
                geometry: *geometry,
                reference: want.multiple.error / total,
                solver: (direct - want.multiple.mean) / total,
                single,
                lookup: single + (got[1] - want.multiple.mean) / total,
            }
        })
        .collect()
}

/// Mean, root mean square and greatest, in per cent.
fn statistics(rows: &[Row], f: impl Fn(&Row) -> f64) -> String {
    let n = rows.len() as f64;
    let mean = 100.0 * rows.iter().map(&f).sum::<f64>() / n;
    let rms = 100.0 * (rows.iter().map(|r| f(r).powi(2)).sum::<f64>() / n).sqrt();
    let most = 100.0 * rows.iter().map(|r| f(r).abs()).fold(0.0, f64::max);
    format!("{mean:+5.2} {rms:5.2} {most:5.2}")
}

#[test]
#[ignore = "an instrument that prints: minutes of tracing"]
fn survey() {
    let text = |name: &str, default: &str| std::env::var(name).unwrap_or(default.to_owned());
    let number = |name: &str, default: &str| text(name, default).parse::<u64>().expect("number");
    let (count, paths) = (number("RAYS", "32"), number("PATHS", "20000"));
    println!("errors in % of a ray's total: mean, root mean square, greatest");
    for name in text("PHASES", "hg:0,hg:0.5,hg:0.85,mie:10um,mie:20um").split(',') {
        let phase: Phase = name.parse().expect("phase");
        let clock = std::time::Instant::now();
        let embedded = TableSet::embedded().expect("built-in tables");
        let table = match embedded.scattering_for(&phase, 1.0) {
            Some(table) => table.clone(),
            None => ScatteringTable::bake(phase, 1.0, &ScatteringOptions::default(), &Silent)
                .expect("bakes"),
        };
        println!("{name}: a table after {:.1} s", clock.elapsed().as_secs_f64());
        for r in text("RADII", "0.1,0.4,1.6,6.4,20,64").split(',') {
            let mut rows = rows(&table, r.parse().expect("number"), count, paths);
            println!(
                "{name} R {r:>4} | s.e. {} | solver {} | single {} | lookup {} | within {}/{}",
                statistics(&rows, |r| r.reference),
                statistics(&rows, |r| r.solver),
                statistics(&rows, |r| r.single),
                statistics(&rows, |r| r.lookup),
                rows.iter().filter(|r| r.good()).count(),
                rows.len()
            );
            rows.sort_by(|a, b| b.lookup.abs().total_cmp(&a.lookup.abs()));
            for row in rows.iter().take(number("WORST", "0") as usize) {
                let g = row.geometry;
                println!(
                    "    impact {:.2} azimuth {:.2} view-sun {:.4}: s.e. {:5.2} solver {:+6.2} \
                     lookup {:+6.2}",
                    (1.0 - g.incidence * g.incidence).sqrt(),
                    g.azimuth,
                    g.view_sun,
                    100.0 * row.reference,
                    100.0 * row.solver,
                    100.0 * row.lookup
                );
            }
        }
    }
}

#[test]
fn built_in_tables_agree_with_traced_paths() {
    let tables = TableSet::embedded().expect("built-in tables");
    for table in tables.scattering() {
        for radius in [0.3, 2.2, 7.0] {
            for row in rows(table, radius, 12, 4000) {
                // 72 rays: 4 standard errors are passed by chance once in 200 runs, and the seeds
                // are fixed.
                let tolerance = f64::max(0.01, 4.0 * row.reference);
                assert!(
                    row.lookup.abs() < tolerance,
                    "R {radius} {:?}: {}",
                    row.geometry,
                    row.lookup
                );
                assert!(
                    row.solver.abs() < tolerance,
                    "R {radius} {:?}: {}",
                    row.geometry,
                    row.solver
                );
            }
        }
    }
}

#[test]
fn solver_agrees_with_traced_paths_where_light_is_absorbed() {
    let phase = Phase::hg(0.5).expect("in range");
    let (albedo, radius) = (0.8, 4.0);
    let rays: Vec<Geometry> = (0..12).map(survey_ray).collect();
    let (got, _) = bake::sources(&phase, albedo, &rays, radius, 3e-4);
    for (i, (ray, got)) in rays.iter().zip(got).enumerate() {
        let want = reference::trace(&phase, albedo, ray, radius, 8000, i as u64).multiple;
        let tolerance = f64::max(0.01 * want.mean, 4.0 * want.error);
        assert!((got - want.mean).abs() < tolerance, "{ray:?}: {got} {want:?}");
    }
}
