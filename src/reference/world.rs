//! A scene as the path tracer sees it: the particles of the frame, placed in the world.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::atmosphere_sky::AtmosphereSky;
use super::film::Film;
use super::geometry::Ray;
use super::grid::ParticleGrid;
use super::particles::WorldParticle;
use super::random::Random;
use super::transport::{Matter, look};
use super::uniform_sky::{SunDisc, UniformSky};
use super::view::View;
use crate::frame::gpu_data::Particle;
use crate::frame::population::Shapes;
use crate::frame::renderer::sky_inputs;
use crate::medium::Shape;
use crate::scene::{Scene, Sky};
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
    scene: Scene,
    shapes: Shapes,
    densities: Densities,
    /// The clouds.
    pub medium: ParticleGrid,
    /// What they are made of.
    pub matter: Matter,
    /// Sky, sun, ground.
    pub surroundings: Place,
}

impl World {
    /// A scene at a time (s). The tables say which shapes there are.
    pub fn new(scene: &Scene, tables: &TableSet, time: f64) -> Result<Self> {
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
                sea: sky_inputs(scene).sea(),
            }),
            Sky::Atmosphere => Place::Air(Box::new(AtmosphereSky::new(&sky_inputs(scene)))),
        };
        let mut world = Self {
            scene: scene.clone(),
            shapes: Shapes::new(tables),
            densities: Densities::default(),
            medium: ParticleGrid::new(Vec::new()),
            matter,
            surroundings,
        };
        world.set_time(time)?;
        Ok(world)
    }

    /// Moves the clouds to another time, s.
    pub fn set_time(&mut self, time: f64) -> Result<()> {
        let particles = self.shapes.populate(&self.scene, time)?;
        self.medium = ParticleGrid::new(self.densities.place(
            &particles,
            &self.shapes,
            self.scene.camera.position,
        )?);
        Ok(())
    }

    /// An unbiased estimate of the radiance along a ray.
    pub fn radiance(&self, ray: Ray, random: &mut Random) -> DVec3 {
        let Self { medium, matter, surroundings, .. } = self;
        match surroundings {
            Place::Uniform(sky) => look(medium, sky, matter, ray, random).radiance,
            Place::Air(sky) => look(medium, sky.as_ref(), matter, ray, random).radiance,
        }
    }

    /// Adds a sample to every pixel of the next rows of a picture.
    pub fn expose_rows(&self, film: &mut Film, view: &View, seed: u64, rows: u32) {
        let Self { medium, matter, surroundings, .. } = self;
        match surroundings {
            Place::Uniform(sky) => film.expose_rows(medium, sky, matter, view, seed, rows),
            Place::Air(sky) => film.expose_rows(medium, sky.as_ref(), matter, view, seed, rows),
        }
    }
}

/// Densities that have been needed so far, by their index in the tables.
#[derive(Default)]
pub struct Densities(HashMap<u32, Arc<Shape>>);

impl Densities {
    /// Particles of the frame in the world, with the densities of their shapes; `camera` is where
    /// their places are relative to, m.
    pub fn place(
        &mut self,
        particles: &[Particle],
        shapes: &Shapes,
        camera: DVec3,
    ) -> Result<Vec<WorldParticle>> {
        particles
            .iter()
            .map(|p| {
                let [x, y, z, w] = p.orientation.map(f64::from);
                Ok(WorldParticle {
                    centre: camera + DVec3::from_array(p.centre.map(f64::from)),
                    radius: p.radius.into(),
                    extinction: p.extinction.into(),
                    to_own: DQuat::from_xyzw(x, y, z, w).normalize(),
                    shape: self.shape(p.shape, shapes)?,
                })
            })
            .collect()
    }

    fn shape(&mut self, index: u32, shapes: &Shapes) -> Result<Arc<Shape>> {
        if let Some(shape) = self.0.get(&index) {
            return Ok(shape.clone());
        }
        let name = shapes
            .name(index)
            .ok_or_else(|| Error::Gpu(format!("a particle of the unknown shape {index}")))?;
        let shape = Arc::new(Shape::new(name.parse()?));
        self.0.insert(index, shape.clone());
        Ok(shape)
    }
}
