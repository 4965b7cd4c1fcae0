//! Devices that are lost.

use cumuli::Error;
use cumuli::frame::{Preset, RenderSettings, Renderer};
use cumuli::gpu::Gpu;
use cumuli::scene::Scene;
use cumuli::tables::TableSet;

use super::SCENE;

#[test]
fn a_lost_device_is_an_error_and_another_goes_on() {
    let tables = TableSet::embedded().expect("the built-in tables");
    let scene = Scene::from_toml(SCENE, "the scene", "".as_ref()).expect("a scene");
    let settings = RenderSettings { preset: Preset::Low, ..Default::default() };
    let renderer = |gpu: &Gpu| Renderer::new(gpu, &tables, &scene, &settings);
    let gpu = Gpu::headless().expect("an adapter");
    let mut lost = renderer(&gpu).expect("a renderer");
    let before = lost.render(&scene, 0.0, [24, 16]).expect("a frame");
    gpu.device.destroy();
    // The same frame, of which nothing has to be made; one that needs new buffers; and again.
    for size in [[24, 16], [64, 48], [24, 16]] {
        let error = lost.render(&scene, 0.0, size).expect_err("a lost device");
        assert!(matches!(error, Error::Gpu(_)), "{error}");
        assert_eq!(error.exit_code(), 1);
        assert!(!error.to_string().contains('\n'), "{error}");
    }
    assert!(gpu.wait().is_err() && gpu.check().is_err());
    assert!(
        renderer(&gpu).is_err()
            || renderer(&gpu).is_ok_and(|mut r| { r.render(&scene, 0.0, [24, 16]).is_err() })
    );
    // A program that opens another device goes on as if nothing had been.
    let gpu = Gpu::headless().expect("an adapter");
    let after = renderer(&gpu).expect("a renderer").render(&scene, 0.0, [24, 16]).expect("a frame");
    assert_eq!((after.radiance, after.pixels), (before.radiance, before.pixels));
}
