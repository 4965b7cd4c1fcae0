//! Where the frame looks from: the camera's uniforms, the boxes seen from the sun, the
//! shadow maps. World coordinates are double; what reaches the device is relative to the camera.

use glam::{DVec2, DVec3};

use super::air_shadow::ray_block;
use super::gpu_data::{FrameUniforms, LightView, SHADOW_MAPS, ShadowUniforms};
use super::settings::Quality;
use crate::medium::Truncation;
use crate::scene::{Camera, Scene, Sky};

/// Side of a screen tile in all presets, blocks of pixels; `cumuli bench` compares it with others.
pub const SCREEN_TILE: u32 = 8;
/// Most tiles a side of a light's picture.
const MOST_LIGHT_TILES: f64 = 160.0;
/// Radiance of a sunlit white cloud in units of the sun's irradiance is about 0.8 / pi at best;
/// this factor puts it near the top of the tone curve at an exposure of 0 EV.
pub const BASE_EXPOSURE: f64 = 5.0;
/// Least side of a light's tile, in radii of a typical particle.
const LEAST_LIGHT_TILE: f64 = 1.0;
/// Distance from which on a light's tiles grow, in radii of a typical particle: those of a field's
/// rings grow so too.
const WARP_DETAILS: f64 = 24.0;
/// Texels of the finest shadow map in a radius of the smallest particle.
const TEXELS_PER_RADIUS: f64 = 8.0;
/// Texels of the finest shadow map in a radius of the smallest particle that is large to the eye, at least, as far
/// as no more than the coarser maps' texels are the price.
const LEAST_TEXELS_PER_RADIUS: f64 = 1.0;
/// Texels of a shadow map before and behind the camera over which its nodes reach at most: one for each step of the
/// 16 bits that tell where they lie.
const RANGE_TEXELS: f64 = 32_768.0;
/// Stands for infinitely far on the device, m.
const FAR: f32 = 1e30;
/// Texels at the borders of a shadow map that the next one shows, both sides together.
const SHADOW_BORDER_TEXELS: f64 = 6.0;

/// A box in the world that holds all particles, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest corner.
    pub low: DVec3,
    /// Highest corner.
    pub high: DVec3,
    /// Radius of a typical particle, m: the size of a light's tiles follows it.
    pub detail: f64,
    /// Radius of the smallest particle, m: the finest shadow map shows it.
    pub finest: f64,
    /// Radius of the smallest listed particle that is large to the eye, m; infinite where there is none.
    pub closest: f64,
    /// Whether particles lie around the camera, the larger the farther away.
    pub around_camera: bool,
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
    [has_clouds, has_shadows, has_air_shadow]: [bool; 3],
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
        tiles: blocks.map(|s| s.div_ceil(quality.tile)),
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
        has_air_shadow: u32::from(has_air_shadow),
        mean_cosine: truncation.moments[0] as f32,
        ray_block: ray_block(size, half_width),
    }
}

/// The axes of the picture along the lines of a light.
pub fn picture_axes(towards: DVec3) -> [DVec3; 2] {
    let sideways = DVec3::Y.cross(towards);
    // Straight up or down any horizontal axis does.
    const PARALLEL: f64 = 1e-6;
    let axis_u = if sideways.length() > PARALLEL { sideways.normalize() } else { DVec3::X };
    [axis_u, towards.cross(axis_u).normalize()]
}

/// The corners of a box relative to a point.
fn corners(bounds: &Bounds, from: DVec3) -> impl Iterator<Item = DVec3> {
    let (low, high) = (bounds.low - from, bounds.high - from);
    (0..8u32).map(move |corner| {
        let pick = |bit: u32, a: f64, b: f64| if corner & bit == 0 { a } else { b };
        DVec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z))
    })
}

/// Picture coordinates (m, relative to the camera), warped so that tiles grow with the distance;
/// twin of `warped` in `shaders/shared/light_view.wgsl`.
pub fn warped(place: DVec2, warp: f64) -> DVec2 {
    if warp <= 0.0 { place } else { (place / warp).map(f64::asinh) * warp }
}

/// The inverse of [`warped`].
pub fn unwarped(place: DVec2, warp: f64) -> DVec2 {
    if warp <= 0.0 { place } else { (place / warp).map(f64::sinh) * warp }
}

/// The picture of a box along the lines of a light.
pub fn light_view(towards: DVec3, bounds: &Bounds, camera: DVec3) -> LightView {
    let [axis_u, axis_v] = picture_axes(towards);
    let warp = if bounds.around_camera { WARP_DETAILS * bounds.detail } else { 0.0 };
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for p in corners(bounds, camera) {
        let place = warped(DVec2::new(p.dot(axis_u), p.dot(axis_v)), warp);
        low = low.min(place);
        high = high.max(place);
    }
    let extent = (high - low).max_element().max(1e-3);
    let tile = (LEAST_LIGHT_TILE * bounds.detail).max(extent / (MOST_LIGHT_TILES - 2.0));
    // One tile more than the box is wide: the grid's size does not depend on where the box lies.
    let tiles =
        (((high - low) / tile).ceil() + 1.0).clamp(DVec2::ONE, DVec2::splat(MOST_LIGHT_TILES));
    LightView {
        axis_u: four(axis_u),
        axis_v: four(axis_v),
        towards: four(towards),
        origin: (low - 0.5 * tile).as_vec2().to_array(),
        tile_size: tile as f32,
        inverse_tile_size: (1.0 / tile) as f32,
        tiles: [tiles.x as u32, tiles.y as u32],
        warp: warp as f32,
        padding_a: 0,
    }
}

/// Where the nodes of a shadow map may lie, no farther than `most` from the camera (m).
fn shadow_range(nearest: f64, reach: f64, most: f64) -> [f32; 4] {
    let farthest = nearest + reach;
    let is_cut = [nearest < -most, farthest > most];
    if is_cut == [false; 2] {
        return [nearest as f32, reach as f32, -FAR, FAR];
    }
    let [begin, end] = [nearest, farthest].map(|place| place.clamp(-most, most));
    // All of the matter before it, or behind: nothing is asked of it.
    let length = (end - begin).max(1e-6);
    let least = if is_cut[0] { begin as f32 } else { -FAR };
    [begin as f32, length as f32, least, if is_cut[1] { end as f32 } else { FAR }]
}

/// Deep shadow maps of a box, around the camera and on whole texels of the world: shadows don't crawl
/// when the camera moves. The coarsest holds the box, each finer one half of it, up to texels that
/// show the smallest particle; less than half where the last would not even show what is large to the eye: drops
/// around it beside a field of kilometres. `seen_only`: texels that the picture cannot show are left out.
/// `anywhere`: what they shadow may lie anywhere behind matter, not only in it and on the ground.
pub fn shadow_uniforms(
    towards: DVec3,
    bounds: &Bounds,
    camera: DVec3,
    ground: Option<f64>,
    resolution: u32,
    seen_only: bool,
    anywhere: bool,
) -> ShadowUniforms {
    let [axis_u, axis_v] = picture_axes(towards);
    let project = |p: DVec3| DVec2::new(p.dot(axis_u), p.dot(axis_v));
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (mut nearest, mut farthest) = (f64::INFINITY, f64::NEG_INFINITY);
    for p in corners(bounds, camera) {
        low = low.min(project(p));
        high = high.max(project(p));
        nearest = nearest.min(-p.dot(towards));
        farthest = farthest.max(-p.dot(towards));
    }
    let world = project(camera);
    let texels = f64::from(resolution) - SHADOW_BORDER_TEXELS;
    let mut middle = 0.5 * (low + high);
    let mut side = (high - low).max_element().max(1e-3);
    let mut uniforms = <ShadowUniforms as bytemuck::Zeroable>::zeroed();
    let mut corners = Vec::new();
    let spread = LEAST_TEXELS_PER_RADIUS * side / texels / bounds.closest;
    // Whole, so that texels don't change their size with every step of the camera.
    let factor = spread.powf(1.0 / (SHADOW_MAPS - 1) as f64).ceil().max(2.0);
    loop {
        let texel = side / texels;
        let corner = middle - 0.5 * f64::from(resolution) * texel;
        let corner = ((corner + world) / texel).floor() * texel - world;
        corners.push([corner.x as f32, corner.y as f32, texel as f32, 0.0]);
        if corners.len() == SHADOW_MAPS || texel <= bounds.finest / TEXELS_PER_RADIUS {
            break;
        }
        // The next one around the camera, as far as it is within this one.
        let room = 0.5 * side * (1.0 - 1.0 / factor);
        middle = DVec2::ZERO.clamp(middle - room, middle + room);
        side /= factor;
    }
    uniforms.maps = corners.len() as u32;
    let reach = (farthest - nearest).max(1e-6);
    for (i, corner) in corners.into_iter().rev().enumerate() {
        uniforms.corner[i] = corner;
        // The coarsest has all: it is asked where the others end.
        let most = RANGE_TEXELS * f64::from(corner[2]);
        let is_last = i + 1 == uniforms.maps as usize;
        uniforms.range[i] =
            shadow_range(nearest, reach, if is_last { f64::INFINITY } else { most });
    }
    let lowest = ground.map_or(bounds.low.y, |g| g.min(bounds.low.y)) - camera.y;
    ShadowUniforms {
        axis_u: four(axis_u),
        axis_v: four(axis_v),
        towards: four(towards),
        nearest: nearest as f32,
        reach: reach as f32,
        lowest: lowest as f32,
        highest: (bounds.high.y - camera.y) as f32,
        resolution,
        seen_only: u32::from(seen_only),
        anywhere: u32::from(anywhere),
        ..uniforms
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn maps(closest: f64, half: f64) -> ShadowUniforms {
        let [low, high] = [DVec3::splat(-half), DVec3::splat(half)];
        let finest = closest.min(1.0);
        let bounds = Bounds { low, high, detail: 1.0, finest, closest, around_camera: false };
        shadow_uniforms(DVec3::new(0.0, 0.6, 0.8), &bounds, DVec3::ZERO, None, 256, true, false)
    }

    #[test]
    fn each_map_is_half_of_the_next_and_reaches_through_all_matter() {
        let maps = maps(f64::INFINITY, 1e4);
        let used = maps.maps as usize;
        assert_eq!(used, SHADOW_MAPS);
        for i in 1..used {
            assert!((maps.corner[i][2] / maps.corner[i - 1][2] - 2.0).abs() < 1e-6);
            assert_eq!(maps.range[i], [maps.nearest, maps.reach, -FAR, FAR]);
        }
    }

    #[test]
    fn what_is_large_to_the_eye_has_texels_beside_a_wide_field() {
        let drop = 1e-3;
        for half in [1e2, 1e5, 1e9] {
            let maps = maps(drop, half);
            let used = maps.maps as usize;
            assert!(maps.corner[0][2] <= 1.001 * drop as f32, "{half}: {:?}", maps.corner);
            for (i, [begin, length, least, most]) in maps.range[..used].iter().enumerate() {
                let texel = maps.corner[i][2];
                // No step of 16 bits is longer than a texel, but in the coarsest, which has all.
                assert!(i + 1 == used || length / 65_536.0 <= 1.001 * texel, "{half} {i}");
                assert!(*least == -FAR || *least == *begin, "{half} {i}");
                assert!(*most == FAR || (most - begin - length).abs() <= 1e-6 * length);
                assert!(begin.abs() <= half as f32 * 2.0 && *begin <= 0.0 && begin + length >= 0.0);
            }
            assert_eq!(maps.range[used - 1], [maps.nearest, maps.reach, -FAR, FAR]);
        }
    }

    #[test]
    fn a_map_far_from_all_matter_has_no_range() {
        // All of it lies behind, or before.
        assert_eq!(shadow_range(50.0, 10.0, 8.0), [8.0, 1e-6, -FAR, 8.0]);
        assert_eq!(shadow_range(-50.0, 10.0, 8.0), [-8.0, 1e-6, -8.0, FAR]);
        assert_eq!(shadow_range(-50.0, 100.0, 8.0), [-8.0, 16.0, -8.0, 8.0]);
    }
}
