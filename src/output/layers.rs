//! OpenEXR pictures with any channels: written for measurements, read for comparisons.

use std::io::{self, BufReader};
use std::path::Path;

use exr::image::{AnyChannel, AnyChannels, FlatSamples, Image, Layer};
use exr::meta::MetaData;
use exr::prelude::{
    LayerAttributes, ReadChannels, ReadLayers, SmallVec, Text, Vec2, WritableImage,
};
use half::f16;

use super::atomic::WriteSeek;
use super::exr::ENCODING;
use super::write_atomically;
use crate::error::{Error, Result};

/// One number for each pixel, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// "R", "standard_error.R" and the like.
    pub name: String,
    /// Rows from top to bottom.
    pub values: Vec<f32>,
}

/// A picture of named channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// In any order.
    pub channels: Vec<Channel>,
    /// What the channels mean.
    pub comment: String,
}

impl Layers {
    /// A channel by its name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// One more channel.
    pub fn add(&mut self, name: &str, values: impl IntoIterator<Item = f32>) {
        self.channels.push(Channel { name: name.to_owned(), values: values.into_iter().collect() });
    }

    /// Writes them as OpenEXR, in 16-bit floats if `half`, otherwise in 32-bit floats. The folder
    /// is made if need be, and what a killed run left of the same picture is removed.
    pub fn write(&self, path: &Path, half: bool) -> Result<()> {
        let pixels = self.size[0] as usize * self.size[1] as usize;
        if pixels == 0 || self.channels.iter().any(|c| c.values.len() != pixels) {
            return Err(Error::input(
                path.display().to_string(),
                format!(
                    "every channel of {} x {} needs {pixels} values",
                    self.size[0], self.size[1]
                ),
            ));
        }
        write_atomically(path, |out| self.encode(out, half))
    }

    fn encode(&self, out: &mut dyn WriteSeek, half: bool) -> io::Result<()> {
        let list: SmallVec<[_; 4]> = self
            .channels
            .iter()
            .map(|c| {
                let samples = if half {
                    FlatSamples::F16(c.values.iter().map(|v| f16::from_f32(*v)).collect())
                } else {
                    FlatSamples::F32(c.values.clone())
                };
                AnyChannel::new(Text::from(c.name.as_str()), samples)
            })
            .collect();
        let attributes = LayerAttributes {
            software_name: Some("Cumuli".into()),
            comments: Some(Text::from(self.comment.as_str())),
            ..LayerAttributes::default()
        };
        let size = Vec2(self.size[0] as usize, self.size[1] as usize);
        let image =
            Image::from_layer(Layer::new(size, attributes, ENCODING, AnyChannels::sort(list)));
        image.write().to_buffered(out).map_err(|e| match e {
            exr::error::Error::Io(e) => e,
            other => io::Error::other(other),
        })
    }

    /// Reads the first layer of an OpenEXR file, of at most `most_side` pixels a side.
    pub fn read(path: &Path, most_side: u32) -> Result<Self> {
        let open = || {
            let file = std::fs::File::open(path).map_err(|e| Error::io(path, "read", e))?;
            Ok(BufReader::new(file))
        };
        let bad = |e: String| Error::input(path.display().to_string(), e);
        let broken = |e: exr::error::Error| bad(format!("cannot be read as OpenEXR: {e}"));
        // The size comes first, so that a file of any claimed size is not decoded.
        let meta = MetaData::read_from_buffered(open()?, false).map_err(broken)?;
        for header in &meta.headers {
            let Vec2(width, height) = header.layer_size;
            if width.max(height) > most_side as usize {
                return Err(bad(format!(
                    "expected at most {most_side} pixels a side, found {width}x{height}"
                )));
            }
        }
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(open()?)
            .map_err(broken)?;
        let layer = image.layer_data;
        let channels = layer
            .channel_data
            .list
            .into_iter()
            .map(|c| Channel {
                name: c.name.to_string(),
                values: c.sample_data.values_as_f32().collect(),
            })
            .collect();
        let comment = layer.attributes.comments.map(|t| t.to_string()).unwrap_or_default();
        Ok(Self { size: [layer.size.0 as u32, layer.size.1 as u32], channels, comment })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layers() -> Layers {
        let mut layers =
            Layers { size: [3, 2], comment: "a comment".to_owned(), ..Layers::default() };
        layers.add("R", (0..6).map(|i| i as f32 * 0.25));
        layers.add("standard_error.R", (0..6).map(|i| i as f32 * 0.5));
        layers.add("A", [1.0; 6]);
        layers
    }

    #[test]
    fn channels_come_back_by_name() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("a.exr");
        for half in [false, true] {
            layers().write(&path, half).expect("written");
            let read = Layers::read(&path, 10).expect("readable");
            assert_eq!((read.size, read.comment.as_str()), ([3, 2], "a comment"));
            for channel in &layers().channels {
                // All values are exact in 16 bits.
                assert_eq!(read.channel(&channel.name), Some(channel.values.as_slice()));
            }
        }
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("a.exr");
        layers().write(&path, false).expect("written");
        assert!(Layers::read(&path, 2).is_err(), "larger than allowed");
        let whole = std::fs::read(&path).expect("readable");
        for cut in [0, 3, 100, whole.len() - 1] {
            std::fs::write(&path, &whole[..cut]).expect("written");
            assert!(Layers::read(&path, 10).is_err(), "cut at {cut}");
        }
        let mut short = layers();
        short.channels[0].values.pop();
        assert!(short.write(&path, false).is_err());
    }
}
