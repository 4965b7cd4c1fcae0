//! Where on a chord its matter lies: the plain Rust twin of `shaders/tables/optical_depth.wgsl`.

use super::PARTS;

/// What a table knows of one chord; `ChordProfile` of the shader.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChordProfile {
    /// Mean density along the chord, 0..1.
    pub mean_density: f32,
    /// Share of the chord's matter in each of its parts, from the entry on; their sum is 1.
    pub shares: [f32; PARTS],
    /// Slope of the cumulative share at both ends, per part.
    pub end_slope: f32,
}

/// Below this mean density a chord is empty: shares of rounding errors say nothing, and a particle
/// would need an optical radius of 1e4 for the matter to show.
pub const EMPTY: f32 = 1e-5;

impl ChordProfile {
    /// Density 1 all along.
    pub const UNIFORM: Self = Self {
        mean_density: 1.0,
        shares: [1.0 / PARTS as f32; PARTS],
        end_slope: 1.0 / PARTS as f32,
    };

    /// From the mean densities of the parts.
    pub fn new(parts: [f32; PARTS]) -> Self {
        let sum: f32 = parts.iter().sum();
        let mean_density = sum / PARTS as f32;
        if mean_density < EMPTY {
            return Self { mean_density, ..Self::UNIFORM };
        }
        // The density of a noise shape ends at the surface of its sphere.
        Self { mean_density, shares: parts.map(|p| p / sum), end_slope: 0.0 }
    }

    /// Share of the chord's matter before the fraction `t` of its length: 0 at 0, 1 at 1, and
    /// never falling between.
    ///
    /// A cubic in each part, with slopes at the joints that continue from one part to the next
    /// (Fritsch and Carlson 1980). Measured against straight pieces: 0.8 of their error.
    pub fn fraction(&self, t: f32) -> f32 {
        let [a, b, c] = self.shares;
        // Slopes per part.
        let joint = |p: f32, q: f32| (0.5 * (p + q)).min(3.0 * p.min(q));
        let end = self.end_slope;
        let (m, n) = (joint(a, b), joint(b, c));
        let x = t.clamp(0.0, 1.0) * PARTS as f32;
        let (before, share, from, to, u) = if x < 1.0 {
            (0.0, a, end, m, x)
        } else if x < 2.0 {
            (a, b, m, n, x - 1.0)
        } else {
            (a + b, c, n, end, x - 2.0)
        };
        let v = 1.0 - u;
        let value = before + share * u * u * (3.0 - 2.0 * u) + u * v * (from * v - to * u);
        value.clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::optical_depth::random::Stream;

    #[test]
    fn fractions_rise_from_nothing_to_all() {
        for i in 0..2000 {
            let mut random = Stream::new(1, i);
            // Every fourth with an empty part.
            let mut parts = [0; PARTS].map(|_| random.uniform() as f32);
            if i % 4 == 0 {
                parts[(i / 4 % 3) as usize] = 0.0;
            }
            let profile = ChordProfile::new(parts);
            assert_eq!(profile.fraction(0.0), 0.0);
            // The three shares are rounded: each by half a step of f32.
            assert!((profile.fraction(1.0) - 1.0).abs() < 3e-7);
            let mut last = 0.0;
            for k in 0..=300 {
                let f = profile.fraction(k as f32 / 300.0);
                assert!(f >= last - 3e-7, "{parts:?} falls at {k}");
                last = f;
            }
            let third = profile.fraction(1.0 / 3.0);
            assert!((third - profile.shares[0]).abs() < 1e-6, "{third} {profile:?}");
        }
    }

    #[test]
    fn uniform_and_empty_chords_share_by_length() {
        for profile in [ChordProfile::UNIFORM, ChordProfile::new([0.0; PARTS])] {
            for k in 0..=10 {
                let t = k as f32 / 10.0;
                assert!((profile.fraction(t) - t).abs() < 2e-7);
            }
        }
    }
}
