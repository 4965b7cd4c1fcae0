//! `noise.wgsl` against its twin.

use cumuli::frame::cpu::noise;
use glam::{IVec3, Vec3};

use crate::common::{Random, Snippet, map};

/// Numbers from which hashes and cells are made: random ones and the ends of the range.
fn words() -> Vec<[u32; 2]> {
    let mut random = Random(10);
    let mut words: Vec<[u32; 2]> =
        (0..4096).map(|_| random.bits()).map(|b| [b as u32, (b >> 32) as u32]).collect();
    let ends = [0, 1, 0x7fff_ffff, 0x8000_0000, u32::MAX];
    words.extend(ends.iter().flat_map(|a| ends.map(|b| [*a, b])));
    words
}

/// Integers wrap the same way everywhere: not one bit may differ, or host and device would see
/// other clouds.
#[test]
fn hashes_are_the_same_bits() {
    let words = words();
    let snippet = Snippet {
        declarations: "#import cumuli::noise::{hash, hash_combine, unit_float}",
        input: "vec2<u32>",
        output: "vec4<u32>",
        result: "vec4(hash(x.x), hash_combine(x.x, x.y), bitcast<u32>(unit_float(x.x)), 0u)",
    };
    let results: Vec<[u32; 4]> = map(snippet, &[], &words);
    for ([a, b], result) in words.iter().zip(results) {
        let unit = noise::unit_float(*a);
        assert!((0.0..1.0).contains(&unit), "{unit} from {a:#x}");
        let twin = [noise::hash(*a), noise::hash_combine(*a, *b), unit.to_bits(), 0];
        assert_eq!(result, twin, "{a:#x} {b:#x}");
    }
}

/// Seed, lattice cell, and fraction within it.
type Place = [u32; 8];

fn place(seed: u32, cell: IVec3, f: Vec3) -> Place {
    let c = cell.as_uvec3();
    [seed, c.x, c.y, c.z, f.x.to_bits(), f.y.to_bits(), f.z.to_bits(), 0]
}

fn noise_on_device(places: &[Place]) -> Vec<f32> {
    let snippet = Snippet {
        declarations:
            "#import cumuli::noise::gradient_noise
            struct Place { seed: u32, x: i32, y: i32, z: i32, fx: f32, fy: f32, fz: f32, pad: u32 }",
        input: "Place",
        output: "f32",
        result: "gradient_noise(x.seed, vec3(x.x, x.y, x.z), vec3(x.fx, x.fy, x.fz))",
    };
    map(snippet, &[], places)
}

#[test]
fn gradient_noise_is_that_of_its_twin() {
    let mut random = Random(11);
    let ends = [i32::MIN, -1, 0, i32::MAX];
    let inputs: Vec<(u32, IVec3, Vec3)> = (0..8192)
        .map(|i| {
            let mut coordinate = || match i % 8 {
                0 => ends[random.bits() as usize % ends.len()],
                _ => random.bits() as i32,
            };
            let cell = IVec3::new(coordinate(), coordinate(), coordinate());
            // Every seventh on a corner of its cell.
            let mut fraction = || match i % 7 {
                0 => (random.bits() % 2) as f32,
                _ => random.uniform() as f32,
            };
            let f = Vec3::new(fraction(), fraction(), fraction());
            (random.bits() as u32, cell, f)
        })
        .collect();
    let places: Vec<Place> = inputs.iter().map(|(seed, cell, f)| place(*seed, *cell, *f)).collect();
    let mut worst = 0.0f32;
    for ((seed, cell, f), value) in inputs.iter().zip(noise_on_device(&places)) {
        assert!(value.abs() <= 1.5, "{value} at {cell} {f}");
        worst = worst.max((value - noise::gradient_noise(*seed, *cell, *f)).abs());
    }
    // The corners' terms are below 3 and their weights add up to 1; a device may fuse a product
    // and a sum where the host does not: about 8 roundings in each of the weights, the dot
    // products and the three mixes, of 1.2e-7 x 3 / 2 at most.
    assert!(worst < 4e-6, "{worst:e}");
}

/// A face that two cells share has one value, however far from the origin, also where the lattice
/// wraps.
#[test]
fn gradient_noise_is_continuous_between_cells() {
    let mut random = Random(12);
    let mut places = Vec::new();
    for _ in 0..1024 {
        let cell = [random.bits() as i32, i32::MAX, -1][random.bits() as usize % 3];
        let cell = IVec3::new(cell, random.bits() as i32, random.bits() as i32);
        let (u, v) = (random.uniform() as f32, random.uniform() as f32);
        let next = IVec3::new(cell.x.wrapping_add(1), cell.y, cell.z);
        places.push(place(7, cell, Vec3::new(1.0, u, v)));
        places.push(place(7, next, Vec3::new(0.0, u, v)));
    }
    for pair in noise_on_device(&places).chunks_exact(2) {
        // As above: roundings of the mixes.
        assert!((pair[0] - pair[1]).abs() < 4e-6, "{pair:?}");
    }
}
