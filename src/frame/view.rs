//! Where the frame looks from: the camera's uniforms, the boxes seen from the sun, the
//! shadow maps. World coordinates are double; what reaches the device is relative to the camera.

use glam::{DVec2, DVec3};

use super::gpu_data::{FrameUniforms, LightView, ShadowUniforms};
use super::settings::Quality;
use crate::medium::Truncation;
use crate::scene::{Camera, Scene, Sky};

/// Side of a screen tile, blocks of pixels: one workgroup of the blend.
pub const SCREEN_TILE: u32 = 8;
/// Most tiles a side of a light's picture.
const MOST_LIGHT_TILES: f64 = 160.0;
/// Radiance of a sunlit white cloud in units of the sun's irradiance is about 0.8 / pi at best;
/// this factor puts it near the top of the tone curve at an exposure of 0 EV.
pub const BASE_EXPOSURE: f64 = 5.0;
/// Side of the near shadow map, m.
const NEAR_SHADOW_SIDE: f64 = 8000.0;

/// A box in the world that holds all particles, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest corner.
    pub low: DVec3,
    /// Highest corner.
    pub high: DVec3,
    /// Radius of a typical particle, m: the size of a light's tiles follows it.
    pub detail: f64,
}

fn four(v: DVec3) -> [f32; 4] {
    let v = v.as_vec3();
    [v.x, v.y, v.z, 0.0]
}

/// Factor on the radiance of a scene before the tone curve.
pub fn exposure(scene: &Scene) -> f64 {
    BASE_EXPOSURE * scene.exposure.exp2() / scene.sun.irradiance.max(1e-30)
}

/// Uniforms of a frame of this size; `grid_shift` is the light grid's anchor relative to the camera.
#[expect(clippy::too_many_arguments, reason = "everything a frame depends on")]
pub fn frame_uniforms(
    scene: &Scene,
    camera: &Camera,
    size: [u32; 2],
    truncation: &Truncation,
    grid_shift: DVec3,
    quality: &Quality,
    particle_capacity: u32,
    [has_clouds, has_shadows]: [bool; 2],
) -> FrameUniforms {
    let stride = quality.pixel_stride;
    let blocks = size.map(|s| s.div_ceil(stride));
    let basis = camera.basis();
    let half_width = camera.half_width();
    let half_height = half_width * f64::from(size[1]) / f64::from(size[0]);
    FrameUniforms {
        right: four(basis.right * half_width),
        up: four(basis.up * half_height),
        forward: four(basis.forward),
        sun: four(scene.sun.direction),
        size,
        tiles: blocks.map(|s| s.div_ceil(SCREEN_TILE)),
        camera_altitude: camera.position.y as f32,
        albedo: scene.medium.albedo as f32,
        delta_scale: truncation.scale(scene.medium.albedo) as f32,
        transmittance_stop: quality.transmittance_stop,
        exposure: exposure(scene) as f32,
        has_air: u32::from(matches!(scene.sky, Sky::Atmosphere)),
        has_ground: u32::from(scene.effective_ground().is_some()),
        particle_capacity,
        has_clouds: u32::from(has_clouds),
        light_epoch: 0,
        halo_share: truncation.peak_depth(scene.medium.albedo) as f32,
        has_shadows: u32::from(has_shadows),
        grid_shift: four(grid_shift),
        blocks,
        stride,
        phase: stride * stride,
        in_place: 1,
        shadow_epoch: 0,
        padding_a: 0,
        padding_b: 0,
    }
}

/// The picture of a box along the lines of a light.
pub fn light_view(
    towards: DVec3,
    bounds: &Bounds,
    camera: DVec3,
    receiver_samples: u32,
) -> LightView {
    let sideways = DVec3::Y.cross(towards);
    // Straight up or down any horizontal axis does.
    const PARALLEL: f64 = 1e-6;
    let axis_u = if sideways.length() > PARALLEL { sideways.normalize() } else { DVec3::X };
    let axis_v = towards.cross(axis_u).normalize();
    let project = |p: DVec3| DVec2::new(p.dot(axis_u), p.dot(axis_v));
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for corner in 0..8u32 {
        let pick = |bit: u32, a: f64, b: f64| if corner & bit == 0 { a } else { b };
        let p = project(DVec3::new(
            pick(1, bounds.low.x, bounds.high.x),
            pick(2, bounds.low.y, bounds.high.y),
            pick(4, bounds.low.z, bounds.high.z),
        ));
        low = low.min(p);
        high = high.max(p);
    }
    let extent = (high - low).max_element().max(1e-3);
    let tile = (2.0 * bounds.detail).max(extent / (MOST_LIGHT_TILES - 2.0));
    // Whole tiles of the world: shadows don't crawl when the box moves with the camera.
    let first = (low / tile).floor();
    // One tile more than the box is wide: the grid's size does not depend on where the box lies.
    let tiles =
        (((high - low) / tile).ceil() + 1.0).clamp(DVec2::ONE, DVec2::splat(MOST_LIGHT_TILES));
    let origin = (first * tile - project(camera)).as_vec2();
    LightView {
        axis_u: four(axis_u),
        axis_v: four(axis_v),
        towards: four(towards),
        origin: origin.to_array(),
        tile_size: tile as f32,
        inverse_tile_size: (1.0 / tile) as f32,
        tiles: [tiles.x as u32, tiles.y as u32],
        receiver_samples,
        padding_a: 0,
    }
}

/// The two shadow maps around the camera, on whole texels of the world.
pub fn shadow_uniforms(
    camera: DVec3,
    bounds: &Bounds,
    resolution: u32,
    seen_only: bool,
) -> ShadowUniforms {
    let around = DVec2::new(camera.x, camera.z);
    let reach = (bounds.high - bounds.low).max_element();
    let map = |side: f64| {
        let texel = side / f64::from(resolution);
        let corner = ((around - 0.5 * side) / texel).floor() * texel - around;
        [corner.x as f32, corner.y as f32, side as f32, 0.0]
    };
    ShadowUniforms {
        corner: [map(NEAR_SHADOW_SIDE.min(reach.max(1.0))), map((1.2 * reach).max(1.0))],
        resolution,
        ground: -camera.y as f32,
        seen_only: u32::from(seen_only),
        padding_b: 0,
    }
}
