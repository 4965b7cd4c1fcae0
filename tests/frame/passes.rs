//! No pass is a stub, no two runs differ, and what is skipped would not have changed a bit.

use cumuli::frame::{
    Opaque, OpaquePicture, Pass, Picture, Preset, RenderSettings, Renderer, Surface,
};
use cumuli::scene::{Ground, Scene, Sky};
use glam::DVec3;

use crate::{GPU, alone, particle, renderer, scene, settings};

/// Seconds; not a time at which anything is special.
const TIME: f64 = 37.5;
const SIZE: [u32; 2] = [96, 64];

/// The shipped meadow with a smaller field, from between its clouds: sky, ground with shadows,
/// clouds above and before them.
fn cumulus() -> Scene {
    let mut scene = scene(cumuli::scene::DEFAULT_SCENE);
    scene.camera.position = DVec3::new(0.0, 900.0, 0.0);
    scene.camera.target = DVec3::new(0.0, 850.0, -1000.0);
    let field = scene.clouds.as_mut().expect("the default scene has a field");
    field.cells = 48;
    field.rings = 3;
    field.coverage = 0.4;
    scene
}

/// Passes of a scene with all that a scene over this ground can have, but nothing opaque of a host.
fn own_passes(scene: &Scene) -> Vec<&'static str> {
    let is_own = |p: &Pass| *p != Pass::Opaque && (*p != Pass::Sea || scene.is_sea());
    Pass::ALL.into_iter().filter(is_own).map(|p| p.name()).collect()
}

fn at_sea(mut scene: Scene) -> Scene {
    scene.ground = Some(Ground::sea(5.0, DVec3::new(0.01, 0.03, 0.05)));
    scene
}

/// A ball before some of the clouds of `cumulus`.
fn ball(scene: &Scene) -> Opaque {
    let (centre, radius) = (DVec3::new(0.0, -40.0, -900.0), 220.0);
    let picture = OpaquePicture::cast(&scene.camera, SIZE, |dir| {
        let middle = centre.dot(dir);
        let half = radius * radius - (centre - middle * dir).length_squared();
        (half > 0.0).then(|| Surface {
            distance: middle - half.sqrt(),
            radiance: DVec3::splat(0.02),
            sunlit: DVec3::new(0.1, 0.05, 0.02),
        })
    });
    picture.upload(&GPU, 0).expect("a picture")
}

fn render(renderer: &mut Renderer, scene: &Scene, time: f64) -> Picture {
    let picture = renderer.render(scene, time, SIZE).expect("a frame");
    assert_eq!(picture.stats.counters.overflowed, 0);
    picture
}

fn fresh(scene: &Scene, time: f64) -> Picture {
    render(&mut renderer(scene, &settings(Preset::Low)), scene, time)
}

/// Share of the pixels in which some channel differs by more than `steps`.
fn differing(a: &Picture, b: &Picture, steps: u8) -> f64 {
    let differs =
        |(a, b): (&[u8; 4], &[u8; 4])| a.iter().zip(b).take(3).any(|(a, b)| a.abs_diff(*b) > steps);
    let count = a.pixels.iter().zip(&b.pixels).filter(|pair| differs(*pair)).count();
    count as f64 / a.pixels.len() as f64
}

fn assert_same_bits(a: &Picture, b: &Picture, what: &str) {
    let bits = |p: &Picture| -> Vec<u32> {
        p.radiance.iter().flatten().map(|value| value.to_bits()).collect()
    };
    assert!(bits(a) == bits(b), "{what}: radiance differs");
    assert!(a.pixels == b.pixels, "{what}: pixels differ in {}", differing(a, b, 0));
}

fn ran(picture: &Picture) -> Vec<&str> {
    picture.stats.passes.iter().filter(|p| p.ran).map(|p| p.name.as_str()).collect()
}

/// Eight of 256 steps are seen side by side by anyone (one is about the threshold in a smooth
/// area, and the dither's amplitude is one); a hundredth of the picture is a patch of 8x8 pixels.
#[test]
fn every_pass_is_seen() {
    let _turn = alone();
    let (plain, sea) = (cumulus(), at_sea(cumulus()));
    let seen = |scene: &Scene, settings: &RenderSettings| {
        let mut renderer = renderer(scene, settings);
        renderer.set_opaque(Some(ball(scene)));
        render(&mut renderer, scene, TIME)
    };
    let [over_land, over_sea] = [&plain, &sea].map(|scene| seen(scene, &settings(Preset::Low)));
    assert_eq!(over_sea.stats.passes.len(), Pass::ALL.len());
    assert_eq!(ran(&over_sea).len(), Pass::ALL.len(), "{:?}", over_sea.stats.passes);
    assert_eq!(ran(&over_land).len(), Pass::ALL.len() - 1, "{:?}", over_land.stats.passes);
    for pass in Pass::ALL {
        let settings = RenderSettings { omit: Some(pass), ..settings(Preset::Low) };
        let (scene, whole) =
            if pass == Pass::Sea { (&sea, &over_sea) } else { (&plain, &over_land) };
        let without = seen(scene, &settings);
        assert!(!ran(&without).contains(&pass.name()), "{pass:?} ran");
        let share = differing(whole, &without, 8);
        println!("without {pass:?}: {share:.3} of the pixels differ");
        assert!(share > 0.01, "{pass:?} is seen in {share:.4} of the pixels");
    }
}

#[test]
fn two_renderers_make_the_same_bits() {
    let _turn = alone();
    for preset in [Preset::Low, Preset::High] {
        let scene = cumulus();
        let make = || render(&mut renderer(&scene, &settings(preset)), &scene, TIME);
        assert_same_bits(&make(), &make(), preset.name());
    }
}

/// One renderer goes through every kind of change; each of its pictures is what a renderer makes
/// that has seen nothing before.
#[test]
fn what_is_skipped_would_not_have_changed_the_picture() {
    let _turn = alone();
    skips_change_nothing(cumulus());
}

#[test]
fn what_is_skipped_at_sea_would_not_have_changed_the_picture() {
    let _turn = alone();
    skips_change_nothing(at_sea(cumulus()));
}

fn skips_change_nothing(still: Scene) {
    let mut turned = still.clone();
    turned.camera.target += DVec3::new(700.0, 100.0, 0.0);
    // Mirrored, its picture keeps the number of tiles: the buffers stay. Another number of tiles
    // takes other buffers, and all is made anew.
    let mut sun = turned.clone();
    sun.sun.direction.x *= -1.0;
    let mut low_sun = turned.clone();
    low_sun.sun.direction = DVec3::new(-0.9, 0.1, -0.3).normalize();
    let mut moved = sun.clone();
    moved.camera.position += DVec3::new(30.0, 0.0, -20.0);
    let mut higher = moved.clone();
    higher.camera.position += DVec3::new(0.0, 300.0, 0.0);
    let mut exposed = higher.clone();
    exposed.exposure = 0.5;

    let all = own_passes(&still);
    let but = |left_out: &[&str]| -> Vec<&str> {
        all.iter().copied().filter(|name| !left_out.contains(name)).collect()
    };
    // Shadows are made where the camera sees them.
    let unmoved = ["sky", "rings", "light_grid", "light_field"];
    let steps: [(&str, &Scene, f64, Vec<&str>); 11] = [
        ("first", &still, TIME, but(&[])),
        ("paused and still", &still, TIME, vec![]),
        ("turned", &turned, TIME, but(&unmoved)),
        ("turned back", &still, TIME, but(&unmoved)),
        ("time", &turned, TIME + 20.0, but(&["sky"])),
        ("sun", &sun, TIME + 20.0, but(&["rings"])),
        ("low sun", &low_sun, TIME + 20.0, but(&[])),
        ("sun back", &sun, TIME + 20.0, but(&[])),
        ("moved level", &moved, TIME + 20.0, but(&["sky", "light_grid"])),
        ("moved up", &higher, TIME + 20.0, but(&["light_grid"])),
        ("exposed", &exposed, TIME + 20.0, but(&unmoved)),
    ];
    let mut lasting = renderer(&still, &settings(Preset::Low));
    for (what, scene, time, expected) in steps {
        let picture = render(&mut lasting, scene, time);
        assert_eq!(ran(&picture), expected, "{what}: {:?}", picture.stats.passes);
        assert!(picture.stats.passes.iter().all(|p| !p.reason.is_empty()), "{what}");
        assert_same_bits(&picture, &fresh(scene, time), what);
    }
}

/// Clouds out of view: a picture without them takes nothing, one of the ground only their shadows; what
/// was left out is made when it comes into view. All with the bits of a renderer that skips nothing.
#[test]
fn what_is_out_of_view_is_not_made() {
    let _turn = alone();
    let still = cumulus();
    let view = |height: f64, ahead: DVec3| {
        let mut scene = still.clone();
        scene.camera.position.y = height;
        scene.camera.target = scene.camera.position + 1000.0 * ahead;
        scene
    };
    let away = view(3000.0, DVec3::new(0.0, 1.0, -1.0));
    let down = view(500.0, DVec3::new(0.0, -1.0, -1.0));
    let picture = ["resolve", "tonemap"];
    let shadows = ["rings", "project", "sort", "tile_lists", "shadow", "resolve", "tonemap"];
    let with_sky = |passes: &[&'static str]| [&["sky"], passes].concat();
    let steps: [(&str, &Scene, f64, Vec<&str>); 6] = [
        ("away", &away, TIME, with_sky(&picture)),
        ("later", &away, TIME + 5.0, vec![]),
        ("down", &down, TIME + 5.0, with_sky(&shadows)),
        ("later", &down, TIME + 10.0, shadows.to_vec()),
        ("away again", &away, TIME + 20.0, with_sky(&picture)),
        ("back", &still, TIME + 20.0, Vec::new()),
    ];
    let mut lasting = renderer(&still, &settings(Preset::Low));
    for (what, scene, time, expected) in steps {
        let made = render(&mut lasting, scene, time);
        if what != "back" {
            assert_eq!(ran(&made), expected, "{what}: {:?}", made.stats.passes);
        }
        let counters = made.stats.counters;
        let none = !expected.contains(&"rings");
        if what != "back" {
            assert_eq!(counters.particles_generated == 0, none, "{what}");
            assert_eq!(counters.light_list_entries == 0, none, "{what}");
            let seen = [counters.particles_visible, counters.screen_list_entries];
            assert_eq!(seen, [0; 2], "{what}");
            assert_eq!([counters.table_lookups, counters.pixels_shaded], [0; 2], "{what}");
            assert_eq!(counters.tiles_empty, counters.tiles, "{what}");
        }
        let mut all = renderer(scene, &settings(Preset::Low));
        all.make_unseen(true);
        let all = render(&mut all, scene, time);
        assert_eq!(ran(&all), own_passes(scene), "{what}: {:?}", all.stats.passes);
        assert_same_bits(&made, &all, what);
    }
}

/// Shadow maps hold what the picture may read, wherever camera and sun are: it is that of maps that hold everything. The
/// last bits of a few pixels may differ: a block of the march that ends below the ground or above all clouds reads the
/// depth there, where nothing is shadowed, for a bin before it that has matter.
#[test]
fn what_shadow_maps_leave_out_is_not_seen() {
    let _turn = alone();
    let field = cumulus();
    let looking = |position: DVec3, ahead: DVec3, sun: DVec3| {
        let mut scene = field.clone();
        scene.camera.position = position;
        scene.camera.target = position + 1000.0 * ahead;
        scene.sun.direction = sun.normalize();
        scene
    };
    let (noon, low, level) =
        (DVec3::new(0.4, 0.8, -0.3), DVec3::new(-0.9, 0.1, -0.3), DVec3::new(0.3, 0.0, 1.0));
    let middle = DVec3::new(0.0, 1200.0, 0.0);
    let mut views: Vec<_> =
        [(DVec3::X, low), (DVec3::Z, low), (-DVec3::X, noon), (-DVec3::Z, noon)]
            .map(|(ahead, sun)| looking(middle, ahead, sun))
            .into();
    views.push(looking(DVec3::new(0.0, 100.0, 0.0), DVec3::new(0.2, 1.0, 0.1), noon));
    views.push(looking(DVec3::new(0.0, 4000.0, 0.0), DVec3::new(0.3, -1.0, 0.0), noon));
    let aside = DVec3::new(3000.0, 1100.0, 2000.0);
    views.push(looking(aside, DVec3::new(-1.0, -0.1, -1.0), level));
    // Air reads the maps wherever the eye looks: without it more is left out. About as bright as through the air.
    let airless = |scene: &Scene| {
        let mut scene = Scene { sky: Sky::Uniform { radiance: 0.05 }, ..scene.clone() };
        scene.sun.irradiance = 0.2;
        scene
    };
    let first_airless = views.len();
    views.extend(views.clone().iter().map(airless));
    let mut some = renderer(&field, &settings(Preset::Low));
    let mut all = renderer(&field, &settings(Preset::Low));
    all.make_unseen(true);
    let mut most_with_air: f64 = 0.0;
    for (index, scene) in views.iter().enumerate() {
        let pictures = [&mut some, &mut all].map(|renderer| render(renderer, scene, TIME));
        let texels = [&some, &all].map(|renderer| renderer.shadow_texels().expect("read back"));
        let left_out = texels[0].iter().zip(&texels[1]).filter(|(a, b)| a != b).count();
        let share = left_out as f64 / texels[0].len() as f64;
        let [some, all] = &pictures;
        let dense = some.radiance.iter().filter(|pixel| pixel[3] > 0.5).count();
        println!("view {index}: {share:.3} of the texels left out, {dense} pixels of dense clouds");
        assert!(dense > 20, "view {index}: {dense}");
        if index < first_airless {
            most_with_air = most_with_air.max(share);
        } else {
            assert!(share > 0.002, "view {index}: {share}");
        }
        let channels = || some.radiance.iter().flatten().zip(all.radiance.iter().flatten());
        let differing = channels().filter(|(a, b)| a != b).count();
        let worst = channels().map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        println!("view {index}: {differing} channels differ, by {worst:e} at most");
        // A hundredth of the channels, by some bits of radiances about 0.2.
        let few = 4 * some.radiance.len() / 100;
        assert!(differing <= few && worst < 2e-6, "view {index}: {differing}, {worst:e}");
    }
    assert!(most_with_air > 0.002, "{most_with_air}");
}

/// The same for listed particles and pictures of other sizes, which keep none of the buffers.
#[test]
fn scenes_and_sizes_can_change_from_frame_to_frame() {
    let _turn = alone();
    let field = cumulus();
    let mut listed = field.clone();
    listed.clouds = None;
    listed.particles = vec![particle(DVec3::new(0.0, 900.0, -700.0), 200.0, 0.02, "uniform")];
    let empty = Scene { particles: Vec::new(), ..listed.clone() };
    let mut lasting = renderer(&field, &settings(Preset::Low));
    for (scene, size) in [
        (&field, [64, 40]),
        (&listed, [64, 40]),
        (&field, [33, 65]),
        (&empty, [33, 65]),
        (&listed, [8, 8]),
    ] {
        let lasted = lasting.render(scene, TIME, size).expect("a frame");
        let new = renderer(scene, &settings(Preset::Low)).render(scene, TIME, size).expect("one");
        assert_same_bits(&lasted, &new, &format!("{size:?}"));
    }
}
