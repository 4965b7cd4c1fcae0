//! Clouds among opaque things of a host: chords end there, shadows fall there, what is hidden is not touched, and
//! pixels of the frame before are not taken over across edges.

mod depths;
mod shadows;

use cumuli::frame::{
    Opaque, OpaquePicture, Pass, Picture, Preset, Quality, RenderSettings, Renderer, Surface,
};
use cumuli::reference::{Window, exact_frame_before};
use cumuli::scene::{CloudField, Scene, Sky};
use glam::DVec3;

use crate::{GPU, TABLES, alone, particle, renderer, settings};

/// Odd, so that the last tiles and blocks stick out of the picture.
const SIZE: [u32; 2] = [97, 65];
/// Of the pictures whose middle is composed exactly.
const LARGE: [u32; 2] = [384, 258];
const GREY: DVec3 = DVec3::splat(0.03);
const LIT: DVec3 = DVec3::new(0.2, 0.15, 0.1);

fn surface(distance: f64) -> Option<Surface> {
    Some(Surface { distance, radiance: GREY, sunlit: LIT })
}

/// Balls (centre and radius, m, in the world) as the scene's camera sees them.
fn balls(scene: &Scene, size: [u32; 2], balls: &[(DVec3, f64)]) -> OpaquePicture {
    let eye = scene.camera.position;
    OpaquePicture::cast(&scene.camera, size, |dir| {
        let meets = |&(centre, radius): &(DVec3, f64)| {
            let middle = (centre - eye).dot(dir);
            let half = radius * radius - (centre - eye - middle * dir).length_squared();
            (half > 0.0 && middle > half.sqrt()).then(|| middle - half.sqrt())
        };
        surface(balls.iter().filter_map(meets).min_by(f64::total_cmp)?)
    })
}

fn upload(picture: &OpaquePicture, revision: u64) -> Opaque {
    picture.upload(&GPU, revision).expect("a picture")
}

fn frame(renderer: &mut Renderer, scene: &Scene, time: f64) -> Picture {
    let picture = renderer.render(scene, time, SIZE).expect("a frame");
    assert_eq!([picture.stats.counters.overflowed, picture.stats.counters.cut], [0; 2]);
    picture
}

fn bits(picture: &Picture) -> Vec<u32> {
    picture.radiance.iter().flatten().map(|value| value.to_bits()).collect()
}

/// Noise shapes and even balls that overlap, under an atmosphere, over the ground.
fn clump() -> Scene {
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, 700.0 + y, z);
    let mut scene = Scene {
        particles: vec![
            particle(at(0.0, 0.0, 0.0), 150.0, 0.02, "pyroclastic-1"),
            particle(at(110.0, 30.0, -60.0), 110.0, 0.015, "uniform"),
            particle(at(-120.0, -30.0, 40.0), 120.0, 0.03, "soft-1"),
            particle(at(30.0, 60.0, 120.0), 90.0, 0.01, "soft-4"),
        ],
        ..Scene::default()
    };
    scene.camera.position = at(0.0, 40.0, 600.0);
    scene.camera.target = at(0.0, 0.0, 0.0);
    scene.camera.fov_x = 50.0;
    scene
}

/// Half the balls lie within particles, so that chords are clipped everywhere on their way.
fn things() -> Vec<(DVec3, f64)> {
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, 700.0 + y, z);
    vec![
        (at(-20.0, 20.0, 30.0), 60.0),
        (at(120.0, 20.0, -20.0), 50.0),
        (at(-170.0, -60.0, 90.0), 70.0),
        (at(60.0, -200.0, -500.0), 180.0),
        (at(20.0, 75.0, 300.0), 20.0),
    ]
}

/// The frame against the exact compositor with the same surfaces, in the pixels that show one: from outside, and from
/// within a particle; with the steps of preset high and with six times as many. Bounds: half as much again as was found;
/// chords that are not clipped are printed beside it. Particles are large in these pixels, so that their densities are
/// not the filtered ones of distant particles, which the exact compositor does not know. The surfaces send light of their
/// own alone: of sunlight that they reflect, 1 and 2 % (RMS, radiance) are off here however many steps there are, as the
/// edges of shadows on them are no sharper than the texels of the shadow maps.
#[test]
fn clipped_chords_are_those_of_the_exact_compositor() {
    let _turn = alone();
    let outside = clump();
    let mut inside = outside.clone();
    inside.camera.position = DVec3::new(20.0, 740.0, 110.0);
    let coarse = Preset::High.quality();
    let fine = Quality { steps: 6 * coarse.steps, ..coarse };
    let bounds = [[0.0105, 0.006], [0.0003, 0.0009]];
    for (name, scene) in [("outside", outside), ("inside", inside)] {
        let mut surfaces = balls(&scene, LARGE, &things());
        surfaces.sunlit.fill([0.0; 3]);
        for (quality, most) in [coarse, fine].into_iter().zip(bounds) {
            let settings = RenderSettings { quality: Some(quality), ..Default::default() };
            let mut renderer = renderer(&scene, &settings);
            let unclipped = renderer.render(&scene, 0.0, LARGE).expect("a frame");
            renderer.set_opaque(Some(upload(&surfaces, 1)));
            let found = renderer.render(&scene, 0.0, LARGE).expect("a frame");
            let window = Window::middle(LARGE, 3);
            let mut row = || {};
            let exact = exact_frame_before(
                Some(&surfaces),
                &renderer,
                &scene,
                &TABLES,
                &quality,
                LARGE,
                window,
                &mut row,
            )
            .expect("exact");
            let errors = |picture: &Picture| {
                let (mut opacity, mut radiance, mut mean, mut count) = (0.0, 0.0, 0.0, 0.0);
                for (i, exact) in exact.iter().enumerate() {
                    let [x, y] = [i as u32 % window.size[0], i as u32 / window.size[0]];
                    let pixel = ((y + window.corner[1]) * LARGE[0] + x + window.corner[0]) as usize;
                    if surfaces.surface(pixel).is_none() {
                        continue;
                    }
                    let [r, g, b, a] = picture.radiance[pixel].map(f64::from);
                    opacity += (a - (1.0 - exact.transmittance)).powi(2);
                    radiance += (DVec3::new(r, g, b) - exact.radiance).length_squared();
                    mean += exact.radiance.length();
                    count += 1.0;
                }
                assert!(count > 1000.0, "{count}");
                [(opacity / count).sqrt(), (radiance / count).sqrt() / (mean / count)]
            };
            let (clipped, whole) = (errors(&found), errors(&unclipped));
            println!("{name}, {} steps: {clipped:.5?}, not clipped {whole:.3?}", quality.steps);
            assert!(clipped[0] < most[0] && clipped[1] < most[1], "{name}: {clipped:?}");
            assert!(whole[0] > 0.1, "{name}: {whole:?}");
        }
    }
}

/// Particles behind what is opaque in all their tiles are in no list and have no light; the others' pixels are the same
/// to the bit.
#[test]
fn what_is_hidden_is_not_touched() {
    let _turn = alone();
    let clouds = CloudField { cells: 40, rings: 3, coverage: 0.5, ..CloudField::default() };
    let mut scene = Scene { clouds: Some(clouds), ..Scene::default() };
    scene.camera.position = DVec3::new(0.0, 1300.0, 0.0);
    scene.camera.target = scene.camera.position + DVec3::new(100.0, -80.0, -1000.0);
    let basis = scene.camera.basis();
    // A wall across the left half of the view.
    let wall = |distance: f64| {
        OpaquePicture::cast(&scene.camera, SIZE, |dir| {
            if dir.dot(basis.right) < 0.0 {
                surface(distance / dir.dot(basis.forward))
            } else {
                None
            }
        })
    };
    let mut renderer = renderer(&scene, &settings(Preset::Low));
    let open = frame(&mut renderer, &scene, 0.0);
    let all = open.stats.counters;
    let mut last = all;
    for (revision, distance) in [4000.0, 1000.0, 0.01].into_iter().enumerate() {
        let surfaces = wall(distance);
        renderer.set_opaque(Some(upload(&surfaces, revision as u64)));
        let picture = frame(&mut renderer, &scene, 0.0);
        let now = picture.stats.counters;
        println!(
            "wall at {distance} m: {} particles in view, {} entries, {} look-ups",
            now.particles_visible, now.screen_list_entries, now.table_lookups
        );
        assert!(now.particles_visible < last.particles_visible, "{now:?}");
        assert!(now.screen_list_entries < last.screen_list_entries, "{now:?}");
        assert!(now.table_lookups < last.table_lookups, "{now:?}");
        last = now;
        for (i, (found, open)) in picture.radiance.iter().zip(&open.radiance).enumerate() {
            assert!(surfaces.surface(i).is_some() || found == open, "pixel {i} beside the wall");
        }
    }
    // The lists of tiles that a near wall fills are empty: left of the middle, which falls into a tile.
    let [columns, tile] = [SIZE[0].div_ceil(renderer.tile_side()), renderer.tile_side()];
    let lists = renderer.tile_entries().expect("read back");
    let hidden = SIZE[0] / 2 / tile;
    for (i, list) in lists.iter().enumerate() {
        assert!(*list == 0 || i as u32 % columns >= hidden, "tile {i} lists {list}");
    }
    assert!(lists.iter().any(|list| *list > 0));
    assert!(2 * last.screen_list_entries < all.screen_list_entries + all.screen_list_entries / 2);
}

/// A revision says whether anything has to be made anew, and only what the depth has a part in is.
#[test]
fn a_frame_is_made_anew_with_another_revision_only() {
    let _turn = alone();
    let scene = clump();
    let mut lasting = renderer(&scene, &settings(Preset::Low));
    let surfaces = balls(&scene, SIZE, &things());
    let first = upload(&surfaces, 1);
    let ran = |picture: &Picture| -> Vec<String> {
        picture.stats.passes.iter().filter(|p| p.ran).map(|p| p.name.clone()).collect()
    };
    lasting.set_opaque(Some(first.clone()));
    let whole = frame(&mut lasting, &scene, 0.0);
    assert!(ran(&whole).contains(&Pass::Opaque.name().to_owned()));
    assert!(ran(&frame(&mut lasting, &scene, 0.0)).is_empty());
    lasting.set_opaque(Some(first.clone()));
    assert!(ran(&frame(&mut lasting, &scene, 0.0)).is_empty(), "the same again");
    let few = balls(&scene, SIZE, &things()[..2]);
    lasting.set_opaque(Some(upload(&few, 2)));
    let changed = frame(&mut lasting, &scene, 0.0);
    let passes =
        ["opaque", "project", "sort", "tile_lists", "light", "blend", "resolve", "tonemap"];
    assert_eq!(ran(&changed), passes);
    let alone = |opaque: Option<Opaque>| {
        let mut renderer = renderer(&scene, &settings(Preset::Low));
        renderer.set_opaque(opaque);
        frame(&mut renderer, &scene, 0.0)
    };
    assert!(bits(&changed) == bits(&alone(Some(upload(&few, 7)))));
    lasting.set_opaque(Some(first));
    assert!(bits(&frame(&mut lasting, &scene, 0.0)) == bits(&whole), "back");
    lasting.set_opaque(None);
    assert!(bits(&frame(&mut lasting, &scene, 0.0)) == bits(&alone(None)), "none");
}

/// A flight past a ball before clouds, one pixel of every block a frame: pixels beside its edge are as near to those of
/// the frame alone as all others. Where they were taken over too, they were off by 0.0056, the others by 0.0001.
#[test]
fn pixels_beside_edges_are_new() {
    let _turn = alone();
    let with_stride = |scene: &Scene, pixel_stride: u32| {
        let quality = Some(Quality { pixel_stride, ..Preset::Low.quality() });
        renderer(scene, &RenderSettings { quality, ..Default::default() })
    };
    let thing = [(DVec3::new(0.0, 720.0, 150.0), 60.0)];
    let flight = |time: f64| {
        let mut scene = clump();
        scene.sky = Sky::Uniform { radiance: 0.1 };
        scene.camera.position += DVec3::new(60.0 * time, 0.0, -40.0 * time);
        scene.camera.target += DVec3::new(60.0 * time, 0.0, -40.0 * time);
        scene
    };
    let mut lasting = with_stride(&flight(0.0), 2);
    let mut whole = with_stride(&flight(0.0), 1);
    let (mut at_edges, mut within) = ([0.0, 0.0], [0.0, 0.0]);
    for i in 0..8 {
        let time = 0.1 * f64::from(i);
        let scene = flight(time);
        let surfaces = balls(&scene, SIZE, &thing);
        for renderer in [&mut lasting, &mut whole] {
            renderer.set_opaque(Some(upload(&surfaces, 1 + i as u64)));
        }
        let found = frame(&mut lasting, &scene, time);
        let alone = frame(&mut whole, &scene, time);
        if i == 0 {
            assert!(bits(&found) == bits(&alone), "the first");
            continue;
        }
        for pixel in 0..surfaces.distance.len() {
            let [x, y] = [pixel % SIZE[0] as usize, pixel / SIZE[0] as usize];
            let there = |dx: i32, dy: i32| {
                let x = (x as i32 + dx).clamp(0, SIZE[0] as i32 - 1) as usize;
                let y = (y as i32 + dy).clamp(0, SIZE[1] as i32 - 1) as usize;
                surfaces.surface(y * SIZE[0] as usize + x).is_some()
            };
            let own = there(0, 0);
            // Whatever the block's new pixel is, one of those around lies across the edge.
            let is_edge = (-1..=1).any(|x| (-1..=1).any(|y| there(x, y) != own));
            let off = (found.radiance[pixel][0] - alone.radiance[pixel][0]).abs();
            let sum = if is_edge { &mut at_edges } else { &mut within };
            sum[0] += f64::from(off);
            sum[1] += 1.0;
        }
    }
    let [edges, rest] = [at_edges, within].map(|[sum, count]| sum / count);
    println!("off by {edges:.6} in {} pixels beside edges, {rest:.6} elsewhere", at_edges[1]);
    assert!(at_edges[1] > 300.0);
    assert!(edges < rest && rest < 2e-3, "{edges} {rest}");
    // Standing still, all becomes what it is alone.
    let scene = flight(0.7);
    for _ in 0..4 {
        frame(&mut lasting, &scene, 0.7);
    }
    assert!(bits(&frame(&mut lasting, &scene, 0.7)) == bits(&frame(&mut whole, &scene, 0.7)));
}
