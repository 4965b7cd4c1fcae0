//! Where on a chord its matter lies: the plain Rust twin of `shaders/tables/optical_depth.wgsl`.
//!
//! Two answers. [`ChordProfile`] is the good one: the mean density and the densities in the middle
//! of [`BINS`] equal parts of the chord, so that any part is answered; they come from a march
//! through the density volume. [`ChordStep`] is the quick one: two fetches from the 4D table.
//!
//! Measured with the exact whole on random parts of chords at central optical depth 10,
//! `pyroclastic-1`, RMS of transmittance: shared by length 0.149; one smooth step with the first
//! two moments 0.051; exact mean densities of 4 equal parts joined by cubics 0.046, of 6 0.028, of
//! 8 0.018, of 12 0.009, without joining 0.062, 0.040, 0.028 and 0.015; samples of the density in
//! place of exact means, not joined, 8: 0.035, 12: 0.018, 20: 0.008. A density ends at 0 at both ends of its chord, so that evenly spaced samples
//! integrate it far better than their number suggests, and parts need that number anyway.
//!
//! The blend asks for shares several times a chord, and packs the bins for that: words that hold
//! three of them in 7 bits and the sum of all before take a dozen integer operations to answer.
//! That moves shares by less than 0.006 ([`PACKING`]); the figures that a table file records are
//! without it, and it adds nothing to their third digit. Kept in memory that is indexed, or as
//! plain bytes that are summed with weights, they made the whole blend half as slow again.

use glam::{Vec3, Vec4};

use super::volume::DensityVolume;

/// Equal parts of a chord whose densities a profile holds.
pub const BINS: usize = 21;
/// Largest error of a share by packing bins to 7 bits in the shader: half of 1/113 of the largest
/// bin each, for half of the bins, where one of them holds all matter.
pub const PACKING: f32 = 0.006;

/// How the matter of one chord is spread; what `ChordProfile` of the shader holds in packed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChordProfile {
    /// Mean density along the chord, 0..1.
    pub mean_density: f32,
    /// Densities of the bins from the entry on.
    pub bins: [f32; BINS],
}

/// The mean density of a chord, and where its matter begins and ends; `ChordStep` of the shader.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChordStep {
    /// Mean density along the chord, 0..1.
    pub mean_density: f32,
    /// Where its matter begins, as a fraction of the length from the entry on.
    pub start: f32,
    /// One over the fraction of the length that its matter takes.
    pub inverse_extent: f32,
    /// 0 where the matter is spread evenly there, 1 where it follows a smooth step.
    pub smoothness: f32,
}

/// Least fraction of a chord's length that its matter takes: at least two bins see it.
pub const LEAST_EXTENT: f32 = 0.1;

impl ChordProfile {
    /// Density 1 all along.
    pub const UNIFORM: Self = Self { mean_density: 1.0, bins: [1.0; BINS] };

    /// From the density by fraction of the length.
    fn of(density: impl Fn(f32) -> f32) -> Self {
        let bins = std::array::from_fn(|bin| density((bin as f32 + 0.5) / BINS as f32));
        Self { mean_density: bins.iter().sum::<f32>() / BINS as f32, bins }
    }

    /// By a march through the density volume between two points of the unit sphere.
    pub fn march(volume: &DensityVolume, entry: Vec3, exit: Vec3) -> Self {
        Self::of(|t| volume.density(entry + t * (exit - entry)))
    }

    /// Share of the chord's matter before the fraction `t` of its length: 0 at 0, 1 at 1, and
    /// never falling between. Where there is no matter, it is the share of the length.
    pub fn fraction(&self, t: f32) -> f32 {
        let total = self.mean_density * BINS as f32;
        if total <= 0.0 {
            return t;
        }
        let place = t * BINS as f32;
        let bin = (place as usize).min(BINS - 1);
        let before: f32 = self.bins[..bin].iter().sum();
        // The mean is rounded: at the end the quotient may miss 1 by a rounding.
        ((before + (place - bin as f32) * self.bins[bin]) / total).min(1.0)
    }
}

impl ChordStep {
    /// Density 1 all along.
    pub const UNIFORM: Self =
        Self { mean_density: 1.0, start: 0.0, inverse_extent: 1.0, smoothness: 0.0 };

    /// From the channels of a table; `reversed` where its chord runs the other way.
    pub(super) fn decode(channels: Vec4, reversed: bool) -> Self {
        let [root, first, last, _] = channels.to_array();
        let (start, end) = if reversed { (1.0 - last, 1.0 - first) } else { (first, last) };
        // Keeps the step inside the chord where its extent is widened to the least.
        let start = start.min(1.0 - LEAST_EXTENT);
        Self {
            mean_density: root * root,
            start,
            inverse_extent: 1.0 / (end - start).max(LEAST_EXTENT),
            smoothness: 1.0,
        }
    }

    /// Share of the chord's matter before the fraction `t` of its length: 0 at 0, 1 at 1, and
    /// never falling between.
    pub fn fraction(&self, t: f32) -> f32 {
        let x = ((t - self.start) * self.inverse_extent).clamp(0.0, 1.0);
        let smooth = x * x * (3.0 - 2.0 * x);
        x + self.smoothness * (smooth - x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::optical_depth::random::Stream;

    /// Channels of a texel; interpolation can bring start and end together, or past each other.
    fn random_channels(i: u64) -> Vec4 {
        let mut random = Stream::new(1, i);
        let mut number = || random.uniform() as f32;
        let (a, b) = (number(), number());
        let (start, end) = if i.is_multiple_of(4) { (a, b) } else { (a.min(b), a.max(b)) };
        Vec4::new(number(), start, end, 0.0)
    }

    /// Noise; some places are empty.
    fn random_profile(i: u64, reversed: bool) -> ChordProfile {
        ChordProfile::of(|t| {
            let t = if reversed { 1.0 - t } else { t };
            let x = Stream::new(i, (t * BINS as f32) as u64).uniform() as f32;
            (2.0 * x - 1.0).max(0.0)
        })
    }

    #[test]
    fn fractions_rise_from_nothing_to_all() {
        for profile in (0..500).map(|i| random_profile(i, false)) {
            assert_eq!(profile.fraction(0.0), 0.0);
            // One over the sum is rounded.
            assert!((profile.fraction(1.0) - 1.0).abs() < 1e-6, "{profile:?}");
            let mut last = 0.0;
            for k in 0..=300 {
                let f = profile.fraction(k as f32 / 300.0);
                // A product of rounded numbers may fall by a step.
                assert!(f >= last - 2e-7, "{profile:?} falls at {k}");
                last = f;
            }
        }
        for i in 0..2000 {
            let step = ChordStep::decode(random_channels(i), i % 2 == 0);
            assert!(step.start >= -1e-6 && step.start + 1.0 / step.inverse_extent <= 1.0 + 1e-5);
            assert_eq!(step.fraction(0.0), 0.0);
            assert!((step.fraction(1.0) - 1.0).abs() < 1e-5, "{step:?}");
        }
    }

    #[test]
    fn reversed_chords_have_the_rest() {
        for i in (1..100).filter(|i| i % 4 != 0) {
            let channels = random_channels(i);
            if channels.z - channels.y < LEAST_EXTENT {
                continue;
            }
            let (there, back) =
                (ChordStep::decode(channels, false), ChordStep::decode(channels, true));
            let profiles = (random_profile(i, false), random_profile(i, true));
            for k in 0..=20 {
                let t = k as f32 / 20.0;
                assert!((there.fraction(t) + back.fraction(1.0 - t) - 1.0).abs() < 1e-5);
                let sum = profiles.0.fraction(t) + profiles.1.fraction(1.0 - t);
                assert!((sum - 1.0).abs() < 1e-5, "{sum}");
            }
        }
    }

    #[test]
    fn uniform_chords_share_by_length() {
        assert_eq!(ChordProfile::of(|_| 0.0).fraction(0.3), 0.3);
        assert!((ChordProfile::of(|t| 1e-3 * t).fraction(1.0) - 1.0).abs() < 1e-6);
        for k in 0..=10 {
            let t = k as f32 / 10.0;
            assert!((ChordProfile::UNIFORM.fraction(t) - t).abs() < 1e-6);
            assert_eq!(ChordStep::UNIFORM.fraction(t), t);
        }
    }
}
