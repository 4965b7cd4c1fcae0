//! Twin of `shaders/shared/octaves.wgsl`, where the method is told.

use super::lighting::mean_sunlight;

/// How many.
pub const OCTAVES: usize = 8;
/// From one to the next.
const OCTAVE: f64 = 0.5;
/// Least square of a distance on the unit circle, as in the shader.
const LEAST_BASE: f64 = 1e-12;

/// What each octave's extinction and scattering are over the true ones.
pub fn shares() -> [f64; OCTAVES] {
    std::array::from_fn(|i| OCTAVE.powi(i as i32))
}

/// Phase function of Henyey and Greenstein, 1/sr.
pub fn henyey_greenstein(cosine: f64, mean_cosine: f64) -> f64 {
    let g = mean_cosine;
    let base = ((1.0 - g).powi(2) + 2.0 * g * (1.0 - cosine)).max(LEAST_BASE);
    (1.0 - g * g) / (base.powf(1.5) * 4.0 * std::f64::consts::PI)
}

/// Sources of the octaves in undimmed sunlight, 1/sr; `first`: that of order 1.
pub fn octave_sources(first: f64, cosine: f64, mean_cosine: f64, albedo: f64) -> [f64; OCTAVES] {
    let mut sources =
        shares().map(|share| albedo * share * henyey_greenstein(cosine, mean_cosine * share));
    sources[0] = first;
    sources
}

/// Source of all octaves in a piece of optical depth `tau` where the depth to the sun goes from `front` to `back`.
pub fn octave_sunlight(sources: &[f64; OCTAVES], front: f64, back: f64, tau: f64) -> f64 {
    let of =
        |(source, share): (&f64, f64)| source * mean_sunlight(share * front, share * back, tau);
    sources.iter().zip(shares()).map(of).sum()
}

/// What comes through a depth of light from all sides, in all octaves, over the same without matter.
pub fn octave_transmittance(depth: f64) -> f64 {
    let all: f64 = shares().iter().sum();
    shares().iter().map(|share| share * (-share * depth).exp()).sum::<f64>() / all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every octave scatters its share of the light: the integral of its phase function is 1.
    #[test]
    fn octaves_scatter_their_shares() {
        let steps = 200_000;
        let mean = |f: &dyn Fn(f64) -> f64| {
            let at = |i: u32| f(-1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(steps));
            4.0 * std::f64::consts::PI * (0..steps).map(at).sum::<f64>() / f64::from(steps)
        };
        for (i, share) in shares().into_iter().enumerate().skip(1) {
            let found = mean(&|cosine| octave_sources(0.0, cosine, 0.9, 0.7)[i]);
            assert!((found / (0.7 * share) - 1.0).abs() < 1e-6, "{i}: {found}");
        }
        assert_eq!(octave_sources(3.0, 0.2, 0.9, 0.7)[0], 3.0);
    }

    #[test]
    fn light_from_all_sides_fades() {
        assert!((octave_transmittance(0.0) - 1.0).abs() < 1e-15);
        let depths = [0.1, 1.0, 10.0, 100.0].map(octave_transmittance);
        assert!(depths.windows(2).all(|pair| pair[0] > pair[1]), "{depths:?}");
        // By hand, the last three octaves: (exp(-100/32) / 32 + exp(-100/64) / 64 + exp(-100/128) / 128) / 1.992.
        assert!((depths[3] - 0.00419).abs() < 1e-4, "{depths:?}");
    }
}
