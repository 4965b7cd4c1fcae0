//! The same frame has the same bits: made again and again, from nothing or from what the frame before
//! left, with passes run or skipped.

use cumuli::frame::{Picture, Preset, RenderSettings, Renderer};
use cumuli::gpu::Gpu;
use cumuli::scene::{CloudField, ParticleSpec, Scene};
use cumuli::tables::TableSet;
use glam::{DQuat, DVec3};

use crate::alone;

const SIZE: [u32; 2] = [24, 16];

/// A field with a listed particle, at a time.
struct Frame {
    scene: Scene,
    time: f64,
    size: [u32; 2],
}

/// Frames from which each way to another leaves out other passes.
fn frames() -> Vec<Frame> {
    let clouds = CloudField { cells: 8, rings: 2, coverage: 0.6, ..CloudField::default() };
    let listed = ParticleSpec {
        centre: DVec3::new(0.0, 900.0, -400.0),
        radius: 120.0,
        extinction: 0.02,
        shape: "pyroclastic-1".to_owned(),
        orientation: DQuat::IDENTITY,
    };
    let mut scene = Scene { clouds: Some(clouds), particles: vec![listed], ..Scene::default() };
    scene.camera.target = DVec3::new(0.0, 600.0, -600.0);
    let frame = |time: f64, change: fn(&mut Scene)| {
        let mut scene = scene.clone();
        change(&mut scene);
        Frame { scene, time, size: SIZE }
    };
    vec![
        frame(0.0, |_| {}),
        frame(7.0, |_| {}),
        frame(0.0, |s| s.camera.target.x += 300.0),
        frame(0.0, |s| s.camera.position += DVec3::new(40.0, 5.0, -20.0)),
        frame(0.0, |s| s.sun.direction = DVec3::new(0.6, 0.48, 0.64)),
        frame(0.0, |s| s.exposure = 1.0),
        frame(0.0, |s| s.particles[0].extinction = 0.03),
        frame(0.0, |s| s.clouds = None),
        Frame { size: [9, 31], ..frame(0.0, |_| {}) },
    ]
}

fn bits(picture: &Picture) -> (Vec<u32>, Vec<[u8; 4]>) {
    (picture.radiance.iter().flatten().map(|v| v.to_bits()).collect(), picture.pixels.clone())
}

#[test]
fn a_hundred_times_the_same_frame_in_any_order() {
    let _turn = alone();
    let gpu = Gpu::headless().expect("an adapter");
    let tables = TableSet::embedded().expect("the built-in tables");
    let settings = RenderSettings { preset: Preset::Low, ..Default::default() };
    let renderer =
        |scene: &Scene| Renderer::new(&gpu, &tables, scene, &settings).expect("a renderer");
    let frames = frames();
    // From nothing, each by a renderer of its own: all passes run.
    let expected: Vec<_> = frames
        .iter()
        .map(|f| bits(&renderer(&f.scene).render(&f.scene, f.time, f.size).expect("a frame")))
        .collect();
    for (i, a) in expected.iter().enumerate() {
        assert!(expected[..i].iter().all(|b| b != a), "frame {i} is the same as one before");
    }
    let mut lasting = renderer(&frames[0].scene);
    let mut skipped = std::collections::BTreeSet::new();
    let mut make = |index: usize, what: &str| {
        let Frame { scene, time, size } = &frames[index];
        let picture = lasting.render(scene, *time, *size).expect("a frame");
        let off = picture.stats.passes.iter().filter(|p| !p.ran).map(|p| p.name.clone());
        skipped.insert(off.collect::<Vec<_>>());
        assert!(bits(&picture) == expected[index], "{what}: frame {index} differs");
    };
    // The first frame after each of the others in turn, a hundred times.
    for round in 0..100 {
        make(0, "again");
        make(1 + round % (frames.len() - 1), "in between");
    }
    // And without any in between.
    for _ in 0..3 {
        make(0, "at once");
    }
    assert!(skipped.len() >= 6, "the frames should leave out different passes: {skipped:?}");
}
