//! Depth of opaque things as distances and as limits of lists, and the lists that end there.

use std::collections::BTreeSet;

use cumuli::frame::gpu_data::FrameUniforms;
use cumuli::frame::opaque::{NOTHING, OpaqueJob, OpaquePass};
use cumuli::frame::view::SCREEN_TILE;
use cumuli::frame::{DepthKind, Opaque, OpaquePicture};
use cumuli::gpu::buffers;
use cumuli::scene::Camera;
use glam::DVec3;

use crate::common::{Random, gpu, library, submit};
use crate::pictures::{Population, frame, read_lists};
use crate::project::particles;

/// Tiles and bins of tiles stick out of it, and ten bins in a row are more than one invocation owns.
const SIZE: [u32; 2] = [603, 131];
/// Tiles a side of a bin, and tiles up to which a particle asks each of them.
const BIN: usize = 8;
const FEW_TILES: usize = 64;
/// Share of a distance within which roundings decide what lies before it.
const ROUNDING: f64 = 1e-5;

/// What the pass leaves: limits of tiles and of bins as distances.
struct Told {
    job: OpaqueJob,
    distances: Vec<f32>,
    limits: [Vec<f32>; 2],
}

fn told(frame: &FrameUniforms, kind: DepthKind, depths: Vec<f32>) -> Told {
    let black = vec![[0.0; 3]; depths.len()];
    let picture =
        OpaquePicture { size: SIZE, distance: depths, radiance: black.clone(), sunlit: black };
    let opaque = Opaque { kind, ..picture.upload(gpu(), 0).expect("a picture") };
    let pass = OpaquePass::new(gpu(), library(), SCREEN_TILE).expect("the pass");
    let job = OpaqueJob::new(gpu(), frame.size, frame.tiles);
    let uniforms = buffers::uniform(gpu(), "frame", frame);
    submit(|compute| pass.encode(gpu(), compute, &uniforms, frame.size, (&job, &opaque)));
    let distances = gpu().read_texture(job.distances.texture()).expect("distances");
    let limits = [0, 1].map(|level| {
        let keys: Vec<u32> = gpu().read_texture(job.limits[level].texture()).expect("limits");
        // Distances are not negative: their keys have the sign turned over.
        keys.into_iter().map(|key| f32::from_bits(key & 0x7fff_ffff)).collect()
    });
    Told { job, distances, limits }
}

/// Distance along a pixel's ray (m), and how much a step of f32 in the depth is in it.
fn distance(
    frame: &FrameUniforms,
    kind: DepthKind,
    pixel: usize,
    depth: f32,
) -> Option<(f64, f64)> {
    let [width, height] = SIZE.map(f64::from);
    let [x, y] = [pixel as u32 % SIZE[0], pixel as u32 / SIZE[0]].map(|v| f64::from(v) + 0.5);
    let [right, up, forward] = [frame.right, frame.up, frame.forward]
        .map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()));
    let slant =
        (forward + (2.0 * x / width - 1.0) * right - (2.0 * y / height - 1.0) * up).length();
    let depth = Some(f64::from(depth)).filter(|d| d.is_finite())?;
    let (distance, steps) = match kind {
        DepthKind::Distance => (depth, 1.0),
        DepthKind::AlongAxis => (depth * slant, 1.0),
        DepthKind::Projected { empty, .. } if depth == f64::from(empty) => return None,
        DepthKind::Projected { scale, offset, .. } => {
            let (scale, offset) = (f64::from(scale), f64::from(offset));
            (
                scale / (depth - offset) * slant,
                (depth.abs() + offset.abs()) / (depth - offset).abs(),
            )
        }
    };
    (0.0..f64::from(NOTHING)).contains(&distance).then_some((distance, steps))
}

fn eye() -> FrameUniforms {
    let camera = Camera { target: DVec3::new(300.0, 100.0, -1000.0), ..Camera::default() };
    frame(&camera, SIZE)
}

#[test]
fn distances_and_limits_are_those_of_the_depths() {
    let frame = eye();
    let mut random = Random(211);
    for kind in [
        DepthKind::Distance,
        DepthKind::AlongAxis,
        DepthKind::infinite_reversed(0.1),
        DepthKind::reversed(0.5, 2e4),
        DepthKind::standard(0.5, 2e4),
    ] {
        let depth = |r: &mut Random, far: f64| {
            let special = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.25, 0.0, 1.0, 2.0];
            let metres = far.min(10f64.powf(r.between(0.0, 4.0)));
            match (r.bits() % 10, kind) {
                (0, _) => special[(r.bits() % 7) as usize],
                (_, DepthKind::Projected { scale, offset, .. }) => {
                    (f64::from(offset) + f64::from(scale) / metres) as f32
                }
                _ => metres as f32,
            }
        };
        // Near by in the left half, so that limits are not those of the farthest pixels alone.
        let depths: Vec<f32> = (0..SIZE[0] * SIZE[1])
            .map(|i| depth(&mut random, if i % SIZE[0] < 100 { 30.0 } else { 1e4 }))
            .collect();
        let told = told(&frame, kind, depths.clone());
        let (mut worst, mut nothing) = (0.0f64, 0);
        for (pixel, (depth, found)) in depths.iter().zip(&told.distances).enumerate() {
            match distance(&frame, kind, pixel, *depth) {
                None => {
                    assert_eq!(*found, NOTHING, "{kind:?}: {pixel}: {depth}");
                    nothing += 1;
                }
                Some((wanted, steps)) => {
                    let off = (f64::from(*found) - wanted).abs();
                    worst = worst
                        .max(off / ((1.0 + steps) * wanted * f64::from(f32::EPSILON)).max(1e-30));
                }
            }
        }
        println!("{kind:?}: {worst:.1} steps, nothing in {nothing} pixels");
        assert!(worst < 4.0 && nothing > 500, "{kind:?}: {worst} steps, {nothing}");
        let sides = [SCREEN_TILE, SCREEN_TILE * BIN as u32];
        for (side, limits) in sides.into_iter().zip(&told.limits) {
            let across = SIZE[0].div_ceil(side);
            assert_eq!(limits.len() as u32, across * SIZE[1].div_ceil(side));
            let mut wanted = vec![0.0f32; limits.len()];
            for (pixel, found) in told.distances.iter().enumerate() {
                let [x, y] = [pixel as u32 % SIZE[0], pixel as u32 / SIZE[0]].map(|v| v / side);
                let most = &mut wanted[(y * across + x) as usize];
                *most = most.max(*found);
            }
            for (wanted, found) in wanted.iter().zip(limits) {
                assert!((wanted - found).abs() <= 2e-7 * wanted, "{kind:?}: {found} for {wanted}");
            }
        }
    }
}

/// Lists before something opaque are those without it, but for what begins behind their tile's farthest pixel; in view is
/// what some tile, or for large particles some bin, may list.
#[test]
fn lists_end_at_what_is_opaque() {
    let frame = eye();
    let forward =
        DVec3::new(frame.forward[0].into(), frame.forward[1].into(), frame.forward[2].into());
    let mut random = Random(212);
    let particles = particles(forward, &mut random);
    let (whole, all) = Population::new(&frame, &particles).screen(&frame);
    let whole = read_lists(&whole);
    let begins: Vec<f64> = particles
        .iter()
        .map(|p| {
            let centre = DVec3::from(p.centre.map(f64::from));
            (centre.length() - f64::from(p.radius)).max(0.0)
        })
        .collect();
    // Walls of many distances with gaps between them; one near wall everywhere.
    for (what, gaps, farthest) in [("walls", 5, 4.0), ("a near wall", 0, 1.0)] {
        let walls: Vec<f32> = (0..64)
            .map(|_| match random.bits() % 10 {
                i if i < gaps => NOTHING,
                _ => 10f64.powf(random.between(0.0, farthest)) as f32,
            })
            .collect();
        let wall = |i: u32| walls[(i % SIZE[0] / 32 + 8 * (i / SIZE[0] / 32)) as usize];
        let depths = (0..SIZE[0] * SIZE[1]).map(wall).collect();
        let told = told(&frame, DepthKind::Distance, depths);
        let (lists, order) = Population::new(&frame, &particles).screen_before(&frame, &told.job);
        let lists = read_lists(&lists);
        let [tiles, bins] = &told.limits;
        let across = frame.tiles[0] as usize;
        let bin_of =
            |tile: usize| tile % across / BIN + across.div_ceil(BIN) * (tile / across / BIN);
        // Where a particle begins at a limit, either is right.
        let is_near = |begin: f64, limit: f32| (begin - f64::from(limit)).abs() <= ROUNDING * begin;
        let unsure: BTreeSet<u32> = (0..particles.len() as u32)
            .filter(|p| tiles.iter().any(|limit| is_near(begins[*p as usize], *limit)))
            .collect();
        let mut touched = vec![Vec::new(); particles.len()];
        let (mut listed, mut left_out) = (0, 0);
        for (tile, (list, whole)) in lists.iter().zip(&whole).enumerate() {
            whole.iter().for_each(|p| touched[*p as usize].push(tile));
            let sure = |p: &&u32| !unsure.contains(*p);
            let wanted: Vec<u32> = whole
                .iter()
                .filter(sure)
                .filter(|p| begins[**p as usize] <= f64::from(tiles[tile]))
                .copied()
                .collect();
            let found: Vec<u32> = list.iter().filter(sure).copied().collect();
            assert_eq!(found, wanted, "{what}: tile {tile}");
            listed += found.len();
            left_out += whole.len() - list.len();
        }
        let seen = |p: &u32| {
            let (begin, touched) = (begins[*p as usize], &touched[*p as usize]);
            let limit = |tile: &usize| match touched.len() <= FEW_TILES {
                true => tiles[*tile],
                false => bins[bin_of(*tile)],
            };
            touched.iter().any(|tile| begin <= f64::from(limit(tile)))
        };
        let sure = |p: &u32| !unsure.contains(p);
        let wanted: BTreeSet<u32> = all.iter().copied().filter(sure).filter(seen).collect();
        let found: BTreeSet<u32> = order.iter().copied().filter(sure).collect();
        assert_eq!(found, wanted, "{what}");
        let large =
            all.iter().filter(|p| touched[**p as usize].len() > FEW_TILES && !seen(p)).count();
        println!(
            "{what}: {listed} entries, {left_out} left out; {} of {} in view, {large} large ones not; {} unsure",
            found.len(),
            all.len(),
            unsure.len()
        );
        assert!(left_out > 100 && found.len() < all.len() && unsure.len() < 5, "{what}");
        assert!(gaps > 0 || large > 0, "{what}");
    }
}
