use super::*;
use crate::frame::{Preset, RenderSettings};
use crate::scene::{ParticleSpec, Scene, Sky};

/// For a picture of a few pixels on the slowest machine.
const PATIENCE: Duration = Duration::from_secs(120);

fn scene() -> Scene {
    let ball = ParticleSpec {
        centre: glam::DVec3::new(0.0, 300.0, -1000.0),
        radius: 200.0,
        extinction: 0.02,
        shape: "uniform".to_owned(),
        orientation: glam::DQuat::IDENTITY,
    };
    Scene { sky: Sky::Uniform { radiance: 0.05 }, particles: vec![ball], ..Scene::default() }
}

fn order(scene: &Arc<Scene>, size: [u32; 2]) -> Order {
    let settings = RenderSettings { preset: Preset::Low, ..Default::default() };
    Order { camera: scene.camera, scene: scene.clone(), time: 0.0, size, settings, inside: None }
}

fn studio() -> Studio {
    let tables = Arc::new(TableSet::embedded().expect("the built-in tables"));
    Studio::new(None, tables, Arc::new(|| {})).expect("a thread")
}

/// The next reply that is no news of a stage.
fn next(studio: &mut Studio) -> Reply {
    let end = Instant::now() + PATIENCE;
    loop {
        match studio.reply() {
            Some(Reply::Stage(_)) => {}
            Some(reply) => return reply,
            None => std::thread::sleep(Duration::from_millis(5)),
        }
        assert!(Instant::now() < end, "no reply");
    }
}

#[test]
fn pictures_come_and_only_the_last_order_counts() {
    let mut studio = studio();
    let scene = Arc::new(scene());
    studio.order(order(&scene, [32, 24]), false);
    assert!(studio.is_busy());
    let Reply::Picture(first) = next(&mut studio) else { panic!("no picture") };
    assert!(studio.compiled() > 0, "what the window shows at the start");
    assert!(first.cold && !studio.is_busy());
    let Image::Pixels(size, pixels) = &first.image else { panic!("not on the host") };
    assert_eq!((*size, pixels.len()), ([32, 24], 32 * 24));
    assert!(pixels.iter().any(|p| p != &pixels[0]), "a ball before the sky");

    studio.order(order(&scene, [32, 24]), false);
    assert!(!studio.is_busy(), "the same is not made twice");
    for width in 33..60 {
        studio.order(order(&scene, [width, 24]), false);
    }
    let mut made = 0;
    while studio.is_busy() {
        let Reply::Picture(shown) = next(&mut studio) else { panic!("no picture") };
        made += 1;
        if !studio.is_busy() {
            assert_eq!(shown.order.size, [59, 24], "the last one");
            assert!(!shown.cold && made < 27, "{made} of 27 orders in a row");
        }
    }
}

/// A defect on the thread: here the window's own call, the first time.
#[test]
fn a_panic_on_the_thread_is_told() {
    let first = std::sync::atomic::AtomicBool::new(true);
    let wake = move || {
        assert!(!first.swap(false, std::sync::atomic::Ordering::Relaxed), "stumbled");
    };
    let tables = Arc::new(TableSet::embedded().expect("the built-in tables"));
    let mut studio = Studio::new(None, tables, Arc::new(wake)).expect("a thread");
    studio.order(order(&Arc::new(scene()), [16, 8]), false);
    let end = Instant::now() + PATIENCE;
    let error = loop {
        match studio.reply() {
            Some(Reply::Failed(error)) => break error.to_string(),
            Some(_) => {}
            None => std::thread::sleep(Duration::from_millis(5)),
        }
        assert!(Instant::now() < end, "nothing is told");
    };
    assert!(error.ends_with("making a picture: stumbled"), "{error}");
}

#[test]
fn what_cannot_be_done_is_refused_and_the_next_order_is_done() {
    let mut studio = studio();
    let good = Arc::new(scene());
    let bad = Arc::new(Scene { exposure: f64::NAN, ..scene() });
    studio.order(order(&bad, [32, 24]), false);
    let Reply::Refused(error) = next(&mut studio) else { panic!("not refused") };
    assert!(error.to_string().contains("exposure"), "{error}");
    studio.send(Errand::Save(order(&good, [16, 8]), vec!["/dev/null/a.png".into()]));
    assert!(matches!(next(&mut studio), Reply::Refused(_)), "no such folder");
    let dir = tempfile::tempdir().expect("a temporary folder");
    let paths = ["a.png", "a.exr"].map(|name| dir.path().join(name)).to_vec();
    studio.send(Errand::Save(order(&good, [16, 8]), paths.clone()));
    assert!(matches!(next(&mut studio), Reply::Saved(saved) if saved == paths));
    assert!(paths.iter().all(|p| crate::output::is_whole_picture(p, [16, 8])));
    studio.order(order(&good, [32, 24]), false);
    assert!(matches!(next(&mut studio), Reply::Picture(_)));
}

#[test]
fn a_lost_device_is_told_and_another_thread_goes_on() {
    let scene = Arc::new(scene());
    let mut pixels = Vec::new();
    let mut lost = studio();
    for size in [[24, 16], [25, 16]] {
        lost.order(order(&scene, size), false);
        match next(&mut lost) {
            Reply::Picture(shown) => pixels.push(shown.image),
            Reply::Failed(error) => assert!(matches!(error, Error::Gpu(_)), "{error}"),
            other => panic!("{other:?}"),
        }
        lost.lose_device();
    }
    assert_eq!(pixels.len(), 1, "the second was lost");
    drop(lost);
    let mut fresh = studio();
    fresh.order(order(&scene, [24, 16]), false);
    let Reply::Picture(shown) = next(&mut fresh) else { panic!("no picture") };
    let (Image::Pixels(_, after), Image::Pixels(_, before)) = (&shown.image, &pixels[0]) else {
        panic!("not on the host")
    };
    assert!(after == before, "the same bits");
}
