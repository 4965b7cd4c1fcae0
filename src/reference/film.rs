//! A picture of a scene by path tracing, sample by sample, so that it can be looked at, saved and
//! gone on with at any row.

use glam::DVec3;
use rayon::prelude::*;

use super::geometry::Medium;
use super::points::Points;
use super::random::Random;
use super::statistics::Estimate;
use super::transport::{Matter, Surroundings, look};
use super::view::{Filter, View};

/// Numbers of a pixel: red, green, blue, transmittance.
pub const CHANNELS: usize = 4;

/// What is known of one pixel: red, green, blue, transmittance. Updated as by Welford (1962), so
/// that a pixel without noise has an error of exactly 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Pixel {
    /// Of the samples.
    pub mean: [f64; CHANNELS],
    /// Sum of squared deviations from the mean.
    pub spread: [f64; CHANNELS],
}

impl Pixel {
    /// The `count`-th sample.
    fn add(&mut self, count: f64, values: [f64; CHANNELS]) {
        for (channel, value) in values.into_iter().enumerate() {
            let off = value - self.mean[channel];
            self.mean[channel] += off / count;
            self.spread[channel] += off * (value - self.mean[channel]);
        }
    }

    fn estimate(&self, count: f64, channel: usize) -> Estimate {
        let value = self.mean[channel];
        let standard_error = if count > 1.0 {
            (self.spread[channel].max(0.0) / (count * (count - 1.0))).sqrt()
        } else {
            f64::INFINITY
        };
        Estimate { value, standard_error }
    }
}

/// The samples of a picture so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Samples every pixel has, unless it wants fewer.
    pub samples: u32,
    /// Rows from the top that have one more.
    pub rows: u32,
    /// Rows from top to bottom.
    pub pixels: Vec<Pixel>,
    /// Samples that each pixel is to get; empty where all get the same.
    pub wanted: Vec<u32>,
}

/// What scrambled points are for.
enum Use {
    Pixel,
    Lens,
}

impl Film {
    /// No samples yet.
    pub fn new(size: [u32; 2]) -> Self {
        let count = size[0] as usize * size[1] as usize;
        Self {
            size,
            samples: 0,
            rows: 0,
            pixels: vec![Pixel::default(); count],
            wanted: Vec::new(),
        }
    }

    /// Adds one sample to every pixel of the next `rows` rows that wants one, at most up to the last row. The
    /// result depends on the seed and the samples before, not on threads or on how the rows are
    /// split.
    pub fn expose_rows(
        &mut self,
        medium: &impl Medium,
        surroundings: &impl Surroundings,
        matter: &Matter,
        view: &View,
        seed: u64,
        rows: u32,
    ) {
        let columns = self.size[0] as usize;
        let end = self.rows.saturating_add(rows).min(self.size[1]);
        let (first, last) = (self.rows as usize * columns, end as usize * columns);
        let (sample, wanted) = (self.samples, &self.wanted);
        self.pixels[first..last].par_iter_mut().enumerate().with_min_len(8).for_each(
            |(offset, pixel)| {
                let index = first + offset;
                if wanted.get(index).is_some_and(|wanted| sample >= *wanted) {
                    return;
                }
                let points = |purpose: Use| Points::new(seed, index as u64, purpose as u64);
                let inside = match view.filter {
                    Filter::Box => points(Use::Pixel).at(sample),
                    Filter::Centre => [0.5; 2],
                };
                let corner = [(index % columns) as f64, (index / columns) as f64];
                let place = [0, 1].map(|axis| corner[axis] + inside[axis]);
                let lens = if view.has_lens() { points(Use::Lens).at(sample) } else { [0.0; 2] };
                let mut random = Random::new(seed, index as u64, u64::from(sample));
                let seen = look(medium, surroundings, matter, view.ray(place, lens), &mut random);
                let [r, g, b] = seen.radiance.to_array();
                pixel.add(f64::from(sample) + 1.0, [r, g, b, seen.transmittance]);
            },
        );
        self.rows = end;
        if self.rows == self.size[1] {
            self.samples += 1;
            self.rows = 0;
        }
    }

    /// Adds `samples` samples to every pixel.
    pub fn expose(
        &mut self,
        medium: &impl Medium,
        surroundings: &impl Surroundings,
        matter: &Matter,
        view: &View,
        seed: u64,
        samples: u32,
    ) {
        for _ in 0..samples {
            let rows = self.size[1] - self.rows;
            self.expose_rows(medium, surroundings, matter, view, seed, rows);
        }
    }

    /// Samples that a pixel has.
    pub fn count(&self, index: usize) -> u32 {
        let ahead = index < self.rows as usize * self.size[0] as usize;
        let count = self.samples + u32::from(ahead);
        self.wanted.get(index).map_or(count, |wanted| count.min(*wanted))
    }

    /// Samples that all pixels have together.
    pub fn total(&self) -> u64 {
        if self.wanted.is_empty() {
            let rows = u64::from(self.samples) * u64::from(self.size[1]) + u64::from(self.rows);
            return rows * u64::from(self.size[0]);
        }
        (0..self.pixels.len()).map(|index| u64::from(self.count(index))).sum()
    }

    /// Radiance of a pixel with its standard errors: red, green, blue, transmittance.
    pub fn estimates(&self, index: usize) -> [Estimate; CHANNELS] {
        let count = f64::from(self.count(index));
        [0, 1, 2, 3].map(|channel| self.pixels[index].estimate(count, channel))
    }

    /// Mean over all pixels.
    pub fn mean(&self) -> DVec3 {
        let sum: DVec3 = (0..self.pixels.len())
            .map(|i| DVec3::from_slice(&self.estimates(i).map(|e| e.value)[..3]))
            .sum();
        sum / self.pixels.len().max(1) as f64
    }
}
