//! What becomes of files: cut, flipped, spliced, mistyped. Always the same.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What readers stumble over: numbers at the ends of types, brackets, quotes, other spellings.
const PIECES: &[&str] = &[
    "nan",
    "inf",
    "-inf",
    "1e999",
    "-1e-999",
    "1e308",
    "-0.0",
    "0x7f",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "4294967296",
    "1e7",
    "null",
    "true",
    "\"\"",
    "\"\\u0000\"",
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "[[[[[[[[",
    "{\"a\":{\"a\":{\"a\":",
    ",",
    ":",
    "=",
    ".",
    "#",
    "\n",
    "\r",
    "\t",
    "\0",
    "\u{feff}",
    "\u{202e}",
    "é",
    "'''",
    "\"\"\"",
    "\\",
    "1979-05-27",
    "data_offsets",
    "shape",
    "dtype",
    "radius",
    "particles",
    "keys",
    "rays",
];
/// Most changes to an input.
const MOST_CHANGES: u64 = 4;
/// Longest piece that is repeated.
const LONGEST: u64 = 200;

/// Makes damaged inputs of sound ones.
pub struct Damage {
    seeds: Vec<Vec<u8>>,
    random: Xoshiro256PlusPlus,
}

impl Damage {
    pub fn new(seeds: Vec<Vec<u8>>) -> Self {
        Self { seeds, random: Xoshiro256PlusPlus::seed_from_u64(9) }
    }

    fn below(&mut self, n: u64) -> usize {
        (self.random.next_u64() % n.max(1)) as usize
    }

    fn place(&mut self, input: &[u8]) -> usize {
        self.below(input.len() as u64 + 1)
    }

    fn seed(&mut self) -> Vec<u8> {
        let index = self.below(self.seeds.len() as u64);
        self.seeds[index].clone()
    }

    pub fn input(&mut self) -> Vec<u8> {
        let mut input = self.seed();
        for _ in 0..=self.below(MOST_CHANGES) {
            self.change(&mut input);
        }
        input
    }

    fn change(&mut self, input: &mut Vec<u8>) {
        let at = self.place(input);
        let end = (at + 1 + self.below(LONGEST)).min(input.len());
        match self.below(10) {
            // A bit, a byte.
            0 if at < input.len() => input[at] ^= 1 << self.below(8),
            1 if at < input.len() => input[at] = self.below(256) as u8,
            // Cut: the end, a piece.
            2 => input.truncate(at),
            3 => drop(input.drain(at..end)),
            // A piece again, or somewhere else.
            4 => {
                let piece = input[at..end].to_vec();
                let to = self.place(input);
                drop(input.splice(to..to, piece));
            }
            // Another input's end.
            5 => {
                let other = self.seed();
                let from = self.place(&other);
                input.truncate(at);
                input.extend_from_slice(&other[from..]);
            }
            6 => {
                let piece = PIECES[self.below(PIECES.len() as u64)];
                drop(input.splice(at..at, piece.bytes()));
            }
            // A digit in place of another: values change, the form stays.
            7 | 8 => {
                let mut digits = input.iter().enumerate().skip(at).take(200);
                if let Some((i, _)) = digits.find(|(_, b)| b.is_ascii_digit()) {
                    input[i] = b'0' + self.below(10) as u8;
                }
            }
            // A whole number gives way to something else.
            _ => {
                let starts = |i: &usize| input[*i].is_ascii_digit();
                if let Some(first) = (at..input.len()).take(200).find(starts) {
                    let more = input[first..].iter().take_while(|b| b.is_ascii_digit()).count();
                    let piece = PIECES[self.below(PIECES.len() as u64)];
                    drop(input.splice(first..first + more, piece.bytes()));
                }
            }
        }
    }
}
