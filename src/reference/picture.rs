//! A picture of a scene by path tracing, in rounds of a few samples a pixel, so that it can be
//! looked at, saved and gone on with.

use glam::DVec3;
use rayon::prelude::*;

use super::geometry::{Medium, Ray};
use super::random::Random;
use super::statistics::{Estimate, Moments};
use super::transport::{Matter, Surroundings, look};
use crate::scene::Camera;

/// Sums of one pixel: red, green, blue, transmittance.
pub type Pixel = [Moments; 4];

/// The samples of a picture so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Samples every pixel has.
    pub samples: u32,
    /// Rows from top to bottom.
    pub pixels: Vec<Pixel>,
}

/// Irrational steps of the two-dimensional golden-ratio sequence (Roberts 2018): any number of
/// points of it is spread evenly.
const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

impl Film {
    /// No samples yet.
    pub fn new(size: [u32; 2]) -> Self {
        let count = size[0] as usize * size[1] as usize;
        Self { size, samples: 0, pixels: vec![Pixel::default(); count] }
    }

    /// Adds `samples` samples to every pixel. The result depends on the seed and the samples
    /// before, not on threads or on how the samples are split into rounds.
    pub fn expose(
        &mut self,
        medium: &impl Medium,
        surroundings: &impl Surroundings,
        matter: &Matter,
        camera: &Camera,
        seed: u64,
        samples: u32,
    ) {
        let [width, height] = self.size.map(f64::from);
        let (columns, first) = (self.size[0] as usize, self.samples);
        self.pixels.par_iter_mut().enumerate().with_min_len(16).for_each(|(index, pixel)| {
            let corner = [(index % columns) as f64, (index / columns) as f64];
            let mut shift = Random::new(seed, index as u64, u64::MAX);
            let shift = [shift.unit(), shift.unit()];
            for sample in first..first + samples {
                let mut random = Random::new(seed, index as u64, u64::from(sample));
                let place = [0, 1].map(|axis| {
                    corner[axis] + (shift[axis] + f64::from(sample) * STEPS[axis]).fract()
                });
                let dir = camera.ray(place[0] / width, place[1] / height, width / height);
                let ray = Ray { origin: camera.position, dir };
                let seen = look(medium, surroundings, matter, ray, &mut random);
                for (moments, value) in pixel
                    .iter_mut()
                    .zip(seen.radiance.to_array().into_iter().chain([seen.transmittance]))
                {
                    moments.add(value);
                }
            }
        });
        self.samples += samples;
    }

    /// Radiance of a pixel with its standard errors: red, green, blue, transmittance.
    pub fn estimates(&self, index: usize) -> [Estimate; 4] {
        self.pixels[index].map(|m| m.estimate())
    }

    /// Mean over all pixels.
    pub fn mean(&self) -> DVec3 {
        let sum: DVec3 = (0..self.pixels.len())
            .map(|i| DVec3::from_slice(&self.estimates(i).map(|e| e.value)[..3]))
            .sum();
        sum / self.pixels.len().max(1) as f64
    }
}
