//! Where the light goes: conservation of energy, and the furnace.
//!
//! With albedo 1 all light that meets matter comes out again. Seen from one chord (the furnace): in
//! uniform light from all sides the source, integrated over the sun's directions, is 1, whatever
//! the chord. Seen from the sun: what leaves in all directions everywhere is what the sphere's
//! matter intercepts. The second is the first averaged over chords by their opacity, so both come
//! from one integration.

use std::f64::consts::{PI, TAU};

use cumuli::reference::{Estimate, Moments, Random, turned};
use cumuli::tables::ScatteringTable;
use rayon::prelude::*;

use super::quadrature::panels;
use super::row::{Row, Worst};
use super::{Effort, draws};

/// Light out over light intercepted: target 0.2 %.
const ENERGY: f64 = 0.002;
/// Furnace of one particle: target 0.5 %.
const FURNACE: f64 = 0.005;
/// Share of the light that may lie in the orders left out: target 0.1 %.
const REMAINDER: f64 = 0.001;
/// Panels and points a panel of the rules; twice as many panels change no figure by 1e-4.
const INCIDENCES: [usize; 2] = [8, 4];
const AZIMUTHS: [usize; 2] = [12, 3];
const ANGLES: [usize; 2] = [16, 4];

/// Integrates a table over the directions of the sun, for one phase function.
pub struct Furnace<'a> {
    table: &'a ScatteringTable,
    /// Angle between view and sun, its share of the solid angle over the azimuth, phase function.
    angles: Vec<(f64, f64, f64)>,
    azimuths: Vec<(f64, f64)>,
}

impl<'a> Furnace<'a> {
    /// For a table.
    pub fn new(table: &'a ScatteringTable) -> Self {
        let phase = table.phase().prepare();
        // Graded towards both poles, where lobes are: h, the sine of half the angle from the pole,
        // is a sinh(b u), from the width of the narrowest lobe on.
        let width = 0.5 * table.phase().peak_angle();
        let reach = std::f64::consts::FRAC_1_SQRT_2;
        let stretch = (reach / width).asinh();
        let half = panels(ANGLES[0], ANGLES[1]).into_iter().map(|(u, w)| {
            let h = width * (stretch * u).sinh();
            // sin(angle) d(angle) = 4 h dh.
            (2.0 * h.asin(), w * 4.0 * h * width * stretch * (stretch * u).cosh())
        });
        let angles = half
            .flat_map(|(angle, w)| [(angle, w), (PI - angle, w)])
            .map(|(angle, w)| (angle, w, phase.eval(angle.cos())))
            .collect();
        // Both halves of the circle are the same.
        let azimuths = panels(AZIMUTHS[0], AZIMUTHS[1]);
        let azimuths = azimuths.into_iter().map(|(u, w)| (PI * u, TAU * w)).collect();
        Self { table, angles, azimuths }
    }

    /// Integral of the source over the sun's directions for a chord.
    pub fn chord(&self, incidence: f64, optical_radius: f64) -> f64 {
        let mut sum = 0.0;
        for &(azimuth, around) in &self.azimuths {
            for &(view_sun, measure, phase) in &self.angles {
                let ray = draws::ray(incidence, view_sun, azimuth);
                let [once, more] = self.table.lookup(ray.entry, ray.dir, ray.sun, optical_radius);
                sum += around * measure * (phase * once + more);
            }
        }
        sum
    }

    /// Light out over light intercepted, and the integral that is furthest from 1 over the chords.
    pub fn balance(&self, optical_radius: f64) -> (f64, f64) {
        let (mut out, mut intercepted, mut worst) = (0.0, 0.0, 1.0f64);
        for (incidence, w) in panels(INCIDENCES[0], INCIDENCES[1]) {
            let opaque = -(-2.0 * optical_radius * incidence).exp_m1();
            let source = self.chord(incidence, optical_radius);
            out += w * incidence * opaque * source;
            intercepted += w * incidence * opaque;
            if (source - 1.0).abs() > (worst - 1.0).abs() {
                worst = source;
            }
        }
        (out / intercepted, worst)
    }
}

/// All rows of one medium; `step` is called after each optical radius.
pub fn rows(table: &ScatteringTable, effort: &Effort, step: impl Fn() + Sync) -> Vec<Row> {
    let medium = super::medium(table);
    let furnace = Furnace::new(table);
    let radii: Vec<f64> = effort.energy_radii(table);
    let of_radius = |radius: &f64| {
        let (out, chord) = furnace.balance(*radius);
        let place = format!("{medium}, optical radius {radius:.4}");
        let rows = if table.albedo() == 1.0 {
            vec![
                Row::absolute(format!("light out over light in, {place}"), 1.0, out, ENERGY),
                Row::absolute(format!("furnace, worst chord, {place}"), 1.0, chord, FURNACE),
            ]
        } else {
            let photons = escaping(table, *radius, effort);
            let tolerance = ENERGY.max(effort.deviations * photons.standard_error);
            let mut worst = Worst::NONE;
            worst.add([photons.value, out], (out - photons.value).abs(), tolerance);
            vec![worst.row(format!("light out over light in, against photons, {place}"))]
        };
        step();
        rows
    };
    let mut rows = vec![remainder(table, &medium)];
    rows.extend(radii.par_iter().map(of_radius).collect::<Vec<_>>().concat());
    rows
}

/// What the bake left out by stopping its scattering orders, by its own record.
fn remainder(table: &ScatteringTable, medium: &str) -> Row {
    let mut worst = Worst::NONE;
    for radius in &table.report().radii {
        worst.add([0.0, radius.residual], radius.residual, REMAINDER);
    }
    worst.row(format!("remainder of the scattering orders, as recorded, {medium}"))
}

/// Photons of one stream of random numbers.
const BATCH: u64 = 1 << 12;

/// Share of the light that is intercepted by the sphere and comes out again.
fn escaping(table: &ScatteringTable, optical_radius: f64, effort: &Effort) -> Estimate {
    let phase = table.phase().prepare();
    let batches = (effort.photons / BATCH).max(1);
    let batch = |batch: u64| {
        let mut random = Random::new(effort.seed, optical_radius.to_bits(), batch);
        let mut moments = Moments::default();
        for _ in 0..BATCH {
            moments.add(photon(&phase, table.albedo(), optical_radius, &mut random));
        }
        moments
    };
    let parts: Vec<Moments> = (0..batches).into_par_iter().map(batch).collect();
    let sum = parts.into_iter().fold(Moments::default(), Moments::merged);
    // Each photon carries the light of the disc; of it the sphere intercepts this share.
    let all: f64 = panels(INCIDENCES[0], INCIDENCES[1])
        .iter()
        .map(|(m, w)| 2.0 * w * m * -(-2.0 * optical_radius * m).exp_m1())
        .sum();
    let estimate = sum.estimate();
    Estimate { value: estimate.value / all, standard_error: estimate.standard_error / all }
}

/// Weight with which light of a random place of the disc leaves after a first collision.
fn photon(
    phase: &cumuli::medium::PreparedPhase,
    albedo: f64,
    optical_radius: f64,
    random: &mut Random,
) -> f64 {
    let incidence = (1.0 - random.unit()).sqrt();
    let ray = draws::ray(incidence, 0.0, 0.0);
    let (mut place, mut dir) = (ray.entry, ray.dir);
    // The first collision is forced, which spares thin spheres most of the noise.
    let opaque = -(-2.0 * optical_radius * incidence).exp_m1();
    let mut flight = -(-random.unit() * opaque).ln_1p() / optical_radius;
    let mut weight = opaque;
    loop {
        place += flight * dir;
        weight *= albedo;
        // Roulette by what the photon carries.
        if weight < 0.1 * opaque {
            if random.unit() >= 0.5 {
                return 0.0;
            }
            weight *= 2.0;
        }
        let cosine = phase.sample(random.unit(), random.unit());
        dir = turned(dir, cosine, TAU * random.unit());
        flight = random.exponential() / optical_radius;
        let along = place.dot(dir);
        let inside = (1.0 - place.length_squared()).max(0.0);
        if flight >= (along * along + inside).sqrt() - along {
            return weight;
        }
    }
}

#[cfg(test)]
mod tests {
    use cumuli::medium::Phase;

    use super::*;

    #[test]
    fn the_rule_integrates_every_lobe() {
        let tables = cumuli::tables::TableSet::embedded().expect("built-in tables");
        for table in tables.scattering() {
            let furnace = Furnace::new(table);
            let around: f64 = furnace.azimuths.iter().map(|(_, w)| w).sum();
            let sphere: f64 = furnace.angles.iter().map(|(_, w, _)| w).sum();
            let lobe: f64 = furnace.angles.iter().map(|(_, w, p)| w * p).sum();
            assert!((around * sphere / (4.0 * PI) - 1.0).abs() < 1e-9, "{around} {sphere}");
            assert!((around * lobe - 1.0).abs() < 1e-6, "{}: {}", table.phase(), around * lobe);
        }
    }

    #[test]
    fn photons_balance_without_absorption() {
        let phase = Phase::Hg { g: 0.5 }.prepare();
        for radius in [0.1, 3.0] {
            let mut random = Random::new(1, 2, 3);
            for _ in 0..1000 {
                // Without absorption a photon leaves with all that it came with.
                let weight = photon(&phase, 1.0, radius, &mut random);
                assert!(weight > 0.0 && weight <= 1.0, "{weight}");
            }
        }
    }
}
