//! Light scattered by a uniform sphere in parallel light, tabulated in four dimensions.
//!
//! The table answers for any ray through the sphere, any direction of the sun and any optical
//! radius: the *source*, which is the scattered radiance that leaves the sphere at the ray's entry
//! divided by the opacity of its chord, `1 - exp(-tau)`. Divided so it stays bounded and smooth
//! where the chord shrinks to nothing and where the sphere is thin.
//!
//! The table holds the natural logarithm of the source of all orders from 2 on, phase function
//! included, divided by `1 - exp(-R)` and by the fall of light across the terminator
//! ([`terminator`]). Interpolating this in place of the source itself makes power-law lobes and
//! exponential shadows nearly linear between the nodes. Order 1 is not tabulated: a short march
//! along the chord is exact enough, and no dearer than a fetch ([`march`]).

pub mod bake;
mod gpu;
mod lookup;
pub mod mapping;
pub mod march;
pub mod reference;
mod report;
pub mod single;
pub mod terminator;

use half::f16;

pub use gpu::ScatteringParams;
pub use report::{RadiusReport, ScatteringReport};

use self::mapping::{RadiusMap, ViewSunMap};
use self::terminator::Terminator;
use crate::error::{Error, Result};
use crate::medium::Phase;
use crate::tables::Progress;
use crate::tables::optical_depth::grid::{Grid, filtered};

/// Fewest and most nodes along an axis. More than 128 slices of incidence and optical radius
/// together would pass the 2048 slices of a 3D texture that every adapter has.
const NODES: [usize; 2] = [2, 128];
/// Most slices of the packed texture: `max_texture_dimension_3d` of WebGPU.
const MAX_SLICES: usize = 2048;
/// Optical radii for which the solver's grids are made.
const OPTICAL_RADII: [f64; 2] = [1e-3, 1e3];

/// Greatest size of a logarithm in a table: sources that are told apart lie within 1e-12 and 1e12,
/// and in f32 the exponential of this is still far from its ends.
const MOST_LOGARITHM: f64 = 64.0;
/// Shares that the remainder of the orders may have: f32 reaches the first.
const REMAINDERS: [f64; 2] = [1e-5, 0.1];

/// Numbers that a table's values are stored as. The device always filters half precision; single
/// precision is for those who compare with other solvers, where rounding is not to be blamed.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    clap::ValueEnum,
)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// 16 bits, 11 of them significant.
    #[default]
    F16,
    /// 32 bits, 24 of them significant.
    F32,
}

impl std::fmt::Display for Precision {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::F16 => "f16",
            Self::F32 => "f32",
        })
    }
}

/// What to bake.
#[derive(Clone, Debug, PartialEq)]
pub struct ScatteringOptions {
    /// Nodes: optical radius, incidence, azimuth, view-sun angle.
    pub resolution: [usize; 4],
    /// Least and greatest optical radius.
    pub optical_radius: [f64; 2],
    /// The scattering orders are summed until a further step changes the light at a place by less
    /// than this share of it, in the root mean square.
    pub remainder: f64,
    /// How the values are stored in a file and looked up on the host.
    pub precision: Precision,
}

impl Default for ScatteringOptions {
    fn default() -> Self {
        Self {
            resolution: [30, 28, 14, 44],
            optical_radius: [0.05, 100.0],
            remainder: 3e-4,
            precision: Precision::F16,
        }
    }
}

impl ScatteringOptions {
    /// Entries of the table.
    pub fn entries(&self) -> usize {
        self.resolution.iter().product()
    }

    /// Optical radius of a node.
    pub fn optical_radius_at(&self, index: usize) -> f64 {
        let map = RadiusMap { range: self.optical_radius };
        map.optical_radius(mapping::node(index, self.resolution[0]))
    }

    /// Whether a table can be baked so.
    pub(super) fn check(&self, albedo: f64) -> Result<()> {
        if !(0.0..=1.0).contains(&albedo) {
            return Err(Error::input(
                format!("albedo {albedo}"),
                "expected a share between 0 and 1",
            ));
        }
        check_shape(self.resolution, self.optical_radius)?;
        if !(REMAINDERS[0]..=REMAINDERS[1]).contains(&self.remainder) {
            return Err(Error::input(
                format!("scattering remainder {}", self.remainder),
                format!("expected a share between {} and {}", REMAINDERS[0], REMAINDERS[1]),
            ));
        }
        Ok(())
    }
}

fn check_shape(resolution: [usize; 4], optical_radius: [f64; 2]) -> Result<()> {
    if resolution.iter().any(|n| !(NODES[0]..=NODES[1]).contains(n))
        || resolution[0] * resolution[1] > MAX_SLICES
    {
        return Err(Error::input(
            format!("scattering resolution {resolution:?}"),
            format!(
                "expected {} to {} nodes along each of optical radius, incidence, azimuth and \
                 view-sun angle, and at most {MAX_SLICES} for the first two together",
                NODES[0], NODES[1]
            ),
        ));
    }
    let [low, high] = optical_radius;
    if !(low >= OPTICAL_RADII[0] && high <= OPTICAL_RADII[1] && low < high) {
        return Err(Error::input(
            format!("optical radius range {low}..{high}"),
            format!(
                "expected two rising numbers between {} and {}",
                OPTICAL_RADII[0], OPTICAL_RADII[1]
            ),
        ));
    }
    Ok(())
}

/// The scattering table of one phase function and albedo.
#[derive(Clone, Debug, PartialEq)]
pub struct ScatteringTable {
    phase: Phase,
    albedo: f64,
    resolution: [usize; 4],
    optical_radius: [f64; 2],
    values: Vec<f16>,
    /// The same before rounding, where they are kept.
    precise: Option<Vec<f32>>,
    report: ScatteringReport,
    map: ViewSunMap,
    terminator: Terminator,
}

impl ScatteringTable {
    /// Computes a table. The same arguments give the same bytes whatever the number of threads.
    pub fn bake(
        phase: Phase,
        albedo: f64,
        options: &ScatteringOptions,
        progress: &dyn Progress,
    ) -> Result<Self> {
        phase.check()?;
        options.check(albedo)?;
        let (values, report) = bake::bake(&phase, albedo, options, progress);
        let solved = report.radii.iter().all(|radius| radius.residual.is_finite());
        if !solved || values.iter().any(|v| !v.is_finite()) {
            return Err(Error::Failed(format!(
                "scattering of {phase} with albedo {albedo}: the solver found no solution; more nodes \
                 of the view-sun angle or a less peaked phase function may do"
            )));
        }
        let (resolution, range) = (options.resolution, options.optical_radius);
        match options.precision {
            Precision::F16 => {
                let values = values.into_iter().map(f16::from_f64).collect();
                Self::from_parts(phase, albedo, resolution, range, values, report)
            }
            Precision::F32 => {
                let values = values.into_iter().map(|v| v as f32).collect();
                Self::from_precise_parts(phase, albedo, resolution, range, values, report)
            }
        }
    }

    /// A table from values in single precision; refused as [`Self::from_parts`] does.
    pub fn from_precise_parts(
        phase: Phase,
        albedo: f64,
        resolution: [usize; 4],
        optical_radius: [f64; 2],
        values: Vec<f32>,
        report: ScatteringReport,
    ) -> Result<Self> {
        let rounded = values.iter().map(|v| f16::from_f32(*v)).collect();
        let table = Self::from_parts(phase, albedo, resolution, optical_radius, rounded, report)?;
        Ok(Self { precise: Some(values), ..table })
    }

    /// A table from stored values, refused unless sizes fit and every value is in its range.
    pub fn from_parts(
        phase: Phase,
        albedo: f64,
        resolution: [usize; 4],
        optical_radius: [f64; 2],
        values: Vec<f16>,
        report: ScatteringReport,
    ) -> Result<Self> {
        phase.check()?;
        let shape = ScatteringOptions { resolution, optical_radius, ..Default::default() };
        shape.check(albedo)?;
        let place = || format!("scattering table of {phase}");
        if values.len() != shape.entries() {
            return Err(Error::input(
                place(),
                format!("expected {} values, found {}", shape.entries(), values.len()),
            ));
        }
        // No range contains NaN.
        let known = -MOST_LOGARITHM..=MOST_LOGARITHM;
        if let Some(value) = values.iter().find(|v| !known.contains(&v.to_f64())) {
            return Err(Error::input(
                place(),
                format!("expected finite logarithms within ±{MOST_LOGARITHM}, found {value}"),
            ));
        }
        let map = ViewSunMap::for_phase(&phase);
        let terminator = Terminator::for_phase(&phase);
        Ok(Self {
            phase,
            albedo,
            resolution,
            optical_radius,
            values,
            precise: None,
            report,
            map,
            terminator,
        })
    }

    /// The same with half as many nodes along each axis, at least 2.
    pub(in crate::tables) fn thinned(&self) -> Result<Self> {
        // A grid's first axis is the fastest, here it is the last.
        let grid = |resolution: [usize; 4]| {
            let [a, b, c, d] = resolution;
            Grid { nodes: [d, c, b, a] }
        };
        let resolution = self.resolution.map(|n| n.div_ceil(2).max(2));
        let (fine, coarse) = (grid(self.resolution), grid(resolution));
        let value = |node: usize| {
            let value = self.values.get(node).copied().unwrap_or_default();
            glam::Vec4::splat(value.to_f32())
        };
        let values = (0..coarse.len()).map(|node| {
            let at = coarse.place(node);
            f16::from_f32(filtered(&fine, at, value).x)
        });
        let (range, report) = (self.optical_radius, self.report.clone());
        Self::from_parts(self.phase, self.albedo, resolution, range, values.collect(), report)
    }

    /// Phase function of the table.
    pub fn phase(&self) -> &Phase {
        &self.phase
    }

    /// Single-scattering albedo of the table.
    pub fn albedo(&self) -> f64 {
        self.albedo
    }

    /// Nodes: optical radius, incidence, azimuth, view-sun angle.
    pub fn resolution(&self) -> [usize; 4] {
        self.resolution
    }

    /// Least and greatest optical radius; beyond them the nearest is used.
    pub fn optical_radius_range(&self) -> [f64; 2] {
        self.optical_radius
    }

    /// All values as the device has them: axes in the order of [`Self::resolution`], the last
    /// varying fastest.
    pub fn values(&self) -> &[f16] {
        &self.values
    }

    /// The same before they were rounded, where the table has kept that.
    pub fn precise_values(&self) -> Option<&[f32]> {
        self.precise.as_deref()
    }

    /// Numbers that the values are stored as.
    pub fn precision(&self) -> Precision {
        if self.precise.is_some() { Precision::F32 } else { Precision::F16 }
    }

    /// The table as the device has it.
    pub fn rounded(&self) -> Self {
        Self { precise: None, ..self.clone() }
    }

    /// What the bake said about itself.
    pub fn report(&self) -> &ScatteringReport {
        &self.report
    }
}

#[cfg(test)]
mod accuracy_tests;
#[cfg(test)]
mod gpu_tests;
#[cfg(test)]
mod tests;
