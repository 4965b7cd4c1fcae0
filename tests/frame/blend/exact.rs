//! What the blend is compared with: an integration in small steps, and the merge of the original.

use crate::TABLES;
use cumuli::frame::Lighting;
use cumuli::frame::cpu::blend::Pixel;
use cumuli::frame::cpu::lighting::Before;
use cumuli::frame::cpu::segments::{Composed, compose as compose_segments};
use cumuli::frame::gpu_data::FrameUniforms;
use glam::{DQuat, DVec3, Vec3};

use super::clouds::Cloud;
use super::rays::by_pixel;

/// The picture with one open chord a pixel.
pub(super) fn merge(frame: &FrameUniforms, cloud: &Cloud) -> (Vec<[f32; 4]>, Vec<f32>) {
    let pixel = |pixel: &Pixel<'_>| {
        let both = pixel.particles.iter().zip(pixel.lights);
        let chords: Vec<_> =
            both.filter_map(|(p, l)| pixel.inputs.chord(p, l, pixel.dir, pixel.far)).collect();
        let seen = compose_segments(&chords, &pixel.inputs.ray(pixel.dir), 1, 0.0);
        (seen.radiance.extend(seen.transmittance).as_vec4().to_array(), seen.distance as f32)
    };
    by_pixel(frame, cloud, Lighting::Grid, pixel).into_iter().unzip()
}

/// Steps of the exact compositor in a radius of the smallest particle on a stretch of the ray.
pub(super) const FINE: f64 = 150.0;

/// Adds up all particles at every point of a ray, in small steps.
pub(super) fn integrate(pixel: &Pixel<'_>) -> Composed {
    let ray = pixel.inputs.ray(pixel.dir);
    let both = pixel.particles.iter().zip(pixel.lights);
    let chords: Vec<_> = both
        .filter_map(|(p, l)| {
            let chord = pixel.inputs.chord(p, l, pixel.dir, pixel.far)?;
            Some((p, chord))
        })
        .collect();
    let mut ends: Vec<f64> = chords.iter().flat_map(|(_, c)| [c.begin, c.end]).collect();
    ends.sort_by(f64::total_cmp);
    let mut since_gap = 0.0;
    let mut sum = Composed { radiance: DVec3::ZERO, transmittance: 1.0, distance: 0.0 };
    for stretch in ends.windows(2) {
        let [from, to] = [stretch[0], stretch[1]];
        let open: Vec<_> = chords.iter().filter(|(_, c)| c.begin <= from && c.end >= to).collect();
        let smallest = open.iter().map(|(p, _)| p.radius).fold(f32::INFINITY, f32::min);
        let count = ((to - from) / f64::from(smallest) * FINE).ceil().max(4.0);
        let step = (to - from) / count;
        if open.is_empty() || step <= 0.0 {
            since_gap = if step > 0.0 { 0.0 } else { since_gap };
            continue;
        }
        for i in 0..count as usize {
            let begin = from + step * i as f64;
            let middle = begin + 0.5 * step;
            let matter: Vec<f64> = open
                .iter()
                .map(|(p, _)| {
                    let turn = DQuat::from_array(p.orientation.map(f64::from));
                    let copy = pixel.inputs.copy(p, pixel.dir);
                    let at = (middle * pixel.dir - Vec3::from(p.centre).as_dvec3())
                        / f64::from(p.radius);
                    f64::from(p.extinction) * step * TABLES.density(p.shape, turn * at, copy)
                })
                .collect();
            let tau: f64 = matter.iter().sum();
            let lit = ray.piece(begin, begin + step, tau, 0.5, Before { view: 0.0, since_gap });
            since_gap += tau;
            let mut light = DVec3::ZERO;
            for ((_, chord), matter) in open.iter().zip(matter) {
                light += matter * lit.source(&chord.light);
            }
            let weight = sum.transmittance * -(-tau).exp_m1();
            if tau > 0.0 {
                sum.radiance += weight / tau * light;
            }
            sum.distance += weight * middle;
            sum.transmittance *= (-tau).exp();
        }
    }
    let opacity = 1.0 - sum.transmittance;
    sum.distance = if opacity > 0.0 { sum.distance / opacity } else { 0.0 };
    sum
}
