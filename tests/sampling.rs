//! Every sampling routine of the path tracer against its density, by chi-square tests.

use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use std::sync::Arc;

use cumuli::medium::{Phase, Sea, Shape};
use cumuli::reference::{
    Filter, Lens, Lobes, Matter, Medium, ParticleGrid, Points, Random, Ray, SunDisc, View,
    WorldParticle, cosine_direction, first_collision, scatter, turned,
};
use cumuli::scene::Camera;
use glam::{DQuat, DVec3};

const SAMPLES: usize = 200_000;

/// Tests counts against expected shares. The bound is 5 standard deviations of a normal variable
/// by the transformation of Wilson and Hilferty (1931): chance passes it once in 3 million tests.
#[track_caller]
fn chi_square(name: &str, counts: &[usize], shares: &[f64]) {
    let total: usize = counts.iter().sum();
    let whole: f64 = shares.iter().sum();
    assert!((whole - 1.0).abs() < 1e-3, "{name}: the shares sum to {whole}");
    // Cells that expect less than 5 make the statistic wider than it is taken for: they go
    // together.
    let (mut sum, mut cells, mut rest) = (0.0, 0, (0usize, 0.0));
    for (&count, &share) in counts.iter().zip(shares) {
        rest = (rest.0 + count, rest.1 + share / whole * total as f64);
        if rest.1 >= 5.0 {
            sum += (rest.0 as f64 - rest.1).powi(2) / rest.1;
            cells += 1;
            rest = (0, 0.0);
        }
    }
    assert!(rest.1 >= 1.0 || rest.0 < 20, "{name}: {rest:?} in cells of no weight");
    let free = f64::from(cells - 1);
    let width = 2.0 / (9.0 * free);
    let normal = ((sum / free).cbrt() - (1.0 - width)) / width.sqrt();
    assert!(cells > 4 && normal < 5.0, "{name}: {sum:.1} with {free} degrees, {normal:.2}");
}

/// Number of the cell of a value from 0 to 1.
fn cell(value: f64, cells: usize) -> usize {
    ((value * cells as f64) as usize).min(cells - 1)
}

/// Counts of (height, azimuth) around an axis, with a height from 0 to 1.
fn counted(
    axis: DVec3,
    cells: [usize; 2],
    height: impl Fn(DVec3) -> f64,
    mut sample: impl FnMut() -> DVec3,
) -> Vec<usize> {
    let (x, y) = axis.any_orthonormal_pair();
    let mut counts = vec![0; cells[0] * cells[1]];
    for _ in 0..SAMPLES {
        let dir = sample();
        assert!((dir.length() - 1.0).abs() < 1e-9);
        let azimuth = dir.dot(y).atan2(dir.dot(x)) / TAU + 0.5;
        counts[cell(height(dir), cells[0]) * cells[1] + cell(azimuth, cells[1])] += 1;
    }
    counts
}

/// Shares of rows, each spread evenly over the azimuths.
fn over_azimuths(rows: &[f64], azimuths: usize) -> Vec<f64> {
    rows.iter().flat_map(|row| std::iter::repeat_n(row / azimuths as f64, azimuths)).collect()
}

/// Integral by the midpoint rule.
fn integral(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 2000;
    let step = (to - from) / STEPS as f64;
    (0..STEPS).map(|i| f(from + (i as f64 + 0.5) * step) * step).sum()
}

#[test]
fn phase_functions() {
    let dir = DVec3::new(0.48, -0.6, 0.64);
    for name in [
        "hg:0", "hg:0.5", "hg:0.85", "hg:0.99", "hg:-0.6", "hg:-0.95", "mie:5um", "mie:10um",
        "mie:20um", "mie:50um",
    ] {
        let phase: Phase = name.parse().expect("a phase function");
        let phase = phase.prepare();
        let lobes = Lobes::new(&Matter { phase, albedo: 1.0 });
        let mut random = Random::new(1, 2, 3);
        // Cells that grow with the distance from both poles, where the lobes are:
        // 1 - cos = 2 h^6 resolves peaks of 1e-5.
        const ROWS: usize = 40;
        let to_cos = |h: f64| {
            if h < 0.5 { 1.0 - (2.0 * h).powi(6) } else { (2.0 * (1.0 - h)).powi(6) - 1.0 }
        };
        let to_height = |cos: f64| {
            let off = |v: f64| 0.5 * v.max(0.0).powf(1.0 / 6.0);
            if cos > 0.0 { off(1.0 - cos) } else { 1.0 - off(1.0 + cos) }
        };
        let counts = counted(
            dir,
            [ROWS, 8],
            |d| to_height(d.dot(dir)),
            || scatter(&phase, dir, &mut random),
        );
        let rows: Vec<f64> = (0..ROWS)
            .map(|i| {
                let edge = |i: usize| i as f64 / ROWS as f64;
                // In h, where the density is smooth: d cos / d h by differences.
                integral(edge(i), edge(i + 1), |h| {
                    let slope = (to_cos(h - 1e-6) - to_cos(h + 1e-6)) / 2e-6;
                    TAU * phase.eval(to_cos(h)) * slope
                })
            })
            .collect();
        chi_square(name, &counts, &over_azimuths(&rows, 8));
        // The same function as a sum of lobes that are drawn one by one.
        let counts = counted(
            dir,
            [ROWS, 8],
            |d| to_height(d.dot(dir)),
            || lobes.scatter(dir, &mut random).0,
        );
        chi_square(&format!("lobes of {name}"), &counts, &over_azimuths(&rows, 8));
        for cos in [-1.0, -0.3, 0.5, 0.99, 1.0] {
            let sum = lobes.broad_density(cos) + lobes.narrow_density(cos);
            assert!((sum / phase.eval(cos) - 1.0).abs() < 1e-12, "{name} {cos}: {sum}");
        }
    }
}

#[test]
fn sun_discs() {
    for diameter in [1e-4, 0.0093, 0.3] {
        let towards = DVec3::new(-0.36, 0.48, 0.8);
        let sun = SunDisc::new(towards, DVec3::ONE, diameter);
        let mut random = Random::new(4, 5, 6);
        const ROWS: usize = 24;
        // The disc ends at 1.3 radii; chords of even steps.
        let most = 0.65 * diameter;
        let height = |d: DVec3| d.distance(towards) / most;
        let counts = counted(towards, [ROWS, 8], height, || sun.sample(&mut random));
        let step = most / ROWS as f64;
        let rows: Vec<f64> = (0..ROWS)
            .map(|i| {
                integral(i as f64 * step, (i + 1) as f64 * step, |chord| {
                    let dir = turned(towards, 1.0 - 0.5 * chord * chord, 0.4);
                    // Solid angle is 2 pi c dc.
                    sun.radiance(dir).x * TAU * chord
                })
            })
            .collect();
        chi_square(&format!("sun of {diameter}"), &counts, &over_azimuths(&rows, 8));
    }
}

#[test]
fn ground_and_azimuths() {
    let normal = DVec3::new(0.6, 0.8, 0.0);
    let mut random = Random::new(7, 8, 9);
    let height = |d: DVec3| d.dot(normal).max(0.0);
    let counts = counted(normal, [20, 8], height, || cosine_direction(normal, &mut random));
    // The density is cos / pi: shares of cos^2.
    let rows: Vec<f64> = (0..20).map(|i| f64::from(2 * i + 1) / 400.0).collect();
    chi_square("ground", &counts, &over_azimuths(&rows, 8));

    let isotropic = "hg:0".parse::<Phase>().expect("a phase function").prepare();
    let counts = counted(
        DVec3::Z,
        [20, 20],
        |d| 0.5 + 0.5 * d.z,
        || scatter(&isotropic, normal, &mut random),
    );
    chi_square("all directions", &counts, &over_azimuths(&[0.05; 20], 20));
}

/// Distances of first collisions in overlapping particles, uniform and with noise, against the
/// transmittance that is integrated in small steps.
#[test]
fn distances() {
    let shapes = ["uniform", "soft-1", "pyroclastic-1"]
        .map(|name| Arc::new(Shape::new(name.parse().expect("a shape"))));
    let mut random = Random::new(10, 11, 12);
    let particles: Vec<_> = (0..12)
        .map(|i| WorldParticle {
            centre: DVec3::new(40.0 * random.unit(), 40.0 * random.unit(), 300.0 * random.unit()),
            radius: 50.0 + 50.0 * random.unit(),
            extinction: 0.0015 + 0.0015 * random.unit(),
            to_own: DQuat::from_rotation_x(6.0 * random.unit()),
            shape: shapes[i % 3].clone(),
        })
        .collect();
    let ray = Ray { origin: DVec3::new(20.0, 20.0, -150.0), dir: DVec3::Z };
    const LENGTH: f64 = 600.0;
    const CELLS: usize = 100;
    const STEPS: usize = 60;
    // The last share is of those that do not collide.
    let (mut shares, mut depth) = (Vec::new(), 0.0f64);
    for i in 0..CELLS {
        let before = (-depth).exp();
        for k in 0..STEPS {
            let step = LENGTH / (CELLS * STEPS) as f64;
            let t = ((i * STEPS + k) as f64 + 0.5) * step;
            depth += step * particles.iter().map(|p| p.extinction_at(ray.at(t))).sum::<f64>();
        }
        shares.push(before - (-depth).exp());
    }
    shares.push((-depth).exp());
    assert!((0.01..0.5).contains(&shares[CELLS]), "{}", shares[CELLS]);
    let grid = ParticleGrid::new(particles);
    let mut counts = vec![0; CELLS + 1];
    for _ in 0..SAMPLES {
        let found = first_collision(&grid, &ray, LENGTH, &mut random);
        counts[found.map_or(CELLS, |t| cell(t / LENGTH, CELLS))] += 1;
    }
    chi_square("distances", &counts, &shares);
    // It is the bounds' doing that few places are looked at, not a lack of matter.
    let mut pieces = 0;
    grid.pieces(&ray, LENGTH, &mut |_| {
        pieces += 1;
        ControlFlow::Continue(())
    });
    assert!(pieces > 10, "{pieces}");
}

#[test]
fn places_on_lens_and_pixel() {
    let camera = Camera { position: DVec3::ZERO, target: DVec3::NEG_Z, ..Camera::default() };
    let lens = Lens { aperture: 2.0, focus: 50.0 };
    let view = View::new(&camera, [8, 8], Some(lens), Filter::Box);
    let mut counts = vec![0; 16 * 16];
    let mut pixel_counts = vec![0; 16 * 16];
    for i in 0..SAMPLES as u64 {
        // One point each of many pixels: those of one pixel are more even than chance.
        let ray = view.ray([4.0, 4.0], Points::new(3, i, 1).at(0));
        let (x, y) = (ray.origin.x, ray.origin.y);
        // Rings of even area, and azimuths.
        let ring = cell(x * x + y * y, 16);
        counts[ring * 16 + cell(y.atan2(x) / TAU + 0.5, 16)] += 1;
        let [u, v] = Points::new(3, i, 0).at(5);
        pixel_counts[cell(u, 16) * 16 + cell(v, 16)] += 1;
    }
    chi_square("lens", &counts, &[1.0 / 256.0; 256]);
    chi_square("pixel", &pixel_counts, &[1.0 / 256.0; 256]);
}

#[test]
fn exponential_and_uniform_numbers() {
    let mut random = Random::new(13, 14, 15);
    let (mut exponential, mut uniform) = (vec![0; 64], vec![0; 64]);
    for _ in 0..SAMPLES {
        exponential[cell(1.0 - (-random.exponential()).exp(), 64)] += 1;
        uniform[cell(random.unit(), 64)] += 1;
    }
    chi_square("exponential", &exponential, &[1.0 / 64.0; 64]);
    chi_square("uniform", &uniform, &[1.0 / 64.0; 64]);
}

/// Facets of the sea among those that a view sees: slopes by exp(-s^2) times the cosine to the view.
#[test]
fn facets_of_the_sea() {
    for wind in [0.0, 5.0, 60.0] {
        let sea = Sea::new(wind);
        for mu in [1e-4f64, 0.05, 0.3, 1.0] {
            const CELLS: usize = 24;
            let across = (1.0 - mu * mu).sqrt();
            let mut random = Random::new(21, 0, 0);
            let mut counts = vec![0; CELLS * 6];
            for _ in 0..SAMPLES {
                let [along, aside] = sea.draw_facet(mu, || random.unit());
                let place = |slope: f64| slope / (6.0 * sea.slope()) + 0.5;
                counts[cell(place(along), CELLS) * 6 + cell(place(aside), 6)] += 1;
            }
            let gauss = |from: f64, to: f64, of: &dyn Fn(f64) -> f64| {
                integral(from, to, |t| (-t * t).exp() * of(t))
            };
            // Beyond three root mean squares: in the outermost cells.
            let edge = |i: usize, n: usize| match i {
                0 => -6.0,
                i if i == n => 6.0,
                i => 6.0 * i as f64 / n as f64 - 3.0,
            };
            let seen = |t: f64| (mu + across * sea.slope() * t).max(0.0);
            let mut shares = Vec::new();
            for i in 0..CELLS {
                let along = gauss(edge(i, CELLS), edge(i + 1, CELLS), &seen);
                for j in 0..6 {
                    shares.push(along * gauss(edge(j, 6), edge(j + 1, 6), &|_| 1.0));
                }
            }
            let whole: f64 = shares.iter().sum();
            shares.iter_mut().for_each(|share| *share /= whole);
            chi_square(&format!("facets {wind} {mu}"), &counts, &shares);
        }
    }
}

/// The test finds what is wrong: a lobe taken for a slightly wider one.
#[test]
#[should_panic(expected = "degrees")]
fn a_wrong_density_is_noticed() {
    let mut random = Random::new(16, 17, 18);
    let sampled = Phase::Hg { g: 0.53 }.prepare();
    let claimed = Phase::Hg { g: 0.5 }.prepare();
    let counts = counted(
        DVec3::Z,
        [20, 4],
        |d| 0.5 + 0.5 * d.z,
        || scatter(&sampled, DVec3::Z, &mut random),
    );
    let rows: Vec<f64> = (0..20)
        .map(|i| {
            let edge = |i: i32| 0.1 * f64::from(i) - 1.0;
            integral(edge(i), edge(i + 1), |cos| 2.0 * PI * claimed.eval(cos))
        })
        .collect();
    chi_square("wrong", &counts, &over_azimuths(&rows, 4));
}
