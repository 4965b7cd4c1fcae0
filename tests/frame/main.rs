//! Whole frames on the device: what each pass contributes, what is skipped, energy, extremes.

mod air;
mod blend;
mod distant;
mod furnace;
mod march;
mod opaque;
mod passes;
mod picture;
mod reuse;
mod sea;
mod shader_branches;
mod shaders;
mod slices;
mod stress;
mod thick;
mod through;
mod tiles;

use std::path::Path;
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

use cumuli::frame::{Picture, Preset, RenderSettings, Renderer};
use cumuli::gpu::Gpu;
use cumuli::scene::{Camera, ParticleSpec, Scene, Sky};
use cumuli::tables::TableSet;
use glam::{DQuat, DVec3};

/// Opening a device takes longer than most of these tests: all of them share one.
static GPU: LazyLock<Gpu> = LazyLock::new(|| Gpu::headless().expect("an adapter"));
static TABLES: LazyLock<TableSet> =
    LazyLock::new(|| TableSet::embedded().expect("the built-in tables"));

/// Software adapters use all cores for one frame; two at a time only take twice the memory.
fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn scene(text: &str) -> Scene {
    Scene::from_toml(text, "a test's scene", Path::new("")).expect(text)
}

fn settings(preset: Preset) -> RenderSettings {
    RenderSettings { preset, ..Default::default() }
}

fn renderer(scene: &Scene, settings: &RenderSettings) -> Renderer {
    Renderer::new(&GPU, &TABLES, scene, settings).expect("a renderer")
}

/// One frame at time 0 by a renderer of its own.
fn picture(scene: &Scene, preset: Preset, size: [u32; 2]) -> Picture {
    let picture = renderer(scene, &settings(preset)).render(scene, 0.0, size).expect("a frame");
    assert_eq!(picture.stats.counters.overflowed, 0);
    picture
}

fn particle(centre: DVec3, radius: f64, extinction: f64, shape: &str) -> ParticleSpec {
    let orientation = DQuat::from_euler(glam::EulerRot::YXZ, 0.4, 1.1, -0.7);
    ParticleSpec { centre, radius, extinction, shape: shape.to_owned(), orientation }
}

/// Particles in empty space under a uniform sky, seen from `eye` towards the origin.
fn space(radiance: f64, irradiance: f64, eye: DVec3, particles: Vec<ParticleSpec>) -> Scene {
    let mut scene = Scene { sky: Sky::Uniform { radiance }, particles, ..Scene::default() };
    scene.sun.irradiance = irradiance;
    scene.camera = Camera { position: eye, target: DVec3::ZERO, fov_x: 50.0, ..scene.camera };
    scene
}
