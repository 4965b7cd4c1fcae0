//! The corners of what is allowed, each a case with a name.

use glam::{DQuat, DVec3};

use super::{Case, MEDIA, Way, live, weather};
use crate::frame::Preset;
use crate::medium::Phase;
use crate::scene::{Camera, CloudField, Ground, Medium, ParticleSpec, Scene, Sky};

/// A noise shape of the built-in tables.
pub(super) const NOISE: &str = "pyroclastic-1";
/// Distance of the eye in most cases, m.
const AWAY: f64 = 300.0;

/// Collects cases.
struct Corners {
    size: [u32; 2],
    preset: Preset,
    cases: Vec<Case>,
}

/// A particle with a turn that is nothing special.
pub(super) fn particle(centre: DVec3, radius: f64, extinction: f64, shape: &str) -> ParticleSpec {
    let orientation = DQuat::from_euler(glam::EulerRot::YXZ, 0.4, 1.1, -0.7);
    ParticleSpec { centre, radius, extinction, shape: shape.to_owned(), orientation }
}

/// Particles under a uniform sky and the sun, from `eye` towards the origin.
pub(super) fn space(eye: DVec3, particles: Vec<ParticleSpec>) -> Scene {
    let mut scene = Scene { sky: Sky::Uniform { radiance: 0.05 }, particles, ..Scene::default() };
    scene.sun.direction = DVec3::new(0.48, 0.64, 0.6);
    scene.camera = Camera { position: eye, target: DVec3::ZERO, fov_x: 50.0, ..scene.camera };
    scene
}

/// Overlapping particles of both kinds around a point.
pub(super) fn clump(origin: DVec3) -> Scene {
    let particles = (0..12u32)
        .map(|number| {
            let i = f64::from(number);
            let (sin, cos) = (2.399963 * i).sin_cos(); // the golden angle, rad
            let centre = 25.0 * i.sqrt() * DVec3::new(cos, 0.4 * (1.7 * i).sin(), sin);
            let shape = if number.is_multiple_of(2) { NOISE } else { "uniform" };
            particle(origin + centre, 40.0 + 30.0 * (0.37 * i).fract(), 0.03, shape)
        })
        .collect();
    let mut scene = space(origin + DVec3::new(60.0, 90.0, AWAY), particles);
    scene.camera.target = origin;
    scene
}

/// A small cloud field over the ground, seen from a meadow.
pub(super) fn field() -> Scene {
    let clouds = CloudField { cells: 16, rings: 2, coverage: 0.6, ..CloudField::default() };
    let mut scene = Scene { clouds: Some(clouds), ..Scene::default() };
    scene.camera.target = DVec3::new(0.0, 600.0, -600.0);
    scene
}

/// All corners, at a size of picture where the case is not about it, and a quality.
pub fn corners(size: [u32; 2], preset: Preset) -> Vec<Case> {
    let mut c = Corners { size, preset, cases: Vec::new() };
    c.extinctions();
    c.overlaps();
    c.rays();
    c.cameras();
    c.suns();
    c.times();
    c.weather();
    c.views();
    c.skies();
    c.seas();
    c.numbers();
    c.media();
    let live = live::corners(&c.cases, size);
    c.cases.into_iter().chain(live).collect()
}

impl Corners {
    fn add(&mut self, name: impl Into<String>, scene: Scene) {
        let (name, size, preset) = (name.into(), self.size, self.preset);
        let (time, way, like) = (0.0, Way::Alone, None);
        self.cases.push(Case { name, scene, time, size, preset, way, like });
    }

    /// From nothing to stone, from a drop to a continent.
    fn extinctions(&mut self) {
        for radius in [1e-3, 1.0, 1e3, 1e6] {
            for extinction in [0.0, 1e-30, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6] {
                let eye = DVec3::new(0.0, 0.0, 2.5 * radius);
                let around = [
                    particle(DVec3::ZERO, radius, extinction, "uniform"),
                    particle(DVec3::new(0.9, 0.3, -0.2) * radius, radius, extinction, NOISE),
                    particle(eye * 1.1, radius, extinction, NOISE),
                ];
                let name = format!("extinction {extinction:e}/m, radius {radius:e} m");
                self.add(name, space(eye, around.to_vec()));
            }
        }
    }

    fn overlaps(&mut self) {
        let eye = DVec3::new(0.0, 0.0, AWAY);
        for shape in ["uniform", NOISE] {
            for count in [2, 9, 64] {
                for extinction in [1e-4, 0.1] {
                    let one = particle(DVec3::ZERO, 100.0, extinction, shape);
                    let name = format!("{count} coincident, {shape}, {extinction}/m");
                    self.add(name, space(eye, vec![one; count]));
                }
            }
        }
        for extinction in [1e-5, 1e-3, 1.0] {
            let row = |i: i32| {
                let centre = DVec3::new(0.0, 0.0, 0.4 * f64::from(i) - 200.0);
                particle(centre, 60.0, extinction, if i % 2 == 0 { NOISE } else { "uniform" })
            };
            let name = format!("400 overlaps on a pixel, {extinction}/m");
            self.add(name, space(eye, (0..400).map(row).collect()));
        }
        for [outer, inner] in [[1e-6, 1e3], [1e3, 1e-6], [0.02, 0.02]] {
            for small in [1e-3, 1.0, 99.9] {
                let nested = vec![
                    particle(DVec3::ZERO, 100.0, outer, "uniform"),
                    particle(DVec3::new(0.05, 0.0, 0.0), small, inner, NOISE),
                ];
                self.add(
                    format!("{small} m of {inner}/m inside 100 m of {outer}/m"),
                    space(eye, nested),
                );
            }
        }
        for small in [1e-3, 1.0] {
            let behind = vec![
                particle(DVec3::ZERO, 100.0, 1e-4, "uniform"),
                particle(DVec3::Z * -80.0, small, 1e-4, NOISE),
            ];
            self.add(format!("a ray to {small} m at the far side of 100 m"), space(eye, behind));
            self.last_size([1, 1]);
        }
    }

    /// One ray, along the view axis, to places where a sphere is special.
    fn rays(&mut self) {
        let (eye, radius) = (DVec3::new(0.0, 0.0, AWAY), 100.0_f64);
        for shape in ["uniform", NOISE] {
            let tangent = [radius.next_down(), radius, radius.next_up(), radius * (1.0 - 1e-7)];
            for x in [tangent[0], tangent[1], tangent[2], tangent[3], 0.0] {
                let mut scene = space(eye, vec![particle(DVec3::X * x, radius, 1.0, shape)]);
                scene.camera.target = DVec3::ZERO;
                self.add(format!("a ray {x:?} m from a centre of {radius} m, {shape}"), scene);
                self.last_size([1, 1]);
            }
        }
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            for sign in [1.0, -1.0] {
                let mut one = particle(DVec3::ZERO, radius, 0.05, NOISE);
                one.orientation = DQuat::IDENTITY;
                let mut scene = space(sign * AWAY * axis, vec![one]);
                scene.sun.direction = axis;
                self.add(format!("a ray through the poles along {}", sign * axis), scene);
                self.last_size([1, 1]);
            }
        }
    }

    fn cameras(&mut self) {
        let scene = clump(DVec3::new(0.0, 500.0, 0.0));
        let first = scene.particles[0].clone();
        let mut at = |name: String, position: DVec3, target: DVec3| {
            let mut scene = Scene { sky: Sky::Atmosphere, ..scene.clone() };
            (scene.camera.position, scene.camera.target) = (position, target);
            self.add(name, scene);
        };
        let surface = first.centre + DVec3::Z * first.radius;
        at("the eye on a surface, looking in".to_owned(), surface, first.centre);
        at("the eye on a surface, along it".to_owned(), surface, surface + DVec3::X);
        at("the eye at a centre".to_owned(), first.centre, first.centre + DVec3::NEG_Z);
        at("the eye at a centre, straight up".to_owned(), first.centre, first.centre + DVec3::Y);
        for altitude in [-100.0, 0.0, 1e-3, 1e5, 4e5, 1e7, 1e10, 1e11] {
            let position = DVec3::new(0.0, altitude, 10.0);
            at(format!("the eye {altitude:e} m high"), position, first.centre);
        }
        at("the eye at the ground, level".to_owned(), DVec3::ZERO, DVec3::NEG_Z);
        at("the eye at the ground, down".to_owned(), DVec3::ZERO, DVec3::NEG_Y);
        for away in [1e4, 1e6, 1e8, 1e10, 9e10] {
            let mut scene = clump(DVec3::new(-away, 500.0, 0.7 * away));
            scene.sky = Sky::Atmosphere;
            self.add(format!("{away:e} m from the origin"), scene);
        }
        for away in [1e7, 1e10] {
            let mut scene = field();
            scene.camera.position.x += away;
            scene.camera.target.x += away;
            self.add(format!("a field {away:e} m from the origin"), scene);
        }
        let mut scene = field();
        scene.particles = vec![particle(DVec3::new(0.0, 3e4, 0.0), 2e4, 1e-5, NOISE)];
        self.add("a giant over a field", scene);
    }

    fn suns(&mut self) {
        let tiny = DVec3::new(1.0, 1e-9, 0.0).normalize();
        let below = DVec3::new(0.8, -0.6, 0.0);
        let dusk = DVec3::new(0.0, -0.02, -1.0).normalize();
        let axes = [DVec3::Y, DVec3::NEG_Y, DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z];
        for sun in axes.into_iter().chain([tiny, below, dusk]) {
            for sky in [Sky::Atmosphere, Sky::Uniform { radiance: 0.0 }] {
                let mut scene = clump(DVec3::new(0.0, 800.0, 0.0));
                scene.ground = Some(Ground::default());
                (scene.sky, scene.sun.direction) = (sky, sun);
                let air = if sky == Sky::Atmosphere { "air" } else { "vacuum" };
                self.add(format!("the sun at {sun}, {air}"), scene);
            }
        }
        for diameter in [0.01, 20.0] {
            let mut scene = clump(DVec3::new(0.0, 800.0, 0.0));
            scene.sun.angular_diameter = diameter;
            scene.sun.direction = (scene.camera.target - scene.camera.position).normalize();
            self.add(format!("a sun of {diameter} degrees behind the cloud"), scene);
        }
    }

    fn times(&mut self) {
        for time in [-1.0, 1e9, -1e9, 1e10, -1e10] {
            self.add(format!("a field at {time:e} s"), field());
            if let Some(case) = self.cases.last_mut() {
                case.time = time;
            }
        }
        for evolution in [1.0, 1e9] {
            let mut scene = field();
            if let Some(clouds) = &mut scene.clouds {
                clouds.evolution_time = evolution;
            }
            self.add(format!("a field that evolves in {evolution:e} s"), scene);
        }
        for (coverage, extinction) in [(0.0, 0.05), (1.0, 1e6), (1.0, 1e-9)] {
            let mut scene = field();
            if let Some(clouds) = &mut scene.clouds {
                (clouds.coverage, clouds.extinction) = (coverage, extinction);
            }
            self.add(format!("a field, coverage {coverage}, {extinction:e}/m"), scene);
        }
    }

    fn weather(&mut self) {
        for (name, scene) in weather::scenes() {
            self.add(name, scene);
        }
    }

    fn views(&mut self) {
        for fov in [1.0, 179.0] {
            let mut scene = clump(DVec3::new(0.0, 800.0, 0.0));
            (scene.sky, scene.camera.fov_x) = (Sky::Atmosphere, fov);
            self.add(format!("a field of view of {fov} degrees"), scene);
        }
        for size in [[1, 1], [1, 300], [300, 1], [8192, 1], [1, 8192], [7, 3], [65, 9]] {
            let mut scene = clump(DVec3::new(0.0, 800.0, 0.0));
            scene.sky = Sky::Atmosphere;
            self.add(format!("{} x {} pixels", size[0], size[1]), scene);
            self.last_size(size);
        }
    }

    fn last_size(&mut self, size: [u32; 2]) {
        if let Some(case) = self.cases.last_mut() {
            case.size = size;
        }
    }

    fn skies(&mut self) {
        for (radiance, irradiance) in [(0.0, 0.0), (1e6, 0.0), (0.0, 1e6), (1e6, 1e6), (1.0, 0.0)] {
            let mut scene = clump(DVec3::ZERO);
            scene.sky = Sky::Uniform { radiance };
            scene.sun.irradiance = irradiance;
            self.add(format!("a sky of {radiance:e}, a sun of {irradiance:e}"), scene);
        }
        for irradiance in [0.0, 1e-6, 1e6] {
            let mut scene = clump(DVec3::new(0.0, 800.0, 0.0));
            (scene.sky, scene.sun.irradiance) = (Sky::Atmosphere, irradiance);
            self.add(format!("air under a sun of {irradiance:e}"), scene);
        }
        for albedo in [0.0, 1.0] {
            let mut scene = clump(DVec3::new(0.0, 300.0, 0.0));
            scene.sky = Sky::Atmosphere;
            scene.ground = Some(Ground::plain(DVec3::splat(albedo)));
            self.add(format!("a ground of albedo {albedo}"), scene);
        }
    }

    /// A sea of no wind and of a storm, from its surface to far away, with the sun up, at the horizon and below it.
    fn seas(&mut self) {
        for wind in [0.0, 60.0] {
            let mut scene = clump(DVec3::new(0.0, 300.0, 0.0));
            scene.sky = Sky::Atmosphere;
            scene.ground =
                Some(Ground::sea(wind, DVec3::splat(if wind > 0.0 { 1.0 } else { 0.0 })));
            scene.camera.target.y = 0.0;
            let mut at = |name: &str, eye: DVec3, sun: DVec3| {
                let mut scene = scene.clone();
                scene.camera.position = eye;
                scene.sun.direction = sun.normalize();
                self.add(format!("a sea, wind {wind} m/s, {name}"), scene);
            };
            let (high, sun) = (DVec3::new(60.0, 390.0, AWAY), DVec3::new(0.48, 0.64, 0.6));
            at("from above", high, sun);
            at("the eye at the surface", DVec3::new(0.0, 0.0, AWAY), sun);
            at("the eye right above", DVec3::new(0.0, AWAY, 0.0), DVec3::Y);
            at("the sun at the horizon", high, DVec3::NEG_Z);
            at("the sun below the horizon", high, DVec3::new(0.0, -0.1, -1.0));
            at("from orbit", DVec3::new(0.0, 1e7, 1e7), sun);
            at("1e10 m high", DVec3::new(0.0, 1e10, 10.0), sun);
        }
        let mut scene = clump(DVec3::new(0.0, 300.0, 0.0));
        scene.ground = Some(Ground::sea(5.0, DVec3::ONE));
        self.add("a sea under a uniform sky", scene);
        let mut scene = field();
        scene.ground = Some(Ground::sea(5.0, DVec3::splat(0.05)));
        scene.camera.target = DVec3::new(0.0, -100.0, -600.0);
        self.add("a sea under a field", scene.clone());
        scene.clouds = None;
        self.add("a sea without clouds", scene);
    }

    fn numbers(&mut self) {
        let eye = DVec3::new(0.0, 0.0, AWAY);
        self.add("no particles", space(eye, Vec::new()));
        let mut scene = Scene { sky: Sky::Atmosphere, ..space(eye, Vec::new()) };
        scene.camera.position.y = 2.0;
        self.add("no particles, air", scene.clone());
        scene.camera.target = scene.camera.position - DVec3::Y;
        self.add("no particles, the ground right below", scene);
        self.add("one particle", space(eye, vec![particle(DVec3::ZERO, 50.0, 0.1, NOISE)]));
        let far = |i: i32| particle(DVec3::X * 1e9 * f64::from(i), 1e-3, 1e6, "uniform");
        self.add("two drops 2e9 m apart", space(eye, vec![far(-1), far(1)]));
    }

    fn media(&mut self) {
        for (phase, albedo) in MEDIA {
            let media = [Medium { phase, albedo }];
            for sky in [Sky::Atmosphere, Sky::Uniform { radiance: 1.0 }] {
                let mut scene = clump(DVec3::new(0.0, 800.0, 0.0));
                (scene.sky, scene.medium) = (sky, media[0]);
                if sky != Sky::Atmosphere {
                    scene.sun.irradiance = 0.0;
                }
                let light = if sky == Sky::Atmosphere { "sun and air" } else { "a uniform sky" };
                self.add(format!("{phase}, albedo {albedo}, {light}"), scene);
            }
            let mut alone = space(
                DVec3::new(0.0, 0.0, AWAY),
                vec![particle(DVec3::ZERO, 100.0, 1e6, "uniform")],
            );
            alone.medium = media[0];
            self.add(format!("{phase}, albedo {albedo}, alone and opaque"), alone);
        }
        // What needs no tables of its own goes first: fewer renderers.
        let built_in = |case: &Case| case.scene.medium == Medium::default();
        self.cases.sort_by_key(|case| !built_in(case));
        debug_assert!(MEDIA[0].0 == Phase::Mie { diameter_um: 20.0 });
    }
}
