//! Pictures to be compared, from OpenEXR or PNG files.

use std::path::Path;

use glam::DVec3;

use crate::error::{Error, Result};
use crate::frame::cpu::tonemap;
use crate::frame::view::BASE_EXPOSURE;
use crate::output::{Format, Layers};

/// Longest side that is read, pixels.
const MOST_SIDE: u32 = 16_384;

/// What the numbers of a picture are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Linear radiance.
    Radiance,
    /// Linear light of a display, 0 to 1.
    Display,
}

/// A picture with what is known of its errors.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Its name in messages.
    pub name: String,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// What the numbers are.
    pub kind: Kind,
    /// Linear Rec. 709, rows from the top.
    pub light: Vec<DVec3>,
    /// Standard errors of the same, where they are known.
    pub standard_error: Option<Vec<DVec3>>,
    /// Opacity of the clouds, where it is known.
    pub opacity: Option<Vec<f64>>,
}

impl Measured {
    /// Reads a picture in the format of the file name's end.
    pub fn read(path: &Path) -> Result<Self> {
        match Format::of(path)? {
            Format::Exr => Self::from_layers(path, &Layers::read(path, MOST_SIDE)?),
            Format::Png => Self::from_png(path),
        }
    }

    fn from_layers(path: &Path, layers: &Layers) -> Result<Self> {
        let name = path.display().to_string();
        let channel = |channel: &str| -> Result<Option<&[f32]>> {
            let Some(values) = layers.channel(channel) else { return Ok(None) };
            match values.iter().position(|v| !v.is_finite()) {
                None => Ok(Some(values)),
                Some(i) => {
                    let (x, y) = (i as u32 % layers.size[0], i as u32 / layers.size[0]);
                    let message = format!(
                        "pixel {x}, {y} holds {} in the channel {channel}, expected numbers",
                        values[i]
                    );
                    Err(Error::input(name.clone(), message))
                }
            }
        };
        let colours = |prefix: &str| -> Result<Option<Vec<DVec3>>> {
            let [r, g, b] = ["R", "G", "B"].map(|c| channel(&format!("{prefix}{c}")));
            Ok(match (r?, g?, b?) {
                (Some(r), Some(g), Some(b)) => Some(
                    (0..r.len())
                        .map(|i| DVec3::new(r[i].into(), g[i].into(), b[i].into()))
                        .collect(),
                ),
                _ => None,
            })
        };
        let light = colours("")?
            .ok_or_else(|| Error::input(name.clone(), "expected channels named R, G and B"))?;
        let standard_error = colours("standard_error.")?;
        let opacity = match channel("T")? {
            Some(t) => Some(t.iter().map(|t| 1.0 - f64::from(*t)).collect()),
            None => channel("A")?.map(|a| a.iter().map(|a| f64::from(*a)).collect()),
        };
        let (size, kind) = (layers.size, Kind::Radiance);
        Ok(Self { name, size, kind, light, standard_error, opacity })
    }

    fn from_png(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let bad = |e: image::ImageError| match e {
            image::ImageError::IoError(e) => Error::io(path, "read", e),
            e => Error::input(name.clone(), format!("cannot be read as PNG: {e}")),
        };
        let file = std::fs::File::open(path).map_err(|e| Error::io(path, "read", e))?;
        let file = std::io::BufReader::new(file);
        let mut reader = image::ImageReader::with_format(file, image::ImageFormat::Png);
        let mut limits = image::Limits::default();
        (limits.max_image_width, limits.max_image_height) = (Some(MOST_SIDE), Some(MOST_SIDE));
        reader.limits(limits);
        let read = reader.decode().map_err(bad)?.into_rgb32f();
        let size = [read.width(), read.height()];
        let light =
            read.pixels().map(|p| DVec3::from_array(p.0.map(|v| linear(v.into())))).collect();
        Ok(Self { name, size, kind: Kind::Display, light, standard_error: None, opacity: None })
    }

    /// Linear light of a display that shows the picture as PNG files do, at this exposure (EV).
    pub fn displayed(&self, exposure: f64) -> Vec<DVec3> {
        match self.kind {
            Kind::Display => self.light.clone(),
            Kind::Radiance => {
                let factor = BASE_EXPOSURE * exposure.exp2();
                let shown = |v: &DVec3| {
                    DVec3::from_array(tonemap::display(*v * factor).to_array().map(linear))
                };
                self.light.iter().map(shown).collect()
            }
        }
    }
}

/// The inverse of the sRGB transfer function, IEC 61966-2-1.
pub fn linear(shown: f64) -> f64 {
    if shown <= 0.04045 { shown / 12.92 } else { ((shown + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_and_back() {
        for i in 0..=1000 {
            let v = f64::from(i) / 1000.0;
            // The standard's two thresholds fit each other to 8 digits only.
            assert!((linear(tonemap::srgb(v)) - v).abs() < 1e-7, "{v}");
        }
    }
}
