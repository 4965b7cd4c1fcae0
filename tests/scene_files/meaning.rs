//! What a good file means.

use std::sync::Arc;

use cumuli::medium::Phase;
use cumuli::scene::{
    Camera, Channel, CloudField, Ground, Medium, Outside, ParticleSpec, Scene, Sky, Sun,
    WeatherImage, WeatherMap,
};
use glam::{DQuat, DVec2, DVec3};

use super::{EVERY_FIELD, SMALLEST, parse, root, shipped};

#[test]
fn every_shipped_scene_is_read_and_written_without_loss() {
    let paths = shipped();
    assert!(paths.len() >= 3, "{paths:?}");
    for path in paths {
        let scene = Scene::load(&path).expect("a good scene");
        assert!(!scene.name.is_empty() && scene.clouds.is_some(), "{}", path.display());
        let written = scene.to_toml().expect("written");
        assert_eq!(parse(&written).expect("what was written"), scene, "{written}");
    }
}

#[test]
fn the_built_in_scene_is_the_one_that_ships() {
    let shipped = Scene::load(&root().join("scenes/cumulus.toml")).expect("a good scene");
    assert_eq!(parse(cumuli::scene::DEFAULT_SCENE).expect("a good scene"), shipped);
}

/// Field by field, against values that stand in the file.
#[test]
fn every_field_is_read() {
    let expected = Scene {
        name: "Every field".to_owned(),
        camera: Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(4.0, 5.0, 6.0),
            up: DVec3::new(0.0, 0.0, 2.0),
            fov_x: 36.0,
            aperture: 0.05,
            focus_distance: Some(12.5),
            shutter: 0.02,
        },
        sun: Sun { direction: DVec3::new(0.0, 0.6, 0.8), irradiance: 2.5, angular_diameter: 0.7 },
        sky: Sky::Uniform { radiance: 0.0318 },
        ground: Some(Ground::plain(DVec3::new(0.25, 0.5, 0.75))),
        medium: Medium { phase: Phase::Hg { g: 0.85 }, albedo: 0.9 },
        particles: vec![
            ParticleSpec {
                centre: DVec3::new(10.0, 420.0, -35.0),
                radius: 180.0,
                extinction: 0.02,
                shape: "soft-1".to_owned(),
                orientation: DQuat::from_xyzw(0.0, 0.0, 0.6, 0.8),
            },
            ParticleSpec {
                centre: DVec3::ZERO,
                radius: 1.0,
                extinction: 0.0,
                shape: "uniform".to_owned(),
                orientation: DQuat::IDENTITY,
            },
        ],
        clouds: Some(CloudField {
            seed: u32::MAX,
            base: 1200.0,
            thickness: 700.0,
            coverage: 0.2,
            extinction: 0.05,
            feature_size: 3000.0,
            cell_size: 60.0,
            cells: 32,
            rings: 4,
            layers: 6,
            particle_size: 0.8,
            wind: DVec3::new(1.0, -2.0, 3.0),
            evolution_time: 600.0,
            shapes: vec!["uniform".to_owned(), "pyroclastic-3".to_owned()],
            weather: Some(WeatherMap {
                file: "tests/scene_files/every_field.png".into(),
                extent: DVec2::new(40_000.0, 20_000.0),
                centre: DVec2::new(-1500.0, 2500.0),
                outside: Outside::Clear,
                channels: vec![Channel::Height, Channel::Unused, Channel::Coverage],
                noise: 0.75,
                // Blue is coverage, red is height.
                image: Arc::new(WeatherImage::new([2, 1], vec![0xff10_8080, 0xff20_ffff])),
            }),
        }),
        exposure: -1.5,
    };
    let scene = parse(EVERY_FIELD).expect("a good scene");
    assert_eq!(scene, expected);
    let written = scene.to_toml().expect("written");
    assert_eq!(parse(&written).expect("what was written"), scene, "{written}");
}

/// The defaults that the README promises.
#[test]
fn what_is_left_out_has_its_default() {
    let scene = parse(SMALLEST).expect("a good scene");
    assert_eq!((scene.camera.up, scene.camera.fov_x), (DVec3::Y, 60.0));
    assert_eq!((scene.sun.irradiance, scene.sun.angular_diameter), (1.0, 0.533));
    assert_eq!((scene.sky, scene.ground), (Sky::Atmosphere, None));
    let grass = Ground::plain(DVec3::new(0.09, 0.11, 0.06));
    assert_eq!(scene.effective_ground(), Some(grass));
    assert_eq!(scene.medium, Medium { phase: Phase::Mie { diameter_um: 20.0 }, albedo: 1.0 });
    assert_eq!((scene.exposure, scene.clouds.is_none()), (0.0, true));

    let field = parse(&format!("{SMALLEST}[clouds]\n")).expect("a good scene").clouds;
    let expected = CloudField {
        seed: 0,
        base: 1000.0,
        thickness: 700.0,
        coverage: 0.25,
        extinction: 0.05,
        feature_size: 2000.0,
        cell_size: 60.0,
        cells: 96,
        rings: 5,
        layers: 8,
        particle_size: 1.4,
        wind: DVec3::new(5.0, 0.0, 0.0),
        evolution_time: 900.0,
        shapes: Vec::new(),
        weather: None,
    };
    assert_eq!(field, Some(expected));
}

#[test]
fn a_uniform_sky_has_no_ground_unless_asked_for() {
    let uniform = format!("{SMALLEST}[sky]\nkind = \"uniform\"\nradiance = 0.1\n");
    assert_eq!(parse(&uniform).expect("a good scene").effective_ground(), None);
    let grounded = format!("{uniform}[ground]\nalbedo = [0.5, 0.5, 0.5]\n");
    let ground = Ground::plain(DVec3::splat(0.5));
    assert_eq!(parse(&grounded).expect("a good scene").effective_ground(), Some(ground));
}

/// The README names every key of a scene, in the table of the scene's fields.
#[test]
fn the_readme_names_every_field() {
    let readme = std::fs::read_to_string(root().join("README.md")).expect("a README");
    let scenes = readme.split("\n## Scenes\n").nth(1).expect("a chapter on scenes");
    let chapter = scenes.split("\n## ").next().expect("its end");
    let keys: Vec<&str> = EVERY_FIELD
        .lines()
        .filter(|line| !line.is_empty())
        .map(|line| line.split(" = ").next().expect("the key"))
        .collect();
    assert!(keys.len() > 40, "{keys:?}");
    for key in keys {
        let row =
            if key.starts_with('[') { format!("| **`{key}`** |") } else { format!("| `{key}` |") };
        assert!(chapter.contains(&row), "the README has no row {row}");
    }
}

#[test]
fn an_editors_byte_order_mark_is_no_part_of_the_text() {
    let marked = format!("\u{feff}{SMALLEST}");
    assert_eq!(parse(&marked).expect("a good scene"), parse(SMALLEST).expect("a good scene"));
}

#[test]
fn a_sea_has_a_wind() {
    let sea = format!(
        "{SMALLEST}[ground]\nkind = \"sea\"\nwind_speed = 7.5\nalbedo = [0.0, 0.25, 0.5]\n"
    );
    let scene = parse(&sea).expect("a good scene");
    assert_eq!(scene.ground, Some(Ground::sea(7.5, DVec3::new(0.0, 0.25, 0.5))));
    assert!(scene.is_sea());
    let again = parse(&scene.to_toml().expect("text")).expect("the same scene");
    assert_eq!(again, scene);
    // Plain is what a ground is that says nothing, and is written as before.
    let plain = format!("{SMALLEST}[ground]\nkind = \"plain\"\nalbedo = [0.5, 0.5, 0.5]\n");
    let scene = parse(&plain).expect("a good scene");
    assert_eq!(scene.ground, Some(Ground::plain(DVec3::splat(0.5))));
    let text = scene.to_toml().expect("text");
    assert!(!text.contains("wind_speed") && !text.contains("plain"), "{text}");
}
