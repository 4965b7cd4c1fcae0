//! Weather maps: the particles that the device makes of them against those of the twin, and what the
//! twin makes of them against what a map means.

use std::sync::Arc;

use cumuli::frame::cpu;
use cumuli::frame::cpu::weather::map_place;
use cumuli::frame::gpu_data::Particle;
use cumuli::frame::rings::PlacedField;
use cumuli::scene::{CloudField, Outside, WeatherImage, WeatherMap};
use glam::{DVec2, DVec3, IVec2, UVec2};

use crate::rings::{FIRST_SLOT, SHAPES, compare, small_field};

/// Slots for the particles of a small field under an overcast sky.
const CAPACITY: u32 = 1 << 14;

fn placed(field: &CloudField, camera: DVec3, time: f64) -> PlacedField {
    PlacedField::new(field, camera, time, &SHAPES, FIRST_SLOT, CAPACITY)
}

/// A map with these texels; they are as wide as they are deep.
fn map(size: [u32; 2], width: f64, texels: Vec<u32>) -> WeatherMap {
    WeatherMap {
        file: "map.png".into(),
        extent: DVec2::new(width, width * f64::from(size[1]) / f64::from(size[0])),
        centre: DVec2::ZERO,
        outside: Outside::Repeat,
        channels: Vec::new(),
        noise: 1.0,
        image: Arc::new(WeatherImage::new(size, texels)),
    }
}

/// Coverage, height and extinction from a hash: all of them everywhere different.
fn motley(size: [u32; 2]) -> Vec<u32> {
    (0..size[0] * size[1]).map(cpu::noise::hash).collect()
}

fn with(weather: WeatherMap) -> CloudField {
    CloudField { coverage: 0.9, weather: Some(weather), ..small_field() }
}

#[test]
fn particles_under_a_map_are_those_of_the_twin() {
    let motley_map = map([37, 23], 5000.0, motley([37, 23]));
    let near = DVec3::new(120.0, 900.0, -340.0);
    for (name, camera, outside, noise) in [
        ("again and again", near, Outside::Repeat, 1.0),
        ("its edge", near, Outside::Edge, 0.4),
        ("clear outside", near, Outside::Clear, 0.0),
        ("10,000 km away", DVec3::new(1e7, 500.0, -7e6), Outside::Repeat, 0.7),
        ("beyond the edge of the edge", DVec3::new(1e7, 500.0, -7e6), Outside::Edge, 1.0),
        // Cell numbers pass 2^31 and wrap; the map goes on.
        ("beyond all cell numbers", DVec3::new(-2e11, 0.0, 3e11), Outside::Repeat, 0.0),
    ] {
        let weather =
            WeatherMap { outside, noise, centre: DVec2::new(-333.0, 77.7), ..motley_map.clone() };
        compare(name, &placed(&with(weather), camera, 12.5));
    }
    // One pixel, as large as it may be, and many, as small as they may be.
    let all = u32::MAX;
    compare("a pixel", &placed(&with(map([1, 1], 1e8, vec![all])), near, 0.0));
    let fine = [512, 512];
    compare("fine", &placed(&with(map(fine, small_field().cell_size, motley(fine))), near, 0.0));
}

/// Where a particle is in the world, m.
fn at(particle: &Particle, camera: DVec3) -> DVec3 {
    camera + DVec3::from_array(particle.centre.map(f64::from))
}

/// The map lies where its fields say, drifts with the wind, and its colours are heights and densities.
#[test]
fn clouds_are_where_the_map_is_bright() {
    let (white, black) = (u32::MAX, 0xffff_0000);
    // North is up: the upper left pixel is in the north-west, at -X and -Z.
    let mut texels = vec![black; 16];
    texels[0] = white;
    let mut field = with(map([4, 4], 4000.0, texels));
    field.wind = DVec3::new(10.0, 0.0, -5.0);
    field.coverage = 1.0;
    field.cells = 64;
    let (camera, time) = (DVec3::new(300.0, 700.0, 100.0), 50.0);
    let drift = field.wind * time;
    let particles = |field: &CloudField| cpu::rings::particles(&placed(field, camera, time));
    for outside in [Outside::Clear, Outside::Edge] {
        let Some(weather) = &mut field.weather else { unreachable!() };
        weather.outside = outside;
        let made = particles(&field);
        assert!(made.len() > 100, "{} particles", made.len());
        let mut beyond = 0;
        for particle in &made {
            let place = at(particle, camera) - drift;
            // Between its middle at -1500 m and its neighbours' it fades.
            assert!(place.x < -500.0 && place.z < -500.0, "{outside:?}: {place}");
            beyond += u32::from(place.x < -2500.0 || place.z < -2500.0);
        }
        assert_eq!(beyond > 0, outside == Outside::Edge, "{beyond} beyond the map");
    }
    // Half as high, a quarter as dense, everywhere. A particle may be above its cloud by a third of a
    // layer, which is lowest in the innermost ring.
    field.rings = 1;
    let above = 0.34 * field.thickness / f64::from(field.layers);
    let texel = 0xffff | 0x80 << 16 | 0x40 << 24;
    field.weather = Some(map([1, 1], 1000.0, vec![texel]));
    let low = particles(&field);
    let highest = |list: &[Particle]| {
        list.iter().map(|p| at(p, camera).y - drift.y - field.base).fold(0.0, f64::max)
    };
    let densest = |list: &[Particle]| list.iter().map(|p| p.extinction).fold(0.0, f32::max);
    field.weather = Some(map([1, 1], 1000.0, vec![white]));
    let tall = particles(&field);
    let (half, quarter) = (f64::from(0x80) / 255.0, 64.0 / 255.0);
    let [low_top, top] = [&low, &tall].map(|list| highest(list));
    assert!(low_top < half * field.thickness + above && low_top < 0.7 * top, "{low_top} {top}");
    assert!((densest(&low) / densest(&tall) - quarter).abs() < 0.01 * quarter);
}

/// A white map is no map, but for steps of the curve: the same particles to some hundredths of their size.
#[test]
fn a_white_map_is_none() {
    let plain = CloudField { coverage: 0.4, ..small_field() };
    let white =
        CloudField { weather: Some(map([3, 5], 700.0, vec![u32::MAX; 15])), ..plain.clone() };
    let [plain, white] = [plain, white].map(|field| {
        let made = cpu::rings::particles(&placed(&field, DVec3::Y, 7.0));
        made.into_iter().map(|p| (p.id, p)).collect::<std::collections::HashMap<_, _>>()
    });
    let mut both = 0;
    for (id, a) in &plain {
        let Some(b) = white.get(id) else { continue };
        assert!((a.radius / b.radius - 1.0).abs() < 0.05, "{a:?} {b:?}");
        both += 1;
    }
    let (plain, white) = (plain.len(), white.len());
    assert!(plain > 500 && plain.abs_diff(white) < plain / 50 && both > plain * 98 / 100);
}

/// Wherever the eye is, a cell reads the map at the same place, to the last bit.
#[test]
fn a_cell_reads_the_same_place_from_everywhere() {
    for outside in [Outside::Repeat, Outside::Edge] {
        let weather = WeatherMap { outside, ..map([37, 23], 4567.8, motley([37, 23])) };
        let field = with(weather);
        for far in [0.0, 1e7, -1e11] {
            let centre = DVec3::new(far, 0.0, 0.25 * far);
            let here = placed(&field, centre, 0.0);
            let there = placed(&field, centre + DVec3::new(333.0, 0.0, -247.0), 0.0);
            for index in 0..here.uniforms.rings as usize {
                let [a, b] = [&here, &there].map(|f| f.uniforms.ring[index]);
                let apart = IVec2::from(a.first_cell).wrapping_sub(IVec2::from(b.first_cell));
                let cell = UVec2::new(12, 13);
                let same = (cell.as_ivec2() + apart).as_uvec2();
                let ((a, a_share), (b, b_share)) = (map_place(&a, cell), map_place(&b, same));
                let size = IVec2::new(37, 23);
                // Periods may differ where it repeats.
                let equal = if outside == Outside::Repeat {
                    a.rem_euclid(size) == b.rem_euclid(size) && a_share == b_share
                } else {
                    (a == b && a_share == b_share) || (a.abs().min(b.abs()).min_element() > 1 << 20)
                };
                assert!(equal, "{outside:?} {far}, ring {index}: {a} {a_share}, {b} {b_share}");
            }
        }
    }
}
