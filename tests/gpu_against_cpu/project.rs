//! Projections against rays and spheres: no tile may miss a particle that it shows, and none may
//! list what its bounds do not reach.

use cumuli::frame::cpu::{light_project, screen_project};
use cumuli::frame::gpu_data::{FrameUniforms, Particle};
use cumuli::frame::view::{Bounds, SCREEN_TILE, light_view};
use cumuli::scene::Camera;
use glam::{DVec2, DVec3};

use crate::common::Random;
use crate::pictures::{Population, ball, frame, read_lists};

/// Offsets of the rays in a pixel: a quarter from its borders, so that what decides is not the
/// rounding of a border between two tiles.
const IN_PIXEL: [f64; 2] = [0.25, 0.75];
/// Rounding of a border of a particle's bounds, pixels or tiles: f32 leaves 24 bits for places up
/// to 2000 and for the square root whose argument cancels where a particle nearly touches the eye.
const ROUNDING: f64 = 0.02;

/// Particles all around an eye at the origin that looks along `forward`.
pub fn particles(forward: DVec3, random: &mut Random) -> Vec<Particle> {
    let mut result = Vec::new();
    for _ in 0..150 {
        // In all directions: beside and behind the eye too, some around it.
        let distance = 10f64.powf(random.between(0.0, 4.0));
        let radius = distance * 10f64.powf(random.between(-3.0, 0.2));
        result.push(ball(random.direction() * distance, radius, 0.1));
    }
    for _ in 0..100 {
        // In and around the picture.
        let direction = (forward + random.direction() * 0.8).normalize();
        result.push(ball(direction * random.between(50.0, 5000.0), random.between(1.0, 80.0), 0.1));
    }
    // Straight ahead and behind; too small for any ray; eye on the surface, just inside and just
    // outside; without matter.
    result.push(ball(forward * 100.0, 10.0, 0.1));
    result.push(ball(forward * -100.0, 10.0, 0.1));
    result.push(ball(forward * 5000.0, 1e-3, 0.1));
    for radius in [99.9, 100.0, 100.1] {
        result.push(ball(random.direction() * 100.0, radius, 0.1));
        result.push(ball(forward * -100.0, radius, 0.1));
    }
    result.push(ball(forward * 60.0, 20.0, 0.0));
    result
}

/// Whether a ray from the origin meets the sphere in front of it, with more than the millionth of a
/// radius that an eye on the surface finds by rounding.
fn meets(particle: &Particle, direction: DVec3) -> bool {
    let centre = DVec3::from(particle.centre.map(f64::from));
    let (middle, r2) = (centre.dot(direction), f64::from(particle.radius).powi(2));
    let half2 = r2 - (centre - middle * direction).length_squared();
    half2 > 0.0 && middle + half2.sqrt() > 1e-6 * f64::from(particle.radius)
}

fn ray(frame: &FrameUniforms, x: f64, y: f64) -> DVec3 {
    let axis = light_project::axis;
    let ndc = DVec2::new(
        2.0 * x / f64::from(frame.size[0]) - 1.0,
        1.0 - 2.0 * y / f64::from(frame.size[1]),
    );
    (axis(frame.forward) + ndc.x * axis(frame.right) + ndc.y * axis(frame.up)).normalize()
}

/// Whether [low, high) in tiles, widened by the rounding, contains this tile.
fn reaches(low: DVec2, high: DVec2, rounding: f64, tile: DVec2) -> bool {
    (low - rounding).floor().cmple(tile).all() && (high + rounding).cmpge(tile).all()
}

fn check_screen(camera: &Camera, size: [u32; 2], seed: u64) {
    let frame = frame(camera, size);
    let particles = particles(camera.basis().forward, &mut Random(seed));
    let (lists, order) = Population::new(&frame, &particles).screen(&frame);
    let lists = read_lists(&lists);
    let mut seen = 0;
    for y in 0..size[1] {
        for x in 0..size[0] {
            let tile = (y / SCREEN_TILE) * frame.tiles[0] + x / SCREEN_TILE;
            let list = &lists[tile as usize];
            for (dx, dy) in IN_PIXEL.iter().flat_map(|dx| IN_PIXEL.map(|dy| (dx, dy))) {
                let ray = ray(&frame, f64::from(x) + dx, f64::from(y) + dy);
                for (i, particle) in particles.iter().enumerate() {
                    if particle.extinction > 0.0 && meets(particle, ray) {
                        seen += 1;
                        let listed = list.contains(&(i as u32));
                        assert!(listed, "pixel {x}, {y} of {size:?} misses {particle:?}");
                    }
                }
            }
        }
    }
    assert!(seen > 1000, "the picture shows nothing");

    // Nothing is listed beyond its bounds, lists are in the order of all, each particle once.
    let place = |i: u32| order.iter().position(|o| *o == i);
    let pixels_per_tile = f64::from(SCREEN_TILE);
    for (index, list) in lists.iter().enumerate() {
        let tile = DVec2::new(
            f64::from(index as u32 % frame.tiles[0]),
            f64::from(index as u32 / frame.tiles[0]),
        );
        for &i in list {
            let particle = &particles[i as usize];
            let twin = screen_project::project(&frame, particle);
            let twin = twin.unwrap_or_else(|| panic!("{particle:?} is out of sight"));
            let (low, high) = (twin.low / pixels_per_tile, twin.high / pixels_per_tile);
            assert!(reaches(low, high, ROUNDING, tile), "{particle:?} in tile {tile}");
        }
        assert!(list.is_sorted_by_key(|i| place(*i).expect("listed, so in view")));
        assert!(list.windows(2).all(|w| w[0] != w[1]));
    }
    let nearest = |i: u32| {
        let particle = &particles[i as usize];
        let distance = DVec3::from(particle.centre.map(f64::from)).length();
        ((distance - f64::from(particle.radius)).max(0.0), distance)
    };
    for pair in order.windows(2) {
        let ((a, reach), (b, _)) = (nearest(pair[0]), nearest(pair[1]));
        // A difference of two numbers of f32, each with a rounding or two.
        assert!(a <= b + 4e-7 * (reach + b), "{pair:?}: {a} before {b}");
        assert!(nearest(pair[0]).0 > 0.0 || b > 0.0 || pair[0] < pair[1], "ties keep their order");
    }
}

#[test]
fn screen_tiles_list_what_they_show() {
    let camera = |target: DVec3, fov_x: f64| Camera {
        position: DVec3::ZERO,
        target,
        fov_x,
        ..Camera::default()
    };
    // Sizes that are no multiples of a tile, narrow and wide views, straight up.
    check_screen(&camera(DVec3::new(0.3, 0.2, -1.0), 60.0), [203, 117], 40);
    check_screen(&camera(DVec3::new(-1.0, -0.4, 0.2), 8.0), [97, 150], 41);
    check_screen(&camera(DVec3::Y, 140.0), [160, 64], 42);
    check_screen(&camera(DVec3::new(0.0, 0.0, 1.0), 90.0), [9, 7], 43);
}

#[test]
fn light_tiles_list_what_their_lines_meet() {
    let mut random = Random(50);
    let spread = DVec3::new(3000.0, 600.0, 3000.0);
    let mut place =
        || DVec3::new(random.uniform(), random.uniform(), random.uniform()) * spread * 2.0 - spread;
    let centres: Vec<DVec3> = (0..400).map(|_| place()).collect();
    // The last ones are wider than many tiles, or reach out of the picture.
    let radius = |i: usize| if i < 380 { 20.0 + (i % 60) as f64 } else { 700.0 };
    let particles: Vec<Particle> =
        centres.iter().enumerate().map(|(i, c)| ball(*c, radius(i), 0.1)).collect();
    let camera = DVec3::new(12_345.0, 678.0, -9_012.0);
    let frame = frame(&Camera::default(), [64, 64]);
    let suns = [DVec3::Y, DVec3::new(0.5, 0.7, -0.4), DVec3::new(1.0, 0.02, 0.3)];
    // Even tiles, and tiles that grow with the distance.
    for (sun, around_camera) in suns.into_iter().flat_map(|s| [(s, false), (s, true)]) {
        let bounds = Bounds {
            low: camera - spread,
            high: camera + spread,
            detail: 60.0,
            finest: 20.0,
            closest: f64::INFINITY,
            around_camera,
        };
        let view = light_view(sun.normalize(), &bounds, camera);
        let (lists, _, order) = Population::new(&frame, &particles).light(&view);
        let lists = read_lists(&lists);
        let mut met = 0;
        for (index, list) in lists.iter().enumerate() {
            let tile = DVec2::new(
                f64::from(index as u32 % view.tiles[0]),
                f64::from(index as u32 / view.tiles[0]),
            );
            let mut lines = vec![DVec2::splat(0.5)];
            lines.resize_with(8, || {
                DVec2::new(random.between(0.02, 0.98), random.between(0.02, 0.98))
            });
            for (i, particle) in particles.iter().enumerate() {
                let twin = light_project::project(&view, particle);
                let listed = list.contains(&(i as u32));
                if lines.iter().any(|l| light_project::meets(&view, particle, tile + *l)) {
                    met += 1;
                    assert!(listed, "tile {tile} misses {particle:?}");
                }
                if listed {
                    let near = reaches(twin.low, twin.high, ROUNDING, tile);
                    assert!(near, "tile {tile} lists {particle:?}");
                }
            }
        }
        assert!(met > 1000, "the lines meet nothing");
        // All take part, from the light on.
        assert_eq!(order.len(), particles.len());
        let depth = |i: u32| light_project::project(&view, &particles[i as usize]).nearest;
        for pair in order.windows(2) {
            // Sums of numbers up to 5000 m in f32.
            assert!(depth(pair[0]) <= depth(pair[1]) + 4e-3, "{pair:?}");
        }
    }
}
