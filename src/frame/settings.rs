//! How much work a picture may cost.

use std::fmt::{Display, Formatter};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::light_grid::{Directions, GridSettings};
use super::view::SCREEN_TILE;
use crate::medium::{Phase, Truncation};

/// Quality against time, from first looks to pictures for print.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    clap::ValueEnum,
)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// For slow machines and first looks.
    Low,
    /// For interactive work.
    Medium,
    /// For pictures; the default.
    #[default]
    High,
    /// As exact as the tables allow.
    Ultra,
}

impl Preset {
    /// All presets, cheapest first.
    pub const ALL: [Self; 4] = [Self::Low, Self::Medium, Self::High, Self::Ultra];

    /// The name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
            Self::Ultra => "ultra",
        }
    }
}

impl Display for Preset {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Preset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|preset| preset.name() == text)
            .ok_or_else(|| format!("expected low, medium, high or ultra, found `{text}`"))
    }
}

/// How the light that clouds scatter among themselves is found.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    clap::ValueEnum,
)]
#[serde(rename_all = "lowercase")]
pub enum Lighting {
    /// Solved for on the light grid; what all presets take.
    #[default]
    Grid,
    /// Octaves of attenuated sunlight and skylight (Wrenninge, Kulla and Lundqvist, SIGGRAPH 2013 Talks) in the delta-M
    /// scaled medium, to compare with: no light grid, and no light that clouds change in the air.
    Octaves,
    /// Each particle as if it were alone, by its own scattering table, in the sunlight that the others leave at its centre
    /// and in skylight as if there were no others (Yusov, High Performance Graphics 2014), to compare with: the medium is
    /// not scaled, and without the same.
    Alone,
}

impl Lighting {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Grid, Self::Octaves, Self::Alone];

    /// The name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Grid => "grid",
            Self::Octaves => "octaves",
            Self::Alone => "alone",
        }
    }

    /// Whether the light grid is solved, and what is made of it.
    pub const fn has_grid(self) -> bool {
        matches!(self, Self::Grid)
    }

    /// Whether the blend looks depths up in the deep shadow maps.
    pub const fn has_maps(self) -> bool {
        !matches!(self, Self::Alone)
    }

    /// What its blend is compiled with.
    pub(crate) const fn definition(self) -> Option<(&'static str, u32)> {
        match self {
            Self::Grid => None,
            Self::Octaves => Some(("OCTAVES", 1)),
            Self::Alone => Some(("ALONE", 1)),
        }
    }

    /// What of the phase function is scaled out of the medium.
    pub fn truncation(self, phase: &Phase) -> Truncation {
        match self {
            Self::Grid | Self::Octaves => Truncation::new(phase),
            Self::Alone => Truncation::none(phase),
        }
    }
}

impl Display for Lighting {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Finenesses of the light grid that there may be: of one cell in eight of the field's, and more than a device binds.
const FINENESSES: [f64; 2] = [0.125, 8.0];

/// What a renderer is made for, besides the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RenderSettings {
    /// Quality against time.
    pub preset: Preset,
    /// Numbers in place of the preset's, for measurements of what each does.
    pub quality: Option<Quality>,
    /// A pass to leave out, to see what it does.
    pub omit: Option<super::plan::Pass>,
    /// Frames are shown one after the other, as in a window: what takes long is spread over several of
    /// them. Else every frame is what it is alone.
    pub live: bool,
    /// Times of the passes are wanted, even where measuring them makes frames slower (software
    /// adapters).
    pub time_passes: bool,
}

impl RenderSettings {
    /// The numbers that hold.
    pub fn quality(&self) -> Quality {
        let quality = self.quality.unwrap_or_else(|| self.preset.quality());
        let [least, most] = FINENESSES;
        // NaN is no fineness.
        let fineness = quality.grid.fineness.max(least).min(most);
        let grid = GridSettings { fineness, ..quality.grid };
        let quality = Quality { tile: quality.tile.max(1), grid, ..quality };
        if self.live { quality.live() } else { quality }
    }
}

/// The numbers behind a preset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Steps of the eye's march in a radius of the smallest particle at hand.
    pub steps: u32,
    /// A pixel is finished below this transmittance.
    pub transmittance_stop: f32,
    /// Steps of the sun's march in a radius of the smallest particle at hand.
    pub shadow_steps: u32,
    /// Sides of a block of pixels, of which a frame that follows another shades one: 1 or 2.
    pub pixel_stride: u32,
    /// Sides of a tile of the screen, which has one list of particles, in blocks of pixels: long lists on
    /// the one hand, many on the other.
    pub tile: u32,
    /// Texels a side of the deep shadow maps.
    pub shadow_resolution: u32,
    /// Steps from one node to the next of the rays on which it is known what clouds change of the air's light.
    pub air_steps: u32,
    /// The light grid.
    pub grid: GridSettings,
    /// What takes its place.
    pub lighting: Lighting,
}

/// Steps of the light grid's solution a frame of a stream. In preset high a step takes about 200 ms of
/// both cores in software, a solution 21 steps; an epoch of a default field is 3.5 s.
const LIVE_SLICE: u32 = 2;

impl Quality {
    /// The same for frames of a stream.
    pub const fn live(self) -> Self {
        let grid = GridSettings { slice: LIVE_SLICE, draft: true, ..self.grid };
        Self { grid, pixel_stride: 2, ..self }
    }
}

impl Preset {
    /// The numbers behind the name.
    pub const fn quality(self) -> Quality {
        match self {
            Self::Low => Quality {
                steps: 3,
                transmittance_stop: 0.02,
                shadow_steps: 2,
                pixel_stride: 1,
                tile: SCREEN_TILE,
                shadow_resolution: 96,
                air_steps: 1,
                grid: GridSettings {
                    fineness: 0.6,
                    directions: Directions::Twenty,
                    turns: [33, 4],
                    slice: 0,
                    draft: false,
                },
                lighting: Lighting::Grid,
            },
            Self::Medium => Quality {
                steps: 4,
                transmittance_stop: 0.01,
                shadow_steps: 3,
                pixel_stride: 1,
                tile: SCREEN_TILE,
                shadow_resolution: 160,
                air_steps: 2,
                grid: GridSettings {
                    fineness: 0.95,
                    directions: Directions::Twenty,
                    turns: [33, 4],
                    slice: 0,
                    draft: false,
                },
                lighting: Lighting::Grid,
            },
            Self::High => Quality {
                steps: 6,
                transmittance_stop: 0.004,
                shadow_steps: 4,
                pixel_stride: 1,
                tile: SCREEN_TILE,
                shadow_resolution: 256,
                air_steps: 4,
                grid: GridSettings {
                    fineness: 1.7,
                    directions: Directions::ThirtyTwo,
                    turns: [33, 4],
                    slice: 0,
                    draft: false,
                },
                lighting: Lighting::Grid,
            },
            Self::Ultra => Quality {
                steps: 12,
                transmittance_stop: 0.002,
                shadow_steps: 4,
                pixel_stride: 1,
                tile: SCREEN_TILE,
                shadow_resolution: 384,
                air_steps: 4,
                grid: GridSettings {
                    fineness: 2.2,
                    directions: Directions::ThirtyTwo,
                    turns: [65, 5],
                    slice: 0,
                    draft: false,
                },
                lighting: Lighting::Grid,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for preset in Preset::ALL {
            assert_eq!(preset.to_string().parse(), Ok(preset));
            let serde_name = serde_json::to_value(preset).expect("a plain enum");
            assert_eq!(serde_name, preset.name());
        }
        assert!("High".parse::<Preset>().is_err());
        for lighting in Lighting::ALL {
            assert_eq!(serde_json::to_value(lighting).expect("a plain enum"), lighting.name());
        }
    }
}
