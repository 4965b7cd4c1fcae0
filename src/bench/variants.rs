//! Ways to make a picture: presets, the numbers behind them one by one, resolution.

use std::str::FromStr;

use super::march::{MarchLight, MarchSettings, STEPS};
use super::record::PointKind;
use crate::frame::{Directions, Preset, Quality};

/// A number in place of a preset's: "steps=4".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    name: Name,
    value: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Name {
    Steps,
    TransmittanceStop,
    ShadowSteps,
    ShadowResolution,
    AirSteps,
    TileSize,
    GridFineness,
    GridDirections,
    GridTurns,
    GridSlice,
    PixelStride,
    Scale,
}

/// Names, what they may be, and whether they are whole numbers.
const NAMES: [(Name, &str, [f64; 2], bool); 12] = [
    (Name::Steps, "steps", [1.0, 32.0], true),
    (Name::TransmittanceStop, "transmittance_stop", [1e-6, 0.5], false),
    (Name::ShadowSteps, "shadow_steps", [1.0, 32.0], true),
    (Name::ShadowResolution, "shadow_resolution", [8.0, 2048.0], true),
    (Name::AirSteps, "air_steps", [1.0, 32.0], true),
    (Name::TileSize, "tile_size", [4.0, 64.0], true),
    (Name::GridFineness, "grid_fineness", [0.25, 3.0], false),
    (Name::GridDirections, "grid_directions", [12.0, 32.0], true),
    (Name::GridTurns, "grid_turns", [1.0, 65.0], true),
    (Name::GridSlice, "grid_slice", [0.0, 1000.0], true),
    (Name::PixelStride, "pixel_stride", [1.0, 2.0], true),
    (Name::Scale, "scale", [0.1, 1.0], false),
];

fn directions(count: f64) -> Option<Directions> {
    Directions::ALL.into_iter().find(|set| f64::from(set.count()) == count)
}

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = || NAMES.map(|n| n.1).join(", ");
        let bad = || format!("expected NAME=NUMBER with a name of {}, found `{text}`", names());
        let (name, value) = text.split_once('=').ok_or_else(bad)?;
        let (name, label, [least, most], whole) =
            *NAMES.iter().find(|n| n.1 == name).ok_or_else(bad)?;
        let expected = || {
            let kind = if whole { "a whole number" } else { "a number" };
            format!("{label}: expected {kind} from {least} to {most}, found `{value}`")
        };
        let value: f64 = value.parse().map_err(|_| expected())?;
        // NaN is in no range.
        if !(least..=most).contains(&value) || (whole && value.fract() != 0.0) {
            return Err(expected());
        }
        if name == Name::GridDirections && directions(value).is_none() {
            return Err(format!("{label}: expected 12, 20 or 32, found `{value}`"));
        }
        Ok(Self { name, value })
    }
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let label = NAMES.iter().find(|n| n.0 == self.name).map_or("", |n| n.1);
        write!(f, "{label}={}", self.value)
    }
}

/// A way to make a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// A name.
    pub name: String,
    /// What it is.
    pub kind: PointKind,
    /// The numbers.
    pub quality: Quality,
    /// Sides of the frame over those of the picture.
    pub scale: f64,
    /// Marched in place of blended.
    pub march: Option<MarchSettings>,
    /// Which of the further table files, in place of the tables that all others take.
    pub tables: Option<usize>,
}

impl Variant {
    /// A preset with some numbers replaced.
    pub fn preset(preset: Preset, set: &[Setting]) -> Self {
        let variant = Self {
            name: preset.name().to_owned(),
            kind: PointKind::Preset,
            quality: preset.quality(),
            scale: 1.0,
            march: None,
            tables: None,
        };
        set.iter().fold(variant, |variant, setting| variant.with(*setting))
    }

    fn with(mut self, setting: Setting) -> Self {
        let (quality, value) = (&mut self.quality, setting.value);
        match setting.name {
            Name::Steps => quality.steps = value as u32,
            Name::TransmittanceStop => quality.transmittance_stop = value as f32,
            Name::ShadowSteps => quality.shadow_steps = value as u32,
            Name::ShadowResolution => quality.shadow_resolution = value as u32,
            Name::AirSteps => quality.air_steps = value as u32,
            Name::TileSize => quality.tile = value as u32,
            Name::GridFineness => quality.grid.fineness = value,
            Name::GridDirections => {
                quality.grid.directions = directions(value).unwrap_or_default();
            }
            // Those of finer levels: the coarsest one's cost nothing.
            Name::GridTurns => quality.grid.turns[1] = value as u32,
            Name::GridSlice => quality.grid.slice = value as u32,
            Name::PixelStride => quality.pixel_stride = value as u32,
            Name::Scale => self.scale = value,
        }
        self
    }

    /// The size of the frame for a picture of this size.
    pub fn size(&self, picture: [u32; 2]) -> [u32; 2] {
        picture.map(|side| ((f64::from(side) * self.scale).round() as u32).max(1))
    }

    /// Whether two of them light the clouds alike: the exact compositor then shows the same.
    pub fn lights_like(&self, other: &Self) -> bool {
        let (own, others) = (&self.quality, &other.quality);
        own.grid == others.grid && own.lighting == others.lighting && self.tables == other.tables
    }
}

/// Numbers that are tried one by one, the others being those of the preset high.
const KNOBS: [&str; 16] = [
    "steps=2",
    "steps=4",
    "steps=12",
    "transmittance_stop=0.02",
    "transmittance_stop=0.0005",
    "shadow_steps=2",
    "shadow_steps=8",
    "shadow_resolution=512",
    "tile_size=4",
    "tile_size=16",
    "tile_size=32",
    "grid_fineness=0.7",
    "grid_fineness=1",
    "pixel_stride=2",
    "scale=0.75",
    "scale=0.5",
];

/// Everything that is set on the plot of run time against error. `tables`: names of further table
/// files; `quick`: presets, one knob, and three marchers of each kind.
pub fn variants(quick: bool, set: &[Setting], tables: &[String]) -> Vec<Variant> {
    let mut all: Vec<_> =
        Preset::ALL.into_iter().map(|preset| Variant::preset(preset, set)).collect();
    let high = Variant::preset(Preset::High, set);
    let knobs = if quick { &["scale=0.5"][..] } else { &KNOBS[..] };
    all.extend(knobs.iter().filter_map(|text| text.parse().ok()).map(|setting: Setting| Variant {
        name: format!("high {setting}"),
        kind: PointKind::Knob,
        ..high.clone().with(setting)
    }));
    all.extend(tables.iter().enumerate().map(|(index, name)| Variant {
        name: format!("high {name}"),
        kind: PointKind::Knob,
        tables: Some(index),
        ..high.clone()
    }));
    for (light, kind) in
        [(MarchLight::Frame, PointKind::ViewMarch), (MarchLight::SunRays, PointKind::March)]
    {
        // In a quick run every second.
        for steps in STEPS.into_iter().step_by(if quick { 2 } else { 1 }) {
            let march = MarchSettings { light, steps };
            all.push(Variant { name: march.name(), kind, march: Some(march), ..high.clone() });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_read_and_refused() {
        for text in KNOBS.into_iter().chain(["grid_directions=20", "grid_turns=7"]) {
            let setting: Setting = text.parse().expect(text);
            assert_eq!(setting.to_string(), text);
            let high = Variant::preset(Preset::High, &[]);
            assert_ne!(high.clone().with(setting), high, "{text} changes nothing");
        }
        for (bad, part) in [
            ("steps", "NAME=NUMBER"),
            ("stpes=3", "steps, transmittance_stop"),
            ("steps=0", "from 1 to 32"),
            ("steps=1.5", "a whole number"),
            ("shadow_steps=33", "from 1 to 32"),
            ("grid_directions=16", "12, 20 or 32"),
            ("scale=nan", "from 0.1 to 1"),
            ("scale=", "from 0.1 to 1"),
        ] {
            let message = bad.parse::<Setting>().expect_err(bad);
            assert!(message.contains(part), "{message}");
        }
    }

    #[test]
    fn names_are_distinct() {
        for quick in [false, true] {
            let all = variants(quick, &[], &["small.safetensors".to_owned()]);
            let mut names: Vec<_> = all.iter().map(|v| &v.name).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), all.len());
            assert!(all.iter().any(|v| v.name == "march-128" && v.march.is_some()));
            assert!(all.iter().any(|v| v.name == "high small.safetensors" && v.tables == Some(0)));
            assert!(all.iter().any(|v| v.name == "view-march-8"));
        }
        assert_eq!(Variant::preset(Preset::Low, &[]).size([3, 1]), [3, 1]);
    }
}
