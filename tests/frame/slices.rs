//! The light grid's solution in slices: the last whole one is shown until the next is whole.

use std::sync::Arc;

use cumuli::frame::light_grid::GridSettings;
use cumuli::frame::{Picture, Preset, Quality, RenderSettings, Renderer};
use cumuli::scene::{Channel, CloudField, Outside, Scene, WeatherImage, WeatherMap};
use glam::{DVec2, DVec3};

use crate::{alone, renderer};

const SIZE: [u32; 2] = [64, 40];
/// Steps a frame, of the larger levels: a slice counts others by their cells.
const SLICE: u32 = 4;
/// The matter, turns of the coarsest level, of one more level over all of the rings', and of the three rings'.
const STEPS: u64 = 1 + 33 + 4 + 3 * 4;
/// All of the two coarser levels, with the matter, are in the first slice, and some turns of the last ring's level.
const FIRST: std::ops::Range<u64> = 39..42;

fn cumulus() -> Scene {
    let clouds = CloudField { cells: 40, rings: 3, coverage: 0.5, ..CloudField::default() };
    Scene { clouds: Some(clouds), ..Scene::default() }
}

fn sliced(scene: &Scene) -> Renderer {
    let quality = Preset::Low.quality();
    let grid = GridSettings { slice: SLICE, ..quality.grid };
    let quality = Some(Quality { grid, ..quality });
    renderer(scene, &RenderSettings { quality, ..Default::default() })
}

fn whole(scene: &Scene, time: f64) -> Picture {
    let settings = RenderSettings { preset: Preset::Low, ..Default::default() };
    renderer(scene, &settings).render(scene, time, SIZE).expect("a frame")
}

fn bits(picture: &Picture) -> Vec<u32> {
    picture.radiance.iter().flatten().map(|value| value.to_bits()).collect()
}

/// Steps that are made, and all.
fn progress(picture: &Picture) -> [u64; 2] {
    [picture.stats.counters.grid_steps_made, picture.stats.counters.grid_steps]
}

#[test]
fn a_sliced_solution_is_the_whole_one_once_it_is_whole() {
    let _turn = alone();
    let scene = cumulus();
    let mut lasting = sliced(&scene);
    let mut frame = |scene: &Scene, time| lasting.render(scene, time, SIZE).expect("a frame");
    let first = frame(&scene, 0.0);
    assert!(bits(&first) == bits(&whole(&scene, 0.0)), "the first frame waits for its light");
    assert_eq!(progress(&first), [0; 2]);

    // Within the same epoch (3.5 s) nothing is to be solved, after it a slice a frame.
    assert_eq!(progress(&frame(&scene, 1.0)), [0; 2]);
    let later = whole(&scene, 20.0);
    let mut steps = 0;
    loop {
        let picture = frame(&scene, 20.0);
        let [done, all] = progress(&picture);
        if steps == 0 {
            assert!(FIRST.contains(&done), "{done}");
        } else {
            assert_eq!(done, u64::from(SLICE).min(all - steps) + steps, "of {all}");
        }
        steps = done;
        assert_eq!(all, STEPS);
        assert_eq!(bits(&picture) == bits(&later), done == all, "{done} of {all}");
        assert_eq!(picture.stats.unfinished, done < all);
        if done == all {
            break;
        }
    }
    let still = frame(&scene, 20.0);
    assert!(still.stats.passes.iter().all(|p| !p.ran) && bits(&still) == bits(&later));
}

#[test]
fn other_clouds_do_not_wait_for_their_light() {
    let _turn = alone();
    let first = cumulus();
    let with = |change: &dyn Fn(&mut CloudField)| {
        let mut scene = first.clone();
        change(scene.clouds.as_mut().expect("a field"));
        scene
    };
    let image = Arc::new(WeatherImage::new([2, 1], vec![0, u32::MAX]));
    let map = WeatherMap {
        file: "map.png".into(),
        extent: DVec2::splat(3000.0),
        centre: DVec2::ZERO,
        outside: Outside::Repeat,
        channels: vec![Channel::Coverage],
        noise: 0.5,
        image,
    };
    let mut other = map.clone();
    other.image = Arc::new(WeatherImage::new([2, 1], vec![u32::MAX, 0]));
    let mut lasting = sliced(&first);
    lasting.render(&first, 0.0, SIZE).expect("a frame");
    for scene in [
        with(&|c| c.seed = 7),
        with(&|c| c.weather = Some(map.clone())),
        with(&|c| c.weather = Some(other.clone())),
        with(&|c| c.coverage = 0.9),
        with(&|c| c.extinction *= 2.0),
    ] {
        let picture = lasting.render(&scene, 0.0, SIZE).expect("a frame");
        assert_eq!(progress(&picture), [0; 2]);
        assert!(bits(&picture) == bits(&whole(&scene, 0.0)), "{:?}", scene.clouds);
    }
    // A little more of the same is lit by the light of before until its own is whole.
    let near = with(&|c| (c.coverage, c.extinction) = (0.53, 2.2 * c.extinction));
    let picture = lasting.render(&near, 0.0, SIZE).expect("a frame");
    assert!(FIRST.contains(&progress(&picture)[0]), "{:?}", progress(&picture));
}

#[test]
fn a_window_begins_with_rough_light_and_its_saved_pictures_do_not() {
    let _turn = alone();
    let scene = cumulus();
    let drafting = || {
        let quality = Preset::Low.quality();
        let grid = GridSettings { slice: SLICE, draft: true, ..quality.grid };
        let quality = Some(Quality { grid, ..quality });
        renderer(&scene, &RenderSettings { quality, ..Default::default() })
    };
    let mut live = drafting();
    let expected = whole(&scene, 0.0);
    let first = live.render(&scene, 0.0, SIZE).expect("a frame");
    assert_eq!(progress(&first), [0, STEPS]);
    assert!(first.stats.unfinished && bits(&first) != bits(&expected));
    let mean = |p: &Picture| p.radiance.iter().map(|v| f64::from(v[1])).sum::<f64>();
    // Some light is still on its way, in the clouds: the sky is as it will be.
    let share = mean(&first) / mean(&expected);
    assert!((0.7..1.1).contains(&share), "{share}");
    let alone = live.render_alone(&scene, 0.0, SIZE).expect("a frame");
    assert!(bits(&alone) == bits(&expected));

    let mut live = drafting();
    let mut frames = 0;
    let last = loop {
        let picture = live.render(&scene, 0.0, SIZE).expect("a frame");
        frames += 1;
        if !picture.stats.unfinished {
            break picture;
        }
    };
    let slices = 1 + (STEPS - FIRST.start).div_ceil(SLICE.into());
    assert_eq!(frames, 1 + slices, "the draft, then slices");
    assert!(bits(&last) == bits(&expected));
}

#[test]
fn a_jump_starts_again_and_what_no_solution_serves_is_waited_for() {
    let _turn = alone();
    let scene = cumulus();
    let mut lasting = sliced(&scene);
    let mut steps = |scene: &Scene, time| {
        let picture = lasting.render(scene, time, SIZE).expect("a frame");
        (progress(&picture)[0], picture)
    };
    let slice = u64::from(SLICE);
    assert_eq!(steps(&scene, 0.0).0, 0);
    let first = steps(&scene, 4.0).0;
    assert!(FIRST.contains(&first), "{first}");
    // The next epoch does not interrupt the solution on the way, nor does a slowly moving sun.
    assert_eq!(steps(&scene, 8.0).0, first + slice);
    let mut evening = scene.clone();
    evening.sun.direction = (scene.sun.direction + DVec3::new(0.02, 0.0, 0.0)).normalize();
    assert_eq!(steps(&evening, 8.0).0, first + 2 * slice);
    evening.sun.direction.x *= -1.0;
    evening.sun.direction = (evening.sun.direction + DVec3::new(0.3, 0.0, 0.0)).normalize();
    assert_eq!(steps(&evening, 8.0).0, first, "the sun has jumped");
    // Far away, and long after.
    let mut away = evening.clone();
    away.camera.position.x += 20_000.0;
    away.camera.target.x += 20_000.0;
    for (scene, time) in [(&away, 8.0), (&away, 200.0)] {
        let (done, picture) = steps(scene, time);
        assert_eq!(done, 0);
        assert!(bits(&picture) == bits(&whole(scene, time)), "{time}");
    }
}
