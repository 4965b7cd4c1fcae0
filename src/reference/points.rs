//! Points that fill the square evenly: Sobol's first two dimensions with Owen's scrambling by
//! hashes (Burley 2020, "Practical Hash-based Owen Scrambling"). Each use of them (place on the
//! pixel, place on the lens, time) has its own scrambling and its own order, so uses are
//! independent of each other and of other pixels, and any number of points can be asked for.

/// The scrambled points of one use in one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Points {
    order: u32,
    scramble: [u32; 2],
}

/// 2^-32.
const UNIT: f64 = 1.0 / 4_294_967_296.0;

/// Steele, Lea and Flood's mixing of SplitMix64 (2014).
fn mixed(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A hash under which a bit depends on lower ones only: Laine and Karras (2011), with Vegdahl's
/// constants (2021), which avalanche better than the first ones.
fn hash_upwards(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Owen's nested uniform scrambling.
fn scrambled(x: u32, seed: u32) -> u32 {
    hash_upwards(x.reverse_bits(), seed).reverse_bits()
}

/// Sobol's second dimension; the first is van der Corput's sequence.
fn second_dimension(mut index: u32) -> u32 {
    let (mut direction, mut x) = (1u32 << 31, 0);
    while index != 0 {
        if index & 1 != 0 {
            x ^= direction;
        }
        index >>= 1;
        direction ^= direction >> 1;
    }
    x
}

impl Points {
    /// The points of a seed, a pixel and a use.
    pub fn new(seed: u64, pixel: u64, purpose: u64) -> Self {
        // Odd multipliers keep the three apart before they are mixed.
        let key = seed
            .wrapping_mul(0x9e37_79b9_7f4a_7c15)
            .wrapping_add(pixel.wrapping_mul(0xd134_2543_de82_ef95))
            .wrapping_add(purpose.wrapping_mul(0xaf25_1af3_b0f0_25b5));
        let (a, b) = (mixed(key), mixed(key ^ 0x6a09_e667_f3bc_c908));
        Self { order: a as u32, scramble: [(a >> 32) as u32, b as u32] }
    }

    /// A point of the unit square.
    pub fn at(&self, index: u32) -> [f64; 2] {
        // Runs of 2^k indices become other runs of 2^k: a random order that stays even.
        let index = scrambled(index, self.order);
        let bits = [index.reverse_bits(), second_dimension(index)];
        [0, 1].map(|axis| f64::from(scrambled(bits[axis], self.scramble[axis])) * UNIT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each run of 2^k points, from any multiple of 2^k on, has one point in every elementary
    /// rectangle of area 2^-k: what makes it a (0, 2)-sequence, kept by Owen's scrambling.
    #[test]
    fn every_elementary_rectangle_has_its_point() {
        for seed in 0..8 {
            let points = Points::new(seed, 12_345, 1);
            for log in [1u32, 4, 8] {
                let count = 1u32 << log;
                for first in [0, count, 6 * count] {
                    for across in 0..=log {
                        let (columns, rows) = (1u32 << across, 1u32 << (log - across));
                        let mut hits = vec![0; count as usize];
                        for index in first..first + count {
                            let [x, y] = points.at(index);
                            let column = (x * f64::from(columns)) as u32;
                            let row = (y * f64::from(rows)) as u32;
                            hits[(row * columns + column) as usize] += 1;
                        }
                        assert!(hits.iter().all(|&h| h == 1), "{seed} {count} {first} {across}");
                    }
                }
            }
        }
    }

    /// The n-th point of many pixels is uniform, and independent of the next use's.
    #[test]
    fn pixels_and_uses_are_independent() {
        const PIXELS: u64 = 64_000;
        const CELLS: usize = 8;
        for index in [0, 1, 7] {
            let mut counts = [0u32; CELLS * CELLS];
            for pixel in 0..PIXELS {
                let [x, _] = Points::new(5, pixel, 0).at(index);
                let [_, y] = Points::new(5, pixel, 1).at(index);
                let cell = |u: f64| (u * CELLS as f64) as usize;
                counts[cell(y) * CELLS + cell(x)] += 1;
            }
            let expected = PIXELS as f64 / (CELLS * CELLS) as f64;
            let chi: f64 = counts.iter().map(|&n| (f64::from(n) - expected).powi(2)).sum();
            // 63 degrees of freedom: mean 63, standard deviation 11.2; this is 5 of them.
            assert!(chi / expected < 63.0 + 5.0 * 11.2, "{index}: {}", chi / expected);
        }
    }
}
