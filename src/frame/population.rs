//! From a scene to particles: the shapes it names, its listed particles, its cloud field. The
//! renderer and the reference share it, so both see the same clouds.

use glam::DVec3;

use super::cpu;
use super::gpu_data::Particle;
use super::rings::{self, FieldShape, PlacedField};
use crate::scene::{CloudField, ParticleSpec, Scene};
use crate::tables::TableSet;
use crate::{Error, Result};

/// Name of the shape with density 1 everywhere.
const UNIFORM: &str = "uniform";

/// The shapes of a table set, by name.
#[derive(Clone, Debug)]
pub struct Shapes {
    shapes: Vec<(String, FieldShape)>,
}

impl Shapes {
    /// The shapes of these tables.
    pub fn new(tables: &TableSet) -> Self {
        let shapes = tables.shape_names().enumerate().map(|(index, name)| {
            let index = index as u32;
            let mean_density = tables.mean_density(index) as f32;
            (name.to_owned(), FieldShape { index, mean_density })
        });
        Self { shapes: shapes.collect() }
    }

    /// Number of shapes.
    pub fn count(&self) -> u32 {
        self.shapes.len() as u32
    }

    /// Name of a shape by its index.
    pub fn name(&self, index: u32) -> Option<&str> {
        self.shapes.iter().find(|(_, s)| s.index == index).map(|(name, _)| name.as_str())
    }

    fn find(&self, name: &str, field: impl FnOnce() -> String) -> Result<FieldShape> {
        self.shapes.iter().find(|(n, _)| n == name).map(|(_, shape)| *shape).ok_or_else(|| {
            let known: Vec<_> = self.shapes.iter().map(|(n, _)| n.as_str()).collect();
            Error::input(
                field(),
                format!("expected a shape of the tables ({}), found `{name}`", known.join(", ")),
            )
        })
    }

    /// The shapes of a cloud field: those it names, or all that have noise.
    fn of_field(&self, field: &CloudField) -> Result<Vec<FieldShape>> {
        if field.shapes.is_empty() {
            let noisy: Vec<_> =
                self.shapes.iter().filter(|(n, _)| n != UNIFORM).map(|(_, s)| *s).collect();
            return Ok(if noisy.is_empty() {
                vec![self.find(UNIFORM, String::new)?]
            } else {
                noisy
            });
        }
        let find = |(i, name): (usize, &String)| self.find(name, || format!("clouds.shapes[{i}]"));
        field.shapes.iter().enumerate().map(find).collect()
    }

    /// The listed particles of a scene, relative to the camera.
    pub fn listed(&self, specs: &[ParticleSpec], camera: DVec3) -> Result<Vec<Particle>> {
        let make = |(i, spec): (usize, &ParticleSpec)| {
            let shape = self.find(&spec.shape, || format!("particles[{i}].shape"))?;
            let optical_radius = spec.extinction * spec.radius * f64::from(shape.mean_density);
            Ok(Particle {
                centre: (spec.centre - camera).as_vec3().to_array(),
                radius: spec.radius as f32,
                orientation: spec.orientation.conjugate().as_quat().to_array(),
                extinction: spec.extinction as f32,
                shape: shape.index,
                id: cpu::noise::hash(i as u32),
                optical_radius: optical_radius as f32,
            })
        };
        specs.iter().enumerate().map(make).collect()
    }

    /// The cloud field of a scene at a time (s), where there is one: `first_slot` and `capacity`
    /// say where its particles go.
    pub fn field(
        &self,
        scene: &Scene,
        time: f64,
        first_slot: u32,
        capacity: u32,
    ) -> Result<Option<PlacedField>> {
        let Some(field) = &scene.clouds else { return Ok(None) };
        rings::columns(field)?;
        let shapes = self.of_field(field)?;
        let camera = scene.camera.position;
        Ok(Some(PlacedField::new(field, camera, time, &shapes, first_slot, capacity)))
    }

    /// All particles of a scene at a time (s), relative to the camera, made on the host.
    pub fn populate(&self, scene: &Scene, time: f64) -> Result<Vec<Particle>> {
        let mut particles = self.listed(&scene.particles, scene.camera.position)?;
        if let Some(clouds) = self.field(scene, time, 0, u32::MAX)? {
            particles.extend(cpu::rings::particles(&clouds));
        }
        Ok(particles)
    }
}
