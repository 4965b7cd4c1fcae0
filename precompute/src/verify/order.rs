//! Order 1 against a quadrature in f64, escape from the uniform sphere against its closed form, and
//! the fall of the orders against critical spheres.

use cumuli::Result;
use cumuli::medium::Phase;
use cumuli::reference::Random;
use cumuli::tables::sample::{SampleRay, Sampler};
use cumuli::tables::{ScatteringTable, TableSet};
use glam::DVec3;
use rayon::prelude::*;

use super::quadrature::{double_exponential, panels};
use super::row::{Row, Worst};
use super::{Effort, draws};

/// Share of a ray's whole radiance by which its order 1 may be off: that of the whole.
const ORDER_ONE: f64 = 0.01;
/// Published to eight digits; the lookups of the uniform sphere are in f64 but for its profile.
const ESCAPE: f64 = 1e-6;
/// Points in each half of a chord: twice as many change nothing by 1e-9.
const HALF_POINTS: i32 = 80;

/// Distance from a point of the closed unit ball to its surface.
fn exit_distance(place: DVec3, dir: DVec3) -> f64 {
    let along = place.dot(dir);
    let inside = (1.0 - place.length_squared()).max(0.0);
    (along * along + inside).sqrt() - along
}

/// Source of order 1 without phase function: the mean of the sun's transmittance over the chord,
/// weighted with that of the view.
pub fn source(albedo: f64, ray: &SampleRay, rule: &[([f64; 2], f64)]) -> f64 {
    let radius = ray.optical_radius;
    let chord = -2.0 * ray.entry.dot(ray.dir);
    let lit = |distance: f64| {
        let sun = exit_distance(ray.entry + distance * ray.dir, ray.sun);
        (-radius * (distance + sun)).exp()
    };
    let sum: f64 = rule.iter().map(|([near, _], w)| w * lit(near * chord)).sum();
    albedo * radius * chord * sum / -(-radius * chord).exp_m1()
}

/// Order 1 of one medium at every optical radius that is looked at.
pub fn rows(table: &ScatteringTable, effort: &Effort) -> Vec<Row> {
    let rule = double_exponential(HALF_POINTS);
    let phase = table.phase().prepare();
    let of_radius = |radius: f64| {
        let rays = (0..effort.quadrature_rays).into_par_iter().map(|number| {
            let mut random = Random::new(effort.seed, 2, number);
            let ray = draws::lit_ray(table.phase(), radius, number, &mut random);
            let chord = -2.0 * ray.entry.dot(ray.dir);
            let scale = -(-radius * chord).exp_m1();
            let p = scale * phase.eval(ray.dir.dot(ray.sun));
            let [once, more] = table.lookup(ray.entry, ray.dir, ray.sun, radius);
            let values = [source(table.albedo(), &ray, &rule), once].map(|source| p * source);
            let total = values[0] + scale * more;
            let mut worst = Worst::NONE;
            worst.add(values, ((values[1] - values[0]) / total).abs(), ORDER_ONE);
            worst
        });
        let worst = rays.reduce(|| Worst::NONE, Worst::or);
        worst.row(format!(
            "order 1, share of all, {}, optical radius {radius}",
            super::medium(table)
        ))
    };
    // Without scattering there is no light to take a share of.
    let radii = if table.albedo() > 0.0 { effort.radii(table) } else { Vec::new() };
    radii.into_iter().map(of_radius).collect()
}

/// Escape probability of light emitted evenly in an absorbing sphere, by the transmittances that
/// the tables answer for the uniform shape: emission along a chord comes out in proportion to its
/// opacity, and chords are cosine-distributed at their entry.
pub fn escape_rows(tables: &TableSet) -> Result<Vec<Row>> {
    // A set without media can't be sampled.
    let Some(table) = tables.scattering().first() else { return Ok(Vec::new()) };
    let phase: &Phase = table.phase();
    let sampler = Sampler::new(tables, "uniform", phase, table.albedo())?;
    let rule = panels(64, 4);
    let row = |optical_radius: f64| {
        let opaque = |incidence: f64| {
            let ray = SampleRay { optical_radius, ..draws::ray(incidence, 1.0, 1.0) };
            1.0 - sampler.sample(&ray).transmittance
        };
        let mean: f64 = rule.iter().map(|&(m, w)| 2.0 * m * w * opaque(m)).sum();
        let got = mean / (4.0 / 3.0 * optical_radius);
        let name = format!("escape probability, uniform, optical radius {optical_radius}");
        Row::relative(name, escape(optical_radius), got, ESCAPE)
    };
    Ok([1e-3, 0.5, 1.0, 2.0, 5.0, 14.0].map(row).to_vec())
}

/// Tolerance of the solver in the critical spheres: the part of the light that lies beyond order 1 is
/// to be right to 0.2 % as the balance of energy is.
const CRITICAL_SPHERE: f64 = 0.002;

/// Fall of the orders and profile of the light in spheres that others have solved, by the solver of
/// this program; for files with media that such a solver has made.
pub fn critical_rows(tables: &TableSet) -> Vec<Row> {
    use cumuli::tables::scattering::bake::critical::{CRITICAL, order_ratio};
    let cases = if tables.scattering().is_empty() { &[] } else { &CRITICAL[..] };
    let rows = cases.iter().flat_map(|case| {
        let (ratio, profile) = order_ratio(case.optical_radius);
        let place = format!("critical sphere, optical radius {:.4}", case.optical_radius);
        let name = format!("ratio of orders, the solver, {place}");
        let first = Row::relative(name, 1.0 / case.secondaries, ratio, CRITICAL_SPHERE);
        let profile = ["1/4", "1/2", "3/4"].into_iter().zip(case.profile).zip(profile);
        let profile = profile.map(|((at, expected), got)| {
            let name = format!("mean intensity at {at} of the radius, the solver, {place}");
            Row::absolute(name, expected, got, CRITICAL_SPHERE)
        });
        std::iter::once(first).chain(profile.collect::<Vec<_>>())
    });
    rows.collect()
}

/// Case, de Hoffmann and Placzek's closed form; it cancels for thin spheres, where a series serves.
fn escape(t: f64) -> f64 {
    if t < 0.01 {
        return 1.0 - 0.75 * t + 0.4 * t * t - t.powi(3) / 6.0;
    }
    let squared = 1.0 / (2.0 * t * t);
    3.0 / (4.0 * t) * (1.0 - squared + (1.0 / t + squared) * (-2.0 * t).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escape_is_what_was_published() {
        for (t, expected) in [
            (0.5, 0.70727665),
            (1.0, 0.52725219),
            (2.0, 0.33241773),
            (5.0, 0.1470015),
            (14.0, 0.05343477),
        ] {
            // Half a unit of the last digit given.
            assert!((escape(t) - expected).abs() < 5e-8, "{t}: {}", escape(t));
        }
        // Both branches meet.
        assert!((escape(0.009999) - escape(0.010001)).abs() < 2e-6);
    }

    #[test]
    fn into_the_sun_it_is_the_closed_form() {
        let rule = double_exponential(HALF_POINTS);
        for radius in [0.01, 1.0, 20.0, 64.0] {
            for incidence in [0.2, 1.0] {
                let ray = SampleRay { optical_radius: radius, ..draws::ray(incidence, 0.0, 0.0) };
                let tau = 2.0 * incidence * radius;
                let expected = tau * (-tau).exp() / -(-tau).exp_m1();
                let got = source(1.0, &ray, &rule);
                assert!((got / expected - 1.0).abs() < 1e-8, "{radius} {incidence} {got}");
            }
        }
    }

    #[test]
    fn more_points_change_nothing() {
        let rules = [HALF_POINTS, 3 * HALF_POINTS].map(double_exponential);
        for number in 0..200 {
            let mut random = Random::new(5, 0, number);
            let phase = Phase::Hg { g: 0.85 };
            let radius = 0.1 * 640f64.powf(random.unit());
            let ray = draws::lit_ray(&phase, radius, number, &mut random);
            let [a, b] = [&rules[0], &rules[1]].map(|rule| source(1.0, &ray, rule));
            // Behind the sphere's middle the sun's path starts with a slope of its own scale.
            assert!((a / b - 1.0).abs() < 1e-6, "{ray:?}: {a} {b}");
        }
    }
}
