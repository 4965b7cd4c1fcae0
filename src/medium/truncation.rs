//! The forward peak of a phase function, set apart.
//!
//! A droplet sends about half of the light nearly straight on. Light that was scattered only so is
//! hardly to be told from light that was not scattered at all; what is left is a smooth phase
//! function over a thinner medium (delta-M scaling, Wiscombe 1977): of a phase function with
//! Legendre moments `p_l` the share `f = p_(N+1)` counts as not scattered, and
//! `(p_l - f) / (1 - f)`, `l <= N`, is left to be solved for. Here N is 2.

use super::Phase;

/// Moments that the smooth part keeps: 0 to this.
const DEGREE: usize = 2;

/// A phase function split into a forward peak and a smooth rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truncation {
    /// Share of the scattered light in the peak, 0 to 1.
    pub peak: f64,
    /// Legendre moments 1 and 2 of the rest.
    pub moments: [f64; DEGREE],
}

impl Truncation {
    /// Of a phase function. Where scattering is backward there is no peak.
    pub fn new(phase: &Phase) -> Self {
        let m = phase.legendre_moments(DEGREE + 2);
        // Below 1: a peak that holds all light would leave nothing to scatter.
        let peak = m[DEGREE + 1].clamp(0.0, 0.999);
        Self { peak, moments: [1, 2].map(|l| (m[l] - peak) / (1.0 - peak)) }
    }

    /// Without a peak: the moments are those of the whole, and nothing is scaled.
    pub fn none(phase: &Phase) -> Self {
        let m = phase.legendre_moments(DEGREE + 1);
        Self { peak: 0.0, moments: [1, 2].map(|l| m[l]) }
    }

    /// Extinction that is left, over the true one.
    pub fn scale(&self, albedo: f64) -> f64 {
        1.0 - albedo * self.peak
    }

    /// Albedo of the medium with that extinction.
    pub fn albedo(&self, albedo: f64) -> f64 {
        albedo * (1.0 - self.peak) / self.scale(albedo)
    }

    /// Optical depth of peak scatterings per scaled optical depth.
    pub fn peak_depth(&self, albedo: f64) -> f64 {
        albedo * self.peak / self.scale(albedo)
    }

    /// The rest, 1/sr.
    pub fn smooth(&self, cos_theta: f64) -> f64 {
        let [first, second] = self.moments;
        let c = cos_theta;
        (1.0 + 3.0 * first * c + 5.0 * second * (1.5 * c * c - 0.5)) / (4.0 * std::f64::consts::PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peak_and_rest_have_the_moments_of_the_whole() {
        for phase in [Phase::Hg { g: 0.85 }, Phase::Hg { g: 0.0 }, Phase::Mie { diameter_um: 12.0 }]
        {
            let t = Truncation::new(&phase);
            let m = phase.legendre_moments(3);
            for (whole, rest) in m[1..].iter().zip(t.moments) {
                let both = t.peak + (1.0 - t.peak) * rest;
                assert!((both - whole).abs() < 1e-12, "{phase}");
            }
            // Scaling keeps what is absorbed: (1 - albedo) times extinction.
            for albedo in [0.0, 0.7, 1.0] {
                let absorbed = (1.0 - t.albedo(albedo)) * t.scale(albedo);
                assert!((absorbed - (1.0 - albedo)).abs() < 1e-12);
            }
        }
        assert_eq!(Truncation::new(&Phase::Hg { g: -0.5 }).peak, 0.0);
        let whole = Truncation::none(&Phase::Hg { g: 0.8 });
        assert!((whole.moments[0] - 0.8).abs() < 1e-12 && (whole.moments[1] - 0.64).abs() < 1e-12);
        assert_eq!([whole.scale(1.0), whole.albedo(0.9), whole.peak_depth(1.0)], [1.0, 0.9, 0.0]);
    }
}
