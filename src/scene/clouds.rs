//! The cloud field that surrounds the camera.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{WeatherMap, vector};

/// Clouds generated on concentric square rings of cells around the camera. Everything about them
/// follows from the seed, the place in the world and the time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CloudField {
    /// Another seed is another sky.
    pub seed: u32,
    /// Altitude of the flat cloud bases, m.
    pub base: f64,
    /// Height of the tallest cloud, m.
    pub thickness: f64,
    /// Share of the sky that is covered, 0 to 1; with a weather map, where that is white.
    pub coverage: f64,
    /// Extinction at density 1, 1/m.
    pub extinction: f64,
    /// Largest wavelength of the coverage noise, m: the distance between groups of clouds.
    pub feature_size: f64,
    /// Side of a cell of the innermost ring, m; each ring's cells are twice the size of the
    /// cells of the ring inside it.
    pub cell_size: f64,
    /// Cells per side of a ring, an even number.
    pub cells: u32,
    /// Number of rings.
    pub rings: u32,
    /// Particles above each other in a cell.
    pub layers: u32,
    /// Radius of a full-grown particle, in cells of its ring.
    pub particle_size: f64,
    /// Velocity of the whole field, m/s.
    #[serde(with = "vector::three")]
    pub wind: DVec3,
    /// Time in which a cloud grows and vanishes, s.
    pub evolution_time: f64,
    /// Noise shapes that the particles take, by name; empty for all that the tables hold.
    pub shapes: Vec<String>,
    /// An image that says where the clouds are, in place of the same coverage everywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weather: Option<WeatherMap>,
}

impl Default for CloudField {
    /// Fair-weather cumulus.
    fn default() -> Self {
        Self {
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
        }
    }
}

impl CloudField {
    /// Places where a particle can be: cells of all rings times layers, before the inner rings
    /// are cut out of the outer ones.
    pub fn slots(&self) -> u64 {
        u64::from(self.cells)
            .saturating_mul(u64::from(self.cells))
            .saturating_mul(u64::from(self.rings))
            .saturating_mul(u64::from(self.layers))
    }
}
