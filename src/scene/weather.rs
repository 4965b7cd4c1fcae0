//! Weather maps: images that say where the clouds of a field are.

use std::fs::File;
use std::hash::{DefaultHasher, Hasher};
use std::io::{BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec2;
use image::codecs::png::PngDecoder;
use image::{ImageDecoder, Limits};
use serde::{Deserialize, Serialize};

use super::fault::tidy;
use super::{limits, vector};
use crate::error::{Error, Result};

/// A weather map, how it lies over the world and what its colours mean. It takes the place of the
/// same coverage everywhere, and drifts with the wind as the field does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeatherMap {
    /// The image, a PNG file; in a scene file relative to that, here as it can be opened.
    pub file: PathBuf,
    /// What the image spans along X and along Z, m.
    #[serde(with = "vector::two", default = "usual_extent")]
    pub extent: DVec2,
    /// X and Z of its middle at time 0, m. Its top is towards -Z, its right towards +X.
    #[serde(with = "vector::two", default)]
    pub centre: DVec2,
    /// What lies beyond its edges.
    #[serde(default)]
    pub outside: Outside,
    /// What red, green and blue mean, in this order; grey is taken for red.
    #[serde(default = "usual_channels")]
    pub channels: Vec<Channel>,
    /// Share of the coverage noise, 0 to 1: at 1 the map says how much of the sky the noise covers,
    /// at 0 it says itself how high the clouds are.
    #[serde(default = "all_noise")]
    pub noise: f64,
    /// The image.
    #[serde(skip)]
    pub image: Arc<WeatherImage>,
}

/// What lies beyond the edges of a weather map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Outside {
    /// The same map again and again.
    #[default]
    Repeat,
    /// Its outermost pixels.
    Edge,
    /// No clouds.
    Clear,
}

impl Outside {
    /// All of them, with their names in files.
    pub const ALL: [(Self, &str); 3] =
        [(Self::Repeat, "repeat"), (Self::Edge, "edge"), (Self::Clear, "clear")];
}

/// What a colour of a weather map means. All are from 0 at black to 1 at white, without a tone curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// Factor on the field's coverage.
    Coverage,
    /// Factor on the field's thickness: how high the clouds can grow.
    Height,
    /// Factor on the field's extinction.
    Extinction,
    /// Nothing.
    Unused,
}

impl Channel {
    /// All of them, with their names in files.
    pub const ALL: [(Self, &str); 4] = [
        (Self::Coverage, "coverage"),
        (Self::Height, "height"),
        (Self::Extinction, "extinction"),
        (Self::Unused, "unused"),
    ];
}

/// Extent where none is given, m: ten times the distance between groups of clouds.
const USUAL_EXTENT: f64 = 20_000.0;

fn usual_extent() -> DVec2 {
    DVec2::splat(USUAL_EXTENT)
}

fn usual_channels() -> Vec<Channel> {
    vec![Channel::Coverage]
}

fn all_noise() -> f64 {
    1.0
}

impl WeatherMap {
    /// A map of coverage with everything else as usual: as wide as usual, with square pixels.
    pub fn open(file: &Path) -> Result<Self> {
        Self::open_as(file, &usual_channels())
    }

    /// The same with colours that mean this, or the coverage alone where the image has fewer.
    pub fn open_as(file: &Path, channels: &[Channel]) -> Result<Self> {
        let (image, channels) = WeatherImage::load_as(file, channels)?;
        let image = Arc::new(image);
        let [width, height] = image.size.map(f64::from);
        // A strip of pixels is no reason for an extent that is out of range.
        let depth = USUAL_EXTENT * height / width;
        let depth = depth.clamp(limits::WEATHER_EXTENT.least, limits::WEATHER_EXTENT.most);
        Ok(Self {
            file: file.to_owned(),
            extent: DVec2::new(USUAL_EXTENT, depth),
            centre: DVec2::ZERO,
            outside: Outside::default(),
            channels,
            noise: all_noise(),
            image,
        })
    }

    /// The same map with its image read anew.
    pub fn read_again(&self) -> Result<Self> {
        let image = Arc::new(WeatherImage::load(&self.file, &self.channels)?);
        Ok(Self { image, ..self.clone() })
    }
}

/// The pixels of a weather map.
#[derive(Default, PartialEq, Eq)]
pub struct WeatherImage {
    // The first to be compared: what differs in it need not be compared pixel by pixel.
    fingerprint: u64,
    size: [u32; 2],
    texels: Vec<u32>,
}

impl std::fmt::Debug for WeatherImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [width, height] = self.size;
        write!(f, "{width} x {height} pixels, {:016x}", self.fingerprint)
    }
}

/// What is wrong with an image, as a sentence that begins with the image.
type Told<T> = std::result::Result<T, String>;

/// What must be there, for messages.
const EXPECTED: &str = "expected a PNG image";
/// Memory for what a decoder keeps of an image besides its pixels, bytes: lines of the largest one
/// take 64 KiB, colour profiles some megabytes.
const DECODER_MEMORY: u64 = 8 << 20;
/// Where a PNG's sizes end: signature, length and name of the first chunk, width, height.
const HEAD: usize = 24;
const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

impl WeatherImage {
    /// Reads an image file. Larger images than [`limits::MOST_MAP_SIDE`] pixels a side are refused by what
    /// their head says, before anything is decoded.
    pub fn load(path: &Path, channels: &[Channel]) -> Result<Self> {
        let told = open(path).and_then(|file| Self::read(BufReader::new(file), channels, None));
        told.map(|(image, _)| image)
            .map_err(|message| Error::input(path.display().to_string(), message))
    }

    /// The same, or with the usual meanings where the image has fewer colours; with those that it has.
    fn load_as(path: &Path, channels: &[Channel]) -> Result<(Self, Vec<Channel>)> {
        let usual = usual_channels();
        let told =
            open(path).and_then(|file| Self::read(BufReader::new(file), channels, Some(&usual)));
        told.map_err(|message| Error::input(path.display().to_string(), message))
    }

    /// The same from memory; `place` names it in errors.
    pub fn from_bytes(bytes: &[u8], place: &str, channels: &[Channel]) -> Result<Self> {
        let told = Self::read(Cursor::new(bytes), channels, None);
        told.map(|(image, _)| image).map_err(|message| Error::input(place, message))
    }

    /// The image with these meanings of its colours, or with `otherwise` where it has fewer, and the
    /// meanings that it was read with.
    fn read(
        mut source: impl BufRead + Seek,
        channels: &[Channel],
        otherwise: Option<&[Channel]>,
    ) -> Told<(Self, Vec<Channel>)> {
        let size = size_of(&mut source)?;
        let unreadable = |e: std::io::Error| format!("cannot be read ({e}), {EXPECTED}");
        source.seek(SeekFrom::Start(SIGNATURE.len() as u64)).map_err(unreadable)?;
        check_palette(&mut source)?;
        source.rewind().map_err(unreadable)?;
        let most = limits::MOST_MAP_SIDE;
        let mut bounds = Limits::default();
        bounds.max_image_width = Some(most);
        bounds.max_image_height = Some(most);
        bounds.max_alloc = Some(DECODER_MEMORY);
        let broken = |e: image::ImageError| {
            format!("is no sound PNG image: {}", tidy(&e.to_string(), LONGEST_REASON))
        };
        let decoder = PngDecoder::with_limits(source, bounds).map_err(broken)?;
        let colour = decoder.color_type();
        let (all, hidden) = (colour.channel_count(), u8::from(colour.has_alpha()));
        let colours = usize::from(all - hidden);
        let channels = match otherwise {
            Some(fewer) if channels.len() > colours => fewer,
            _ => channels,
        };
        if channels.len() > colours {
            return Err(format!(
                "has {colours} {}, expected at least {}: as many as clouds.weather.channels names",
                if colours == 1 { "channel" } else { "channels" },
                channels.len()
            ));
        }
        let bytes_a_pixel = usize::from(colour.bytes_per_pixel());
        let bytes_a_channel = bytes_a_pixel / usize::from(all).max(1);
        let bytes = usize::try_from(decoder.total_bytes()).map_err(|e| e.to_string())?;
        let mut pixels = vec![0; bytes];
        decoder.read_image(&mut pixels).map_err(broken)?;
        let texels = pixels.chunks_exact(bytes_a_pixel.max(1)).map(|pixel| {
            // 16-bit channels stand in the machine's own order.
            let channel = |index: usize| match pixel.get(index * bytes_a_channel..) {
                Some([low, high, ..]) if bytes_a_channel == 2 => u16::from_ne_bytes([*low, *high]),
                Some([byte, ..]) => u16::from(*byte) * 257,
                _ => u16::MAX,
            };
            packed(channels, channel)
        });
        Ok((Self::new(size, texels.collect()), channels.to_vec()))
    }

    /// An image of these texels, line by line: 16 bits of coverage, then 8 of height, then 8 of
    /// extinction. What is missing is clear. An image of more than [`limits::MOST_MAP_SIDE`] pixels a side is
    /// not filled up: [`Scene::validate`](super::Scene::validate) refuses it.
    pub fn new(size: [u32; 2], mut texels: Vec<u32>) -> Self {
        if size.iter().all(|side| *side <= limits::MOST_MAP_SIDE) {
            texels.resize(size[0] as usize * size[1] as usize, 0);
        }
        let mut hasher = DefaultHasher::new();
        size.iter().for_each(|side| hasher.write_u32(*side));
        texels.iter().for_each(|texel| hasher.write_u32(*texel));
        Self { fingerprint: hasher.finish(), size, texels }
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The texels, line by line: bits 0 to 15 coverage, 16 to 23 height, 24 to 31 extinction.
    pub fn texels(&self) -> &[u32] {
        &self.texels
    }

    /// What tells one image from another, to be compared with what the same program says.
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }
}

/// Longest part of a decoder's message that is repeated.
const LONGEST_REASON: usize = 200;

/// Opens a plain file of no more than the limit: one that a scene names must not make the program
/// wait for a pipe.
fn open(path: &Path) -> Told<File> {
    let unreadable = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => format!("there is no such file, {EXPECTED}"),
        _ => format!("cannot be read ({e}), {EXPECTED}"),
    };
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(format!("is not a plain file, {EXPECTED}"));
    }
    if metadata.len() > limits::MOST_MAP_BYTES {
        return Err(format!("is larger than {} MiB, {EXPECTED}", limits::MOST_MAP_BYTES >> 20));
    }
    File::open(path).map_err(unreadable)
}

/// The size that an image's head tells, where it is one that is allowed.
fn size_of(source: &mut impl Read) -> Told<[u32; 2]> {
    let mut head = [0; HEAD];
    let no_png = |_| format!("is no PNG image, {EXPECTED}");
    source.read_exact(&mut head).map_err(no_png)?;
    let number = |at: usize| {
        head.iter().skip(at).take(4).fold(0_u32, |number, byte| number << 8 | u32::from(*byte))
    };
    if !head.starts_with(&SIGNATURE) || &head[12..16] != b"IHDR" {
        return Err(format!("is no PNG image, {EXPECTED}"));
    }
    let (size, most) = ([number(16), number(20)], limits::MOST_MAP_SIDE);
    if size.iter().any(|side| !(1..=most).contains(side)) {
        let [width, height] = size;
        return Err(format!("is {width} x {height} pixels, expected 1 to {most} a side"));
    }
    Ok(size)
}

/// Refuses palettes with a part of a colour or too many: the decoder (png 0.18.1) panics at them. From the first
/// chunk on, to the first of pixels; what is wrong with chunks themselves the decoder tells.
fn check_palette(source: &mut impl Read) -> Told<()> {
    const BYTES_A_COLOUR: u32 = 3;
    const MOST_BYTES: u32 = 256 * BYTES_A_COLOUR;
    const CHECKSUM: u64 = 4;
    let mut head = [0; 8];
    while source.read_exact(&mut head).is_ok() {
        let [a, b, c, d, name @ ..] = head;
        let length = u32::from_be_bytes([a, b, c, d]);
        if name == *b"IDAT" {
            break;
        }
        let sound = length.is_multiple_of(BYTES_A_COLOUR) && length <= MOST_BYTES;
        if name == *b"PLTE" && !sound {
            return Err(format!(
                "is no sound PNG image: its palette has {length} bytes, expected 3 for each of at \
                 most 256 colours"
            ));
        }
        let rest = u64::from(length) + CHECKSUM;
        if std::io::copy(&mut source.take(rest), &mut std::io::sink()).is_err() {
            break;
        }
    }
    Ok(())
}

/// A texel of what each channel of a pixel means.
fn packed(channels: &[Channel], value: impl Fn(usize) -> u16) -> u32 {
    // To the nearest of 8 bits.
    let byte = |value: u16| (u32::from(value) * 255 + 32_767) / 65_535;
    let (mut coverage, mut height, mut extinction) = (0xffff, 0xff, 0xff);
    for (index, channel) in channels.iter().enumerate() {
        match channel {
            Channel::Coverage => coverage = u32::from(value(index)),
            Channel::Height => height = byte(value(index)),
            Channel::Extinction => extinction = byte(value(index)),
            Channel::Unused => {}
        }
    }
    coverage | height << 16 | extinction << 24
}

/// How a scene file in `folder` names a file: relative where it lies in the folder, else from the root.
pub(super) fn named_from(folder: &Path, file: &Path) -> PathBuf {
    let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    // An empty path is no path to `absolute`.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let file = whole(file);
    file.strip_prefix(whole(folder)).map(Path::to_owned).unwrap_or(file)
}

#[cfg(test)]
#[path = "weather_tests.rs"]
mod tests;
