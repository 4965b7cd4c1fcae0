//! A scene as the path tracer sees it: the particles of the frame, placed in the world.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::atmosphere_sky::AtmosphereSky;
use super::particles::{ParticleGrid, WorldParticle};
use super::picture::Film;
use super::transport::Matter;
use super::uniform_sky::{SunDisc, UniformSky};
use crate::frame::gpu_data::Particle;
use crate::frame::population::Shapes;
use crate::frame::renderer::sky_inputs;
use crate::medium::Shape;
use crate::scene::{Camera, Scene, Sky};
use crate::tables::TableSet;
use crate::{Error, Result};

/// The kinds of surroundings.
pub enum Place {
    /// The same light from everywhere.
    Uniform(UniformSky),
    /// The clear atmosphere.
    Air(Box<AtmosphereSky>),
}

/// Everything a path needs, at one time.
pub struct World {
    /// The clouds.
    pub medium: ParticleGrid,
    /// What they are made of.
    pub matter: Matter,
    /// Sky, sun, ground.
    pub surroundings: Place,
    /// The eye.
    pub camera: Camera,
}

impl World {
    /// A scene at a time (s). The tables say which shapes there are.
    pub fn new(scene: &Scene, tables: &TableSet, time: f64) -> Result<Self> {
        let shapes = Shapes::new(tables);
        let particles = shapes.populate(scene, time)?;
        let medium = ParticleGrid::new(place(&particles, &shapes, scene.camera.position)?);
        let matter = Matter { phase: scene.medium.phase.prepare(), albedo: scene.medium.albedo };
        let surroundings = match scene.sky {
            Sky::Uniform { radiance } => Place::Uniform(UniformSky {
                radiance: DVec3::splat(radiance),
                sun: (scene.sun.irradiance > 0.0).then(|| {
                    SunDisc::new(
                        scene.sun.direction,
                        DVec3::splat(scene.sun.irradiance),
                        scene.sun.angular_diameter.to_radians(),
                    )
                }),
                ground: scene.effective_ground().map(|g| g.albedo),
            }),
            Sky::Atmosphere => Place::Air(Box::new(AtmosphereSky::new(&sky_inputs(scene)))),
        };
        Ok(Self { medium, matter, surroundings, camera: scene.camera })
    }

    /// Adds samples to a picture.
    pub fn expose(&self, film: &mut Film, seed: u64, samples: u32) {
        let Self { medium, matter, camera, .. } = self;
        match &self.surroundings {
            Place::Uniform(sky) => film.expose(medium, sky, matter, camera, seed, samples),
            Place::Air(sky) => film.expose(medium, sky.as_ref(), matter, camera, seed, samples),
        }
    }
}

/// Particles of the frame in the world, with the densities of their shapes.
fn place(particles: &[Particle], shapes: &Shapes, camera: DVec3) -> Result<Vec<WorldParticle>> {
    let mut made: HashMap<u32, Arc<Shape>> = HashMap::new();
    particles
        .iter()
        .map(|p| {
            let shape = match made.get(&p.shape) {
                Some(shape) => shape.clone(),
                None => {
                    let name = shapes.name(p.shape).ok_or_else(|| {
                        Error::Gpu(format!("a particle of the unknown shape {}", p.shape))
                    })?;
                    let shape = Arc::new(Shape::new(name.parse()?));
                    made.insert(p.shape, shape.clone());
                    shape
                }
            };
            let [x, y, z, w] = p.orientation.map(f64::from);
            Ok(WorldParticle {
                centre: camera + DVec3::from_array(p.centre.map(f64::from)),
                radius: p.radius.into(),
                extinction: p.extinction.into(),
                to_own: DQuat::from_xyzw(x, y, z, w).normalize(),
                shape,
            })
        })
        .collect()
}
