//! Draws the weather map of `scenes/cyclone.toml`: a cyclone, its arms logarithmic spirals around an eye,
//! red for coverage, green for height.
//!
//! `cargo run --example weather_map -- scenes/cyclone.png`

use std::error::Error;
use std::io::Cursor;

use cumuli::output::write_atomically;
use image::{ImageFormat, Rgb, RgbImage};

/// Pixels a side; the scene makes them 160 m wide.
pub const SIDE: u32 = 256;
/// Arms of the cyclone.
const ARMS: f64 = 2.0;
/// Turns that an arm takes as its radius grows by the factor e.
const WINDING: f64 = 0.45;
/// Radii in half sides of the map: where the eye's wall is, and where the last clouds end.
const WALL: f64 = 0.1;
const END: f64 = 0.95;

fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Coverage and height at a place of the map, from -1 to 1 each way.
fn weather(x: f64, y: f64) -> [f64; 2] {
    let radius = x.hypot(y).max(1e-6);
    let phase = ARMS * (y.atan2(x) / std::f64::consts::TAU - WINDING * (radius / WALL).ln());
    let arm = 0.5 + 0.5 * (std::f64::consts::TAU * phase).cos();
    // Next to the eye the arms run together, outwards they grow narrow.
    let wall = 1.0 - smoothstep(WALL, 3.0 * WALL, radius);
    let inside = smoothstep(0.6 * WALL, WALL, radius) * (1.0 - smoothstep(0.6, END, radius));
    let coverage = inside * (wall + (1.0 - wall) * arm.powf(1.0 + 2.0 * radius));
    let height = 0.3 + 0.7 * (1.0 - smoothstep(WALL, 0.7, radius));
    [coverage, height]
}

/// The map.
pub fn map() -> RgbImage {
    let at = |pixel: u32| (2.0 * f64::from(pixel) + 1.0) / f64::from(SIDE) - 1.0;
    RgbImage::from_fn(SIDE, SIDE, |x, y| {
        let [coverage, height] = weather(at(x), at(y)).map(|v| (255.0 * v).round() as u8);
        Rgb([coverage, height, 0])
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1).ok_or("expected the name of the PNG file to write")?;
    let mut bytes = Vec::new();
    map().write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png)?;
    write_atomically(path.as_ref(), |file| file.write_all(&bytes))?;
    Ok(())
}
