//! Table files that are damaged, cut, foreign or made up, given to every command that reads one.

use std::collections::HashMap;
use std::path::Path;

use proptest::prelude::*;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView};

use super::{bake, precompute, refusal};

/// A small table file.
fn sound() -> Vec<u8> {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("tables");
    assert!(bake(&path, &[]).status.success());
    std::fs::read(path).expect("written")
}

/// Every command that reads a table file refuses this one in a sentence with its name and `word`.
fn refused_by_all(path: &Path, word: &str) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let rays = dir.path().join("rays.json");
    std::fs::write(&rays, "{\"rays\":[]}").expect("written");
    let file = path.display().to_string();
    let (rays, out) = (rays.display().to_string(), dir.path().join("out"));
    let out_name = out.display().to_string();
    for command in [
        &["info", &file][..],
        &["verify", &file, "--quick"],
        &["plot", &file, "--out", &out_name],
        &["sample", &file, "--rays", &rays, "--out", &out_name],
    ] {
        let text = refusal(&precompute(command));
        assert_eq!(text.lines().count(), 1, "{command:?}: {text}");
        assert!(text.contains(&file) && text.contains(word), "{command:?}: {word}: {text}");
        assert!(!out.exists(), "{command:?}");
    }
}

/// The header's length, the header, and bytes behind it.
fn with_header(header: &str, body: &[u8]) -> Vec<u8> {
    [&(header.len() as u64).to_le_bytes(), header.as_bytes(), body].concat()
}

/// The header of a file.
fn header(bytes: &[u8]) -> String {
    let length = u64::from_le_bytes(*bytes.first_chunk().expect("a length")) as usize;
    String::from_utf8(bytes[8..8 + length].to_vec()).expect("text")
}

#[test]
fn no_command_reads_what_is_no_table() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    refused_by_all(&dir.path().join("missing"), "no such file");
    refused_by_all(dir.path(), "folder");
    let bytes = sound();
    let text = header(&bytes);
    let body = &bytes[8 + text.len()..];
    let foreign = r#"{"a":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}"#;
    let terabytes =
        r#"{"a":{"dtype":"F32","shape":[1099511627776],"data_offsets":[0,4398046511104]}}"#;
    // The first tensor's name given to the second too.
    let names: Vec<&str> =
        text.split('"').filter(|part| part.starts_with("optical_depth.")).collect();
    let twice = text.replacen(names[1], names[0], 1);
    let cases: [(&str, Vec<u8>, &str); 9] = [
        ("empty", Vec::new(), "8 bytes"),
        ("text", b"A text that is no table, and longer than eight bytes.".to_vec(), "safetensors"),
        ("endless", u64::MAX.to_le_bytes().to_vec(), "safetensors"),
        ("cut", bytes[..bytes.len() - 100].to_vec(), "damaged"),
        ("cut in the header", bytes[..200].to_vec(), "truncated"),
        ("foreign", with_header(foreign, &[0; 4]), "foreign"),
        ("terabytes", with_header(terabytes, &[0; 4]), "foreign"),
        ("twice", with_header(&twice, body), "twice"),
        ("flipped", flipped(&bytes, bytes.len() - 1), "damaged"),
    ];
    for (name, bytes, word) in cases {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        refused_by_all(&path, word);
    }
    #[cfg(unix)]
    refused_by_all(Path::new("/dev/zero"), "plain file");
}

fn flipped(bytes: &[u8], at: usize) -> Vec<u8> {
    let mut flipped = bytes.to_vec();
    flipped[at] ^= 1;
    flipped
}

/// A file of a gigabyte that takes no room on the disk is refused by its header alone.
#[cfg(target_os = "linux")]
#[test]
fn a_foreign_giant_costs_no_memory() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("giant");
    let foreign = r#"{"a":{"dtype":"U8","shape":[1000000000],"data_offsets":[0,1000000000]}}"#;
    std::fs::write(&path, with_header(foreign, &[])).expect("written");
    let file = std::fs::OpenOptions::new().write(true).open(&path).expect("a file");
    file.set_len(8 + foreign.len() as u64 + 1_000_000_000).expect("a giant");
    let file = path.display().to_string();
    // 300 MB of address space: a gigabyte would end it.
    let command = format!("ulimit -v 300000; exec \"$0\" info \"{file}\"");
    let output = std::process::Command::new("bash")
        .args(["-c", &command, env!("CARGO_BIN_EXE_precompute")])
        .output()
        .expect("bash");
    let text = refusal(&output);
    assert!(text.contains("foreign"), "{text}");
}

type Tensors = Vec<(String, Dtype, Vec<usize>, Vec<u8>)>;

/// A file with its tensors changed; the recorded fingerprint stays.
fn altered(bytes: &[u8], alter: impl FnOnce(&mut Tensors)) -> Vec<u8> {
    let (_, header) = SafeTensors::read_metadata(bytes).expect("a header");
    let metadata: HashMap<String, String> = header.metadata().clone().expect("metadata");
    let file = SafeTensors::deserialize(bytes).expect("tensors");
    let mut tensors: Tensors = file
        .tensors()
        .into_iter()
        .map(|(name, t)| (name, t.dtype(), t.shape().to_vec(), t.data().to_vec()))
        .collect();
    alter(&mut tensors);
    let views = tensors.iter().map(|(name, dtype, shape, data)| {
        (name, TensorView::new(*dtype, shape.clone(), data).expect("a tensor"))
    });
    safetensors::serialize(views, Some(metadata)).expect("serialised")
}

#[test]
fn wrong_tensors_are_named() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let bytes = sound();
    let find = |tensors: &Tensors, name: &str| {
        tensors.iter().position(|t| t.0.starts_with(name)).expect("the tensor")
    };
    let cases: [(&str, Vec<u8>, &str); 4] = [
        (
            "dtype",
            altered(&bytes, |t| {
                let i = find(t, "scattering.");
                t[i].1 = Dtype::BF16;
            }),
            "scattering.hg:0.5@0.9",
        ),
        (
            "shape",
            altered(&bytes, |t| {
                let i = find(t, "scattering.");
                t[i].2.swap(0, 1);
            }),
            "scattering.hg:0.5@0.9",
        ),
        (
            "missing",
            altered(&bytes, |t| {
                let i = find(t, "optical_depth.soft-9");
                t.remove(i);
            }),
            "optical_depth.soft-9",
        ),
        (
            "nan",
            altered(&bytes, |t| {
                let i = find(t, "scattering.");
                t[i].3[..2].copy_from_slice(&half::f16::NAN.to_le_bytes());
            }),
            "finite",
        ),
    ];
    for (name, bytes, word) in cases {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        refused_by_all(&path, word);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..Default::default() })]

    /// Whatever is overwritten, cut out or put in: the file is refused in one sentence, or it is as
    /// sound as before. Through the library, which all commands read files with: no process each.
    #[test]
    fn any_damage_is_refused_in_one_sentence(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        header_only in any::<bool>(),
        cut in prop::option::of((any::<prop::sample::Index>(), 0usize..9)),
        more in prop::option::of((any::<prop::sample::Index>(), prop::collection::vec(any::<u8>(), 1..9))),
    ) {
        use std::sync::OnceLock;
        static SOUND: OnceLock<Vec<u8>> = OnceLock::new();
        let sound = SOUND.get_or_init(sound);
        let mut bytes = sound.clone();
        let range = if header_only { 8 + header(sound).len() } else { bytes.len() };
        for (place, byte) in &edits {
            let at = place.index(range);
            bytes[at] = *byte;
        }
        if let Some((place, length)) = &cut {
            let at = place.index(range);
            bytes.drain(at..(at + length).min(bytes.len()));
        }
        if let Some((place, text)) = &more {
            let at = place.index(range);
            bytes.splice(at..at, text.iter().copied());
        }
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("damaged");
        std::fs::write(&path, &bytes).expect("written");
        match cumuli::tables::TableSet::load(&path) {
            Ok(set) => {
                for table in set.scattering() {
                    prop_assert!(table.values().iter().all(|v| v.is_finite()));
                }
            }
            Err(error) => {
                let text = error.to_string();
                prop_assert_eq!(error.exit_code(), 2, "{}", text);
                prop_assert!(text.contains("damaged") && text.lines().count() == 1, "{}", text);
                prop_assert!(text.len() < 1000, "{}", text);
            }
        }
    }
}
