//! The readers of the library, sound inputs for each, and how much memory they may take.

use std::path::Path;

use cumuli::medium::Phase;
use cumuli::scene::{CameraPath, Channel, Scene, WeatherImage};
use cumuli::tables::optical_depth::OpticalDepthOptions;
use cumuli::tables::{BakeOptions, ScatteringOptions, Silent, TableSet, rays};
use image::ImageEncoder;

/// What inputs are called in errors.
pub const PLACE: &str = "input";

/// A reader under attack.
pub struct Reader {
    pub name: &'static str,
    /// Sound inputs.
    pub seeds: fn() -> Vec<Vec<u8>>,
    pub read: fn(&[u8]) -> cumuli::Result<()>,
    /// It takes at most this multiple of the input's size, and this many bytes besides.
    pub multiple: usize,
    pub constant: usize,
}

/// A table of text: the parser's tree has some hundred bytes for each value of a few characters, and an
/// error looks the line up in a tree of its own.
pub const SCENES: Reader = Reader {
    name: "scenes",
    seeds: || {
        let files = ["cumulus", "flight", "sunset"].map(|name| format!("scenes/{name}.toml"));
        let mut seeds: Vec<_> = files.iter().map(|file| from_tree(file)).collect();
        seeds.push(include_bytes!("../scene_files/every_field.toml").to_vec());
        // A file that it names is not there.
        let text = String::from_utf8_lossy(&seeds[3]).replace("particles_file", "# particles_file");
        // Nor is its map, whose pixels have an attack of their own.
        let (before, _) = text.split_once("[clouds.weather]").expect("a map, at the end");
        seeds[3] = before.as_bytes().to_vec();
        seeds
    },
    read: |bytes| {
        let nowhere = Path::new("/nonexistent");
        Scene::from_toml(&String::from_utf8_lossy(bytes), PLACE, nowhere).map(|_| ())
    },
    multiple: 64,
    constant: 1 << 16,
};

pub const PARTICLES: Reader = Reader {
    name: "particle lists",
    seeds: || {
        let one = r#"{"centre": [1, -2.5, 3e2], "radius": 10, "extinction": 0.02}"#;
        let all = r#"{"centre": [0, 0, 0], "radius": 1, "extinction": 1, "shape": "soft-1", "orientation": [0, 1, 0, 2]}"#;
        let list = |of: &[&str]| format!("{{\"particles\": [{}]}}", of.join(",\n")).into_bytes();
        vec![list(&[]), list(&[one]), list(&[one, all]), list(&[all; 40])]
    },
    read: |bytes| Scene::particles_from_json(&String::from_utf8_lossy(bytes), PLACE).map(|_| ()),
    multiple: 16,
    constant: 1 << 14,
};

pub const PATHS: Reader = Reader {
    name: "camera paths",
    seeds: || {
        let key =
            "[[keys]]\ntime = 1\nposition = [0, 1, 2]\norientation = [0, 0, 0, 1]\nfov_x = 50\n";
        vec![from_tree("scenes/paths/through.toml"), key.as_bytes().to_vec()]
    },
    read: |bytes| {
        let path = CameraPath::from_toml(&String::from_utf8_lossy(bytes), PLACE)?;
        // What is read can be followed.
        let camera = path.camera(0.5 * path.end(), &Default::default());
        assert!(camera.position.is_finite() && camera.target.is_finite(), "{camera:?}");
        Ok(())
    },
    multiple: 64,
    constant: 1 << 16,
};

/// The file's own bytes are not counted: reading holds them once more as values, and unpacks densities.
pub const TABLES: Reader = Reader {
    name: "tables",
    seeds: || {
        let options = BakeOptions {
            shapes: vec!["soft-9".parse().expect("a shape")],
            optical_depth: OpticalDepthOptions {
                disc: 4,
                direction: 4,
                rays_per_cell: 2,
                iterations: 1,
                seed: 5,
            },
            media: vec![(Phase::hg(0.5).expect("a phase function"), 0.9)],
            scattering: ScatteringOptions {
                resolution: [2, 4, 4, 4],
                optical_radius: [0.5, 2.0],
                remainder: 1e-2,
                ..Default::default()
            },
        };
        let whole = TableSet::bake(&options, &Silent).expect("baked");
        let scattering = whole.scattering().to_vec();
        let small = TableSet::new(Vec::new(), options.optical_depth, scattering).expect("a set");
        let dir = tempfile::tempdir().expect("a temporary folder");
        let bytes = |set: &TableSet| {
            let path = dir.path().join("tables");
            set.save(&path).expect("saved");
            std::fs::read(&path).expect("written")
        };
        // A shape has a quarter of a megabyte of densities: most inputs go without.
        let mut seeds = vec![bytes(&small); 15];
        seeds.push(bytes(&whole));
        seeds
    },
    read: |bytes| TableSet::from_bytes(bytes, PLACE).map(|_| ()),
    multiple: 32,
    constant: 1 << 16,
};

pub const RAYS: Reader = Reader {
    name: "ray files",
    seeds: || {
        let ray =
            r#"{"entry": [0, 0.6, 0.8], "dir": [0, 0, -1], "sun": [0, 1, 0], "optical_radius": 4}"#;
        let part = r#"{"entry": [0, 0, 1], "dir": [0, 0, -1], "sun": [1, 0, 0], "optical_radius": 1e-3, "from": 0.25, "to": 1}"#;
        let list = |of: &[&str]| format!("{{\"rays\": [{}]}}", of.join(",\n")).into_bytes();
        vec![list(&[]), list(&[ray]), list(&[ray, part]), list(&[part; 30])]
    },
    read: |bytes| rays::parse(bytes, PLACE).map(|_| ()),
    multiple: 16,
    constant: 1 << 14,
};

/// A decoder of PNG files has buffers of a fixed size, and a hundred bytes of a file can hold a thousand
/// pixels of the same colour; each takes at most 12 bytes, as read and as kept.
pub const MAPS: Reader = Reader {
    name: "weather maps",
    seeds: || {
        let png = |size: [u32; 2], colour: image::ExtendedColorType, bytes: &[u8]| {
            let mut file = Vec::new();
            let encoder = image::codecs::png::PngEncoder::new(&mut file);
            encoder.write_image(bytes, size[0], size[1], colour).expect("encoded");
            file
        };
        let motley: Vec<u8> = (0..3 * 16 * 16).map(|i: u32| (i * i * 31 % 251) as u8).collect();
        vec![
            png([1, 1], image::ExtendedColorType::L8, &[7]),
            png([16, 48], image::ExtendedColorType::L8, &motley),
            png([16, 16], image::ExtendedColorType::Rgb8, &motley),
            png([8, 16], image::ExtendedColorType::Rgb16, &motley),
            png([24, 16], image::ExtendedColorType::La8, &motley),
        ]
    },
    read: |bytes| {
        let map = WeatherImage::from_bytes(bytes, PLACE, &[Channel::Coverage])?;
        let [width, height] = map.size();
        assert_eq!(map.texels().len(), width as usize * height as usize);
        Ok(())
    },
    multiple: 64,
    constant: 1 << 20,
};

fn from_tree(path: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}
