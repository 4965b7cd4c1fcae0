//! 8-bit sRGB PNG.

use std::io::{self, BufReader};
use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngDecoder, PngEncoder};
use image::{ExtendedColorType, ImageDecoder, ImageEncoder};

use super::atomic::WriteSeek;
use crate::frame::Picture;

/// Encodes the tone-mapped pixels; their alpha is not used.
pub(super) fn encode(picture: &Picture, out: &mut dyn WriteSeek) -> io::Result<()> {
    let rgb: Vec<u8> = picture.pixels.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
    encode_bytes(picture.size, &rgb, out)
}

/// Encodes red, green and blue, one after the other.
pub(super) fn encode_bytes(size: [u32; 2], rgb: &[u8], out: &mut dyn WriteSeek) -> io::Result<()> {
    let [width, height] = size;
    PngEncoder::new_with_quality(&mut *out, CompressionType::Default, FilterType::Adaptive)
        .write_image(rgb, width, height, ExtendedColorType::Rgb8)
        .map_err(io::Error::other)?;
    out.flush()
}

/// Whether a file is a PNG of this size that can be read to its end.
pub(super) fn is_whole(path: &Path, size: [u32; 2]) -> bool {
    let Ok(file) = std::fs::File::open(path) else { return false };
    let Ok(decoder) = PngDecoder::new(BufReader::new(file)) else { return false };
    // The size comes first, so that a foreign file of any claimed size is not decoded.
    if decoder.dimensions() != (size[0], size[1]) || decoder.color_type() != image::ColorType::Rgb8
    {
        return false;
    }
    let mut bytes = vec![0; 3 * Picture::pixel_count(size)];
    decoder.read_image(&mut bytes).is_ok()
}
