//! The camera of the tests, and the rays of its pixels.

use crate::TABLES;
use bytemuck::Zeroable;
use cumuli::frame::Lighting;
use cumuli::frame::cpu::atmosphere::distance_to_ground;
use cumuli::frame::cpu::blend::Pixel;
use cumuli::frame::cpu::lighting::SunDepth;
use cumuli::frame::cpu::segments::ChordInputs;
use cumuli::frame::gpu_data::FrameUniforms;
use glam::{DVec3, Vec3};

use super::clouds::{Cloud, sun};
use super::{HALO, PHASE, SIZE};

/// Looks along -Z; 57 degrees wide.
pub(super) fn frame(altitude: f64) -> FrameUniforms {
    FrameUniforms {
        right: [0.55, 0.0, 0.0, 0.0],
        up: [0.0, 0.44, 0.0, 0.0],
        forward: [0.0, 0.0, -1.0, 0.0],
        sun: sun().as_vec3().extend(0.0).to_array(),
        size: SIZE,
        tiles: SIZE.map(|s| s.div_ceil(8)),
        blocks: SIZE,
        stride: 1,
        phase: 1,
        in_place: 1,
        camera_altitude: altitude as f32,
        albedo: 1.0,
        delta_scale: 0.45,
        mean_cosine: 0.85,
        has_ground: u32::from(altitude > 0.0),
        ..FrameUniforms::zeroed()
    }
}

/// What the chords of a pixel are lit by.
pub(super) fn inputs<'a>(
    frame: &'a FrameUniforms,
    cloud: &'a Cloud,
    sun_depth: SunDepth<'a>,
) -> ChordInputs<'a> {
    ChordInputs {
        frame,
        tables: &TABLES,
        scattering: TABLES.scattering_for(&PHASE, 1.0).expect("built in"),
        phase: PHASE.prepare(),
        halo: &HALO,
        field: &cloud.field,
        sun_depth,
    }
}

pub(super) fn pixel_direction(frame: &FrameUniforms, i: u32) -> DVec3 {
    let axis = |v: [f32; 4]| Vec3::from_slice(&v).as_dvec3();
    let [x, y] = [i % SIZE[0], i / SIZE[0]];
    let ndc = |at: u32, size: u32| (f64::from(at) + 0.5) / f64::from(size) * 2.0 - 1.0;
    let (x, y) = (ndc(x, SIZE[0]), ndc(y, SIZE[1]));
    (axis(frame.forward) + x * axis(frame.right) - y * axis(frame.up)).normalize()
}

/// Calls `f` for the ray of every pixel.
pub(super) fn by_pixel<T>(
    frame: &FrameUniforms,
    cloud: &Cloud,
    lighting: Lighting,
    mut f: impl FnMut(&Pixel<'_>) -> T,
) -> Vec<T> {
    let sun_depth = |point| cloud.shadow.depth(point, lighting);
    let inputs = inputs(frame, cloud, &sun_depth);
    let pixel = |i: u32| {
        let dir = pixel_direction(frame, i);
        let ground =
            if cloud.altitude > 0.0 { distance_to_ground(cloud.altitude, dir.y) } else { -1.0 };
        let far = if ground >= 0.0 { ground } else { 1e30 };
        let (particles, lights) = (&cloud.particles, &cloud.lights);
        f(&Pixel { inputs: &inputs, particles, lights, dir, far, lighting })
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}
