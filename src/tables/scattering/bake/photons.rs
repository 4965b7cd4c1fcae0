//! Photons through the sphere: every scattering is recorded on the grid.
//!
//! Each flight is forced to end inside (the weight takes the probability), so thin spheres waste
//! no photon; Russian roulette ends a photon whose weight has become small. Nothing is cut off at
//! an order.

use super::angles::AngleSampler;
use super::grid::FieldGrid;
use super::random::Random;

/// Roulette begins below this share of the weight that a typical second scattering has.
const ROULETTE_SHARE: f32 = 0.25;

/// Recorded scatterings of some photons.
pub struct Tally {
    /// Photons started.
    pub photons: u64,
    /// Weights by incoming light: scattered once, then scattered more often. Each a field in the
    /// order radius, zenith, view-sun angle, azimuth.
    pub fields: [Vec<f32>; 2],
    /// Sum of the weights by order of the incoming light: 0 is sunlight, the last all above.
    pub by_order: Vec<f64>,
}

/// Orders that are counted one by one.
pub const COUNTED_ORDERS: usize = 64;

/// Traces photons through one sphere.
pub struct Tracer<'a> {
    pub grid: &'a FieldGrid,
    pub angles: &'a AngleSampler,
    pub optical_radius: f32,
    pub albedo: f32,
    /// Doublings of the number of photons from the sunlit to the dark side.
    pub levels: u32,
}

impl Tracer<'_> {
    /// Traces photons until `events` scatterings are recorded.
    pub fn trace(&self, events: u64, stream: u64) -> Tally {
        let mut random = Random::new(stream);
        let empty = vec![0.0f32; self.grid.size.len()];
        let mut tally = Tally {
            photons: 0,
            fields: [empty.clone(), empty],
            by_order: vec![0.0; COUNTED_ORDERS + 1],
        };
        let locator = Locator::new(self.grid);
        let offset = random.unit();
        let mut recorded = 0;
        while recorded < events {
            // The golden ratio's multiples fill the disc evenly.
            let disc =
                (tally.photons as f64 * 0.618_033_988_749_894_9 + f64::from(offset)).fract() as f32;
            tally.photons += 1;
            recorded += self.photon(disc, &mut random, &locator, &mut tally);
        }
        tally
    }

    fn photon(&self, disc: f32, random: &mut Random, locator: &Locator, tally: &mut Tally) -> u64 {
        let mut recorded = 0;
        let mut waiting = vec![Photon {
            x: [disc.sqrt(), 0.0, (1.0 - disc).sqrt()],
            k: [0.0, 0.0, -1.0],
            weight: 1.0,
            least: 0.0,
            order: 0,
            level: 0,
        }];
        while let Some(mut photon) = waiting.pop() {
            while self.scatter(&mut photon, random, locator, tally, &mut recorded) {
                let copies = self.change_level(&mut photon, random);
                if copies == 0 {
                    break;
                }
                waiting.extend(std::iter::repeat_n(photon, copies - 1));
            }
        }
        recorded.max(1)
    }

    /// One flight and one scattering; false where the photon ends.
    fn scatter(
        &self,
        photon: &mut Photon,
        random: &mut Random,
        locator: &Locator,
        tally: &mut Tally,
        recorded: &mut u64,
    ) -> bool {
        let r = self.optical_radius;
        let Photon { x, k, weight, .. } = photon;
        let along = dot(*x, *k);
        let inside = (1.0 - dot(*x, *x)).max(0.0);
        let root = (along * along + inside).sqrt();
        let exit = if along > 0.0 { inside / (root + along) } else { root - along };
        let collides = -(-r * exit).exp_m1();
        *weight *= collides;
        if *weight <= 0.0 {
            return false;
        }
        let flight = (-(1.0 - random.unit() * collides).ln() / r).min(exit);
        for i in 0..3 {
            x[i] += flight * k[i];
        }
        tally.by_order[photon.order.min(COUNTED_ORDERS)] += f64::from(*weight);
        if photon.order > 0 {
            let index = locator.index(*x, *k, random);
            tally.fields[usize::from(photon.order > 1)][index] += *weight;
            *recorded += 1;
        } else {
            photon.least = ROULETTE_SHARE * *weight * -(-r).exp_m1();
        }
        *weight *= self.albedo;
        if *weight < photon.least {
            if random.unit() * photon.least >= *weight {
                return false;
            }
            *weight = photon.least;
        }
        *k = turned(*k, self.angles.sample(random.bits()), random.unit());
        photon.order += 1;
        true
    }

    /// Splits a photon that has gone deeper away from the sun, and plays roulette with one that
    /// has come back, so that the dark side of thick spheres sees about as many photons as the
    /// bright side. Returns how many photons there are now.
    fn change_level(&self, photon: &mut Photon, random: &mut Random) -> usize {
        let depth = 0.5 * (1.0 - photon.x[2]) * (self.levels + 1) as f32;
        let level = (depth as u32).min(self.levels);
        let (from, to) = (photon.level, level);
        photon.level = level;
        if to > from {
            let share = 0.5f32.powi((to - from) as i32);
            photon.weight *= share;
            photon.least *= share;
            return 1 << (to - from);
        }
        let share = 0.5f32.powi((from - to) as i32);
        if to < from {
            if random.unit() >= share {
                return 0;
            }
            photon.weight /= share;
            photon.least /= share;
        }
        1
    }
}

/// A photon on its way.
#[derive(Clone, Copy)]
struct Photon {
    x: [f32; 3],
    k: [f32; 3],
    weight: f32,
    /// Roulette begins below this weight.
    least: f32,
    order: usize,
    level: u32,
}

/// Finds grid nodes in f32.
struct Locator {
    crowding: f32,
    radius_scale: f32,
    zenith_scale: f32,
    azimuth_scale: f32,
    lobe_inverse: f32,
    lobe_factor: f32,
    even_factor: f32,
    last: [u32; 4],
}

impl Locator {
    fn new(grid: &FieldGrid) -> Self {
        let size = grid.size;
        let (crowding, radius_scale) = grid.radius_factors();
        let steps = (size.view_sun - 1) as f64;
        Self {
            crowding,
            radius_scale,
            zenith_scale: (size.zenith - 1) as f32 / std::f32::consts::PI,
            azimuth_scale: (size.azimuth - 1) as f32 / std::f32::consts::PI,
            lobe_inverse: (1.0 / grid.view_sun.lobe_scale) as f32,
            lobe_factor: (grid.view_sun.lobe_factor() * steps) as f32,
            even_factor: (grid.view_sun.even_factor() * steps) as f32,
            last: [size.radius, size.zenith, size.view_sun, size.azimuth].map(|n| n as u32 - 1),
        }
    }

    /// A node near a photon at `x` that travels along `k`, drawn with the hat functions as
    /// probabilities: on average the same as sharing the weight among all sixteen.
    fn index(&self, x: [f32; 3], k: [f32; 3], random: &mut Random) -> usize {
        let radius = dot(x, x).sqrt();
        let deep = (1.0 - radius).max(0.0) * self.crowding;
        let at_radius = asinh(deep) * self.radius_scale;
        let at_zenith = acos(x[2] / radius.max(f32::MIN_POSITIVE)) * self.zenith_scale;
        // The eye looks against the light: sine of half the angle between -k and the sun.
        let across = k[0] * k[0] + k[1] * k[1];
        let half_sine2 = if k[2] < 0.0 { 0.5 * across / (1.0 - k[2]) } else { 0.5 * (1.0 + k[2]) };
        let half_sine = half_sine2.sqrt();
        let half_cosine = (1.0 - half_sine2).max(0.0).sqrt();
        let at_angle = asinh(half_sine * self.lobe_inverse) * self.lobe_factor
            + (1.0 + half_sine - half_cosine) * self.even_factor;
        let product = ((x[0] * x[0] + x[1] * x[1]) * across).sqrt().max(1e-20);
        let cosine = -(x[0] * k[0] + x[1] * k[1]) / product;
        let at_azimuth = acos(cosine) * self.azimuth_scale;
        // 16 bits decide each of the four rounding steps.
        let (a, b) = (random.bits(), random.bits());
        const UNIT: f32 = 1.0 / 65536.0;
        let up =
            |at: f32, bits: u32, last: u32| ((at + bits as f32 * UNIT) as u32).min(last) as usize;
        let i = up(at_radius, a & 0xffff, self.last[0]);
        let j = up(at_zenith, a >> 16, self.last[1]);
        let t = up(at_angle, b & 0xffff, self.last[2]);
        let p = up(at_azimuth, b >> 16, self.last[3]);
        ((i * (self.last[1] as usize + 1) + j) * (self.last[2] as usize + 1) + t)
            * (self.last[3] as usize + 1)
            + p
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Inverse hyperbolic sine of a number that is not negative.
fn asinh(x: f32) -> f32 {
    (x + (x * x + 1.0).sqrt()).ln()
}

/// Inverse cosine, error below 7e-5 rad (Abramowitz and Stegun 4.4.45): a thousandth of a cell.
fn acos(c: f32) -> f32 {
    let a = c.abs().min(1.0);
    let p =
        (1.0 - a).sqrt() * (1.570_728_8 + a * (-0.212_114_4 + a * (0.074_261 - 0.018_729_3 * a)));
    if c < 0.0 { std::f32::consts::PI - p } else { p }
}

/// `k` turned by an angle given as 1 - cos, at a random azimuth.
fn turned(k: [f32; 3], one_minus_cos: f32, azimuth: f32) -> [f32; 3] {
    let sine = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
    let (s, c) = (std::f32::consts::TAU * azimuth).sin_cos();
    // Orthonormal basis of Duff et al. 2017.
    let sign = if k[2] < 0.0 { -1.0f32 } else { 1.0 };
    let a = -1.0 / (sign + k[2]);
    let b = k[0] * k[1] * a;
    let u = [1.0 + sign * k[0] * k[0] * a, sign * b, -sign * k[0]];
    let v = [b, sign + k[1] * k[1] * a, -k[1]];
    let mut out = [0.0; 3];
    for i in 0..3 {
        out[i] = k[i] * (1.0 - one_minus_cos) + sine * (c * u[i] + s * v[i]);
    }
    // Rounding must not build up over hundreds of turns.
    let scale = 1.5 - 0.5 * dot(out, out);
    out.map(|v| v * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quick_inverse_cosine_is_close() {
        for i in -1000..=1000 {
            let c = i as f32 / 1000.0;
            assert!((acos(c) - c.acos()).abs() < 1e-4, "{c}");
        }
    }

    #[test]
    fn turning_keeps_length_and_angle() {
        let mut random = Random::new(3);
        let mut k = [0.0, 0.6, -0.8];
        for _ in 0..1000 {
            let turn = 2.0 * random.unit();
            let next = turned(k, turn, random.unit());
            assert!((dot(next, next) - 1.0).abs() < 1e-6);
            assert!((1.0 - dot(k, next) - turn).abs() < 2e-6);
            k = next;
        }
    }
}
