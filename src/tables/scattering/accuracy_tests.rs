//! Errors of lookups against traced paths. The survey is not a test but the instrument behind the
//! figures in the module documentation:
//! `RADII=0.4,6.4 PHASES=hg:0.85 cargo test --lib survey -- --ignored --nocapture`.

use super::mapping::Geometry;
use super::*;
use crate::tables::Silent;

/// Ray of the survey: impact parameters 0 to 0.95; even numbers look evenly in all directions,
/// odd ones evenly in the logarithm of the angle from the sun between 0.005 rad and half a circle.
fn survey_ray(number: u64) -> Geometry {
    let share = |k: f64| ((number + 1) as f64 * 1.220_744_084_605_76_f64.powf(-k)).fract();
    let across = 0.95 * share(1.0).sqrt();
    let even = (1.0 - 2.0 * share(2.0)).acos();
    let least: f64 = 0.005;
    Geometry {
        incidence: (1.0 - across * across).sqrt(),
        azimuth: std::f64::consts::PI * share(3.0),
        view_sun: if number.is_multiple_of(2) {
            even
        } else {
            least * (std::f64::consts::PI / least).powf(share(2.0))
        },
    }
}

#[test]
#[ignore = "an instrument that prints, not a test"]
fn references() {
    use std::io::Write;
    let text = |name: &str, default: &str| std::env::var(name).unwrap_or(default.to_owned());
    let path = text("REFERENCES", "/tmp/solver/references.csv");
    let have = std::fs::read_to_string(&path).unwrap_or_default();
    let mut file =
        std::fs::OpenOptions::new().create(true).append(true).open(&path).expect("opens");
    let rays: u64 = text("RAYS", "32").parse().expect("number");
    let scale: f64 = text("SCALE", "1").parse().expect("number");
    for r in text("RADII", "0.1,0.4,1.6,6.4,20,64").split(',') {
        for name in text("PHASES", "hg:0.85,mie:20um,hg:0,mie:10um,hg:0.5").split(',') {
            let phase: Phase = name.parse().expect("phase");
            let radius: f64 = r.parse().expect("number");
            let paths = match radius {
                r if r < 0.2 => 6e3,
                r if r < 1.0 => 2e4,
                r if r < 3.0 => 4e4,
                _ => 6e4,
            } * scale;
            for i in 0..rays {
                let key = format!("{name},{radius},{i},");
                if have.lines().any(|l| l.starts_with(&key)) {
                    continue;
                }
                let v = reference::trace(&phase, 1.0, &survey_ray(i), radius, paths as u64, i);
                writeln!(file, "{key}{},{},{}", v.single, v.multiple.mean, v.multiple.error)
                    .expect("writes");
            }
        }
    }
}

/// Reference values of the survey's rays: single, multiple, standard error.
fn references_of(name: &str, radius: f64) -> Vec<(Geometry, [f64; 3])> {
    let path = std::env::var("REFERENCES").unwrap_or("/tmp/solver/references.csv".to_owned());
    let mut text = std::fs::read_to_string(path).expect("references");
    let second = std::fs::read_to_string("/tmp/solver/references2.csv").unwrap_or_default();
    let better: Vec<&str> = second.lines().collect();
    text = text.lines().map(|l| {
        let key = &l[..l.match_indices(',').nth(2).map_or(0, |m| m.0) + 1];
        let b = better.iter().find(|b| b.starts_with(key)).map_or(l, |b| *b);
        format!("{b}\n")
    }).collect();
    let key = format!("{name},{radius},");
    text.lines()
        .filter_map(|l| l.strip_prefix(&key))
        .map(|l| {
            let v: Vec<f64> = l.split(',').map(|v| v.parse().expect("number")).collect();
            (survey_ray(v[0] as u64), [v[1], v[2], v[3]])
        })
        .collect()
}

#[test]
#[ignore = "an instrument that prints, not a test"]
fn against() {
    let text = |name: &str, default: &str| std::env::var(name).unwrap_or(default.to_owned());
    let field: Vec<usize> =
        text("FIELD", "").split('x').filter_map(|v| v.parse().ok()).collect();
    let field = match field[..] {
        [radius, zenith, view_sun, azimuth] => {
            Some(bake::FieldSize { radius, zenith, view_sun, azimuth })
        }
        _ => None,
    };
    let mut options = ScatteringOptions::default();
    let res: Vec<usize> = text("RES", "").split('x').filter_map(|v| v.parse().ok()).collect();
    options.resolution[4 - res.len()..].copy_from_slice(&res);
    let worst: usize = text("WORST", "0").parse().expect("number");
    for name in text("PHASES", "hg:0.85,mie:20um").split(',') {
        let phase: Phase = name.parse().expect("phase");
        let clock = std::time::Instant::now();
        let table = text("TABLE", "1").eq("1").then(|| {
            let table = ScatteringTable::bake(phase, 1.0, &options, &Silent).expect("bakes");
            println!("{name}: baked in {:.1} s", clock.elapsed().as_secs_f64());
            table
        });
        for r in text("RADII", "0.1,0.4,1.6,6.4,20,64").split(',') {
            let radius: f64 = r.parse().expect("number");
            let refs = references_of(name, radius);
            if refs.is_empty() { continue; }
            let rays: Vec<Geometry> = refs.iter().map(|r| r.0).collect();
            let clock = std::time::Instant::now();
            let (direct, convergence) =
                bake::sources(&phase, 1.0, &rays, radius, options.remainder, field.unwrap_or(bake::FieldSize::for_radius(radius, 1.0 - phase.mean_cosine())));
            let time = clock.elapsed().as_secs_f64();
            let mut rows = Vec::new();
            for (i, (geometry, [single, multiple, error])) in refs.iter().enumerate() {
                let p = phase.eval(geometry.view_sun.cos());
                let total = p * single + multiple;
                let got = table.as_ref().map_or([*single, direct[i]], |t| t.lookup_geometry(geometry, radius));
                rows.push([
                    error / total,
                    (direct[i] - multiple) / total,
                    (p * (got[0] - single) + got[1] - direct[i]) / total,
                    (p * (got[0] - single) + got[1] - multiple) / total,
                ]);
            }
            let stat = |k: usize| {
                let n = rows.len() as f64;
                let mean = rows.iter().map(|r| r[k]).sum::<f64>() / n;
                let rms = (rows.iter().map(|r| r[k] * r[k]).sum::<f64>() / n).sqrt();
                let max = rows.iter().map(|r| r[k].abs()).fold(0.0, f64::max);
                format!("mean {:+5.2} rms {:5.2} max {:5.2}", 100.0 * mean, 100.0 * rms, 100.0 * max)
            };
            let good = |k: usize| rows.iter().filter(|r| r[k].abs() < f64::max(0.01, 3.0 * r[0])).count();
            let excess = |k: usize| {
                let n = rows.len() as f64;
                let v = rows.iter().map(|r| r[k] * r[k] - r[0] * r[0]).sum::<f64>() / n;
                100.0 * v.max(0.0).sqrt()
            };
            println!("{name} R {radius:5.1} | s.e. {:5.2} | solver {} excess {:5.2} good {} | table-solver {} | table {} excess {:5.2} good {}/{} | {} steps {time:.1} s",
                100.0 * (rows.iter().map(|r| r[0] * r[0]).sum::<f64>() / rows.len() as f64).sqrt(),
                stat(1), excess(1), good(1), stat(2), stat(3), excess(3), good(3), rows.len(), convergence.steps);
            let mut order: Vec<usize> = (0..rows.len()).collect();
            order.sort_by(|a, b| rows[*b][1].abs().total_cmp(&rows[*a][1].abs()));
            for i in order.into_iter().take(worst) {
                let g = rays[i];
                println!("    b {:.2} az {:.2} view-sun {:7.4} s.e. {:5.2} solver {:+6.2} table-solver {:+6.2}",
                    (1.0 - g.incidence * g.incidence).sqrt(), g.azimuth, g.view_sun,
                    100.0 * rows[i][0], 100.0 * rows[i][1], 100.0 * rows[i][2]);
            }
        }
    }
}

#[test]
#[ignore = "an instrument that prints, not a test"]
fn axes() {
    let text = |name: &str, default: &str| std::env::var(name).unwrap_or(default.to_owned());
    let mut options = ScatteringOptions::default();
    let res: Vec<usize> = text("RES", "").split('x').filter_map(|v| v.parse().ok()).collect();
    options.resolution[4 - res.len()..].copy_from_slice(&res);
    let [radii, incidences, azimuths, views] = options.resolution;
    let count: u64 = text("RAYS", "100").parse().expect("number");
    for name in text("PHASES", "hg:0.85,mie:20um").split(',') {
        let phase: Phase = name.parse().expect("phase");
        let map = ViewSunMap::for_phase(&phase);
        for r in text("RADII", "0.4,1.6,6.4,20,64").split(',') {
            let radius: f64 = r.parse().expect("number");
            let rays: Vec<Geometry> = (0..count).map(survey_ray).collect();
            let around = |c: f64, n: usize| {
                let at = c * (n - 1) as f64;
                let i = at.floor().min((n - 2) as f64);
                let u = at - i;
                [(i / (n - 1) as f64, 1.0 - u), ((i + 1.0) / (n - 1) as f64, u)]
            };
            let mut all = rays.clone();
            let mut weights = Vec::new();
            for g in &rays {
                for (c, w) in around(mapping::incidence_coordinate(g.incidence), incidences) {
                    all.push(Geometry { incidence: mapping::incidence_cosine(c), ..*g });
                    weights.push(w);
                }
                for (c, w) in around(mapping::azimuth_coordinate(g.azimuth.cos()), azimuths) {
                    all.push(Geometry { azimuth: mapping::azimuth_angle(c), ..*g });
                    weights.push(w);
                }
                for (c, w) in around(map.coordinate((0.5 * g.view_sun).sin()), views) {
                    all.push(Geometry { view_sun: map.angle(c), ..*g });
                    weights.push(w);
                }
            }
            let (v, _) = bake::sources(&phase, 1.0, &all, radius, 3e-4, bake::FieldSize::for_radius(radius, 1.0 - phase.mean_cosine()));
            let share = mapping::RadiusMap { range: options.optical_radius }.coordinate(radius);
            let mut across = vec![0.0; rays.len()];
            for (c, w) in around(share, radii) {
                let r = mapping::RadiusMap { range: options.optical_radius }.optical_radius(c);
                let (v, _) = bake::sources(&phase, 1.0, &rays, r, 3e-4, bake::FieldSize::for_radius(radius, 1.0 - phase.mean_cosine()));
                for (a, v) in across.iter_mut().zip(v) {
                    *a += w * (v / single::opacity(r)).ln();
                }
            }
            let mut line = format!("{name} R {radius:5.1}");
            for axis in 0..4 {
                let (mut mean, mut rms, mut most) = (0.0, 0.0, 0.0f64);
                for i in 0..rays.len() {
                    let p = phase.eval(rays[i].view_sun.cos());
                    let total = p * single::single_source(&rays[i], radius) + v[i];
                    let log = if axis == 0 {
                        across[i] + single::opacity(radius).ln()
                    } else {
                        let k = 6 * i + 2 * (axis - 1);
                        let at = rays.len() + k;
                        weights[k] * v[at].ln() + weights[k + 1] * v[at + 1].ln()
                    };
                    let e = (log.exp() - v[i]) / total;
                    mean += e / rays.len() as f64;
                    rms += e * e / rays.len() as f64;
                    most = most.max(e.abs());
                }
                line += &format!(
                    " | {} mean {:+5.2} rms {:5.2} max {:5.2}",
                    ["radius", "incidence", "azimuth", "view-sun"][axis],
                    100.0 * mean,
                    100.0 * rms.sqrt(),
                    100.0 * most
                );
            }
            println!("{line}");
        }
    }
}

#[test]
#[ignore = "an instrument that prints, not a test"]
fn fields() {
    let text = |name: &str, default: &str| std::env::var(name).unwrap_or(default.to_owned());
    let number = |text: &str| text.parse::<f64>().expect("number");
    let sizes: Vec<bake::FieldSize> = text("FIELDS", "20x33x36x11,30x33x36x11,20x49x36x11,20x33x54x11,20x33x36x17")
        .split(',')
        .map(|t| {
            let v: Vec<usize> = t.split('x').map(|v| v.parse().expect("number")).collect();
            bake::FieldSize { radius: v[0], zenith: v[1], view_sun: v[2], azimuth: v[3] }
        })
        .collect();
    let count: u64 = text("RAYS", "60").parse().expect("number");
    let rays: Vec<Geometry> = (0..count).map(survey_ray).collect();
    for name in text("PHASES", "hg:0.85,mie:20um").split(',') {
        let phase: Phase = name.parse().expect("phase");
        for r in text("RADII", "6.4,20,64").split(',') {
            let radius = number(r);
            let remainder = number(&text("REMAINDER", "3e-4"));
            let all: Vec<Vec<f64>> = sizes
                .iter()
                .map(|s| bake::sources(&phase, 1.0, &rays, radius, remainder, *s).0)
                .collect();
            for (size, v) in sizes.iter().zip(&all).skip(1) {
                let e: Vec<f64> = (0..rays.len())
                    .map(|i| {
                        let p = phase.eval(rays[i].view_sun.cos());
                        (v[i] - all[0][i]) / (p * single::single_source(&rays[i], radius) + v[i])
                    })
                    .collect();
                let n = e.len() as f64;
                println!(
                    "{name} R {radius:5.1} {size:?} against the first: mean {:+5.2} rms {:5.2} max {:5.2}",
                    100.0 * e.iter().sum::<f64>() / n,
                    100.0 * (e.iter().map(|e| e * e).sum::<f64>() / n).sqrt(),
                    100.0 * e.iter().map(|e| e.abs()).fold(0.0, f64::max)
                );
            }
        }
    }
}
