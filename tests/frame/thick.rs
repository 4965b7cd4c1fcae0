//! Thick clouds over the path tracer, from their lit and their dark sides.

use std::sync::Arc;

use cumuli::frame::Preset;
use cumuli::medium::Shape;
use cumuli::reference::{
    Film, Filter, Matter, ParticleGrid, SunDisc, UniformSky, View, WorldParticle,
};
use cumuli::scene::Scene;
use glam::{DQuat, DVec3};

use crate::{alone, particle, picture, space};

/// m.
const RADIUS: f64 = 200.0;
/// Spheres at one place: none of them is alone, so that the light grid lights them, not their table.
const COUNT: usize = 8;
/// 1/m, of all together: optical thickness 80.
const EXTINCTION: f64 = 0.2;
/// Pixels a side, and those of the frame for one of the reference.
const SIDE: u32 = 12;
const FINER: u32 = 4;

fn ball(sun: DVec3, eye: DVec3) -> Scene {
    let one = particle(DVec3::ZERO, RADIUS, EXTINCTION / COUNT as f64, "uniform");
    let mut scene = space(0.0, 1.0, eye, vec![one; COUNT]);
    scene.camera.fov_x = 16.0;
    scene.sun.direction = sun;
    scene.medium.phase = "mie:20um".parse().expect("a phase function");
    scene.medium.albedo = 1.0;
    scene
}

/// Mean radiance of all pixels, traced.
fn traced(scene: &Scene) -> f64 {
    let shape = Arc::new(Shape::new("uniform".parse().expect("a shape")));
    let particles = scene.particles.iter().map(|p| WorldParticle {
        centre: p.centre,
        radius: p.radius,
        extinction: p.extinction,
        to_own: DQuat::IDENTITY,
        shape: shape.clone(),
    });
    let medium = ParticleGrid::new(particles.collect());
    let matter = Matter { phase: scene.medium.phase.prepare(), albedo: 1.0 };
    let sun = SunDisc::new(scene.sun.direction, DVec3::ONE, 0.0093);
    let sky = UniformSky { radiance: DVec3::ZERO, sun: Some(sun), ground: None, sea: None };
    let view = View::new(&scene.camera, [SIDE; 2], None, Filter::Box);
    let mut film = Film::new([SIDE; 2]);
    film.expose(&medium, &sky, &matter, &view, 3, 400);
    (0..film.pixels.len()).map(|i| film.estimates(i)[1].value).sum::<f64>()
        / film.pixels.len() as f64
}

#[test]
fn thick_clouds_are_lit_and_dark_as_they_are_traced() {
    let _turn = alone();
    // 30 degrees off, so that the eye does not see the sun's disc past the ball.
    for (side, sun) in [
        ("lit", DVec3::new(0.5, 0.0, 0.75f64.sqrt())),
        ("dark", DVec3::new(0.5, 0.0, -(0.75f64.sqrt()))),
    ] {
        let scene = ball(sun, DVec3::new(0.0, 0.0, 1600.0));
        let frame = picture(&scene, Preset::High, [SIDE * FINER; 2]);
        let mean = frame.radiance.iter().map(|v| f64::from(v[1])).sum::<f64>()
            / frame.radiance.len() as f64;
        let ratio = mean / traced(&scene);
        println!("{side}: {ratio:.3} of the traced light");
        // Where sunlight is passed on from cell to cell and light looked up far apart, 0.83 and 1.68. What is left
        // is the width of cells of 1.8 mean free paths.
        let bounds = if side == "lit" { 0.87..1.03 } else { 0.95..1.4 };
        assert!(bounds.contains(&ratio), "{side}: {ratio}");
    }
}
