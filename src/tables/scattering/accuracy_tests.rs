//! Development: errors of lookups against traced paths.
use super::mapping::Geometry;
use super::*;

#[test]
#[ignore]
fn survey() {
    let names = std::env::var("PHASES").unwrap_or("hg:0.85".into());
    let rays: u64 = std::env::var("RAYS").map(|v| v.parse().unwrap()).unwrap_or(60);
    let paths: u64 = std::env::var("PATHS").map(|v| v.parse().unwrap()).unwrap_or(20000);
    let radii: Vec<f64> = std::env::var("RADII")
        .unwrap_or("0.1,0.4,1.6,6.4,20,64".into())
        .split(',')
        .map(|v| v.parse().unwrap())
        .collect();
    let events: u64 = std::env::var("EVENTS").map(|v| v.parse().unwrap()).unwrap_or(8_000_000);
    for name in names.split(',') {
        let phase: Phase = name.parse().unwrap();
        let clock = std::time::Instant::now();
        let table = ScatteringTable::bake(
            phase,
            1.0,
            &ScatteringOptions { events, ..Default::default() },
            &crate::tables::Silent,
        )
        .unwrap();
        println!("{name}: baked in {:.1} s", clock.elapsed().as_secs_f64());
        if std::env::var("REPORT").is_ok() {
            for r in &table.report().radii {
                println!(
                    "  R {:8.3} photons {:9} orders {:7.2} beyond {:.1e} conservation {:?}",
                    r.optical_radius, r.photons, r.mean_orders, r.beyond_64, r.conservation
                );
            }
        }
        for &r in &radii {
            use rayon::prelude::*;
            let rows: Vec<_> = (0..rays)
                .into_par_iter()
                .map(|i| {
                    let h = |k: u64| {
                        ((i + 1) as f64
                            * [0.8566748838545029, 0.733891856627126, 0.6287067210378087]
                                [k as usize])
                            .fract()
                    };
                    let b = 0.95 * h(0).sqrt();
                    // half of the rays evenly over the sphere of directions, half over the graded axis
                    let view_sun =
                        if i % 2 == 0 { (1.0 - 2.0 * h(1)).acos() } else { table.map.angle(h(1)) };
                    let g = Geometry {
                        incidence: (1.0 - b * b).sqrt(),
                        azimuth: std::f64::consts::PI * h(2),
                        view_sun,
                    };
                    let want = reference::trace(&phase, 1.0, &g, r, paths, i);
                    let got = table.lookup_geometry(&g, r);
                    let p = phase.eval(view_sun.cos());
                    let total = p * want.single + want.multiple.mean;
                    let e1 = p * (got[0] - want.single) / total;
                    let e2 = (got[1] - want.multiple.mean) / total;
                    (e1, e2, want.multiple.error / total, g, total, i % 2)
                })
                .collect();
            for half in 0..2 {
                let rows: Vec<_> = rows.iter().filter(|r| r.5 == half).collect();
                let stat = |f: &dyn Fn(&(f64, f64, f64, Geometry, f64, u64)) -> f64| {
                    let mut v: Vec<f64> = rows.iter().map(|r| f(r)).collect();
                    let mean = v.iter().sum::<f64>() / v.len() as f64;
                    v.iter_mut().for_each(|x| *x = x.abs());
                    v.sort_by(f64::total_cmp);
                    let rms = (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
                    format!(
                        "mean {:+.4} rms {:.4} p90 {:.4} max {:.4}",
                        mean,
                        rms,
                        v[v.len() * 9 / 10],
                        v[v.len() - 1]
                    )
                };
                let ok =
                    rows.iter().filter(|r| (r.0 + r.1).abs() < f64::max(0.01, 3.0 * r.2)).count();
                println!(
                    "R {r:6.2} {} | single {} | multiple {} | total {} | ref s.e. {} | within {:.0} %",
                    ["even", "lobe"][half as usize],
                    stat(&|r| r.0),
                    stat(&|r| r.1),
                    stat(&|r| r.0 + r.1),
                    stat(&|r| r.2),
                    100.0 * ok as f64 / rows.len() as f64
                );
                if std::env::var("WORST").is_ok() {
                    let mut s: Vec<_> = rows.iter().collect();
                    s.sort_by(|a, b| (b.0 + b.1).abs().total_cmp(&(a.0 + a.1).abs()));
                    for r in s.iter().take(5) {
                        println!(
                            "    e1 {:+.4} e2 {:+.4} se {:.4} m {:.3} az {:.3} vs {:.4} total {:.5}",
                            r.0, r.1, r.2, r.3.incidence, r.3.azimuth, r.3.view_sun, r.4
                        );
                    }
                }
            }
        }
    }
}
