//! Scenes beyond the limits, as a program may make them: each must be refused with the name of the
//! field, by the renderer itself.

use glam::{DQuat, DVec3};

use super::corners::{field, particle};
use crate::medium::Phase;
use crate::scene::{CloudField, Ground, Scene, Sky};

/// Numbers that are never in range.
const NEVER: [f64; 4] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1e300];

/// A scene with one value out of range.
#[derive(Clone, Debug)]
pub struct Beyond {
    /// The field that must be named.
    pub field: &'static str,
    /// The scene.
    pub scene: Scene,
    /// s.
    pub time: f64,
}

/// Sets one value of a scene.
type Set = fn(&mut Scene, f64);

/// Sets a whole number of a field.
type SetField = fn(&mut CloudField);

fn clouds(scene: &mut Scene) -> &mut CloudField {
    scene.clouds.get_or_insert_with(CloudField::default)
}

/// Fields, how they are set, and a value just out of their range.
const FIELDS: &[(&str, Set, f64)] = &[
    ("camera.position", |s, v| s.camera.position.x = v, 1.1e11),
    ("camera.target", |s, v| s.camera.target.z = v, -1.1e11),
    ("camera.up", |s, v| s.camera.up = DVec3::splat(v), 0.0),
    ("camera.fov_x", |s, v| s.camera.fov_x = v, 179.5),
    ("camera.aperture", |s, v| s.camera.aperture = v, 1.1e4),
    ("camera.focus_distance", |s, v| s.camera.focus_distance = Some(v), 1e-4),
    ("camera.shutter", |s, v| s.camera.shutter = v, 1.1e6),
    ("sun.direction", |s, v| s.sun.direction = DVec3::splat(v), 3.0),
    ("sun.irradiance", |s, v| s.sun.irradiance = v, 1.1e6),
    ("sun.angular_diameter", |s, v| s.sun.angular_diameter = v, 0.0),
    ("sky.radiance", |s, v| s.sky = Sky::Uniform { radiance: v }, -1e-9),
    ("ground.albedo", |s, v| s.ground = Some(Ground::plain(DVec3::splat(v))), 1.01),
    ("ground.wind_speed", |s, v| s.ground = Some(Ground::sea(v, DVec3::ZERO)), 60.1),
    ("medium.albedo", |s, v| s.medium.albedo = v, 1.01),
    ("output.exposure", |s, v| s.exposure = v, 25.0),
    ("particles[0].centre", |s, v| s.particles[0].centre.y = v, 1.1e11),
    ("particles[0].radius", |s, v| s.particles[0].radius = v, 0.0),
    ("particles[0].extinction", |s, v| s.particles[0].extinction = v, 1.1e6),
    (
        "particles[0].orientation",
        |s, v| s.particles[0].orientation = DQuat::from_xyzw(v, 0.0, 0.0, v),
        3.0,
    ),
    ("clouds.base", |s, v| clouds(s).base = v, 2.1e4),
    ("clouds.thickness", |s, v| clouds(s).thickness = v, 0.0),
    ("clouds.coverage", |s, v| clouds(s).coverage = v, 1.1),
    ("clouds.extinction", |s, v| clouds(s).extinction = v, 1.1e6),
    ("clouds.feature_size", |s, v| clouds(s).feature_size = v, 1.0),
    ("clouds.cell_size", |s, v| clouds(s).cell_size = v, 0.5),
    ("clouds.particle_size", |s, v| clouds(s).particle_size = v, 5.0),
    ("clouds.wind", |s, v| clouds(s).wind.y = v, 201.0),
    ("clouds.evolution_time", |s, v| clouds(s).evolution_time = v, 0.0),
];

/// Whole numbers of the field out of range.
const WHOLE: &[(&str, SetField)] = &[
    ("clouds.cells", |c| c.cells = 0),
    ("clouds.cells", |c| c.cells = 3),
    ("clouds.cells", |c| c.cells = u32::MAX),
    ("clouds.rings", |c| c.rings = 0),
    ("clouds.rings", |c| c.rings = 9),
    ("clouds.layers", |c| c.layers = 0),
    ("clouds.layers", |c| c.layers = u32::MAX),
    ("clouds: ", |c| (c.cells, c.rings, c.layers) = (512, 8, 64)),
    ("clouds.shapes[0]", |c| c.shapes = vec![String::new()]),
    ("clouds.shapes[0]", |c| c.shapes = vec!["no such shape".to_owned()]),
    ("clouds.shapes", |c| c.shapes = vec!["soft-1".to_owned(); 9]),
];

/// All of them.
pub fn beyond() -> Vec<Beyond> {
    let one = || {
        let particles = vec![particle(DVec3::ZERO, 10.0, 0.1, "uniform")];
        Scene { particles, ..Scene::default() }
    };
    let mut result = Vec::new();
    for &(field, set, value) in FIELDS {
        // A direction to be scaled may have any length.
        let any_length = |v: &f64| field != "camera.up" || !v.is_finite();
        for value in NEVER.into_iter().filter(any_length).chain([value]) {
            let mut scene = one();
            set(&mut scene, value);
            result.push(Beyond { field, scene, time: 0.0 });
        }
    }
    for &(name, set) in WHOLE {
        let mut scene = field();
        set(clouds(&mut scene));
        result.push(Beyond { field: name, scene, time: 0.0 });
    }
    for phase in [Phase::Hg { g: 1.0 }, Phase::Hg { g: f64::NAN }, Phase::Mie { diameter_um: 0.0 }]
    {
        let mut scene = one();
        scene.medium.phase = phase;
        result.push(Beyond { field: "medium.phase", scene, time: 0.0 });
    }
    let mut scene = one();
    scene.camera.target = scene.camera.position;
    result.push(Beyond { field: "camera.target", scene, time: 0.0 });
    let mut scene = one();
    scene.particles[0].shape = "no such shape".to_owned();
    result.push(Beyond { field: "particles[0].shape", scene, time: 0.0 });
    for time in NEVER.into_iter().chain([1.1e10]) {
        result.push(Beyond { field: "time", scene: one(), time });
    }
    result
}
