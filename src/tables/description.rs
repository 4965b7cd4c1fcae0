//! What a table file says about itself: its metadata.

use serde::{Deserialize, Serialize};

use super::TableSet;
use super::fingerprint::Fingerprint;
use super::optical_depth::{OpticalDepthErrors, OpticalDepthOptions, encoding, mapping};
use super::scattering::{Precision, ScatteringReport, ScatteringTable};
use crate::error::{Error, Result};
use crate::medium::shape::FORMULA_VERSION;
use crate::medium::{Phase, ShapeSpec};

/// Version of the layout of table files. A file of another version is refused.
pub const FORMAT: u32 = 3;
/// Version of the scattering solver and of the meaning of its values. Tables of another are refused.
pub const SCATTERING_VERSION: u32 = 4;
/// The program that computes tables.
const GENERATOR: &str = concat!("cumuli precompute ", env!("CARGO_PKG_VERSION"));

/// All metadata of a table file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// [`FORMAT`].
    pub format: u32,
    /// Program and version that computed the tables.
    pub generator: String,
    /// The optical depth tables.
    pub optical_depth: OpticalDepthDescription,
    /// The scattering tables.
    pub scattering: ScatteringDescription,
    /// Fingerprint of all parameters, hexadecimal: equal where the same tables were asked for.
    pub parameters: String,
    /// Fingerprint of all values, hexadecimal; empty until the file is written.
    pub values: String,
}

/// The optical depth tables of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpticalDepthDescription {
    /// Name of the mapping from chords to places.
    pub mapping: String,
    /// Name of the encoding of the values.
    pub encoding: String,
    /// Version of the noise formulas.
    pub formula: u32,
    /// How the tables were computed.
    pub options: OpticalDepthOptions,
    /// The noise shapes, in the order of their indices (from 1 on).
    pub shapes: Vec<ShapeDescription>,
}

/// The table of one noise shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShapeDescription {
    /// Kind and seed, as scenes say them.
    pub shape: ShapeSpec,
    /// Mean density over the unit sphere.
    pub mean_density: f64,
    /// Errors measured when the table was baked.
    pub errors: OpticalDepthErrors,
}

/// The scattering tables of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScatteringDescription {
    /// [`SCATTERING_VERSION`].
    pub version: u32,
    /// The media.
    pub media: Vec<MediumDescription>,
}

/// The scattering table of one medium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MediumDescription {
    /// Phase function, as scenes say it.
    pub phase: Phase,
    /// Single-scattering albedo.
    pub albedo: f64,
    /// Nodes: optical radius, cosine of incidence, azimuth, view-sun angle.
    pub resolution: [usize; 4],
    /// Numbers that the values are stored as.
    #[serde(default)]
    pub precision: Precision,
    /// Least and greatest optical radius.
    pub optical_radius: [f64; 2],
    /// What the bake measured.
    pub report: ScatteringReport,
}

impl Description {
    pub(super) fn of(tables: &TableSet) -> Self {
        let shapes = tables.optical_depth().iter().map(|table| ShapeDescription {
            shape: table.spec(),
            mean_density: table.mean_density(),
            errors: table.errors().clone(),
        });
        let mut description = Self {
            format: FORMAT,
            generator: GENERATOR.to_owned(),
            optical_depth: OpticalDepthDescription {
                mapping: mapping::NAME.to_owned(),
                encoding: encoding::NAME.to_owned(),
                formula: FORMULA_VERSION,
                options: *tables.optical_depth_options(),
                shapes: shapes.collect(),
            },
            scattering: ScatteringDescription {
                version: SCATTERING_VERSION,
                media: tables.scattering().iter().map(MediumDescription::of).collect(),
            },
            parameters: String::new(),
            values: String::new(),
        };
        description.parameters = description.parameter_hash();
        description
    }

    /// Fingerprint of what was asked for: not of what was measured.
    fn parameter_hash(&self) -> String {
        let depth = &self.optical_depth;
        let mut hash = Fingerprint::default();
        hash.add(
            format!("{} {} {} {}", self.format, depth.mapping, depth.encoding, depth.formula)
                .as_bytes(),
        );
        hash.add(format!("{:?}", depth.options).as_bytes());
        for shape in &depth.shapes {
            hash.add(shape.shape.to_string().as_bytes());
        }
        hash.add(self.scattering.version.to_string().as_bytes());
        for medium in &self.scattering.media {
            hash.add(medium.parameters().as_bytes());
        }
        hash.to_string()
    }

    /// Whether this program can use tables described so. `place` names the file.
    pub(super) fn check(&self, place: &str) -> Result<()> {
        let depth = &self.optical_depth;
        let expect = |field: &str, expected: &str, found: &str| {
            if expected == found {
                return Ok(());
            }
            let shown = |c: char| if c.is_control() { ' ' } else { c };
            let found: String = found.chars().take(60).map(shown).collect();
            Err(Error::input(
                format!("{place}: {field}"),
                format!("expected {expected}, found {found}; bake the tables anew with precompute"),
            ))
        };
        expect("optical_depth.mapping", mapping::NAME, &depth.mapping)?;
        expect("optical_depth.encoding", encoding::NAME, &depth.encoding)?;
        expect("optical_depth.formula", &FORMULA_VERSION.to_string(), &depth.formula.to_string())?;
        let version = (SCATTERING_VERSION.to_string(), self.scattering.version.to_string());
        expect("scattering.version", &version.0, &version.1)?;
        expect("parameters", &self.parameter_hash(), &self.parameters)
    }
}

impl MediumDescription {
    fn of(table: &ScatteringTable) -> Self {
        Self {
            phase: *table.phase(),
            albedo: table.albedo(),
            resolution: table.resolution(),
            precision: table.precision(),
            optical_radius: table.optical_radius_range(),
            report: table.report().clone(),
        }
    }

    /// What was asked for.
    fn parameters(&self) -> String {
        let (resolution, range) = (self.resolution, self.optical_radius);
        let finer = match self.precision {
            Precision::F16 => "",
            Precision::F32 => " f32",
        };
        format!("{} {} {resolution:?} {range:?}{finer}", self.phase, self.albedo)
    }
}
