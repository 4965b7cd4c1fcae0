//! The surface of the sea: waves as facets whose slopes are Gaussian, each a mirror by Fresnel's equations, over water
//! that sends some of the light back.
//!
//! The slopes' mean square is that which Cox and Munk measured in sun glitter (1954, "Measurement of the roughness of the
//! sea surface from photographs of the sun's glitter", J. Opt. Soc. Am. 44), alike in all directions of the wind: their up- and
//! crosswind parts differ by a third. Facets hide and shade each other as Smith's function for Gaussian slopes
//! has it (1967, IEEE Trans. Antennas Propag. 15), with heights of the eye's and the sun's facets correlated (Ross,
//! Potvin and Dion 2005; Heitz 2014). Light that a facet sends into another wave counts as having entered the water:
//! what is reflected and what enters make up all light.
//!
//! What enters is scattered back with the ground's albedo and spread alike in all directions below the surface: each way
//! through the surface takes the share that is not reflected there, and the product is scaled so that what comes in along any
//! direction leaves again with albedo 1 (Kelemen and Szirmay-Kalos 2001): energy is kept, and both ways are alike.
//!
//! Twin of `shaders/shared/sea.wgsl`. Vectors are unit; `mu` is the cosine of the zenith angle of a direction.

use std::f64::consts::{FRAC_2_SQRT_PI, PI};
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

/// Refractive index of sea water at 0.55 um, 20 degrees Celsius, 35 g of salt a kilogram (Quan and Fry 1995: 1.340).
pub const WATER_INDEX: f64 = 1.34;
/// Mean square slope of a sea without wind, and what a wind of 1 m/s adds: Cox and Munk (1954).
const CALM: f64 = 0.003;
/// s/m.
const OF_WIND: f64 = 0.00512;
/// Nodes of the tables by `mu`, even in its square root: linear between them, reflectances are within 1.5e-3 (test).
pub const HEIGHTS: usize = 32;
/// Facets of [`Sea::facets`]: along the view and across. Of a sky with an aureole, RMS over directions (and the largest error) at
/// 15 m/s: 2 by 3 facets 0.050 (0.14), 3 by 2 0.015 (0.049), 3 by 3 0.013 (0.040), 4 by 3 0.008 (0.023), 5 by 3 0.005 (0.015), 5 by 5 0.003 (0.009); with the
/// nodes of Gauss and Hermite at the mean and variance of the visible slopes, 5 by 3, 0.11 (0.12).
pub const FACETS: [usize; 2] = [4, 3];
/// Least sine of a zenith angle: straight up a direction sees all slopes.
const LEAST_SINE: f64 = 1e-6;
/// Least cosine of a facet's zenith angle: the density of steeper ones is 0 in f32 at any wind.
const LEAST_FACET: f64 = 0.05;
/// Least product of cosines: below it light runs along the surface and none of it is reflected.
const LEAST_AREA: f64 = 1e-12;

/// The complementary error function of a number that is not negative, within 1.5e-7: Abramowitz and Stegun, 7.1.26.
pub fn erfc(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let sum = -1.453_152_027 + t * 1.061_405_429;
    t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * sum))) * (-x * x).exp()
}

/// Reflected share of unpolarised light that falls on flat water, by the cosine of its angle to the normal: Fresnel's
/// equations.
pub fn fresnel(cosine: f64) -> f64 {
    let c = cosine.clamp(0.0, 1.0);
    let g = (WATER_INDEX * WATER_INDEX - 1.0 + c * c).sqrt();
    let (across, along) = ((g - c) / (g + c), (c * (g + c) - 1.0) / (c * (g - c) + 1.0));
    0.5 * across * across * (1.0 + along * along)
}

/// The surface under one wind.
#[derive(Clone, Debug, PartialEq)]
pub struct Sea {
    slope: f64,
    /// At every height of the view, along it: slopes, and shares of the light that facets of these reflect.
    rules: Vec<Rule>,
    mean: f64,
}

/// Nodes and weights.
type Rule = [[f64; 2]; FACETS[0]];

/// A facet of the rule that stands for all that a view sees.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Towards the viewer and across.
    pub slope: [f64; 2],
    /// Share of the light that reaches the eye, of light that is alike from everywhere above.
    pub weight: f64,
}

/// The sea that was asked for last: its tables take a fiftieth of a second, and every frame asks.
static KEPT: Mutex<Option<(f64, Arc<Sea>)>> = Mutex::new(None);

impl Sea {
    /// Under a wind of this speed, m/s.
    pub fn new(wind_speed: f64) -> Arc<Self> {
        let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, sea)) = kept.as_ref().filter(|(wind, _)| *wind == wind_speed) {
            return sea.clone();
        }
        let sea = Arc::new(Self::of_slope((CALM + OF_WIND * wind_speed).sqrt()));
        *kept = Some((wind_speed, sea.clone()));
        sea
    }

    /// Of this root mean square slope.
    fn of_slope(slope: f64) -> Self {
        let mut sea = Self { slope, rules: Vec::new(), mean: 0.0 };
        let height = |i: usize| (i as f64 / (HEIGHTS - 1) as f64).powi(2);
        sea.rules = (0..HEIGHTS).map(|i| gauss(&sea.seen_slopes(height(i), STEPS))).collect();
        for [along, _] in sea.rules.iter_mut().flatten() {
            *along *= slope;
        }
        // Of light that is alike from everywhere: over the cosine's square, by the midpoints of many steps.
        const MANY: u32 = 2048;
        let at = |i: u32| sea.reflectance(((f64::from(i) + 0.5) / f64::from(MANY)).sqrt());
        sea.mean = (0..MANY).map(at).sum::<f64>() / f64::from(MANY);
        sea
    }

    /// Root mean square slope.
    pub fn slope(&self) -> f64 {
        self.slope
    }

    /// Slopes along the view and shares of the reflected light, by the height of the view.
    pub fn rules(&self) -> &[Rule] {
        &self.rules
    }

    /// Share of light along a direction that is reflected.
    pub fn reflectance(&self, mu: f64) -> f64 {
        self.rule(mu).iter().map(|[_, weight]| weight).sum()
    }

    fn rule(&self, mu: f64) -> Rule {
        let place = mu.clamp(0.0, 1.0).sqrt() * (HEIGHTS - 1) as f64;
        let low = (place as usize).min(HEIGHTS - 2);
        let share = place - low as f64;
        let [a, b] = [&self.rules[low], &self.rules[low + 1]];
        std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + (b[i][j] - a[i][j]) * share))
    }

    /// The same of light that is alike from everywhere above.
    pub fn mean_reflectance(&self) -> f64 {
        self.mean
    }

    /// What a direction sees of a level square metre's facets, hidden ones left out, m2: the cosine over the share that is seen.
    pub fn seen_area(&self, mu: f64) -> f64 {
        let rough = (1.0 - mu * mu).max(LEAST_SINE * LEAST_SINE).sqrt() * self.slope;
        let a = mu / rough;
        mu * (1.0 - 0.5 * erfc(a)) + rough * (-a * a).exp() * (0.25 * FRAC_2_SQRT_PI)
    }

    /// Share of what facets that an eye sees send in a direction that is not stopped by another wave.
    pub fn free_share(&self, mu_view: f64, mu_light: f64) -> f64 {
        let [v, l] = [mu_view, mu_light].map(|mu| self.seen_area(mu));
        let both = mu_light * v + mu_view * l - mu_view * mu_light;
        if mu_light <= 0.0 { 0.0 } else { v * mu_light / both.max(LEAST_AREA) }
    }

    /// Radiance towards an eye of light from a direction that gives unit irradiance on a level surface, 1/sr: what is reflected.
    pub fn glitter(&self, normal: DVec3, view: DVec3, light: DVec3) -> f64 {
        let [mu_view, mu_light] = [view, light].map(|d| normal.dot(d));
        let facet = (view + light).normalize_or_zero();
        let up = normal.dot(facet);
        if mu_view <= 0.0 || mu_light <= 0.0 || up < LEAST_FACET {
            return 0.0;
        }
        let square = self.slope * self.slope;
        let density = (-(1.0 / (up * up) - 1.0) / square).exp() / (PI * square * up.powi(4));
        let [v, l] = [mu_view, mu_light].map(|mu| self.seen_area(mu));
        let both = (mu_light * v + mu_view * l - mu_view * mu_light).max(LEAST_AREA);
        0.25 * density * fresnel(view.dot(facet)) / both
    }

    /// Radiance towards an eye of the water below for albedo 1, over that of a Lambertian surface in the same light, where
    /// `entering` is the share of the light that is not reflected.
    pub fn below(&self, mu_view: f64, entering: f64) -> f64 {
        (1.0 - self.reflectance(mu_view)) * entering / (1.0 - self.mean)
    }

    /// Facets that together stand for those that a view sees: the nodes of Gauss's rule for what visible facets reflect freely, by
    /// their slope along the view, and of Hermite's across. The rule knows where light below the horizon would begin,
    /// which is where other rules are off most.
    pub fn facets(&self, mu: f64) -> impl Iterator<Item = Facet> + use<> {
        let slope = self.slope;
        self.rule(mu).into_iter().flat_map(move |[along, share]| {
            ACROSS.into_iter().map(move |(across, part)| Facet {
                slope: [along, slope * across],
                weight: share * part,
            })
        })
    }

    /// Direction in which a facet sends the view of an eye at this height, in the plane of the view, across it, and up.
    pub fn mirrored(mu: f64, [along, across]: [f64; 2]) -> (DVec3, f64) {
        let view = DVec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
        let facet = DVec3::new(along, across, 1.0).normalize();
        let cosine = view.dot(facet).max(0.0);
        (2.0 * cosine * facet - view, cosine)
    }

    /// Draws a facet among those that a view sees, as densely as it sees them: slopes towards the viewer and across.
    pub fn draw_facet(&self, mu: f64, mut unit: impl FnMut() -> f64) -> [f64; 2] {
        let rough = (1.0 - mu * mu).max(LEAST_SINE * LEAST_SINE).sqrt() * self.slope;
        let a = (mu / rough).max(0.0);
        // From exp(-t^2) (a + |t|), which is two parts that are drawn straight, rejected down to exp(-t^2) (a + t).
        let even = a * PI.sqrt() / (a * PI.sqrt() + 1.0);
        loop {
            let distance = (-(1.0 - unit()).ln()).sqrt();
            let (sin, cos) = (2.0 * PI * unit()).sin_cos();
            let across = distance * sin;
            let along = if unit() < even {
                distance * cos
            } else {
                (-(1.0 - unit()).ln()).sqrt().copysign(unit() - 0.5)
            };
            if unit() * (a + along.abs()) < a + along {
                return [self.slope * along, self.slope * across];
            }
        }
    }

    /// Slopes along the view over the root mean square one, and the share of the light that visible facets of about
    /// these reflect; in so many steps, and a twentieth of them across.
    fn seen_slopes(&self, mu: f64, steps: u32) -> Vec<[f64; 2]> {
        let rough = (1.0 - mu * mu).max(LEAST_SINE * LEAST_SINE).sqrt() * self.slope;
        let a = (mu / rough).max(0.0);
        let nearest = (-a).max(-FAR);
        let middle = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
        let rows = steps / ACROSS_STEPS;
        let across: f64 = (0..rows).map(|j| (-(FAR * middle(j, rows)).powi(2)).exp()).sum();
        let share = |i: u32| {
            let t = nearest + (FAR - nearest) * middle(i, steps);
            let visible = (-t * t).exp() * (a + t);
            let reflected = (0..rows).map(|j| {
                let u = FAR * middle(j, rows);
                let (light, cosine) = Self::mirrored(mu, [self.slope * t, self.slope * u]);
                (-u * u).exp() * fresnel(cosine) * self.free_share(mu, light.z)
            });
            [t, visible, visible * reflected.sum::<f64>() / across]
        };
        let all: Vec<_> = (0..steps).map(share).collect();
        let visible: f64 = all.iter().map(|[_, visible, _]| visible).sum();
        all.into_iter().map(|[t, _, reflected]| [t, reflected / visible]).collect()
    }

    /// Reflected share of light along a direction, without the table.
    pub fn reflected_share(&self, mu: f64) -> f64 {
        self.seen_slopes(mu, 2 * STEPS).iter().map(|[_, share]| share).sum()
    }
}

/// Slopes beyond so many root mean squares are not there in f32.
const FAR: f64 = 4.5;
/// Steps of the sums over slopes along the view, and how many of them there are for one across.
const STEPS: u32 = 480;
const ACROSS_STEPS: u32 = 20;

/// Gauss's rule for weights at places: the zeros of the polynomial that is orthogonal under them (Stieltjes's procedure), and
/// what of the weights belongs to each.
fn gauss(weights: &[[f64; 2]]) -> Rule {
    const N: usize = FACETS[0];
    let sum = |of: &dyn Fn(f64) -> f64| weights.iter().map(|[x, w]| w * of(*x)).sum::<f64>();
    let all = sum(&|_| 1.0);
    let (mut a, mut b) = ([0.0; N], [0.0; N]);
    // Of degree k, and its square sum; by the coefficients so far.
    let polynomial = |x: f64, k: usize, a: &[f64; N], b: &[f64; N]| {
        (0..k).fold([0.0, 1.0], |[before, now], i| [now, (x - a[i]) * now - b[i] * before])[1]
    };
    let mut squares = [all; N];
    for k in 0..N {
        squares[k] = sum(&|x| polynomial(x, k, &a, &b).powi(2));
        let mean = sum(&|x| x * polynomial(x, k, &a, &b).powi(2)) / squares[k];
        b[k] = if k > 0 { squares[k] / squares[k - 1] } else { 0.0 };
        a[k] = mean;
    }
    // Zeros lie between the outermost places, apart from each other: halved between changes of sign.
    let zero = |mut low: f64, mut high: f64| {
        let sign = polynomial(low, N, &a, &b).signum();
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if polynomial(middle, N, &a, &b).signum() == sign {
                low = middle
            } else {
                high = middle
            }
        }
        0.5 * (low + high)
    };
    let places = weights.windows(2).map(|pair| [pair[0][0], pair[1][0]]);
    let changes = |[low, high]: &[f64; 2]| {
        polynomial(*low, N, &a, &b).signum() != polynomial(*high, N, &a, &b).signum()
    };
    let mut zeros = places.filter(changes).map(|[low, high]| zero(low, high));
    std::array::from_fn(|_| {
        let x = zeros.next().unwrap_or(a[0]);
        let density: f64 = (0..N).map(|k| polynomial(x, k, &a, &b).powi(2) / squares[k]).sum();
        [x, 1.0 / density]
    })
}

/// Hermite's nodes, and weights over the root of pi (Abramowitz and Stegun, table 25.10).
const ACROSS: [(f64, f64); FACETS[1]] =
    [(-1.224_744_871_391_589, 1.0 / 6.0), (0.0, 2.0 / 3.0), (1.224_744_871_391_589, 1.0 / 6.0)];

#[cfg(test)]
#[path = "sea_tests.rs"]
mod tests;
