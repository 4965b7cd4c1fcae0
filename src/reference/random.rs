//! Random numbers of the path tracer: one stream per (seed, pixel, round), so that a picture
//! depends on its seed and never on the number of threads.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A stream of uniform random numbers.
#[derive(Clone, Debug)]
pub struct Random(Xoshiro256PlusPlus);

impl Random {
    /// The stream of one purpose: the same numbers select the same stream.
    pub fn new(seed: u64, stream: u64, round: u64) -> Self {
        // `seed_from_u64` runs SplitMix64 over its argument, so neighbouring numbers are unrelated;
        // odd multipliers keep the three apart before that.
        let mixed = seed
            .wrapping_mul(0x9e37_79b9_7f4a_7c15)
            .wrapping_add(stream.wrapping_mul(0xd134_2543_de82_ef95))
            .wrapping_add(round.wrapping_mul(0xaf25_1af3_b0f0_25b5));
        Self(Xoshiro256PlusPlus::seed_from_u64(mixed))
    }

    /// Uniform in [0, 1): the upper 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (-53.0f64).exp2()
    }

    /// Exponentially distributed with mean 1; never infinite.
    pub fn exponential(&mut self) -> f64 {
        -(1.0 - self.unit()).ln()
    }
}
