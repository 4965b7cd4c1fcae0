//! What large weather maps take that are sound: as much as is promised for each of their pixels.

use std::sync::PoisonError;

use cumuli::scene::{Channel, WeatherImage};
use image::{ExtendedColorType, ImageEncoder};

use super::{MEMORY, TURN, readers};

/// Memory for each pixel, and besides, bytes: the README's.
const A_PIXEL: usize = 12;
const BESIDES: usize = 1 << 20;

#[test]
fn large_sound_maps_take_what_their_pixels_may() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    // The largest there may be, and the most bytes a pixel.
    for (size, colour, bytes_a_pixel) in [
        ([4096, 4096], ExtendedColorType::L8, 1),
        ([2048, 1024], ExtendedColorType::Rgba16, 8),
        ([4096, 3], ExtendedColorType::Rgb8, 3),
    ] {
        let [width, height] = size.map(|side| side as usize);
        let bytes: Vec<u8> =
            (0..width * height * bytes_a_pixel).map(|i| (i * i / 7 % 251) as u8).collect();
        let mut file = Vec::new();
        let encoder = image::codecs::png::PngEncoder::new(&mut file);
        encoder.write_image(&bytes, size[0], size[1], colour).expect("encoded");
        let before = MEMORY.current_usage();
        MEMORY.reset_peak_usage();
        let map = WeatherImage::from_bytes(&file, readers::PLACE, &[Channel::Coverage]);
        let taken = MEMORY.peak_usage() - before;
        let map = map.expect("a sound map");
        assert_eq!(map.texels().len(), width * height);
        let allowed = A_PIXEL * width * height + BESIDES;
        println!("{width} x {height} {colour:?}: {taken} of {allowed} bytes");
        // Less than the texels alone would mean that nothing was measured.
        assert!((4 * width * height..=allowed).contains(&taken), "{taken} of {allowed}: {size:?}");
    }
}
