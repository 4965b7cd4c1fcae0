//! Particles listed one by one, in a scene or in a JSON file beside it.

use std::path::Path;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::fault::{self, At};
use super::{check, text_file, vector};
use crate::error::{Error, Result};

/// One spherical particle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParticleSpec {
    /// Centre, m.
    #[serde(with = "vector::three")]
    pub centre: DVec3,
    /// Radius, m.
    pub radius: f64,
    /// Extinction at density 1, 1/m.
    pub extinction: f64,
    /// "uniform", or a noise shape of the tables by name.
    #[serde(default = "uniform")]
    pub shape: String,
    /// Turn of the shape: a unit quaternion [x, y, z, w] from the particle's axes to the world's;
    /// of any length in a file.
    #[serde(with = "vector::quaternion", default = "no_turn")]
    pub orientation: DQuat,
}

fn uniform() -> String {
    "uniform".to_owned()
}

fn no_turn() -> DQuat {
    DQuat::IDENTITY
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ParticlesFile {
    particles: Vec<ParticleSpec>,
}

/// Reads a JSON file of particles and checks each.
pub(super) fn load(path: &Path) -> Result<Vec<ParticleSpec>> {
    let text = text_file::read(path, text_file::PARTICLES)?;
    parse(&text, &path.display().to_string())
}

/// Reads particles from text and checks each. `place` names it in errors.
pub(super) fn parse(text: &str, place: &str) -> Result<Vec<ParticleSpec>> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let file: ParticlesFile = serde_path_to_error::deserialize(&mut reader).map_err(|e| {
        let path = fault::path_text(e.path());
        let error = e.into_inner();
        // serde_json appends the position to its message; here it stands with the file.
        let position = format!(" at line {} column {}", error.line(), error.column());
        let message = error.to_string().replace(&position, "");
        fault::from_serde(&path, &message).in_line(place, error.line())
    })?;
    reader.end().map_err(|e| {
        Error::input(
            format!("{place}:{}", e.line()),
            "something follows the closing brace, expected the end of the file",
        )
    })?;
    let mut particles = file.particles;
    check::particles(&particles, At::Root).map_err(|f| f.in_place(place))?;
    normalise(&mut particles);
    Ok(particles)
}

/// Makes all orientations unit quaternions; those of checked particles are not zero.
pub(super) fn normalise(particles: &mut [ParticleSpec]) {
    for particle in particles {
        particle.orientation =
            vector::unit_quaternion(particle.orientation).unwrap_or(DQuat::IDENTITY);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(json: &str) -> String {
        parse(json, "clump.json").expect_err(json).to_string()
    }

    #[test]
    fn reads_a_list() {
        let particles = parse(
            r#"{"particles": [{"centre": [1, 2, 3.5], "radius": 10, "extinction": 0.02, "shape": "soft"},
                {"centre": [0, 0, 0], "radius": 1, "extinction": 0, "orientation": [0, 2, 0, 0]}]}"#,
            "clump.json",
        )
        .expect("a good list");
        assert_eq!(particles.len(), 2);
        assert_eq!(particles[0].centre, DVec3::new(1.0, 2.0, 3.5));
        assert_eq!(particles[0].orientation, DQuat::IDENTITY);
        assert_eq!(particles[1].shape, "uniform");
        assert_eq!(particles[1].orientation, DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0));
    }

    #[test]
    fn names_index_and_field() {
        let good = r#"{"centre": [0, 0, 0], "radius": 1, "extinction": 1}"#;
        for (bad, expected) in [
            (r#"{"centre": [0, 0], "radius": 1, "extinction": 1}"#, "particles[1].centre: "),
            (r#"{"centre": [0, 0, 0, 0], "radius": 1, "extinction": 1}"#, "particles[1].centre: "),
            (r#"{"centre": [0, 0, 0], "radius": -1, "extinction": 1}"#, "particles[1].radius: "),
            (r#"{"centre": [0, 0, 0], "radius": "1", "extinction": 1}"#, "particles[1].radius: "),
            (
                r#"{"centre": [0, 0, 0], "radius": 1, "extinction": null}"#,
                "particles[1].extinction: ",
            ),
            (
                r#"{"centre": [0, 0, "x"], "radius": 1, "extinction": 1}"#,
                "particles[1].centre[2]: ",
            ),
            (r#"{"centre": [0, 0, 0], "radius": 1}"#, "particles[1].extinction: "),
            (
                r#"{"centre": [0, 0, 0], "radius": 1, "extinction": 1, "shape": ""}"#,
                "particles[1].shape: ",
            ),
            (r#"{"centre": [0, 0, 0], "raduis": 1, "extinction": 1}"#, "did you mean `radius`"),
            (
                r#"{"centre": [0, 0, 0], "radius": 1, "extinction": 1, "orientation": [0, 0, 0, 0]}"#,
                "particles[1].orientation: ",
            ),
            ("3", "particles[1]: "),
        ] {
            let text = refusal(&format!("{{\"particles\": [{good},\n{bad}]}}"));
            assert!(text.starts_with("clump.json"), "{text}");
            assert!(text.contains(expected), "{text} lacks {expected}");
            assert!(!text.contains('\n'), "{text}");
        }
    }

    #[test]
    fn hostile_text_is_refused() {
        let deep = "[".repeat(100_000);
        let deep_in_place = format!("{{\"particles\": {deep}");
        let huge_number =
            r#"{"particles": [{"centre": [1e999, 0, 0], "radius": 1, "extinction": 1}]}"#;
        let long_key = format!("{{\"{}\": 1}}", "k".repeat(1_000_000));
        for text in [
            "",
            "{",
            "[]",
            "null",
            "{}",
            "{\"particles\": {}}",
            "{\"particles\": [],}",
            &deep,
            &deep_in_place,
            huge_number,
            &long_key,
            "{\"particles\": []} x",
            "{\"particles\": [], \"particles\": []}",
            "{\"particles\": [NaN]}",
        ] {
            let message = refusal(text);
            assert!(message.starts_with("clump.json"), "{message}");
            assert!(message.len() < 600, "a message of {} bytes", message.len());
        }
        assert_eq!(parse("{\"particles\": []}", "clump.json").expect("empty is allowed"), []);
    }
}
