//! Table files: what is written is read, and nothing else is.

use std::collections::HashMap;
use std::path::Path;

use cumuli::medium::Phase;
use cumuli::tables::optical_depth::OpticalDepthOptions;
use cumuli::tables::{BakeOptions, ScatteringOptions, Silent, TableSet};
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView};

/// Small tables of every kind, in a file: its bytes.
fn small() -> (TableSet, Vec<u8>) {
    let options = BakeOptions {
        shapes: vec!["soft-9".parse().expect("a shape"), "pyroclastic-9".parse().expect("a shape")],
        optical_depth: OpticalDepthOptions {
            disc: 6,
            direction: 4,
            rays_per_cell: 4,
            iterations: 3,
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
    let tables = TableSet::bake(&options, &Silent).expect("baked");
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("tables.safetensors");
    tables.save(&path).expect("saved");
    let bytes = std::fs::read(&path).expect("written");
    (tables, bytes)
}

/// The sentence with which a file of these bytes is refused.
fn refusal(bytes: &[u8]) -> String {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("bad.safetensors");
    std::fs::write(&path, bytes).expect("written");
    let error = TableSet::load(&path).expect_err("refused");
    assert_eq!(error.exit_code(), 2, "{error}");
    let text = error.to_string();
    assert!(text.contains("bad.safetensors") && !text.contains('\n'), "{text}");
    text
}

type Tensors = Vec<(String, Dtype, Vec<usize>, Vec<u8>)>;

/// A file with its metadata and tensors changed.
fn altered(bytes: &[u8], alter: impl FnOnce(&mut serde_json::Value, &mut Tensors)) -> Vec<u8> {
    let (_, header) = SafeTensors::read_metadata(bytes).expect("a header");
    let text = &header.metadata().as_ref().expect("metadata")["cumuli"];
    let mut json = serde_json::from_str(text).expect("JSON");
    let file = SafeTensors::deserialize(bytes).expect("tensors");
    let mut tensors: Tensors = file
        .tensors()
        .into_iter()
        .map(|(name, t)| (name, t.dtype(), t.shape().to_vec(), t.data().to_vec()))
        .collect();
    alter(&mut json, &mut tensors);
    let views = tensors.iter().map(|(name, dtype, shape, data)| {
        (name, TensorView::new(*dtype, shape.clone(), data).expect("a tensor"))
    });
    let metadata = HashMap::from([("cumuli".to_owned(), json.to_string())]);
    safetensors::serialize(views, Some(metadata)).expect("serialised")
}

#[test]
fn what_is_written_is_read() {
    let (tables, bytes) = small();
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("again.safetensors");
    std::fs::write(&path, &bytes).expect("written");
    let read = TableSet::load(&path).expect("sound");
    assert_eq!(read.shape_names().collect::<Vec<_>>(), ["uniform", "soft-9", "pyroclastic-9"]);
    assert_eq!(read.shape_index("pyroclastic-9"), Some(2));
    assert_eq!(read.shape_index("soft-1"), None);
    for (a, b) in read.optical_depth().iter().zip(tables.optical_depth()) {
        assert!(a.texels() == b.texels());
        assert_eq!((a.grid(), a.spec()), (b.grid(), b.spec()));
    }
    let scattering = |set: &TableSet| {
        let phase = Phase::hg(0.5).expect("a phase function");
        set.scattering_for(&phase, 0.9).expect("the medium").values().to_vec()
    };
    assert!(scattering(&read) == scattering(&tables));
    assert_eq!(read.description().parameters, tables.description().parameters);
    read.save(&path).expect("saved");
    assert!(std::fs::read(&path).expect("written") == bytes, "written the same");
}

#[test]
fn the_built_in_tables_are_sound_and_small() {
    let tables = TableSet::embedded().expect("sound");
    assert!(tables.shape_names().count() >= 6, "uniform and five noise shapes");
    for phase in ["mie:20um", "hg:0.85"] {
        let phase: Phase = phase.parse().expect("a phase function");
        assert!(tables.scattering_for(&phase, 1.0).is_some(), "{phase}");
        assert!(tables.scattering_for(&phase, 0.5).is_none());
    }
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/default_tables.safetensors");
    // They are part of every copy of the program.
    assert!(std::fs::metadata(file).expect("the file").len() <= 8 << 20);
}

#[test]
fn every_truncation_is_refused() {
    let (_, bytes) = small();
    for part in 0..64 {
        refusal(&bytes[..bytes.len() * part / 64]);
    }
    refusal(&bytes[..bytes.len() - 1]);
    let mut longer = bytes.clone();
    longer.push(0);
    refusal(&longer);
}

#[test]
fn every_flipped_bit_of_the_values_is_noticed() {
    let (_, bytes) = small();
    let values = bytes.len() - 6 * 6 * 4 * 4 * 4;
    for i in (values..bytes.len()).step_by(191) {
        let mut damaged = bytes.clone();
        damaged[i] ^= 1 << (i % 8);
        refusal(&damaged);
    }
}

#[test]
fn claimed_terabytes_are_not_allocated() {
    // A header longer than any memory.
    let mut huge = u64::MAX.to_le_bytes().to_vec();
    huge.extend_from_slice(b"{}");
    assert!(refusal(&huge).contains("no safetensors header"));
    let with_header = |header: &str| {
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend_from_slice(header.as_bytes());
        bytes
    };
    // A tensor larger than any disk, and one whose size overflows.
    refusal(&with_header(
        r#"{"a":{"dtype":"F32","shape":[1000000000000],"data_offsets":[0,4000000000000]}}"#,
    ));
    refusal(&with_header(
        r#"{"a":{"dtype":"F32","shape":[9223372036854775807,4],"data_offsets":[0,4]}}"#,
    ));
    // A description that claims a resolution of terabytes.
    let (_, bytes) = small();
    for nodes in [1u64 << 40, u64::MAX, 65, 0] {
        let text = refusal(&altered(&bytes, |json, _| {
            json["optical_depth"]["options"]["disc"] = nodes.into();
        }));
        assert!(text.contains("expected"), "{text}");
        let text = refusal(&altered(&bytes, |json, _| {
            json["scattering"]["media"][0]["resolution"][1] = nodes.into();
        }));
        assert!(text.contains("expected"), "{text}");
    }
}

#[test]
fn foreign_and_stale_files_are_refused() {
    refusal(b"");
    refusal(b"PNG\r\n and so on, long enough for a header");
    let view = TensorView::new(Dtype::U8, vec![3], &[1, 2, 3]).expect("a tensor");
    let foreign = safetensors::serialize([("weights", view)], None).expect("serialised");
    assert!(refusal(&foreign).contains("foreign"));

    let (_, bytes) = small();
    let text = refusal(&altered(&bytes, |json, _| json["format"] = 999.into()));
    assert!(text.contains("999") && text.contains("bake"), "{text}");
    let text = refusal(&altered(&bytes, |json, _| json["optical_depth"]["formula"] = 0.into()));
    assert!(text.contains("formula"), "{text}");
    let text = refusal(&altered(&bytes, |json, _| {
        json["optical_depth"]["mapping"] = "linear angles".into();
    }));
    assert!(text.contains("mapping"), "{text}");
    let text = refusal(&altered(&bytes, |json, _| {
        json["scattering"]["media"][0]["albedo"] = 0.5.into();
    }));
    assert!(text.contains("parameters"), "{text}");
    refusal(&altered(&bytes, |json, _| {
        json["optical_depth"]["shapes"][0]["shape"] = "blob".into();
    }));
    refusal(&altered(&bytes, |json, _| {
        json["surprise"] = true.into();
    }));
}

#[test]
fn wrong_tensors_are_refused() {
    let (_, bytes) = small();
    let find = |tensors: &mut Tensors, name: &str| {
        tensors.iter().position(|t| t.0.starts_with(name)).expect("the tensor")
    };
    let text = refusal(&altered(&bytes, |_, tensors| {
        let i = find(tensors, "optical_depth.soft-9");
        tensors.remove(i);
    }));
    assert!(text.contains("optical_depth.soft-9"), "{text}");
    let text = refusal(&altered(&bytes, |_, tensors| {
        let i = find(tensors, "scattering.");
        tensors[i].2.swap(0, 1);
    }));
    assert!(text.contains("scattering.hg:0.5@0.9") && text.contains("[2, 4, 4, 4]"), "{text}");
    refusal(&altered(&bytes, |_, tensors| {
        let i = find(tensors, "optical_depth.soft-9");
        tensors[i].1 = Dtype::F32;
    }));
    refusal(&altered(&bytes, |_, tensors| {
        tensors.push(("extra".to_owned(), Dtype::U8, vec![1], vec![0]));
    }));
    // Values that no bake makes, whatever the fingerprint says: NaN, infinity, stray bits.
    for half in [half::f16::NAN, half::f16::INFINITY, half::f16::NEG_INFINITY] {
        let text = refusal(&altered(&bytes, |_, tensors| {
            let i = find(tensors, "scattering.");
            tensors[i].3[..2].copy_from_slice(&half.to_le_bytes());
        }));
        assert!(text.contains("finite"), "{text}");
    }
    let text = refusal(&altered(&bytes, |_, tensors| {
        let i = find(tensors, "optical_depth.pyroclastic-9");
        tensors[i].3[..4].copy_from_slice(&u32::MAX.to_le_bytes());
    }));
    assert!(text.contains("pyroclastic-9") && text.contains("10 bits"), "{text}");
}

#[test]
fn what_is_no_file_is_refused() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let error = TableSet::load(dir.path()).expect_err("a folder");
    assert_eq!(error.exit_code(), 2, "{error}");
    let missing = dir.path().join("missing.safetensors");
    let error = TableSet::load(&missing).expect_err("nothing");
    assert!(error.to_string().contains("missing.safetensors"), "{error}");
    assert_eq!(error.exit_code(), 2);
    #[cfg(unix)]
    assert!(TableSet::load(Path::new("/dev/zero")).is_err());
}

/// Every second node says nearly the same, in fewer bytes. Found: an RMS of 0.046 of density 1, and
/// of 9 % of the light; it may be twice as much, and must be more than rounding.
#[test]
fn thinned_tables_are_smaller_and_nearly_alike() {
    let whole = TableSet::embedded().expect("the built-in tables");
    let thin = whole.thinned().expect("tables");
    let phase = Phase::Mie { diameter_um: 20.0 };
    let scattering = [&whole, &thin].map(|t| t.scattering_for(&phase, 1.0).expect("built in"));
    assert_eq!(scattering[1].resolution(), scattering[0].resolution().map(|n| n.div_ceil(2)));
    let mut random = cumuli::reference::Random::new(3, 0, 0);
    let mut on_sphere = || {
        let (z, turn) = (2.0 * random.unit() - 1.0, std::f64::consts::TAU * random.unit());
        let across = (1.0 - z * z).sqrt();
        glam::DVec3::new(across * turn.cos(), across * turn.sin(), z)
    };
    const RAYS: usize = 4000;
    let (mut depth, mut light, mut all_light) = (0.0, 0.0, 0.0);
    for _ in 0..RAYS {
        let (entry, exit, sun) = (on_sphere(), on_sphere(), on_sphere());
        let density = [&whole, &thin].map(|t| f64::from(t.chord_step(1, entry, exit).mean_density));
        depth += (density[0] - density[1]).powi(2);
        let source = scattering.map(|t| t.lookup(entry, (exit - entry).normalize(), sun, 4.0)[1]);
        light += (source[0] - source[1]).powi(2);
        all_light += source[0].powi(2);
    }
    let (depth, light) = ((depth / RAYS as f64).sqrt(), (light / all_light).sqrt());
    println!("RMS {depth:.4} of the mean density, {light:.4} of the light");
    assert!((0.01..0.1).contains(&depth), "{depth}");
    assert!((0.01..0.2).contains(&light), "{light}");
}
