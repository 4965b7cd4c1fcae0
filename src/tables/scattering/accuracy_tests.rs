//! Errors of lookups against traced paths. The survey is not a test but the instrument behind the
//! figures in the module documentation:
//! `RADII=0.4,6.4 PHASES=hg:0.85 cargo test --lib survey -- --ignored --nocapture`.

use rayon::prelude::*;

use super::mapping::Geometry;
use super::*;
use crate::tables::Silent;

/// Errors of one ray, relative to its total radiance.
struct Row {
    single: f64,
    multiple: f64,
    reference: f64,
    geometry: Geometry,
    total: f64,
}

impl Row {
    fn of(table: &ScatteringTable, geometry: Geometry, r: f64, paths: u64, seed: u64) -> Self {
        let phase = table.phase();
        let want = reference::trace(phase, table.albedo(), &geometry, r, paths, seed);
        let got = table.lookup_geometry(&geometry, r);
        let p = phase.eval(geometry.view_sun.cos());
        let total = p * want.single + want.multiple.mean;
        Self {
            single: p * (got[0] - want.single) / total,
            multiple: (got[1] - want.multiple.mean) / total,
            reference: want.multiple.error / total,
            geometry,
            total,
        }
    }

    fn error(&self) -> f64 {
        self.single + self.multiple
    }
}

/// The ray with this number: impact parameters up to 0.95; even numbers look evenly in all
/// directions, odd ones evenly over the table's view-sun axis.
fn ray(table: &ScatteringTable, number: u64) -> Geometry {
    // Multiples of the powers of the plastic number of three dimensions.
    let share = |k: f64| ((number + 1) as f64 * 1.220_744_084_605_76_f64.powf(-k)).fract();
    let across = 0.95 * share(1.0).sqrt();
    let even = (1.0 - 2.0 * share(2.0)).acos();
    Geometry {
        incidence: (1.0 - across * across).sqrt(),
        azimuth: std::f64::consts::PI * share(3.0),
        view_sun: if number.is_multiple_of(2) { even } else { table.map.angle(share(2.0)) },
    }
}

fn statistics(rows: &[&Row], f: impl Fn(&Row) -> f64) -> String {
    let mut v: Vec<f64> = rows.iter().map(|r| f(r)).collect();
    let n = v.len() as f64;
    let mean = v.iter().sum::<f64>() / n;
    let rms = (v.iter().map(|x| x * x).sum::<f64>() / n).sqrt();
    v.iter_mut().for_each(|x| *x = x.abs());
    v.sort_by(f64::total_cmp);
    let percent = |x: f64| 100.0 * x;
    format!(
        "mean {:+6.2} rms {:5.2} p90 {:5.2} max {:5.2}",
        percent(mean),
        percent(rms),
        percent(v[v.len() * 9 / 10]),
        percent(v[v.len() - 1])
    )
}

#[test]
#[ignore = "an instrument that prints, not a test"]
fn survey() {
    let text = |name: &str, default: &str| std::env::var(name).unwrap_or(default.to_owned());
    let number = |name: &str, default: &str| text(name, default).parse::<u64>().expect("number");
    let real = |name: &str, default: &str| text(name, default).parse::<f64>().expect("number");
    let (rays, paths) = (number("RAYS", "60"), number("PATHS", "20000"));
    let options = ScatteringOptions { remainder: real("REMAINDER", "3e-4"), ..Default::default() };
    for name in text("PHASES", "hg:0.85").split(',') {
        let phase: Phase = name.parse().expect("phase");
        let clock = std::time::Instant::now();
        let table = ScatteringTable::bake(phase, 1.0, &options, &Silent).expect("bakes");
        println!("{name}: baked in {:.1} s", clock.elapsed().as_secs_f64());
        if !text("REPORT", "").is_empty() {
            table.report().radii.iter().for_each(|r| println!("  {r:?}"));
        }
        for r in text("RADII", "0.1,0.4,1.6,6.4,20,64").split(',') {
            let r: f64 = r.parse().expect("number");
            let rows: Vec<Row> = (0..rays)
                .into_par_iter()
                .map(|i| Row::of(&table, ray(&table, i), r, paths, i))
                .collect();
            for (half, label) in ["even", "lobe"].into_iter().enumerate() {
                let rows: Vec<&Row> = rows.iter().skip(half).step_by(2).collect();
                let good = rows
                    .iter()
                    .filter(|r| r.error().abs() < f64::max(0.01, 3.0 * r.reference))
                    .count();
                println!(
                    "R {r:6.2} {label} % | single {} | multiple {} | total {} | s.e. {} | within {:3.0}",
                    statistics(&rows, |r| r.single),
                    statistics(&rows, |r| r.multiple),
                    statistics(&rows, Row::error),
                    statistics(&rows, |r| r.reference),
                    100.0 * good as f64 / rows.len() as f64
                );
                let mut worst = rows;
                worst.sort_by(|a, b| b.error().abs().total_cmp(&a.error().abs()));
                for r in worst.iter().take(number("WORST", "0") as usize) {
                    println!(
                        "   {:+.4} s.e. {:.4} {:?} {:.4e}",
                        r.error(),
                        r.reference,
                        r.geometry,
                        r.total
                    );
                }
            }
        }
    }
}

/// Two bakes of four radii that differ in something, relative to the total.
#[test]
#[ignore = "an instrument that prints, not a test"]
fn compare_bakes() {
    let text = |name: &str, default: &str| std::env::var(name).unwrap_or(default.to_owned());
    let number = |name: &str, default: &str| text(name, default).parse::<u64>().expect("number");
    let real = |name: &str, default: &str| text(name, default).parse::<f64>().expect("number");
    let size = |name: &str| {
        let text = text(name, "");
        let n: Vec<usize> = text.split('x').filter_map(|v| v.parse().ok()).collect();
        match n[..] {
            [radius, zenith, view_sun, azimuth] => {
                bake::FieldSize { radius, zenith, view_sun, azimuth }
            }
            _ => bake::FIELD,
        }
    };
    for name in text("PHASES", "hg:0.85").split(',') {
        let phase: Phase = name.parse().expect("phase");
        let mut options = ScatteringOptions {
            remainder: real("REMAINDER", "3e-4"),
            optical_radius: [real("LEAST", "0.1"), 64.0],
            ..Default::default()
        };
        options.resolution[0] = number("NODES", "4") as usize;
        let make = |remainder, field, nodes: &str| {
            let mut options = options.clone();
            let nodes: Vec<usize> =
                text(nodes, "").split('x').filter_map(|v| v.parse().ok()).collect();
            options.resolution[4 - nodes.len()..].copy_from_slice(&nodes);
            let clock = std::time::Instant::now();
            let options = ScatteringOptions { remainder, ..options.clone() };
            let (values, report) = bake::bake_with(&phase, 1.0, &options, field, &Silent);
            println!("  {:.1} s", clock.elapsed().as_secs_f64());
            report.radii.iter().for_each(|r| println!("  {r:?}"));
            ScatteringTable::from_parts(
                phase,
                1.0,
                options.resolution,
                options.optical_radius,
                values.into_iter().map(f16::from_f64).collect(),
                report,
            )
            .expect("table")
        };
        let one = make(options.remainder, size("FIELD1"), "RES1");
        if number("ONE", "0") == 1 {
            continue;
        }
        let two = make(real("REMAINDER2", "3e-4"), size("FIELD2"), "RES2");
        for k in 0..options.resolution[0] {
            let r = options.optical_radius_at(k);
            for (half, label) in ["even", "lobe"].into_iter().enumerate() {
                let rows: Vec<Row> = (0..4000u64)
                    .filter(|i| i % 2 == half as u64)
                    .map(|i| {
                        let geometry = ray(&one, i);
                        let (a, b) =
                            (one.lookup_geometry(&geometry, r), two.lookup_geometry(&geometry, r));
                        let p = phase.eval(geometry.view_sun.cos());
                        let total = p * b[0] + b[1];
                        Row {
                            single: p * (a[0] - b[0]) / total,
                            multiple: (a[1] - b[1]) / total,
                            reference: 0.0,
                            geometry,
                            total,
                        }
                    })
                    .collect();
                let mut rows: Vec<&Row> = rows.iter().collect();
                println!(
                    "{name} R {r:7.3} {label} % {}",
                    statistics(&rows, |r| r.single)
                        + " | multiple "
                        + &statistics(&rows, |r| r.multiple)
                        + " | total "
                        + &statistics(&rows, Row::error)
                );
                rows.sort_by(|a, b| b.error().abs().total_cmp(&a.error().abs()));
                for r in rows.iter().take(number("WORST", "0") as usize) {
                    println!("   {:+.4} {:?} {:.4e}", r.error(), r.geometry, r.total);
                }
            }
        }
    }
}
