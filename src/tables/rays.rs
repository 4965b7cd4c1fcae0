//! Ray files: rays through the unit sphere in JSON, answers in JSON.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::header::one_line;
use super::sample::{Sample, SampleRay};
use crate::error::{Error, Result};

/// Largest ray file: a million rays take about 150 MB.
const MOST_BYTES: u64 = 1 << 30;
/// How far the length of a unit vector may be from 1. Components rounded to four digits are off by
/// up to 5e-5 each, which moves the length by less than this; such vectors are scaled to length 1.
const LENGTH_TOLERANCE: f64 = 1e-4;
/// Largest optical radius: ten thousand times that of a dense cumulus particle, and its optical
/// depths stay finite in every precision.
const MOST_OPTICAL_RADIUS: f64 = 1e6;

/// Keys that are not in this list are refused, not skipped: they are likely misspelt.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RayFile {
    rays: Vec<RayEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RayEntry {
    entry: [f64; 3],
    dir: [f64; 3],
    sun: [f64; 3],
    optical_radius: f64,
    #[serde(default)]
    from: f64,
    #[serde(default = "whole")]
    to: f64,
}

fn whole() -> f64 {
    1.0
}

#[derive(Serialize)]
struct AnswerEntry {
    optical_depth: f64,
    transmittance: f64,
    single: f64,
    multiple: f64,
    total: f64,
}

/// Reads and checks a ray file.
pub fn read(path: &Path) -> Result<Vec<SampleRay>> {
    let place = path.display().to_string();
    let refuse = |message: String| Err(Error::input(place.clone(), message));
    let file = File::open(path).map_err(|e| Error::io(path, "read", e))?;
    if file.metadata().is_ok_and(|m| m.is_dir()) {
        return refuse("is a folder, expected a file of rays in JSON".to_owned());
    }
    // A pipe has no size to look at: reading stops behind the limit.
    let mut bytes = Vec::new();
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(|e| Error::io(path, "read", e))?;
    if bytes.len() as u64 > MOST_BYTES {
        return refuse(format!("expected at most {} MiB of rays", MOST_BYTES >> 20));
    }
    parse(&bytes, &place)
}

/// Parses and checks the bytes of a ray file. `place` names it in errors.
pub fn parse(bytes: &[u8], place: &str) -> Result<Vec<SampleRay>> {
    let mut json = serde_json::Deserializer::from_slice(bytes);
    let file: RayFile = serde_path_to_error::deserialize(&mut json).map_err(|e| {
        let field = one_line(e.path());
        let place = if field == "." { place.to_owned() } else { format!("{place}: {field}") };
        Error::input(place, one_line(&e.into_inner()))
    })?;
    json.end().map_err(|e| Error::input(place, one_line(&e)))?;
    let rays = file.rays.iter().enumerate();
    rays.map(|(index, ray)| {
        ray.check().map_err(|(field, message)| {
            Error::input(format!("{place}: rays[{index}].{field}"), message)
        })
    })
    .collect()
}

type Fault = (&'static str, String);

impl RayEntry {
    /// The ray, or the field that is wrong and why.
    fn check(&self) -> std::result::Result<SampleRay, Fault> {
        let entry = unit("entry", self.entry, "a point on the unit sphere")?;
        let dir = unit("dir", self.dir, "a unit vector")?;
        let sun = unit("sun", self.sun, "a unit vector")?;
        let outwards = entry.dot(dir);
        // Rounding may turn a grazing ray outwards by as much as it moves the vectors.
        if outwards > LENGTH_TOLERANCE {
            let message = format!(
                "expected a direction into the sphere (its dot product with the entry at most 0), \
                 found {outwards:.6}"
            );
            return Err(("dir", message));
        }
        if !(0.0..=MOST_OPTICAL_RADIUS).contains(&self.optical_radius) {
            let message = format!(
                "expected a number from 0 to {MOST_OPTICAL_RADIUS:e}, found {}",
                self.optical_radius
            );
            return Err(("optical_radius", message));
        }
        for (field, value, least) in [("from", self.from, 0.0), ("to", self.to, self.from)] {
            if !(least..=1.0).contains(&value) {
                return Err((
                    field,
                    format!("expected a fraction from {least} to 1, found {value}"),
                ));
            }
        }
        let (optical_radius, part) = (self.optical_radius, [self.from, self.to]);
        Ok(SampleRay { entry, dir, sun, optical_radius, part })
    }
}

/// A vector of length 1 up to rounding, made exactly so.
fn unit(field: &'static str, vector: [f64; 3], what: &str) -> std::result::Result<DVec3, Fault> {
    let vector = DVec3::from_array(vector);
    let length = vector.length();
    if (length - 1.0).abs() <= LENGTH_TOLERANCE {
        return Ok(vector / length);
    }
    Err((
        field,
        format!("expected {what} (length 1 to within {LENGTH_TOLERANCE}), found length {length}"),
    ))
}

/// Writes the answers, whole or not at all: one line for each ray, in the order of the rays.
pub fn write(path: &Path, samples: &[Sample]) -> Result<()> {
    crate::output::write_atomically(path, |out| {
        out.write_all(b"{\"rays\": [")?;
        for (i, sample) in samples.iter().enumerate() {
            let entry = AnswerEntry {
                optical_depth: sample.optical_depth,
                transmittance: sample.transmittance,
                single: sample.single,
                multiple: sample.multiple,
                total: sample.total(),
            };
            let line = serde_json::to_string(&entry)?;
            let before = if i == 0 { "\n" } else { ",\n" };
            write!(out, "{before}{line}")?;
        }
        out.write_all(b"\n]}\n")
    })
}
