//! Energy: a particle that absorbs nothing is invisible in uniform light, and one that is alone in
//! sunlight shines as its table says.

use cumuli::frame::{Picture, Preset, RenderSettings, Renderer};
use cumuli::medium::Phase;
use cumuli::scene::{ParticleSpec, Scene};
use cumuli::tables::{ScatteringOptions, ScatteringTable, Silent, TableSet};
use glam::DVec3;

use crate::{GPU, TABLES, alone, particle, settings, space};

/// Radiance of the sky; not a power of two, so that rounding shows.
const SKY: f64 = 0.0318;
const RADIUS: f64 = 150.0;
const SIZE: [u32; 2] = [48, 40];

/// The furnace is about the sky's light alone; a coarse table of other phase functions will do.
fn tables_for(phase: Phase) -> TableSet {
    let options = ScatteringOptions {
        resolution: [4, 4, 4, 8],
        remainder: 1e-2,
        ..ScatteringOptions::default()
    };
    let table = ScatteringTable::bake(phase, 1.0, &options, &Silent).expect("a small table");
    let depth = TABLES.optical_depth().to_vec();
    TableSet::new(depth, *TABLES.optical_depth_options(), vec![table]).expect("a set")
}

/// Largest relative deviation of any channel of any pixel from the sky's radiance.
fn deviation(picture: &Picture) -> f64 {
    let off = |v: &f32| (f64::from(*v) / SKY - 1.0).abs();
    picture.radiance.iter().flat_map(|p| p[..3].iter().map(off)).fold(0.0, f64::max)
}

/// Opacity in the middle of the picture.
fn opacity(picture: &Picture) -> f64 {
    let middle = SIZE[0] * (SIZE[1] / 2) + SIZE[0] / 2;
    f64::from(picture.radiance[middle as usize][3])
}

fn one(optical_depth: f64, shape: &str) -> Vec<ParticleSpec> {
    vec![particle(DVec3::ZERO, RADIUS, optical_depth / (2.0 * RADIUS), shape)]
}

fn frame(renderer: &mut Renderer, scene: &Scene) -> Picture {
    let picture = renderer.render(scene, 0.0, SIZE).expect("a frame");
    assert_eq!(picture.stats.counters.overflowed, 0);
    picture
}

/// Asked for is half a percent; composing one chord costs a few roundings of f32.
const ONE_PARTICLE: f64 = 1e-5;

#[test]
fn one_particle_is_invisible_in_uniform_light() {
    let _turn = alone();
    let eyes = [
        DVec3::new(-90.0, 260.0, 400.0), // outside
        DVec3::new(30.0, -60.0, 80.0),   // inside
        DVec3::new(0.0, 0.0, 1e-3),      // at its centre
    ];
    let noise = TABLES.shape_names().nth(1).expect("a noise shape").to_owned();
    for phase in [Phase::Mie { diameter_um: 20.0 }, Phase::Hg { g: 0.85 }, Phase::Hg { g: 0.0 }] {
        let own;
        let tables = match TABLES.scattering_for(&phase, 1.0) {
            Some(_) => &*TABLES,
            None => {
                own = tables_for(phase);
                &own
            }
        };
        let mut scene = space(SKY, 0.0, eyes[0], one(1.0, "uniform"));
        scene.medium.phase = phase;
        let mut renderer =
            Renderer::new(&GPU, tables, &scene, &settings(Preset::Low)).expect("a renderer");
        for eye in eyes {
            scene.camera.position = eye;
            for optical_depth in [0.01, 0.3, 1.0, 5.0, 20.0, 60.0] {
                for shape in ["uniform", &noise] {
                    scene.particles = one(optical_depth, shape);
                    let picture = frame(&mut renderer, &scene);
                    let off = deviation(&picture);
                    let what = format!("{phase} {eye} {optical_depth} {shape}");
                    assert!(off < ONE_PARTICLE, "{what}: {off}");
                    // It is there: the optical depth from the eye on through a uniform sphere.
                    if shape == "uniform" && eye == eyes[2] {
                        let expected = 1.0 - (-0.5 * optical_depth).exp();
                        let found = opacity(&picture);
                        assert!((found - expected).abs() < 1e-4, "{what}: {found} {expected}");
                    } else {
                        assert!(opacity(&picture) > 1e-3 * optical_depth.min(1.0), "{what}");
                    }
                }
            }
        }
    }
}

/// Asked for are 3 %. The model's diffuse light is exact here (the same from above and below), so
/// what is left are the roundings of some tens of chords.
const MANY_PARTICLES: f64 = 1e-4;

#[test]
fn many_overlapping_particles_are_invisible_in_uniform_light() {
    let _turn = alone();
    let names: Vec<_> = TABLES.shape_names().collect();
    let particles: Vec<_> = (0..150)
        .map(|i| {
            let i = f64::from(i);
            // A spiral of golden angles: overlaps of all kinds, the same every time.
            let (sin, cos) = (2.399963 * i).sin_cos();
            let centre = 12.0 * i.sqrt() * DVec3::new(cos, 0.4 * (1.7 * i).sin(), sin);
            let shape = names[i as usize % names.len()];
            particle(
                centre,
                25.0 + 40.0 * (0.37 * i).fract(),
                0.01 + 0.02 * (0.71 * i).fract(),
                shape,
            )
        })
        .collect();
    for preset in Preset::ALL {
        let mut scene = space(SKY, 0.0, DVec3::new(0.0, 120.0, 420.0), particles.clone());
        let mut renderer =
            Renderer::new(&GPU, &TABLES, &scene, &settings(preset)).expect("a renderer");
        for eye in [DVec3::new(0.0, 120.0, 420.0), DVec3::new(20.0, 3.0, 40.0)] {
            scene.camera.position = eye;
            let picture = frame(&mut renderer, &scene);
            let off = deviation(&picture);
            assert!(opacity(&picture) > 0.5, "{}", opacity(&picture));
            assert!(off < MANY_PARTICLES, "{preset} {eye}: {off}");
        }
    }
}

/// Pixels that are taken over come from others by a spline of a transmittance, which f32 holds to 6e-8, and
/// of radiance: sums of 16 products, frame after frame.
const TAKEN_OVER: f64 = 1e-4;

#[test]
fn pixels_taken_over_are_invisible_in_uniform_light() {
    let _turn = alone();
    // Opaque, with hard edges: there the spline swings most.
    let ball = |x: f64| particle(DVec3::new(x, 0.3 * x, 0.0), 60.0, 5.0, "uniform");
    let mut scene = space(SKY, 0.0, DVec3::Z, vec![ball(-90.0), ball(20.0), ball(110.0)]);
    let live = RenderSettings { live: true, ..settings(Preset::Medium) };
    let mut renderer = Renderer::new(&GPU, &TABLES, &scene, &live).expect("a renderer");
    for step in 0..6 {
        scene.camera.position = DVec3::new(7.0 * f64::from(step), 120.0, 420.0);
        let picture = renderer.render(&scene, 0.1 * f64::from(step), SIZE).expect("a frame");
        let shaded = picture.stats.counters.pixels_shaded;
        assert!(step == 0 || shaded < u64::from(SIZE[0] * SIZE[1] / 2), "frame {step}: {shaded}");
        assert!(opacity(&picture) > 0.99 || step > 1, "{}", opacity(&picture));
        let off = deviation(&picture);
        assert!(off < TAKEN_OVER, "frame {step}: {off}");
    }
}

/// The device filters the table with its texture unit, whose fractions may have 8 bits: a 256th
/// of the difference between neighbouring nodes, which stays below half a percent of the value.
/// Where it filters in f32 (lavapipe), 7e-5 was measured.
const LOOKUP: f64 = 5e-3;

#[test]
fn one_particle_in_sunlight_shines_as_its_table_says() {
    let _turn = alone();
    let eye = DVec3::new(-90.0, 260.0, 400.0);
    for phase in [Phase::Mie { diameter_um: 20.0 }, Phase::Hg { g: 0.85 }] {
        let table = TABLES.scattering_for(&phase, 1.0).expect("built in");
        let mut scene = space(0.0, 1.7, eye, one(1.0, "uniform"));
        scene.medium.phase = phase;
        scene.sun.angular_diameter = 0.01;
        let mut renderer =
            Renderer::new(&GPU, &TABLES, &scene, &settings(Preset::Medium)).expect("a renderer");
        let mut worst: f64 = 0.0;
        for optical_depth in [0.05, 1.0, 8.0, 40.0] {
            for sun in [DVec3::Y, DVec3::new(0.5, 0.3, -1.0), DVec3::new(-0.2, 0.1, 1.0)] {
                scene.particles = one(optical_depth, "uniform");
                scene.sun.direction = sun.normalize();
                let picture = frame(&mut renderer, &scene);
                let mut hits = 0;
                for (i, pixel) in picture.radiance.iter().enumerate() {
                    let [width, height] = SIZE.map(f64::from);
                    let (x, y) = (i % SIZE[0] as usize, i / SIZE[0] as usize);
                    let dir = scene.camera.ray(
                        (x as f64 + 0.5) / width,
                        (y as f64 + 0.5) / height,
                        width / height,
                    );
                    let expected = alone_in_sunlight(&scene, table, dir);
                    hits += usize::from(expected > 0.0);
                    // At grazing chords f32 loses digits of the chord's length.
                    let scale = expected.max(1e-4 * optical_depth.min(1.0));
                    let off = (f64::from(pixel[0]) - expected).abs() / scale;
                    worst = worst.max(off);
                    assert!(
                        off < LOOKUP,
                        "{phase} {optical_depth} {sun} {x},{y}: {pixel:?} {expected}"
                    );
                }
                assert!(hits > picture.radiance.len() / 4, "{hits} pixels see the particle");
            }
        }
        println!("{phase}: off by {worst} at most");
    }
}

/// Radiance of the scene's first particle as if there were nothing else, from the tables.
fn alone_in_sunlight(scene: &Scene, table: &ScatteringTable, dir: DVec3) -> f64 {
    let particle = &scene.particles[0];
    let centre = particle.centre - scene.camera.position;
    let middle = centre.dot(dir);
    let half_squared = particle.radius.powi(2) - (centre - middle * dir).length_squared();
    if half_squared <= 0.0 {
        return 0.0;
    }
    let half = half_squared.sqrt();
    let entry = ((middle - half) * dir - centre) / particle.radius;
    let sun = scene.sun.direction;
    let [once, more] = table.lookup(entry, dir, sun, particle.extinction * particle.radius);
    let opacity = -(-particle.extinction * 2.0 * half).exp_m1();
    scene.sun.irradiance * (once * scene.medium.phase.eval(dir.dot(sun)) + more) * opacity
}
