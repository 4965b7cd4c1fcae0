//! OpenEXR with 32-bit floats.

use std::io::{self, BufReader};
use std::path::Path;

use exr::image::{Blocks, Encoding, Image, Layer, SpecificChannels};
use exr::prelude::{Compression, LayerAttributes, LineOrder, Vec2, WritableImage};
use image::ImageDecoder;
use image::codecs::openexr::OpenExrDecoder;

use super::atomic::WriteSeek;
use crate::frame::Picture;

/// Lossless and small; 16 rows a block, in order, so that the same picture is the same bytes.
pub(super) const ENCODING: Encoding = Encoding {
    compression: Compression::ZIP16,
    blocks: Blocks::ScanLines,
    line_order: LineOrder::Increasing,
};

/// Encodes linear radiance as R, G, B and the opacity of the clouds as A.
pub(super) fn encode(picture: &Picture, out: &mut dyn WriteSeek) -> io::Result<()> {
    let size = Vec2(picture.size[0] as usize, picture.size[1] as usize);
    // The caller has checked that there is a pixel for every position.
    let pixel = |position: Vec2<usize>| {
        let [r, g, b, a] = picture.radiance[position.y() * size.width() + position.x()];
        (r, g, b, a)
    };
    let attributes = LayerAttributes {
        software_name: Some("Cumuli".into()),
        comments: Some(
            "R, G, B: linear Rec. 709 radiance, unit: solar irradiance per steradian, clouds and \
             all behind them. A: opacity of the clouds alone; R, G, B are not multiplied by it."
                .into(),
        ),
        ..LayerAttributes::default()
    };
    let channels = SpecificChannels::rgba(pixel);
    let image = Image::from_layer(Layer::new(size, attributes, ENCODING, channels));
    image.write().to_buffered(out).map_err(|e| match e {
        exr::error::Error::Io(e) => e,
        other => io::Error::other(other),
    })
}

/// Whether a file is an OpenEXR picture of this size that can be read to its end.
pub(super) fn is_whole(path: &Path, size: [u32; 2]) -> bool {
    let Ok(file) = std::fs::File::open(path) else { return false };
    let Ok(decoder) = OpenExrDecoder::new(BufReader::new(file)) else { return false };
    // The size comes first, so that a foreign file of any claimed size is not decoded.
    let channels = decoder.color_type();
    if decoder.dimensions() != (size[0], size[1]) || channels != image::ColorType::Rgba32F {
        return false;
    }
    let mut bytes = vec![0; usize::from(channels.bytes_per_pixel()) * Picture::pixel_count(size)];
    decoder.read_image(&mut bytes).is_ok()
}
