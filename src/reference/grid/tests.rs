use glam::DQuat;

use super::*;
use crate::reference::{Random, transmittance};

/// Overlapping particles of all kinds, large and small.
fn particles(count: usize, seed: u64) -> Vec<WorldParticle> {
    let shapes = ["uniform", "soft-1", "pyroclastic-2"]
        .map(|name| Arc::new(Shape::new(name.parse().expect("a shape"))));
    let mut random = Random::new(seed, 0, 0);
    (0..count)
        .map(|i| {
            let mut signed = || 2.0 * random.unit() - 1.0;
            WorldParticle {
                centre: DVec3::new(signed(), signed(), signed()) * 300.0,
                radius: 10.0 * 16.0f64.powf(signed().abs()),
                extinction: 0.02 * signed().abs(),
                to_own: DQuat::from_xyzw(signed(), signed(), signed(), 1.0).normalize(),
                shape: shapes[i % shapes.len()].clone(),
            }
        })
        .collect()
}

/// Along random rays: pieces follow each other, hold what all particles together hold there, and
/// nothing lies between them.
#[test]
fn pieces_hold_the_sum_of_all_particles() {
    let all = particles(120, 5);
    let grid = ParticleGrid::new(all.clone());
    let sum = |point: DVec3| all.iter().map(|p| p.extinction_at(point)).sum::<f64>();
    let mut random = Random::new(1, 1, 1);
    let (mut seen, mut ratio) = (0, 0.0);
    for _ in 0..300 {
        let mut signed = || 2.0 * random.unit() - 1.0;
        let origin = DVec3::new(signed(), signed(), signed()) * 500.0;
        let dir = DVec3::new(signed(), signed(), signed()).normalize();
        let ray = Ray { origin, dir };
        let mut last = 0.0;
        grid.pieces(&ray, 900.0, &mut |piece| {
            assert!(piece.begin >= last && piece.end > piece.begin && piece.end <= 900.0);
            // What is skipped is empty.
            for share in [0.1, 0.5, 0.9] {
                let gap = piece.begin - last;
                assert!(gap < 1e-9 || sum(ray.at(last + share * gap)) == 0.0, "{gap}");
                let point = ray.at(piece.begin + share * (piece.end - piece.begin));
                let (expected, got) = (sum(point), grid.extinction(piece.cell, point));
                assert!((got - expected).abs() <= 1e-12 + 1e-9 * expected, "{got} {expected}");
                assert!(got >= piece.minorant && got <= piece.majorant, "{piece:?}: {got}");
                (seen, ratio) = (seen + 1, ratio + (got - piece.minorant) / piece.majorant);
            }
            last = piece.end;
            ControlFlow::Continue(())
        });
    }
    assert!(seen > 5_000 && ratio > 0.1 * f64::from(seen), "{seen} {ratio}");
}

#[test]
fn rays_along_axes_and_walls_are_no_exception() {
    let all = particles(40, 6);
    let grid = ParticleGrid::new(all.clone());
    for dir in [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::new(0.6, 0.0, -0.8)] {
        for corner in [IVec3::ZERO, IVec3::ONE, grid.cells.count] {
            let ray = Ray { origin: grid.cells.corner(corner) - dir * 2000.0, dir };
            let mut length = 0.0;
            grid.pieces(&ray, f64::INFINITY, &mut |piece| {
                length += piece.end - piece.begin;
                ControlFlow::Continue(())
            });
            assert!(length.is_finite(), "{dir} {corner}: {length}");
        }
    }
}

/// Every particle that a ray meets is found, evenly filled cells or not.
#[test]
fn along_a_ray_no_particle_is_missed() {
    let all = particles(120, 7);
    let grid = ParticleGrid::new(all.clone());
    let mut random = Random::new(2, 1, 1);
    let mut found = Vec::new();
    for _ in 0..200 {
        let mut signed = || 2.0 * random.unit() - 1.0;
        let origin = DVec3::new(signed(), signed(), signed()) * 400.0;
        let dir = DVec3::new(signed(), signed(), signed()).normalize();
        let ray = Ray { origin, dir };
        grid.along(&ray, f64::INFINITY, &mut found);
        for (i, particle) in all.iter().enumerate() {
            let Some((begin, end)) = particle.span(&ray) else { continue };
            let (begin, end) = (begin.max(0.0), end);
            if end > begin && particle.optical_depth(&ray, begin, end) > 0.0 {
                assert!(found.contains(&(i as u32)), "particle {i}");
            }
        }
    }
}

/// Estimates against optical depths that are integrated particle by particle.
#[test]
fn transmittance_is_unbiased() {
    let all = particles(60, 8);
    let grid = ParticleGrid::new(all.clone());
    let mut random = Random::new(3, 1, 1);
    let (mut squares, mut cases) = (0.0, 0);
    for _ in 0..40 {
        let mut signed = || 2.0 * random.unit() - 1.0;
        let origin = DVec3::new(signed(), signed(), signed()) * 400.0;
        let ray = Ray { origin, dir: (-origin).normalize() };
        let depth: f64 = all
            .iter()
            .filter_map(|p| p.span(&ray).map(|(begin, end)| (p, begin.max(0.0), end.min(700.0))))
            .filter(|(_, begin, end)| end > begin)
            .map(|(p, begin, end)| p.optical_depth(&ray, begin, end))
            .sum();
        let mut moments = crate::reference::Moments::default();
        for _ in 0..4000 {
            moments.add(transmittance(&grid, &ray, 700.0, &mut random));
        }
        // Depths are integrated to 1e-4; deeper, too few of 4000 estimates are above 0.
        if depth < 6.0 {
            let z = moments.estimate().z((-depth).exp(), 1e-4);
            (squares, cases) = (squares + z * z, cases + 1);
            assert!(z.abs() < 4.5, "depth {depth}: {z}");
        }
    }
    // A sum of squares of so many normal numbers: its standard deviation is sqrt(2 cases).
    let cases = f64::from(cases);
    assert!(cases > 20.0 && squares < cases + 4.0 * (2.0 * cases).sqrt(), "{squares} of {cases}");
}
