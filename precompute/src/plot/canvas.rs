//! A picture to draw on, and its colours.

use std::path::Path;
use std::sync::Once;

use cumuli::{Error, Result};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;
use rayon::prelude::*;

/// Name under which the font is known to plotters. It comes with the program: the pictures are the
/// same on machines without fonts.
pub const FONT: &str = "plain";
/// 8-bit RGB, from the top left.
pub struct Canvas {
    size: [u32; 2],
    pixels: Vec<u8>,
}

/// Where on a canvas a tile lies: its left upper corner and its side, pixels.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    pub x: u32,
    pub y: u32,
    pub side: u32,
}

impl Canvas {
    /// All white.
    pub fn new(size: [u32; 2]) -> Self {
        static FONTS: Once = Once::new();
        FONTS.call_once(|| {
            // A font that cannot be read leaves the pictures without words, and says so then.
            let _ = register_font(FONT, FontStyle::Normal, epaint_default_fonts::HACK_REGULAR);
        });
        Self { size, pixels: vec![255; 3 * size[0] as usize * size[1] as usize] }
    }

    /// To draw charts on.
    pub fn area(&mut self) -> DrawingArea<BitMapBackend<'_>, Shift> {
        let size = (self.size[0], self.size[1]);
        BitMapBackend::with_buffer(&mut self.pixels, size).into_drawing_area()
    }

    /// Words, by their left upper corner.
    pub fn text(&mut self, text: &str, at: [u32; 2], height: u32) -> Result<()> {
        let place = (at[0] as i32, at[1] as i32);
        let style = (FONT, height).into_font().color(&BLACK);
        self.area().draw(&Text::new(text.to_owned(), place, style)).map_err(failed)
    }

    /// Fills a tile from a function over -1..1 in x (to the right) and y (upwards), with so many
    /// samples along each side of a pixel.
    pub fn fill(&mut self, tile: Tile, samples: u32, colour: impl Fn(f64, f64) -> [f64; 3] + Sync) {
        let width = self.size[0] as usize;
        let Tile { x, y, side } = tile;
        let rows = self.pixels.par_chunks_mut(3 * width).skip(y as usize).take(side as usize);
        rows.enumerate().for_each(|(row, line)| {
            let pixels = line.chunks_exact_mut(3).skip(x as usize).take(side as usize);
            for (column, pixel) in pixels.enumerate() {
                let place = |index: usize, part: u32| {
                    let within = (f64::from(part) + 0.5) / f64::from(samples);
                    2.0 * (index as f64 + within) / f64::from(side) - 1.0
                };
                let mut sum = [0.0; 3];
                for part in 0..samples * samples {
                    let u = place(column, part % samples);
                    let v = -place(row, part / samples);
                    sum.iter_mut().zip(colour(u, v)).for_each(|(s, c)| *s += c);
                }
                let count = f64::from(samples * samples);
                for (byte, s) in pixel.iter_mut().zip(sum) {
                    *byte = (255.0 * (s / count).clamp(0.0, 1.0)).round() as u8;
                }
            }
        });
    }

    /// Writes a PNG file, whole or not at all.
    pub fn save(&self, path: &Path) -> Result<()> {
        let [width, height] = self.size;
        cumuli::output::write_atomically(path, |out| {
            PngEncoder::new(&mut *out)
                .write_image(&self.pixels, width, height, ExtendedColorType::Rgb8)
                .map_err(std::io::Error::other)
        })
    }
}

/// What plotters refuses is a mistake of ours.
pub fn failed(error: impl std::fmt::Display) -> Error {
    Error::Failed(format!("drawing: {error}"))
}

/// Grey, 0 black to 1 white.
pub fn grey(value: f64) -> [f64; 3] {
    [value; 3]
}

/// Differences in -1..1: blue below 0, white at 0, red above.
pub fn signed(value: f64) -> [f64; 3] {
    let v = value.clamp(-1.0, 1.0);
    if v < 0.0 { [1.0 + v, 1.0 + 0.7 * v, 1.0] } else { [1.0, 1.0 - 0.8 * v, 1.0 - v] }
}

/// The display's nonlinear value of a linear one (IEC 61966-2-1).
pub fn srgb(linear: f64) -> f64 {
    let v = linear.clamp(0.0, 1.0);
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// Colours of curves, dark enough for white paper and apart for most eyes (Okabe and Ito 2008).
pub const CURVES: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];
