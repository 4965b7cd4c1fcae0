//! Random numbers of the photon tracer: PCG32 (O'Neill 2014), small and quick, one stream a batch.

/// A PCG32 generator.
pub struct Random {
    state: u64,
    increment: u64,
}

impl Random {
    /// The generator of a stream; streams are independent sequences.
    pub fn new(stream: u64) -> Self {
        let mut random = Self { state: 0, increment: (stream << 1) | 1 };
        random.bits();
        random.state = random.state.wrapping_add(0x853c_49e6_748f_ea9b);
        random.bits();
        random
    }

    /// 32 random bits.
    pub fn bits(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let shifted = (((old >> 18) ^ old) >> 27) as u32;
        shifted.rotate_right((old >> 59) as u32)
    }

    /// Uniform in 0..1, 1 excluded.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 * (1.0 / (1 << 24) as f32)
    }
}
