//! Random numbers that depend on a counter only, so that any thread can make any of them.

/// A short stream of random numbers of its own for every (seed, counter).
#[derive(Clone, Copy, Debug)]
pub struct Stream(u64);

/// 2^64 over the golden ratio, odd: the step of SplitMix64 (Steele, Lea and Flood 2014).
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

impl Stream {
    /// The stream of a counter.
    pub fn new(seed: u64, counter: u64) -> Self {
        Self(mix(mix(seed.wrapping_add(STEP)) ^ counter.wrapping_mul(STEP)))
    }

    /// The next number, uniform in 0..1.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(STEP);
        // 53 bits fill the mantissa.
        (mix(self.0) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// A point uniformly distributed on the unit sphere.
    pub fn on_sphere(&mut self) -> glam::DVec3 {
        let z = 2.0 * self.uniform() - 1.0;
        let azimuth = std::f64::consts::TAU * self.uniform();
        let r = (1.0 - z * z).max(0.0).sqrt();
        glam::DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
    }
}

/// SplitMix64's finaliser.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
