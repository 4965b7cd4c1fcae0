//! The side of a tile is a matter of time, not of the picture.

use cumuli::frame::{Picture, Preset, Quality, RenderSettings};
use cumuli::scene::{CloudField, Scene};
use glam::DVec3;

use crate::{alone, particle, renderer, space};

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

/// Workgroups of the blend are as many as there are areas of 8x8 pixels that a tile with particles touches; the others are
/// clear, as they are where every tile lists something.
#[test]
fn empty_tiles_are_not_dispatched() {
    let _turn = alone();
    // Wider than a row of the dispatch has workgroups, so that the list goes on in a second one.
    let wide = [8192, 16];
    let at =
        |x: f64, y: f64, radius: f64| particle(DVec3::new(x, y, -1000.0), radius, 0.05, "soft-1");
    let corner = vec![at(-380.0, 240.0, 60.0), at(300.0, -150.0, 90.0)];
    let all = vec![at(0.0, 0.0, 900.0)];
    let none = vec![at(0.0, 5000.0, 10.0)];
    for (what, particles, size) in [
        ("two", &corner, SIZE),
        ("all", &all, SIZE),
        ("a wide picture", &all, wide),
        ("none", &none, SIZE),
    ] {
        for tile in [4, 8, 13, 32] {
            let mut scene = space(0.1, 1.0, DVec3::ZERO, particles.clone());
            scene.camera.target = DVec3::new(0.0, 0.0, -1.0);
            let quality = Some(Quality { tile, ..Preset::Low.quality() });
            let mut renderer = renderer(&scene, &RenderSettings { quality, ..Default::default() });
            let picture = renderer.render(&scene, 0.0, size).expect("a frame");
            let lists = renderer.tile_entries().expect("read back");
            let across = size[0].div_ceil(tile);
            let listed = |x: u32, y: u32| lists[(y / tile * across + x / tile) as usize] > 0;
            let is_wanted = |area: &[u32; 2]| {
                let [x, y] = area.map(|v| 8 * v);
                let pixels = |from: u32, size: u32| from..(from + 8).min(size);
                pixels(x, size[0]).any(|x| pixels(y, size[1]).any(|y| listed(x, y)))
            };
            let [columns, rows] = size.map(|s| s.div_ceil(8));
            let wanted =
                (0..rows).flat_map(|y| (0..columns).map(move |x| [x, y])).filter(is_wanted).count();
            let dispatched = renderer.blend_groups().expect("read back");
            println!("{what}, tiles of {tile}: {dispatched:?} for {wanted} of {}", columns * rows);
            let [x, y, z] = dispatched[..] else { panic!("{dispatched:?}") };
            if wanted > 1024 {
                assert_eq!([x, y, z], [1024, wanted.div_ceil(1024) as u32, 1], "{what}");
            } else if what == "none" {
                assert_eq!([x, y], [0, 0]);
            } else {
                assert_eq!([x, y, z], [wanted as u32, 1, 1], "{what}");
            }
            assert_eq!(what == "two", (1..60).contains(&wanted), "{what}: {wanted}");
            assert_eq!(what == "a wide picture", wanted > 1024, "{what}: {wanted}");
            let empty = lists.iter().filter(|list| **list == 0).count() as u64;
            assert_eq!(picture.stats.counters.tiles_empty, empty, "{what}");
            for (i, pixel) in picture.radiance.iter().enumerate() {
                let [x, y] = [i as u32 % size[0], i as u32 / size[0]];
                // The uniform sky, and no cloud before it.
                assert!(
                    listed(x, y) || *pixel == [0.1, 0.1, 0.1, 0.0],
                    "{what}: {x} {y} {pixel:?}"
                );
            }
        }
    }
}
