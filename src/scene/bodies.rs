//! Sun, sky, ground and what the clouds are made of.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::vector;
use crate::medium::Phase;

/// The sun: parallel light from a small disc.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sun {
    /// Towards the sun; a unit vector once read, of any length in a file.
    #[serde(with = "vector::three")]
    pub direction: DVec3,
    /// Irradiance on a surface that faces the sun, at the top of the atmosphere. It sets the unit
    /// of all radiances.
    #[serde(default = "default_irradiance")]
    pub irradiance: f64,
    /// Width of the disc, degrees.
    #[serde(default = "default_angular_diameter")]
    pub angular_diameter: f64,
}

fn default_irradiance() -> f64 {
    1.0
}

/// Mean over the year: 1.392e9 m across, 1.496e11 m away.
fn default_angular_diameter() -> f64 {
    0.533
}

impl Default for Sun {
    /// 45 degrees high.
    fn default() -> Self {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        Self {
            direction: DVec3::new(half, half, 0.0),
            irradiance: default_irradiance(),
            angular_diameter: default_angular_diameter(),
        }
    }
}

/// What is behind and between the clouds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sky {
    /// The same radiance from all directions, below the horizon too; no air.
    Uniform {
        /// Radiance per steradian, in the unit of the sun's irradiance.
        radiance: f64,
    },
    /// The Earth's clear atmosphere.
    Atmosphere,
}

/// What the ground's surface is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GroundKind {
    /// Lambertian: it scatters alike in all directions.
    Plain,
    /// Waves that reflect by Fresnel's equations over water that scatters some of what enters it; see
    /// [`crate::medium::Sea`].
    Sea {
        /// 12.5 m above the surface, as Cox and Munk have it, m/s; it sets how rough the sea is.
        wind_speed: f64,
    },
}

/// A sphere at altitude 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// What its surface is.
    pub kind: GroundKind,
    /// Reflected share of linear Rec. 709 red, green and blue; of a sea the share of the light that has entered the water
    /// which leaves it again.
    pub albedo: DVec3,
}

impl Ground {
    /// One that scatters alike in all directions.
    pub fn plain(albedo: DVec3) -> Self {
        Self { kind: GroundKind::Plain, albedo }
    }

    /// The sea, m/s.
    pub fn sea(wind_speed: f64, albedo: DVec3) -> Self {
        Self { kind: GroundKind::Sea { wind_speed }, albedo }
    }

    /// The wind over it, where it is a sea, m/s.
    pub fn wind_speed(&self) -> Option<f64> {
        match self.kind {
            GroundKind::Plain => None,
            GroundKind::Sea { wind_speed } => Some(wind_speed),
        }
    }
}

impl Default for Ground {
    /// Grass and fields: the order of measured broadband albedos of vegetation in the visible
    /// (0.05 to 0.15), most in green.
    fn default() -> Self {
        Self::plain(DVec3::new(0.09, 0.11, 0.06))
    }
}

/// What scatters inside the particles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Medium {
    /// Phase function: "mie:20um" or "hg:0.85".
    #[serde(with = "vector::text", default = "default_phase")]
    pub phase: Phase,
    /// Single-scattering albedo: the share of extinguished light that is scattered on.
    #[serde(default = "default_albedo")]
    pub albedo: f64,
}

/// Droplets of a mature cumulus, um.
const DROPLET_DIAMETER: f64 = 20.0;

fn default_phase() -> Phase {
    Phase::Mie { diameter_um: DROPLET_DIAMETER }
}

/// Water absorbs less than one visible photon in 100,000 scatterings.
fn default_albedo() -> f64 {
    1.0
}

impl Default for Medium {
    fn default() -> Self {
        Self { phase: default_phase(), albedo: default_albedo() }
    }
}
