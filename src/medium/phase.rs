//! Phase functions: how much light turns by which angle at one scattering.
//!
//! Two kinds, one code path. [`Phase::Hg`] is Henyey-Greenstein, for checks against published
//! numbers. [`Phase::Mie`] is the fit of Jendersie and d'Eon, "An Approximate Mie Scattering
//! Function for Fog and Cloud Rendering" (SIGGRAPH 2023 Talks), to water droplets: a narrow
//! Henyey-Greenstein lobe plus a lobe of Draine (2003). Both are a weighted sum of one
//! Henyey-Greenstein and one Draine lobe, so the GPU evaluates one formula without a branch, and
//! every moment has a closed form.

use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// Largest |g| that is accepted: beyond it f32 can no longer tell the lobe from a delta function.
pub const MAX_ABS_G: f64 = 0.999;
/// Droplet diameters in micrometres for which the fit of Jendersie and d'Eon was made.
pub const MIE_DIAMETER_UM: std::ops::RangeInclusive<f64> = 5.0..=50.0;

/// A phase function, normalised to 1 over all directions.
///
/// Text form, in scenes, on the command line and in table files: `hg:0.85` or `mie:20um`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Phase {
    /// Henyey-Greenstein.
    Hg {
        /// Mean cosine of the scattering angle, in -0.999..0.999.
        g: f64,
    },
    /// Water droplets of one diameter, Jendersie and d'Eon 2023.
    Mie {
        /// Diameter of the droplets, micrometres, in 5..50.
        diameter_um: f64,
    },
}

/// What the GPU needs to evaluate a [`Phase`]; `PhaseParams` in `shaders/medium/phase.wgsl`.
///
/// Each lobe is `scale / (base + slope * (1 - sign * cos))^1.5`: written with `1 - cos`, the
/// narrow peak keeps its digits in f32, which `1 + g^2 - 2 g cos` does not.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PhaseParams {
    /// Weight of the Henyey-Greenstein lobe times its numerator, 1/sr.
    pub hg_scale: f32,
    /// `(1 - |g|)^2` of the Henyey-Greenstein lobe.
    pub hg_base: f32,
    /// `2 |g|` of the Henyey-Greenstein lobe.
    pub hg_slope: f32,
    /// Sign of its g.
    pub hg_sign: f32,
    /// Weight of the Draine lobe times its numerator, 1/sr.
    pub draine_scale: f32,
    /// `(1 - g)^2` of the Draine lobe.
    pub draine_base: f32,
    /// `2 g` of the Draine lobe.
    pub draine_slope: f32,
    /// Weight of `cos^2` in the Draine lobe.
    pub draine_alpha: f32,
}

/// The two lobes of a phase function with their constants worked out: [`Phase::prepare`] makes it
/// once, then many evaluations and samples are cheap.
#[derive(Clone, Copy, Debug)]
pub struct PreparedPhase {
    hg_g: f64,
    /// Weight of the Draine lobe; the Henyey-Greenstein lobe has the rest.
    draine_weight: f64,
    draine_g: f64,
    draine_alpha: f64,
}

impl PreparedPhase {
    fn of(phase: &Phase) -> Self {
        match *phase {
            Phase::Hg { g } => {
                Self { hg_g: g, draine_weight: 0.0, draine_g: 0.0, draine_alpha: 0.0 }
            }
            // Equations 7 to 10 of the talk, for diameters of 5 to 50 micrometres.
            Phase::Mie { diameter_um: d } => Self {
                hg_g: (-0.0990567 / (d - 1.67154)).exp(),
                draine_weight: (-0.599085 / (d - 0.641583) - 0.665888).exp(),
                draine_g: (-2.20679 / (d + 3.91029) - 0.428934).exp(),
                draine_alpha: (3.62489 - 8.29288 / (d + 5.52825)).exp(),
            },
        }
    }

    /// Integral of `1 + alpha cos^2` over the lobe `HG(g)`: normalises Draine's function.
    fn draine_norm(&self) -> f64 {
        1.0 + self.draine_alpha * (1.0 + 2.0 * self.draine_g * self.draine_g) / 3.0
    }

    /// Value in 1/sr at the cosine of the scattering angle; see [`Phase::eval`].
    pub fn eval(&self, cos_theta: f64) -> f64 {
        let c = cos_theta.clamp(-1.0, 1.0);
        let draine = henyey_greenstein(self.draine_g, c) * (1.0 + self.draine_alpha * c * c)
            / self.draine_norm();
        (1.0 - self.draine_weight) * henyey_greenstein(self.hg_g, c) + self.draine_weight * draine
    }

    /// The Henyey-Greenstein lobe alone, if its mean cosine is at least this, forwards or
    /// backwards.
    pub fn narrow_lobe(&self, least: f64) -> Option<Self> {
        (self.hg_g.abs() >= least).then_some(Self { draine_weight: 0.0, ..*self })
    }

    /// The lobe of Draine alone, if there is one.
    pub fn broad_lobe(&self) -> Option<Self> {
        (self.draine_weight > 0.0).then_some(Self { draine_weight: 1.0, ..*self })
    }

    /// Share of scatterings that belong to the Henyey-Greenstein lobe.
    pub fn narrow_share(&self) -> f64 {
        1.0 - self.draine_weight
    }

    /// Cosine of a random scattering angle; see [`Phase::sample`].
    pub fn sample(&self, u_lobe: f64, u_angle: f64) -> f64 {
        if u_lobe < self.draine_weight {
            sample_draine(self, u_angle)
        } else {
            sample_henyey_greenstein(self.hg_g, u_angle)
        }
    }
}

/// Henyey-Greenstein, 1/sr.
fn henyey_greenstein(g: f64, cos_theta: f64) -> f64 {
    let a = g.abs();
    let turned = if g < 0.0 { -cos_theta } else { cos_theta };
    let d = (1.0 - a) * (1.0 - a) + 2.0 * a * (1.0 - turned).max(0.0);
    (1.0 - g * g) / (4.0 * PI * d * d.sqrt())
}

/// Cosine whose share of Henyey-Greenstein below it is `u`. Written so that g = 0 needs no branch.
fn sample_henyey_greenstein(g: f64, u: f64) -> f64 {
    let x = 2.0 * u - 1.0;
    let d = 1.0 + g * x;
    let n = 2.0 * x * (1.0 + g * g) + g * (3.0 - g * g + x * x * (1.0 + g * g));
    (n / (2.0 * d * d)).clamp(-1.0, 1.0)
}

impl Phase {
    /// Henyey-Greenstein with the mean cosine `g`, refused outside -0.999..0.999.
    pub fn hg(g: f64) -> Result<Self> {
        let phase = Self::Hg { g };
        phase.check().map(|()| phase)
    }

    /// Water droplets of a diameter in micrometres, refused outside 5..50.
    pub fn mie(diameter_um: f64) -> Result<Self> {
        let phase = Self::Mie { diameter_um };
        phase.check().map(|()| phase)
    }

    /// Whether the parameter lies in the range the formula is for.
    pub fn check(&self) -> Result<()> {
        match *self {
            Self::Hg { g } if !(-MAX_ABS_G..=MAX_ABS_G).contains(&g) => Err(Error::input(
                format!("phase function hg:{g}"),
                format!("expected a mean cosine between -{MAX_ABS_G} and {MAX_ABS_G}"),
            )),
            Self::Mie { diameter_um } if !MIE_DIAMETER_UM.contains(&diameter_um) => {
                Err(Error::input(
                    format!("phase function mie:{diameter_um}um"),
                    "expected a droplet diameter between 5 and 50 micrometres",
                ))
            }
            _ => Ok(()),
        }
    }

    /// Value in 1/sr at the cosine of the angle between light's directions of travel before and
    /// after.
    pub fn eval(&self, cos_theta: f64) -> f64 {
        self.prepare().eval(cos_theta)
    }

    /// Works out the constants of the lobes once, for many evaluations.
    pub fn prepare(&self) -> PreparedPhase {
        PreparedPhase::of(self)
    }

    /// Cosine of a random scattering angle, distributed as [`Self::eval`]: `u_lobe` picks the
    /// lobe and `u_angle` the angle, both uniform in 0..1.
    pub fn sample(&self, u_lobe: f64, u_angle: f64) -> f64 {
        self.prepare().sample(u_lobe, u_angle)
    }

    /// Mean cosine of the scattering angle.
    pub fn mean_cosine(&self) -> f64 {
        self.legendre_moments(2)[1]
    }

    /// The first `count` Legendre moments: integrals of the phase function times `P_l(cos)` over
    /// all directions; the first is 1, the second the mean cosine.
    pub fn legendre_moments(&self, count: usize) -> Vec<f64> {
        let l = PreparedPhase::of(self);
        let n = l.draine_norm();
        (0..count)
            .map(|order| {
                let o = order as f64;
                let h = |k: f64| l.draine_g.powf(k);
                // cos^2 P_o by applying cos P_o = ((o+1) P_(o+1) + o P_(o-1)) / (2o+1) twice.
                let up = (o + 1.0) * (o + 2.0) / ((2.0 * o + 1.0) * (2.0 * o + 3.0));
                let here = (o + 1.0).powi(2) / ((2.0 * o + 1.0) * (2.0 * o + 3.0))
                    + if order > 0 { o * o / ((2.0 * o + 1.0) * (2.0 * o - 1.0)) } else { 0.0 };
                let down = if order > 1 {
                    o * (o - 1.0) / ((2.0 * o + 1.0) * (2.0 * o - 1.0)) * h(o - 2.0)
                } else {
                    0.0
                };
                let squared = up * h(o + 2.0) + here * h(o) + down;
                let draine = (h(o) + l.draine_alpha * squared) / n;
                (1.0 - l.draine_weight) * l.hg_g.powi(order as i32) + l.draine_weight * draine
            })
            .collect()
    }

    /// Half-width in radians of the narrowest lobe, the scale a direction grid has to resolve.
    pub fn peak_angle(&self) -> f64 {
        1.0 - PreparedPhase::of(self).hg_g.abs()
    }

    /// The same function as the GPU evaluates it.
    pub fn gpu_params(&self) -> PhaseParams {
        let l = PreparedPhase::of(self);
        let numerator = |g: f64| (1.0 - g * g) / (4.0 * PI);
        let a = l.hg_g.abs();
        PhaseParams {
            hg_scale: ((1.0 - l.draine_weight) * numerator(l.hg_g)) as f32,
            hg_base: ((1.0 - a) * (1.0 - a)) as f32,
            hg_slope: (2.0 * a) as f32,
            hg_sign: if l.hg_g < 0.0 { -1.0 } else { 1.0 },
            draine_scale: (l.draine_weight * numerator(l.draine_g) / l.draine_norm()) as f32,
            draine_base: (1.0 - l.draine_g).powi(2) as f32,
            draine_slope: (2.0 * l.draine_g) as f32,
            draine_alpha: l.draine_alpha as f32,
        }
    }
}

impl PhaseParams {
    /// Twin of `phase_function` in `shaders/medium/phase.wgsl`, 1/sr.
    pub fn eval(&self, cos_theta: f32) -> f32 {
        let lobe = |base: f32, slope: f32, turned: f32| {
            let i = 1.0 / (base + slope * (1.0 - turned).max(0.0)).sqrt();
            i * i * i
        };
        self.hg_scale * lobe(self.hg_base, self.hg_slope, self.hg_sign * cos_theta)
            + self.draine_scale
                * (1.0 + self.draine_alpha * cos_theta * cos_theta)
                * lobe(self.draine_base, self.draine_slope, cos_theta)
    }
}

/// Inverts the cumulative distribution of Draine's function.
///
/// With `s = sqrt(1 + g^2 - 2 g cos)` the distribution is a short polynomial in s and 1/s. Newton
/// steps kept inside a shrinking bracket reach f64's precision; the published closed form of the
/// root loses it for small weights of `cos^2`.
fn sample_draine(l: &PreparedPhase, u: f64) -> f64 {
    let (g, alpha) = (l.draine_g, l.draine_alpha);
    let q = 1.0 + g * g;
    let four_g2 = 4.0 * g * g;
    // Antiderivative over s of (1 + alpha cos^2) / s^2.
    let antiderivative =
        |s: f64| -1.0 / s + alpha / four_g2 * (-q * q / s - 2.0 * q * s + s * s * s / 3.0);
    let density = |s: f64| {
        let c = (q - s * s) / (2.0 * g);
        (1.0 + alpha * c * c) / (s * s)
    };
    // s falls from 1 + g (backwards) to 1 - g (forwards) as the cosine rises.
    let (mut low, mut high) = (1.0 - g, 1.0 + g);
    let (at_low, at_high) = (antiderivative(low), antiderivative(high));
    let wanted = at_high - u.clamp(0.0, 1.0) * (at_high - at_low);
    let mut s = 0.5 * (low + high);
    for _ in 0..60 {
        let excess = antiderivative(s) - wanted;
        if excess > 0.0 {
            high = s
        } else {
            low = s
        }
        let newton = s - excess / density(s);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        let step = (next - s).abs();
        s = next;
        // The digits double with every step.
        if step < 1e-8 {
            break;
        }
    }
    ((q - s * s) / (2.0 * g)).clamp(-1.0, 1.0)
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hg { g } => write!(f, "hg:{g}"),
            Self::Mie { diameter_um } => write!(f, "mie:{diameter_um}um"),
        }
    }
}

impl FromStr for Phase {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let number = |digits: &str| digits.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let parsed = match text.trim().split_once(':') {
            // Adding zero turns -0 into 0, so that one function has one name.
            Some(("hg", g)) => number(g).map(|g| Self::Hg { g: g + 0.0 }),
            Some(("mie", d)) => d
                .trim()
                .strip_suffix("um")
                .and_then(number)
                .map(|diameter_um| Self::Mie { diameter_um }),
            _ => None,
        };
        let phase = parsed.ok_or_else(|| {
            let shown: String = text.chars().take(40).collect();
            Error::input(
                format!("phase function \"{shown}\""),
                "expected hg:G with a mean cosine, as in hg:0.85, \
                 or mie:Dum with a droplet diameter in micrometres, as in mie:20um",
            )
        })?;
        phase.check().map(|()| phase)
    }
}

impl TryFrom<String> for Phase {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl From<Phase> for String {
    fn from(phase: Phase) -> Self {
        phase.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<Phase> {
        [
            "hg:0", "hg:0.5", "hg:0.85", "hg:-0.6", "hg:0.99", "mie:5um", "mie:10um", "mie:20um",
            "mie:50um",
        ]
        .iter()
        .map(|t| t.parse().expect(t))
        .collect()
    }

    /// Integral over the sphere of `f(cos) * p(cos)`, graded towards both poles: with
    /// 1 - cos = 2 x^4 the narrowest peak (1e-5 wide in 1 - cos) covers a twentieth of the nodes.
    fn integrate(phase: &Phase, f: impl Fn(f64) -> f64) -> f64 {
        const N: usize = 20_000;
        let half = |sign: f64| -> f64 {
            (0..N)
                .map(|i| {
                    let x = (i as f64 + 0.5) / N as f64;
                    let c = sign * (1.0 - x.powi(4));
                    2.0 * PI * phase.eval(c) * f(c) * 4.0 * x.powi(3) / N as f64
                })
                .sum()
        };
        half(1.0) + half(-1.0)
    }

    #[test]
    fn integrates_to_one_with_the_stated_moments() {
        for phase in all() {
            let moments = phase.legendre_moments(4);
            let p2 = |c: f64| 1.5 * c * c - 0.5;
            let p3 = |c: f64| 2.5 * c * c * c - 1.5 * c;
            // The midpoint rule on this graded grid is good to 1e-6 for the narrowest lobe.
            assert!((integrate(&phase, |_| 1.0) - 1.0).abs() < 1e-5, "{phase}");
            assert!((integrate(&phase, |c| c) - phase.mean_cosine()).abs() < 1e-5, "{phase}");
            assert!((integrate(&phase, p2) - moments[2]).abs() < 1e-5, "{phase}");
            assert!((integrate(&phase, p3) - moments[3]).abs() < 1e-5, "{phase}");
        }
    }

    #[test]
    fn mie_fit_has_the_asymmetry_of_cloud_droplets() {
        // Water clouds in visible light: asymmetry 0.83 to 0.88, rising with the droplets' size.
        let g: Vec<f64> = [5.0, 10.0, 20.0, 50.0]
            .iter()
            .map(|&d| Phase::mie(d).expect("in range").mean_cosine())
            .collect();
        assert!(g.iter().all(|g| (0.78..0.90).contains(g)), "{g:?}");
        assert!(g.windows(2).all(|w| w[0] < w[1]), "{g:?}");
    }

    #[test]
    fn samples_follow_the_density() {
        // Stratified samples in both variables: the empirical distribution function then differs
        // from the exact one by at most a few strata.
        const N: usize = 400;
        for phase in all() {
            let mut cosines: Vec<f64> = (0..N * N)
                .map(|k| {
                    phase.sample(
                        ((k % N) as f64 + 0.5) / N as f64,
                        ((k / N) as f64 + 0.5) / N as f64,
                    )
                })
                .collect();
            cosines.sort_by(f64::total_cmp);
            for limit in [-0.9, -0.5, 0.0, 0.3, 0.8, 0.95, 0.99, 0.999] {
                let below = cosines.partition_point(|c| *c < limit) as f64 / (N * N) as f64;
                let exact = integrate(&phase, |c| if c < limit { 1.0 } else { 0.0 });
                assert!((below - exact).abs() < 4.0 / N as f64, "{phase} {limit}: {below} {exact}");
            }
        }
    }

    #[test]
    fn gpu_form_equals_the_exact_one() {
        for phase in all() {
            let params = phase.gpu_params();
            for i in 0..=2000 {
                let c = (i as f32 / 1000.0 - 1.0).clamp(-1.0, 1.0);
                let (gpu, exact) = (f64::from(params.eval(c)), phase.eval(f64::from(c)));
                // A handful of f32 operations, raised to the power 1.5.
                assert!((gpu / exact - 1.0).abs() < 4e-6, "{phase} at {c}: {gpu} {exact}");
            }
        }
    }

    #[test]
    fn text_form_round_trips() {
        for phase in all() {
            assert_eq!(phase.to_string().parse::<Phase>().expect("own text"), phase);
            let json = serde_json::to_string(&phase).expect("serialisable");
            assert_eq!(serde_json::from_str::<Phase>(&json).expect("own json"), phase);
        }
    }

    #[test]
    fn bad_text_is_refused_with_a_sentence() {
        for bad in [
            "",
            "hg",
            "hg:",
            "hg:x",
            "hg:1",
            "hg:-1",
            "hg:NaN",
            "hg:inf",
            "mie:20",
            "mie:4um",
            "mie:51um",
            "mie:um",
            "rayleigh:1",
        ] {
            let error = bad.parse::<Phase>().expect_err(bad).to_string();
            assert!(error.starts_with("phase function") && error.contains("expected"), "{error}");
        }
    }
}
