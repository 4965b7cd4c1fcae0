//! The path tracer in a furnace: uniform light from all sides and albedo 1 make every cloud
//! invisible, whatever its optical depth, phase function or overlap. And how fast it is.

use std::sync::Arc;

use cumuli::medium::{Phase, Sea, Shape};
use cumuli::reference::{
    Film, Filter, Matter, ParticleGrid, Random, UniformSky, View, WorldParticle,
};
use cumuli::scene::Camera;
use glam::{DQuat, DVec3};

/// Overlapping spheres in a ball of 500 m.
fn clump(count: usize, shape: &str, extinction: f64) -> ParticleGrid {
    let shape = Arc::new(Shape::new(shape.parse().expect("a shape")));
    let mut random = Random::new(7, 0, 0);
    let mut particles = Vec::new();
    while particles.len() < count {
        let place = DVec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0;
        if place.length() < 1.0 {
            particles.push(WorldParticle {
                centre: place * 500.0,
                radius: 80.0 + 80.0 * random.unit(),
                extinction,
                to_own: DQuat::from_rotation_y(random.unit() * 6.0),
                shape: shape.clone(),
            });
        }
    }
    ParticleGrid::new(particles)
}

fn view(size: [u32; 2]) -> View {
    let camera = Camera {
        position: DVec3::new(0.0, 0.0, 1500.0),
        target: DVec3::ZERO,
        fov_x: 40.0,
        ..Camera::default()
    };
    View::new(&camera, size, None, Filter::Box)
}

#[test]
fn clouds_vanish_in_a_furnace() {
    for (shape, phase) in
        [("uniform", "hg:0.85"), ("soft-1", "hg:0"), ("pyroclastic-2", "mie:20um")]
    {
        let medium = clump(60, shape, 0.03);
        let phase: Phase = phase.parse().expect("a phase function");
        let matter = Matter { phase: phase.prepare(), albedo: 1.0 };
        let sky =
            UniformSky { radiance: DVec3::new(1.0, 0.5, 0.25), sun: None, ground: None, sea: None };
        let mut film = Film::new([24, 16]);
        film.expose(&medium, &sky, &matter, &view([24, 16]), 1, 4);
        for pixel in 0..film.pixels.len() {
            let [red, green, ..] = film.estimates(pixel);
            // Every path of albedo 1 brings the sky's radiance home: no noise at all.
            assert!((red.value - 1.0).abs() < 1e-12 && (green.value - 0.5).abs() < 1e-12);
        }
        let covered = (0..film.pixels.len()).filter(|&i| film.estimates(i)[3].value < 0.5).count();
        assert!(covered > 50, "{shape}: the clump covers {covered} pixels, so it was met");
    }
}

/// A sea of albedo 1 sends back all that falls on it: it vanishes with the clouds over it, but for the noise of its facets.
#[test]
fn a_white_sea_vanishes_in_a_furnace() {
    let medium = clump(60, "uniform", 0.03);
    let phase: Phase = "mie:20um".parse().expect("a phase function");
    let matter = Matter { phase: phase.prepare(), albedo: 1.0 };
    for wind in [0.0, 5.0, 30.0] {
        let sea = Some(Sea::new(wind));
        let sky = UniformSky { radiance: DVec3::ONE, sun: None, ground: Some(DVec3::ONE), sea };
        let camera = Camera {
            position: DVec3::new(0.0, 500.0, 1500.0),
            target: DVec3::ZERO,
            fov_x: 60.0,
            ..Camera::default()
        };
        let view = View::new(&camera, [24, 16], None, Filter::Box);
        let mut film = Film::new([24, 16]);
        film.expose(&medium, &sky, &matter, &view, 1, 64);
        let red = (0..film.pixels.len()).map(|pixel| film.estimates(pixel)[0]);
        let (sum, square, most) = red.fold((0.0, 0.0, 0.0f64), |(sum, square, most), e| {
            (sum + e.value, square + e.standard_error.powi(2), most.max(e.value))
        });
        let count = film.pixels.len() as f64;
        let (mean, error) = (sum / count, square.sqrt() / count);
        println!("wind {wind}: {mean:.5} +- {error:.5}, at most {most:.3}");
        // The tables of reflectances are within 6e-4 of a share.
        assert!((mean - 1.0).abs() < 4.0 * error + 1e-3 && error < 5e-3, "{wind}: {mean} {error}");
    }
}
