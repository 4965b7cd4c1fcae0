//! Times of what the host computes: table look-ups, a solution of the scattering solver, the
//! particles of the rings, paths of the reference. `cargo bench --bench host`.

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use cumuli::frame::population::Shapes;
use cumuli::medium::Phase;
use cumuli::reference::{Film, Filter, Random, View, World, speed};
use cumuli::scene::{DEFAULT_SCENE, Scene};
use cumuli::tables::TableSet;
use cumuli::tables::scattering::{bake, mapping::Geometry};
use glam::DVec3;

/// Chords and directions that are looked up one after the other.
const RAYS: usize = 1024;
const PHASE: Phase = Phase::Mie { diameter_um: 20.0 };

fn tables() -> TableSet {
    TableSet::embedded().expect("the built-in tables")
}

fn scene() -> Scene {
    Scene::from_toml(DEFAULT_SCENE, "the built-in scene", Path::new("")).expect("a scene")
}

fn on_sphere(random: &mut Random) -> DVec3 {
    let (z, turn) = (2.0 * random.unit() - 1.0, std::f64::consts::TAU * random.unit());
    let across = (1.0 - z * z).sqrt();
    DVec3::new(across * turn.cos(), across * turn.sin(), z)
}

fn lookups(c: &mut Criterion) {
    let tables = tables();
    let mut random = Random::new(1, 0, 0);
    let points: Vec<_> = (0..RAYS + 2).map(|_| on_sphere(&mut random)).collect();
    let rays = || points.windows(3).map(|p| (p[0], p[1], p[2]));
    let mut group = c.benchmark_group("lookup");
    group.throughput(criterion::Throughput::Elements(RAYS as u64));
    group.bench_function("chord_profile", |b| {
        b.iter(|| rays().map(|(a, e, _)| tables.chord_profile(1, a, e).mean_density).sum::<f32>());
    });
    group.bench_function("chord_step", |b| {
        b.iter(|| rays().map(|(a, e, _)| tables.chord_step(1, a, e).mean_density).sum::<f32>());
    });
    let scattering = tables.scattering_for(&PHASE, 1.0).expect("built in");
    group.bench_function("scattering", |b| {
        let one = |(entry, exit, sun): (DVec3, DVec3, DVec3)| {
            scattering.lookup(entry, (exit - entry).normalize(), sun, 4.0)[1]
        };
        b.iter(|| rays().map(one).sum::<f64>());
    });
    group.finish();
}

fn solver(c: &mut Criterion) {
    let ray = Geometry::of(DVec3::new(0.0, 0.0, 1.0), DVec3::NEG_Z, DVec3::Y);
    // A remainder of 0.1 is reached in the first steps.
    c.bench_function("solver/optical_radius_1", |b| {
        b.iter(|| bake::sources(&PHASE, 1.0, black_box(&[ray]), 1.0, 0.1).0);
    });
}

fn rings(c: &mut Criterion) {
    let (shapes, scene) = (Shapes::new(&tables()), scene());
    c.bench_function("rings/cumulus", |b| {
        b.iter(|| shapes.populate(black_box(&scene), 0.0).expect("particles").len());
    });
}

fn path_tracer(c: &mut Criterion) {
    let mut group = c.benchmark_group("path_tracer");
    const PATHS: u64 = 1 << 11;
    group.throughput(criterion::Throughput::Elements(PATHS));
    group.bench_function("spheres", |b| b.iter(|| speed(PATHS).radiance));
    let (tables, scene) = (tables(), scene());
    let world = World::new(&scene, &tables, 0.0).expect("a world");
    let size = [32, 18];
    let view = View::new(&scene.camera, size, None, Filter::Box);
    group.throughput(criterion::Throughput::Elements(u64::from(size[0] * size[1])));
    group.bench_function("cumulus", |b| {
        b.iter(|| {
            let mut film = Film::new(size);
            world.expose_rows(&mut film, &view, 0, size[1]);
            film.mean()
        });
    });
    group.finish();
}

criterion_group! {
    name = host;
    config = Criterion::default().sample_size(10).measurement_time(Duration::from_secs(4));
    targets = lookups, solver, rings, path_tracer
}
criterion_main!(host);
