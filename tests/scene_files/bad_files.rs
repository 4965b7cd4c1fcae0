//! Files that are not what they should be, and particles in files of their own.

use std::path::Path;

use cumuli::scene::Scene;

use super::SMALLEST;

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn refusal(path: &Path) -> String {
    let error = Scene::load(path).expect_err("a bad file");
    assert_eq!(error.exit_code(), 2, "{error}");
    let message = error.to_string();
    assert!(!message.contains('\n'), "{message}");
    message
}

/// The message for a scene file with these bytes.
fn refusal_of(bytes: &[u8]) -> String {
    let dir = folder();
    let path = dir.path().join("a.toml");
    std::fs::write(&path, bytes).expect("written");
    let message = refusal(&path);
    assert!(message.starts_with(&path.display().to_string()), "{message}");
    message
}

#[test]
fn a_missing_file_and_a_folder() {
    let dir = folder();
    let message = refusal(&dir.path().join("none.toml"));
    assert!(message.contains("none.toml: there is no such file, expected a scene in TOML"));
    let message = refusal(dir.path());
    assert!(message.ends_with("is a folder, expected a scene in TOML"), "{message}");
    // A file where a folder should be.
    std::fs::write(dir.path().join("file"), "").expect("written");
    let message = refusal(&dir.path().join("file/a.toml"));
    assert!(message.contains("expected a scene in TOML"), "{message}");
}

#[test]
fn an_empty_file_and_what_is_not_text() {
    assert!(refusal_of(b"").ends_with("camera: is missing"));
    assert!(refusal_of(b"\n# nothing\n").ends_with("camera: is missing"));
    let message = refusal_of(b"name = \"\xff\xfe\"");
    assert!(message.contains("byte 8"), "{message}");
    assert!(message.ends_with("expected a scene in TOML"), "{message}");
    refusal_of(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    // UTF-16, as some editors write it.
    let wide: Vec<u8> = SMALLEST.encode_utf16().flat_map(u16::to_le_bytes).collect();
    refusal_of(&wide);
}

#[test]
fn a_file_too_large_is_not_read() {
    let dir = folder();
    let path = dir.path().join("a.toml");
    // Sparse: it takes no space on the disk.
    let file = std::fs::File::create(&path).expect("created");
    file.set_len(1 << 40).expect("enlarged");
    let message = refusal(&path);
    assert!(message.contains("larger than 4 MiB"), "{message}");
}

#[cfg(unix)]
#[test]
fn an_endless_file_is_not_read_to_its_end() {
    let message = refusal(Path::new("/dev/zero"));
    assert!(message.contains("larger than 4 MiB"), "{message}");
}

#[test]
fn a_scene_without_a_name_has_its_files() {
    let dir = folder();
    let path = dir.path().join("a clear day.toml");
    std::fs::write(&path, SMALLEST).expect("written");
    assert_eq!(Scene::load(&path).expect("a good scene").name, "a clear day");
}

/// A scene beside a file of particles with this text: the scene, or the message.
fn with_particles(json: Option<&[u8]>) -> Result<Scene, String> {
    let dir = folder();
    if let Some(json) = json {
        std::fs::write(dir.path().join("clump.json"), json).expect("written");
    }
    let path = dir.path().join("a.toml");
    let text = format!("particles_file = \"clump.json\"\n{SMALLEST}");
    std::fs::write(&path, text).expect("written");
    Scene::load(&path).map_err(|e| {
        assert_eq!(e.exit_code(), 2, "{e}");
        e.to_string()
    })
}

#[test]
fn particles_come_from_the_scenes_folder() {
    let json = br#"{"particles": [{"centre": [1, 2, 3], "radius": 4, "extinction": 0.5}]}"#;
    let scene = with_particles(Some(json)).expect("a good scene");
    assert_eq!(scene.particles.len(), 1);
    assert_eq!(scene.particles[0].radius, 4.0);
    assert_eq!(scene.particles[0].shape, "uniform");
}

#[test]
fn particles_files_that_cannot_be_used() {
    let one = |particle: &str| format!("{{\"particles\": [{particle}]}}").into_bytes();
    let cases: Vec<(Option<Vec<u8>>, &str)> = vec![
        (None, "particles_file: expected a JSON file of particles"),
        (Some(Vec::new()), "the file ends within a value"),
        (Some(b"{".to_vec()), "the file ends within an object"),
        (Some(b"particles = []".to_vec()), "expected"),
        (Some(b"{\"particles\": [\xff]}".to_vec()), "is not UTF-8"),
        (Some(one(r#"{"centre": [NaN, 0, 0], "radius": 1, "extinction": 1}"#)), "centre[0]"),
        (Some(one(r#"{"centre": [1e999, 0, 0], "radius": 1, "extinction": 1}"#)), "centre[0]"),
        (Some(one(r#"{"centre": [1e300, 0, 0], "radius": 1, "extinction": 1}"#)), "1e11 m"),
        (
            Some(one(r#"{"centre": [0, 0, 0], "radius": -1, "extinction": 1}"#)),
            "particles[0].radius",
        ),
        (Some(one(r#"{"centre": [0, 0, 0], "radius": 1}"#)), "particles[0].extinction: is missing"),
        (
            Some(one(r#"{"center": [0, 0, 0], "radius": 1, "extinction": 1}"#)),
            "did you mean `centre`?",
        ),
    ];
    for (json, expected) in cases {
        let message = with_particles(json.as_deref()).expect_err(expected);
        assert!(message.contains("clump.json"), "{message} does not name the file");
        assert!(message.contains(expected), "{message} lacks {expected}");
        assert!(!message.contains('\n'), "{message}");
    }
}

#[test]
fn too_many_particles() {
    let one = r#"{"centre":[0,0,0],"radius":1,"extinction":1},"#;
    let most = cumuli::scene::limits::MOST_PARTICLES;
    let mut json = String::from("{\"particles\":[");
    for _ in 0..=most {
        json.push_str(one);
    }
    json.pop();
    json.push_str("]}");
    let message = with_particles(Some(json.as_bytes())).expect_err("too many");
    assert!(message.contains("at most 2000000 particles, found 2000001"), "{message}");
}

#[cfg(unix)]
#[test]
fn a_scene_cannot_make_the_program_wait() {
    let dir = folder();
    let path = dir.path().join("a.toml");
    // A pipe nobody writes to, and a file without an end, named by a scene from somewhere.
    let pipe = dir.path().join("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs");
    assert!(made.success());
    for named in ["pipe", "/dev/zero", "/dev/stdin", "."] {
        let text = format!("particles_file = \"{named}\"\n{SMALLEST}");
        std::fs::write(&path, text).expect("written");
        let message = refusal(&path);
        assert!(message.contains("expected a JSON file of particles"), "{message}");
    }
}
