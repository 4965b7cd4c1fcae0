//! Clumps of overlapping particles, and where they are seen from.

use glam::{DQuat, DVec3};

use crate::Result;
use crate::frame::gpu_data::Particle;
use crate::frame::population::Shapes;
use crate::reference::Random;
use crate::scene::{Camera, ParticleSpec, Scene, Sky, Sun};
use crate::tables::TableSet;

/// Particles of a clump.
pub const PARTICLES: usize = 200;
/// Radius of the ball that holds all of them, m: that of a small cumulus.
const BALL: f64 = 400.0;
/// Radii of particles, m, evenly drawn; all together they fill the ball about four times.
const RADII: [f64; 2] = [70.0, 150.0];
/// Least and greatest extinction over their geometric mean, drawn by magnitude.
const UNEVEN: [f64; 2] = [0.5, 2.0];
/// Altitude of the middle, m.
const ALTITUDE: f64 = 1000.0;
/// From there to the eye outside, m: the ball is 31 degrees wide.
const DISTANCE: f64 = 1500.0;
/// And inside.
const INSIDE: f64 = 0.4 * BALL;
/// Width of the pictures, degrees: a disc of the sun behind the clump stays out of them.
const FIELD_OF_VIEW: f64 = 50.0;
/// Of the sky, per steradian and unit of the sun's irradiance, from all sides and without air: a sky that lights a plane
/// with 0.16 of what the sun does.
const SKY: f64 = 0.05;
/// Lines through the middle whose mean optical depth is the thickness.
const LINES: u32 = 64;
/// Steps of a chord of such a line.
const STEPS: u32 = 64;

/// Where the sun stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SunSide {
    /// Behind the eye.
    Front,
    /// To the right.
    Side,
    /// Behind the clump.
    Back,
}

impl SunSide {
    const ALL: [Self; 3] = [Self::Front, Self::Side, Self::Back];

    fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Side => "side",
            Self::Back => "back",
        }
    }

    /// Towards the sun, 20 to 24 degrees high; the eye looks along -Z.
    fn direction(self) -> DVec3 {
        let towards = match self {
            Self::Front => DVec3::new(0.3, 0.4, 0.87),
            Self::Side => DVec3::new(0.9, 0.4, 0.1),
            Self::Back => DVec3::new(0.15, 0.36, -0.92),
        };
        towards.normalize()
    }
}

/// A clump, how it is lit and seen.
#[derive(Clone, Debug)]
pub struct Clump {
    /// "clump-20-back-inside".
    pub name: String,
    /// It.
    pub scene: Scene,
}

/// Optical depths through the middle.
const THICKNESSES: [f64; 3] = [5.0, 20.0, 60.0];

/// All clumps: each thickness under each sun, from outside and inside. One seed, one layout.
pub fn clumps(tables: &TableSet, seed: u64) -> Result<Vec<Clump>> {
    let mut found = Vec::new();
    for thickness in THICKNESSES {
        let particles = particles(tables, seed, thickness)?;
        for sun in SunSide::ALL {
            for (place, distance) in [("outside", DISTANCE), ("inside", INSIDE)] {
                let name = format!("clump-{thickness}-{}-{place}", sun.name());
                let position = DVec3::new(0.0, ALTITUDE, distance);
                let camera = Camera {
                    position,
                    target: position - 1000.0 * DVec3::Z,
                    fov_x: FIELD_OF_VIEW,
                    ..Camera::default()
                };
                let scene = Scene {
                    name: name.clone(),
                    camera,
                    sun: Sun { direction: sun.direction(), ..Sun::default() },
                    sky: Sky::Uniform { radiance: SKY },
                    particles: particles.clone(),
                    ..Scene::default()
                };
                found.push(Clump { name, scene });
            }
        }
    }
    Ok(found)
}

/// Particles of a mean optical depth through the middle: half of them uniform, half of the tables' noise shapes in turn.
fn particles(tables: &TableSet, seed: u64, thickness: f64) -> Result<Vec<ParticleSpec>> {
    let noisy: Vec<_> = tables.shape_names().skip(1).collect();
    let mut random = Random::new(seed, 0, 0);
    let mut made: Vec<_> = (0..PARTICLES)
        .map(|i| {
            let mut between = |[low, high]: [f64; 2]| low + (high - low) * random.unit();
            let radius = between(RADII);
            let extinction = between(UNEVEN.map(f64::ln)).exp();
            let mut direction = || {
                let (height, turn) = (between([-1.0, 1.0]), between([0.0, std::f64::consts::TAU]));
                let across = (1.0 - height * height).sqrt();
                DVec3::new(across * turn.cos(), height, across * turn.sin())
            };
            let (from_middle, axis) = (direction(), direction());
            let turn = between([0.0, std::f64::consts::TAU]);
            let far = (BALL - radius) * between([0.0, 1.0]).cbrt();
            let shape = match (i % 2, noisy.len()) {
                (0, _) | (_, 0) => "uniform",
                (_, shapes) => noisy[i / 2 % shapes],
            };
            ParticleSpec {
                centre: DVec3::Y * ALTITUDE + far * from_middle,
                radius,
                extinction,
                shape: shape.to_owned(),
                orientation: DQuat::from_axis_angle(axis, turn),
            }
        })
        .collect();
    let through = mean_depth(tables, &made)?;
    for particle in &mut made {
        particle.extinction *= thickness / through;
    }
    Ok(made)
}

/// Mean optical depth of lines through the middle, evenly spread over all directions (a spiral of the golden angle).
fn mean_depth(tables: &TableSet, specs: &[ParticleSpec]) -> Result<f64> {
    let particles = Shapes::new(tables).listed(specs, DVec3::Y * ALTITUDE)?;
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let depth = |line: u32| {
        let height = (f64::from(line) + 0.5) / f64::from(LINES);
        let across = (1.0 - height * height).sqrt();
        let turn = golden * f64::from(line);
        let direction = DVec3::new(across * turn.cos(), height, across * turn.sin());
        particles.iter().map(|p| depth_through(tables, p, direction)).sum::<f64>()
    };
    Ok((0..LINES).map(depth).sum::<f64>() / f64::from(LINES))
}

/// Optical depth of one particle on a line through the origin.
fn depth_through(tables: &TableSet, particle: &Particle, direction: DVec3) -> f64 {
    let (centre, radius) =
        (DVec3::from(particle.centre.map(f64::from)), f64::from(particle.radius));
    let middle = centre.dot(direction);
    let half = radius * radius - (centre - middle * direction).length_squared();
    if half <= 0.0 {
        return 0.0;
    }
    let turn = DQuat::from_array(particle.orientation.map(f64::from));
    let step = 2.0 * half.sqrt() / f64::from(STEPS);
    let density = |i: u32| {
        let t = middle - half.sqrt() + (f64::from(i) + 0.5) * step;
        tables.density(particle.shape, turn * ((t * direction - centre) / radius), 0)
    };
    f64::from(particle.extinction) * step * (0..STEPS).map(density).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Density times extinction of all particles at a place, written anew from the scene's own terms.
    fn extinction_at(tables: &TableSet, particles: &[ParticleSpec], place: DVec3) -> f64 {
        let of = |p: &ParticleSpec| {
            let own = p.orientation.inverse() * ((place - p.centre) / p.radius);
            let shape = tables.shape_index(&p.shape).expect("a shape of the tables");
            if own.length() < 1.0 { p.extinction * tables.density(shape, own, 0) } else { 0.0 }
        };
        particles.iter().map(of).sum()
    }

    #[test]
    fn clumps_are_as_thick_as_their_names_say() {
        let tables = TableSet::embedded().expect("built in");
        let clumps = clumps(&tables, 7).expect("clumps");
        assert_eq!(clumps.len(), 18);
        let mut random = Random::new(3, 0, 0);
        for clump in clumps.iter().step_by(6) {
            let particles = &clump.scene.particles;
            // Other lines than those the maker took: 400 in random directions, integrated in steps of 4 m. Lines differ
            // by about 0.2 of the mean, so that the mean of 400 is off by 0.01, and that of the maker's 64 by less than
            // 0.025, for they are spread evenly.
            let lines = 400;
            let mut sum = 0.0;
            for _ in 0..lines {
                let height = 2.0 * random.unit() - 1.0;
                let turn = std::f64::consts::TAU * random.unit();
                let across = (1.0 - height * height).sqrt();
                let direction = DVec3::new(across * turn.cos(), height, across * turn.sin());
                let at = |i: i32| DVec3::Y * ALTITUDE + (4.0 * f64::from(i) + 2.0) * direction;
                sum += (-100..100)
                    .map(|i| 4.0 * extinction_at(&tables, particles, at(i)))
                    .sum::<f64>();
            }
            let wanted: f64 =
                clump.name.split('-').nth(1).expect("a word").parse().expect("a number");
            let found = sum / f64::from(lines);
            assert!((found / wanted - 1.0).abs() < 0.06, "{}: {found}", clump.name);
        }
    }

    #[test]
    fn clumps_are_sound_dense_and_the_same_for_the_same_seed() {
        let tables = TableSet::embedded().expect("built in");
        let all = clumps(&tables, 0).expect("clumps");
        let again = clumps(&tables, 0).expect("clumps");
        let other = clumps(&tables, 1).expect("clumps");
        for ((clump, again), other) in all.iter().zip(&again).zip(&other) {
            clump.scene.validate().expect(&clump.name);
            assert_eq!(clump.scene, again.scene);
            assert_ne!(clump.scene.particles, other.scene.particles);
            let particles = &clump.scene.particles;
            assert_eq!(particles.len(), PARTICLES);
            let middle = DVec3::Y * ALTITUDE;
            let within = |p: &ParticleSpec| p.centre.distance(middle) + p.radius <= BALL + 1e-9;
            assert!(particles.iter().all(within), "{}", clump.name);
            let volume: f64 = particles.iter().map(|p| p.radius.powi(3)).sum();
            assert!(volume > 3.0 * BALL.powi(3), "hardly any overlap: {volume}");
            // The eye is in matter, or out of all of it.
            let inside = clump.name.ends_with("inside");
            let eye = clump.scene.camera.position;
            assert_eq!(extinction_at(&tables, particles, eye) > 0.0, inside, "{}", clump.name);
        }
        let uniform = |p: &&ParticleSpec| p.shape == "uniform";
        assert_eq!(all[0].scene.particles.iter().filter(uniform).count(), PARTICLES / 2);
    }
}
