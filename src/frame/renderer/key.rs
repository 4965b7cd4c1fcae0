//! Everything that a frame's picture depends on, from the scene.

use glam::DVec3;

use super::Renderer;
use crate::Result;
use crate::frame::changes::FrameKey;
use crate::frame::in_view::{self, InView};
use crate::frame::light_grid::{scale_field, scale_particles};
use crate::frame::plan::Pass;
use crate::frame::rings;
use crate::frame::settings::Quality;
use crate::frame::sky::{SkyInputs, SkyKind};
use crate::frame::view::{self, Bounds};
use crate::scene::{Scene, Sky};

impl Renderer {
    /// Everything this frame's picture depends on.
    pub(super) fn key(
        &self,
        scene: &Scene,
        time: f64,
        size: [u32; 2],
        shift: DVec3,
        in_view: InView,
    ) -> Result<FrameKey> {
        let camera = &scene.camera;
        let scale = self.truncation.scale(scene.medium.albedo);
        let mut listed = self.shapes.listed(&scene.particles, camera.position)?;
        scale_particles(&mut listed, scale);
        let first_slot = listed.len() as u32;
        let mut clouds = self.shapes.field(scene, time, first_slot, self.capacities.particles)?;
        if let Some(clouds) = &mut clouds {
            scale_field(clouds, scale);
            if self.rings_end_at_once {
                clouds.end_at_once();
            }
        }
        let any = clouds.is_some() || !listed.is_empty();
        let has_clouds = any && in_view.clouds && self.omit != Some(Pass::Blend);
        let is_lit = self.opaque.as_ref().is_some_and(|opaque| opaque.sunlit.is_some());
        let has_shadows = any && (in_view.ground || is_lit);
        let is_asked = any && self.sun_asked;
        // Air is as bare where no cloud is in view: there is no light field then.
        let shown = if self.make_unseen { in_view::in_view(scene, time, size) } else { in_view };
        let has_air_shadow = any
            && shown.clouds
            && self.quality.lighting.has_grid()
            && matches!(scene.sky, Sky::Atmosphere)
            && self.omit != Some(Pass::AirShadow)
            && !self.composer.as_ref().is_some_and(|c| c.unneeded().contains(&Pass::AirShadow));
        // What a picture without clouds does not depend on shall not make it anew.
        let is_made = has_clouds || has_shadows || is_asked;
        let capacity = if is_made { self.capacities.particles } else { 0 };
        let bounds = bounds(scene, time);
        let light = view::light_view(scene.sun.direction, &bounds, camera.position);
        Ok(FrameKey {
            frame: view::frame_uniforms(
                scene,
                camera,
                size,
                &self.truncation,
                shift,
                &Quality { pixel_stride: self.stride(), ..self.quality },
                capacity,
                [has_clouds, has_shadows, has_air_shadow],
            ),
            clouds,
            listed,
            light,
            shadow: view::shadow_uniforms(
                scene.sun.direction,
                &bounds,
                camera.position,
                scene.effective_ground().map(|_| 0.0),
                self.quality.shadow_resolution,
                !self.make_unseen,
                is_lit,
            ),
            is_sea: scene.is_sea(),
            in_view,
            opaque: self.opaque.clone(),
            lighting: self.quality.lighting,
            sun_asked: self.sun_asked,
        })
    }
}

/// What the sky of a scene depends on.
pub fn sky_inputs(scene: &Scene) -> SkyInputs {
    SkyInputs {
        kind: match scene.sky {
            Sky::Uniform { radiance } => SkyKind::Uniform { radiance: radiance as f32 },
            Sky::Atmosphere => SkyKind::Atmosphere,
        },
        sun_direction: scene.sun.direction.as_vec3(),
        sun_irradiance: scene.sun.irradiance as f32,
        angular_diameter: scene.sun.angular_diameter.to_radians() as f32,
        camera_altitude: scene.camera.position.y,
        ground_albedo: scene.effective_ground().map_or(DVec3::ZERO, |g| g.albedo).as_vec3(),
        has_ground: scene.effective_ground().is_some(),
        sea_wind: scene.effective_ground().and_then(|ground| ground.wind_speed()),
    }
}

/// Distance of a particle that is large to the eye over its radius, at most: a degree of the view.
const LARGE: f64 = 60.0;

/// A box around all particles of the scene.
fn bounds(scene: &Scene, time: f64) -> Bounds {
    let mut result = Bounds {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
        detail: 1e-3,
        finest: f64::INFINITY,
        closest: f64::INFINITY,
        around_camera: scene.clouds.is_some(),
    };
    if let Some(field) = &scene.clouds {
        let reach = rings::reach(field);
        let largest = field.particle_size * field.cell_size;
        let camera = scene.camera.position;
        let base = field.base + field.wind.y * time;
        result.low = DVec3::new(camera.x - reach, base - largest, camera.z - reach);
        result.high =
            DVec3::new(camera.x + reach, base + 1.5 * field.thickness + largest, camera.z + reach);
        result.detail = largest;
        result.finest = largest;
    }
    if !scene.particles.is_empty() {
        let mut radii = 0.0;
        for particle in &scene.particles {
            result.low = result.low.min(particle.centre - particle.radius);
            result.high = result.high.max(particle.centre + particle.radius);
            result.finest = result.finest.min(particle.radius);
            let distance = particle.centre.distance(scene.camera.position);
            if distance <= LARGE * particle.radius {
                result.closest = result.closest.min(particle.radius);
            }
            radii += particle.radius;
        }
        result.detail = result.detail.max(radii / scene.particles.len() as f64);
    }
    if result.low.x > result.high.x {
        result.low = DVec3::ZERO;
        result.high = DVec3::ONE;
        result.finest = 1.0;
    }
    result
}
