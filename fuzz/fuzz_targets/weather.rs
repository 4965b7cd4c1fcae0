//! Weather maps.
#![no_main]

use cumuli::scene::{Channel, WeatherImage};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let channels = [Channel::Coverage, Channel::Height, Channel::Extinction];
    for count in 1..=channels.len() {
        if let Ok(map) = WeatherImage::from_bytes(bytes, "fuzz", &channels[..count]) {
            let [width, height] = map.size();
            assert_eq!(map.texels().len(), width as usize * height as usize);
        }
    }
});
