//! Where inside its unit sphere a particle has matter: the density D(x) in 0..1.
//!
//! D is *defined* as a density volume of [`VOLUME_NODES`]^3 values with trilinear filtering,
//! filled once from a noise formula. The bake, the path tracer and a shader then integrate the very same
//! function, quickly; a formula evaluated directly would differ from its filtered copy by more
//! than the tables' errors, and costs four octaves of noise a sample. The values are rounded to
//! 8 bits, and these to half floats, so that a file of bytes and a texture of half floats are the
//! same function too.
//!
//! Two kinds of noise shape. *Soft*: a metaball falloff plus fractal noise through a soft
//! threshold: wisps and rags. *Pyroclastic*: billowy noise (sums of |Perlin|, round bulges between
//! sharp creases) displaces the radius: the cauliflower tops of cumulus.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;
use noise::{NoiseFn, Perlin};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::bricks::Bricks;
use crate::error::{Error, Result};

/// Nodes along each edge of the density volume, which spans the cube -1..1.
pub const VOLUME_NODES: usize = 64;
/// Length of a cell of the density volume, in radii.
pub const VOLUME_CELL: f64 = 2.0 / (VOLUME_NODES - 1) as f64;
/// The byte that stands for density 1.
const VOLUME_FULL: f32 = 255.0;
/// Version of the formulas below; part of every table's parameters, so that a table baked from
/// other formulas is not taken for a fresh one.
pub const FORMULA_VERSION: u32 = 2;

/// The byte that holds a density.
pub fn volume_byte(density: f32) -> u8 {
    (density * VOLUME_FULL).round() as u8
}

/// The density that a byte holds.
pub fn volume_density(byte: u8) -> half::f16 {
    half::f16::from_f32(f32::from(byte) / VOLUME_FULL)
}

/// Octaves of noise: the finest has 2 to 3 volume cells a wavelength's half, finer would alias.
const OCTAVES: usize = 4;

/// How a shape's density comes from noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ShapeKind {
    /// D = 1 everywhere in the unit sphere; for checks, it needs no table.
    Uniform,
    /// Radial falloff plus fractal noise, through a soft threshold.
    Soft,
    /// Billowy noise displaces the radius.
    Pyroclastic,
}

/// Kind and seed of a shape; its name is `uniform`, `soft-7` or `pyroclastic-3`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct ShapeSpec {
    /// How the density comes from noise.
    pub kind: ShapeKind,
    /// Seed of the noise; 0 for [`ShapeKind::Uniform`].
    pub seed: u32,
}

impl ShapeSpec {
    /// D = 1 everywhere.
    pub const UNIFORM: Self = Self { kind: ShapeKind::Uniform, seed: 0 };
}

impl fmt::Display for ShapeSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind {
            ShapeKind::Uniform => write!(f, "uniform"),
            ShapeKind::Soft => write!(f, "soft-{}", self.seed),
            ShapeKind::Pyroclastic => write!(f, "pyroclastic-{}", self.seed),
        }
    }
}

impl FromStr for ShapeSpec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if text == "uniform" {
            return Ok(Self::UNIFORM);
        }
        let parsed = text.rsplit_once('-').and_then(|(kind, seed)| {
            let kind = match kind {
                "soft" => ShapeKind::Soft,
                "pyroclastic" => ShapeKind::Pyroclastic,
                _ => return None,
            };
            let seed: u32 = seed.parse().ok()?;
            // Only the canonical spelling: one shape has one name.
            (seed.to_string() == text.rsplit_once('-')?.1).then_some(Self { kind, seed })
        });
        parsed.ok_or_else(|| {
            let shown: String = text.chars().take(40).collect();
            Error::input(
                format!("shape \"{shown}\""),
                "expected uniform, soft-SEED or pyroclastic-SEED, as in pyroclastic-3",
            )
        })
    }
}

impl TryFrom<String> for ShapeSpec {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl From<ShapeSpec> for String {
    fn from(spec: ShapeSpec) -> Self {
        spec.to_string()
    }
}

/// A shape ready to be evaluated.
#[derive(Clone, Debug)]
pub struct Shape {
    spec: ShapeSpec,
    /// x fastest, then y, then z; empty for the uniform shape.
    volume: Vec<f32>,
    /// The same, for single places.
    bricks: Bricks,
    mean_density: f64,
    majorant: f64,
}

impl Shape {
    /// Fills the density volume from the noise formula: about a fifth of a second of one core.
    pub fn new(spec: ShapeSpec) -> Self {
        if spec.kind == ShapeKind::Uniform {
            return Self {
                spec,
                volume: Vec::new(),
                bricks: Bricks::new(&[]),
                mean_density: 1.0,
                majorant: 1.0,
            };
        }
        let formula = Formula::new(spec);
        let n = VOLUME_NODES;
        let volume: Vec<f32> = (0..n * n * n)
            .into_par_iter()
            .map(|i| {
                let at = |k: usize| k as f64 * VOLUME_CELL - 1.0;
                let x = DVec3::new(at(i % n), at(i / n % n), at(i / (n * n)));
                volume_density(volume_byte(formula.density(x) as f32)).to_f32()
            })
            .collect();
        let majorant = volume.iter().fold(0.0f32, |a, b| a.max(*b));
        let bricks = Bricks::new(&volume);
        let mut shape =
            Self { spec, volume, bricks, mean_density: 0.0, majorant: f64::from(majorant) };
        shape.mean_density = shape.volume_mean();
        shape
    }

    /// Kind and seed.
    pub fn spec(&self) -> ShapeSpec {
        self.spec
    }

    /// The shape's name, as scenes say it.
    pub fn name(&self) -> String {
        self.spec.to_string()
    }

    /// Density at a point of the unit sphere, in 0..1; 0 outside.
    pub fn density(&self, x: DVec3) -> f64 {
        if x.length_squared() > 1.0 {
            return 0.0;
        }
        if self.volume.is_empty() {
            return 1.0;
        }
        self.bricks.filtered(x)
    }

    /// The density volume, x fastest, then y, then z, [`VOLUME_NODES`] along each edge; empty for
    /// the uniform shape. Trilinear filtering with nodes at both ends of -1..1 gives D.
    pub fn volume(&self) -> &[f32] {
        &self.volume
    }

    /// Mean of the density over the volume of the unit sphere.
    pub fn mean_density(&self) -> f64 {
        self.mean_density
    }

    /// Upper bound of the density, for delta tracking.
    pub fn majorant(&self) -> f64 {
        self.majorant
    }

    /// Integrals of the density over `parts` equal parts of the segment between two points of the
    /// closed unit sphere, each divided by the length of a part: the mean density of each part.
    ///
    /// Two Gauss points a volume cell: along a line the density is a cubic between cell faces, so
    /// the error is that of the few cells a face cuts, below 1e-4.
    pub fn segment_means(&self, from: DVec3, to: DVec3, parts: &mut [f64]) {
        if self.volume.is_empty() {
            parts.fill(1.0);
            return;
        }
        let count = parts.len().max(1) as f64;
        let span = to - from;
        let part = span / count;
        let steps = (part.length() / VOLUME_CELL).ceil().max(1.0);
        // Abscissa of the two-point Gauss rule on -1..1.
        const GAUSS: f64 = 0.577_350_269_189_625_8;
        for (i, mean) in parts.iter_mut().enumerate() {
            let start = from + part * i as f64;
            let step = part / steps;
            let mut sum = 0.0;
            for k in 0..steps as usize {
                let middle = start + step * (k as f64 + 0.5);
                sum += self.filtered(middle - step * (0.5 * GAUSS));
                sum += self.filtered(middle + step * (0.5 * GAUSS));
            }
            *mean = sum / (2.0 * steps);
        }
    }

    /// Trilinear filtering; the caller has made sure of the unit sphere.
    fn filtered(&self, x: DVec3) -> f64 {
        let n = VOLUME_NODES;
        let p = (x + 1.0) / VOLUME_CELL;
        // Conversion cuts off fractions, and is quicker than rounding down.
        let cell = |place: f64| (place.max(0.0) as usize).min(n - 2);
        let (cx, cy, cz) = (cell(p.x), cell(p.y), cell(p.z));
        let f = (p - DVec3::new(cx as f64, cy as f64, cz as f64)).clamp(DVec3::ZERO, DVec3::ONE);
        let base = cx + n * (cy + n * cz);
        let row = |offset: usize| {
            let i = base + offset;
            match self.volume.get(i..i + 2) {
                Some(&[a, b]) => f64::from(a) + f.x * f64::from(b - a),
                _ => 0.0,
            }
        };
        let near = row(0) + f.y * (row(n) - row(0));
        let far = row(n * n) + f.y * (row(n * n + n) - row(n * n));
        near + f.z * (far - near)
    }

    /// Mean over the sphere by a regular lattice of the volume's spacing, shifted off the nodes.
    fn volume_mean(&self) -> f64 {
        let n = VOLUME_NODES - 1;
        let (sum, count) = (0..n)
            .into_par_iter()
            .map(|z| {
                let mut sum = 0.0;
                let mut count = 0u32;
                for y in 0..n {
                    for x in 0..n {
                        let at = |k: usize| (k as f64 + 0.5) * VOLUME_CELL - 1.0;
                        let p = DVec3::new(at(x), at(y), at(z));
                        if p.length_squared() <= 1.0 {
                            sum += self.filtered(p);
                            count += 1;
                        }
                    }
                }
                (sum, count)
            })
            .collect::<Vec<_>>()
            .into_iter()
            .fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        sum / f64::from(count.max(1))
    }
}

/// The noise formula of one shape.
struct Formula {
    kind: ShapeKind,
    octaves: Vec<Perlin>,
}

/// Cells of the first octave's lattice a radius: bulges about 0.45 radii across.
const BILLOW_FREQUENCY: f64 = 1.15;
/// The first octave of the soft kind is coarser, its threshold brings out the detail.
const SOFT_FREQUENCY: f64 = 1.3;
/// Ratio of the frequencies of successive octaves; not 2, so that lattices don't line up.
const LACUNARITY: f64 = 2.03;
/// Ratio of the amplitudes of successive octaves.
const PERSISTENCE: f64 = 0.5;

impl Formula {
    fn new(spec: ShapeSpec) -> Self {
        let octaves = (0..OCTAVES as u32)
            .map(|i| Perlin::new(spec.seed.wrapping_mul(0x9e37_79b9).wrapping_add(i)))
            .collect();
        Self { kind: spec.kind, octaves }
    }

    /// Sum of octaves of `shape(noise)`, divided by the sum of amplitudes.
    fn fractal(&self, x: DVec3, frequency: f64, shape: impl Fn(f64) -> f64) -> f64 {
        let (mut sum, mut weight, mut amplitude, mut f) = (0.0, 0.0, 1.0, frequency);
        for (i, octave) in self.octaves.iter().enumerate() {
            // Perlin noise vanishes on its lattice: an offset keeps the centre off it.
            let p = x * f + DVec3::new(0.37, 0.71, 0.13) * (i + 1) as f64;
            sum += amplitude * shape(octave.get(p.to_array()));
            weight += amplitude;
            amplitude *= PERSISTENCE;
            f *= LACUNARITY;
        }
        sum / weight
    }

    fn density(&self, x: DVec3) -> f64 {
        let r = x.length();
        // One cell of the volume inside the sphere everything has ended, so that filtering does
        // not carry density outside.
        let edge = smoothstep(1.0, 1.0 - 3.0 * VOLUME_CELL, r);
        let density = match self.kind {
            ShapeKind::Uniform => 1.0,
            ShapeKind::Soft => {
                // Metaball falloff: 1 at the centre, 0 with a horizontal tangent at the rim.
                let falloff = (1.0 - r * r).max(0.0).powi(2);
                let noise = self.fractal(x, SOFT_FREQUENCY, |n| n);
                smoothstep(0.12, 0.62, falloff + 1.1 * noise * (1.0 - falloff) + 0.05)
            }
            ShapeKind::Pyroclastic => {
                let billow = self.fractal(x, BILLOW_FREQUENCY, |n| (2.2 * n.abs()).min(1.0));
                let surface = 0.45 + 0.72 * billow;
                smoothstep(0.0, 0.28, surface - r)
            }
        };
        density * edge
    }
}

/// Smooth cubic step from 0 at `from` to 1 at `to`, in either order.
fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise_shapes() -> Vec<Shape> {
        ["soft-1", "pyroclastic-1"]
            .iter()
            .map(|name| Shape::new(name.parse().expect("a shape's name")))
            .collect()
    }

    #[test]
    fn names_round_trip_and_bad_ones_are_refused() {
        for name in ["uniform", "soft-0", "soft-12", "pyroclastic-4294967295"] {
            assert_eq!(name.parse::<ShapeSpec>().expect(name).to_string(), name);
        }
        for bad in
            ["", "soft", "soft-", "soft--1", "soft-01", "soft-4294967296", "Uniform", "cube-1"]
        {
            let error = bad.parse::<ShapeSpec>().expect_err(bad).to_string();
            assert!(error.contains("expected uniform"), "{error}");
        }
    }

    #[test]
    fn density_stays_in_its_bounds_and_fills_the_sphere_well() {
        for shape in noise_shapes() {
            for v in shape.volume() {
                assert!((0.0..=1.0).contains(v));
            }
            assert!(shape.majorant() <= 1.0 && shape.majorant() > 0.9, "{}", shape.name());
            // A particle that is mostly empty would need many overlapping ones to look filled.
            assert!(
                (0.2..0.6).contains(&shape.mean_density()),
                "{} {}",
                shape.name(),
                shape.mean_density()
            );
            assert_eq!(shape.density(DVec3::new(1.0, 0.1, 0.0)), 0.0);
            assert!(shape.density(DVec3::new(0.0, 0.0, 0.9999)) < 0.01);
        }
    }

    #[test]
    fn both_copies_of_the_volume_are_the_same_function() {
        let shape = Shape::new("pyroclastic-3".parse().expect("a shape's name"));
        let mut random = crate::reference::Random::new(0, 0, 0);
        for _ in 0..20_000 {
            let x = 2.0 * DVec3::new(random.unit(), random.unit(), random.unit()) - 1.0;
            let inside = x.length_squared() <= 1.0;
            let expected = if inside { shape.filtered(x) } else { 0.0 };
            assert_eq!(shape.density(x).to_bits(), expected.to_bits(), "{x}");
        }
    }

    #[test]
    fn seeds_and_kinds_differ_and_repeat() {
        let density = |name: &str| Shape::new(name.parse().expect(name)).volume().to_vec();
        assert_eq!(density("soft-5"), density("soft-5"));
        let distance = |a: &[f32], b: &[f32]| {
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / a.len() as f32
        };
        // Mean differences of 3 % of full density: other lumps, not other grains.
        assert!(distance(&density("soft-5"), &density("soft-6")) > 0.03);
        assert!(distance(&density("pyroclastic-5"), &density("pyroclastic-6")) > 0.03);
        assert!(distance(&density("pyroclastic-5"), &density("soft-5")) > 0.03);
    }

    #[test]
    fn segment_means_agree_with_a_fine_sum() {
        for shape in noise_shapes() {
            let (a, b) = (DVec3::new(0.6, -0.64, 0.48), DVec3::new(-0.8, 0.36, 0.48));
            let mut parts = [0.0; 4];
            shape.segment_means(a, b, &mut parts);
            let fine = |from: f64, to: f64| {
                const N: usize = 4000;
                (0..N)
                    .map(|i| {
                        shape.density(a.lerp(b, from + (to - from) * (i as f64 + 0.5) / N as f64))
                    })
                    .sum::<f64>()
                    / N as f64
            };
            for (i, part) in parts.iter().enumerate() {
                let exact = fine(i as f64 / 4.0, (i + 1) as f64 / 4.0);
                // Two Gauss points a cell of a piecewise cubic.
                assert!((part - exact).abs() < 1e-3, "{} {part} {exact}", shape.name());
            }
        }
    }

    #[test]
    fn uniform_is_one_inside() {
        let shape = Shape::new(ShapeSpec::UNIFORM);
        assert_eq!(shape.density(DVec3::new(0.5, 0.5, 0.5)), 1.0);
        assert_eq!(shape.density(DVec3::new(0.9, 0.9, 0.0)), 0.0);
        assert_eq!(shape.mean_density(), 1.0);
        let mut parts = [0.0; 3];
        shape.segment_means(DVec3::X, DVec3::NEG_X, &mut parts);
        assert_eq!(parts, [1.0; 3]);
    }
}
