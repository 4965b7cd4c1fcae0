//! The side of a tile is a matter of time, not of the picture.

use cumuli::frame::{Picture, Preset, Quality, RenderSettings};
use cumuli::scene::{CloudField, Scene};
use glam::DVec3;

use crate::{alone, renderer};

/// Odd, so that the last tiles stick out of the picture.
const SIZE: [u32; 2] = [97, 65];

fn picture(tile: u32, pixel_stride: u32) -> Picture {
    let clouds = CloudField { cells: 40, rings: 3, coverage: 0.5, ..CloudField::default() };
    let mut scene = Scene { clouds: Some(clouds), ..Scene::default() };
    scene.camera.position = DVec3::new(0.0, 1300.0, 0.0);
    scene.camera.target = scene.camera.position + DVec3::new(100.0, -80.0, -1000.0);
    let quality = Some(Quality { tile, pixel_stride, ..Preset::Low.quality() });
    let mut renderer = renderer(&scene, &RenderSettings { quality, ..Default::default() });
    // Two, as the second of blocks of pixels is made of parts.
    renderer.render(&scene, 0.0, SIZE).expect("a frame");
    let picture = renderer.render(&scene, 0.1, SIZE).expect("a frame");
    let blocks = SIZE.map(|side| side.div_ceil(pixel_stride).div_ceil(tile));
    let counters = &picture.stats.counters;
    assert_eq!(counters.tiles, u64::from(blocks[0] * blocks[1]), "{tile}");
    assert_eq!(counters.overflowed, 0);
    picture
}

#[test]
fn pictures_of_all_tile_sizes_are_the_same() {
    let _turn = alone();
    let bits = |picture: &Picture| -> Vec<u32> {
        picture.radiance.iter().flatten().map(|value| value.to_bits()).collect()
    };
    for stride in [1, 2] {
        let usual = picture(8, stride);
        for tile in [4, 13, 32] {
            let other = picture(tile, stride);
            assert!(bits(&other) == bits(&usual), "tiles of {tile}, blocks of {stride}");
            let [entries, usual] = [&other, &usual].map(|p| p.stats.counters.screen_list_entries);
            // Small tiles have more lists, and more entries in all.
            assert!(if tile < 8 { entries > usual } else { entries < usual }, "{entries} {usual}");
        }
    }
}
