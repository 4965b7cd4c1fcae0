//! From samples to pictures.

use super::film::Film;
use crate::frame::Picture;
use crate::frame::cpu::tonemap;
use crate::frame::picture::FrameStats;
use crate::frame::view::exposure;
use crate::output::Layers;
use crate::scene::Scene;
use glam::DVec3;

/// What the channels of a reference picture mean.
const MEANING: &str = "R, G, B: linear Rec. 709 radiance, unit: solar irradiance per steradian, \
    clouds and all behind them. A: opacity of the clouds alone, T: 1 - A; R, G, B are not \
    multiplied by it. standard_error: of each of these, one standard deviation of the mean; A has that of T.";

/// A picture that is displayed as the frame would: rows of radiance and opacity.
pub fn picture(scene: &Scene, size: [u32; 2], radiance: Vec<[f32; 4]>) -> Picture {
    let exposure = exposure(scene);
    let pixels = radiance
        .iter()
        .enumerate()
        .map(|(i, pixel)| {
            let linear = DVec3::new(pixel[0].into(), pixel[1].into(), pixel[2].into());
            let (x, y) = (i as u32 % size[0], i as u32 / size[0]);
            let shown = tonemap::display(linear * exposure) + tonemap::dither(x, y);
            let byte = |v: f64| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
            [byte(shown.x), byte(shown.y), byte(shown.z), 255]
        })
        .collect();
    Picture { size, radiance, pixels, stats: FrameStats::default() }
}

impl Film {
    /// Mean radiance of every pixel, and the opacity.
    pub fn radiance(&self) -> Vec<[f32; 4]> {
        let pixel = |i| {
            let [r, g, b, transmittance] = self.estimates(i).map(|e| e.value);
            [r as f32, g as f32, b as f32, (1.0 - transmittance) as f32]
        };
        (0..self.pixels.len()).map(pixel).collect()
    }

    /// Radiance, opacity, transmittance and their standard errors as named channels. The error of
    /// a single sample is unknown: there is none then.
    pub fn layers(&self) -> Layers {
        let estimates: Vec<_> = (0..self.pixels.len()).map(|i| self.estimates(i)).collect();
        let counts = (0..self.pixels.len()).map(|i| self.count(i));
        let (least, most) = (counts.clone().min().unwrap_or(0), counts.max().unwrap_or(0));
        let samples = if least < most { format!("{least} to {most}") } else { most.to_string() };
        let comment = format!("{MEANING} {samples} samples a pixel.");
        let mut layers = Layers { size: self.size, comment, ..Layers::default() };
        for (channel, name) in ["R", "G", "B", "T"].into_iter().enumerate() {
            layers.add(name, estimates.iter().map(|e| e[channel].value as f32));
        }
        layers.add("A", estimates.iter().map(|e| (1.0 - e[3].value) as f32));
        if self.samples > 1 {
            for (channel, name) in ["R", "G", "B", "T"].into_iter().enumerate() {
                layers.add(
                    &format!("standard_error.{name}"),
                    estimates.iter().map(|e| e[channel].standard_error as f32),
                );
            }
        }
        layers
    }
}
