//! Numbers under stress: frames of scenes at the corners of what is allowed, and of random ones,
//! with every number of every buffer and texture of every pass judged.
//!
//! A case fails where one is not finite, where radiance is negative ([`rules`]) or more than energy
//! allows ([`energy`]), where transmittance leaves 0 to 1, or where the picture is far from the one
//! that is composed exactly ([`composed`]).

pub mod audit;
pub mod beyond;
pub mod composed;
pub mod corners;
pub mod difference;
pub mod energy;
mod explained;
pub mod large;
mod live;
pub mod random;
pub mod rules;
pub mod soak;
mod weather;

use serde::Serialize;

pub use audit::Audit;
pub use composed::KeptAir;
pub use difference::Difference;
pub use energy::Energy;

use crate::error::{Error, Result};
use crate::frame::{Picture, Preset, RenderSettings, Renderer};
use crate::gpu::Gpu;
use crate::medium::{Halo, Phase, Truncation};
use crate::scene::{Medium, Scene};
use crate::tables::{ScatteringOptions, ScatteringTable, Silent, TableSet};

/// A scene to be judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// What is special.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// s.
    pub time: f64,
    /// Pixels.
    pub size: [u32; 2],
    /// Quality.
    pub preset: Preset,
    /// How the frame comes about.
    pub way: Way,
    /// Other particles for the same picture, where the case has too many to be composed exactly.
    pub like: Option<Box<Scene>>,
}

/// How a case's frame comes about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Way {
    /// By itself.
    #[default]
    Alone,
    /// As in a window: pixels are taken over from the frames before, the light grid is made in slices.
    Live,
}

/// What became of a case.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Row {
    /// The case's name.
    pub name: String,
    /// Pixels.
    pub size: [u32; 2],
    /// Particles, listed and generated.
    pub particles: u64,
    /// Counts over all buffers and textures.
    #[serde(flatten)]
    pub audit: Audit,
    /// Largest radiance over what energy allows.
    pub energy: f64,
    /// Difference to the exact compositor.
    pub composed: Option<Difference>,
    /// Rays and lists that the device cut, as the renderer tells.
    pub cut: u64,
    /// Why the case fails; none where it passes.
    pub failure: Option<String>,
}

impl Row {
    /// Whether all is as it should be.
    pub fn passes(&self) -> bool {
        self.failure.is_none()
    }
}

/// The media of the cases: those of the built-in tables, and the ends of the ranges.
pub const MEDIA: [(Phase, f64); 9] = [
    (Phase::Mie { diameter_um: 20.0 }, 1.0),
    (Phase::Hg { g: 0.85 }, 1.0),
    (Phase::Hg { g: -0.99 }, 1.0),
    (Phase::Hg { g: -0.5 }, 0.5),
    (Phase::Hg { g: 0.0 }, 0.0),
    (Phase::Hg { g: 0.0 }, 1.0),
    (Phase::Hg { g: 0.99 }, 1.0),
    (Phase::Hg { g: 0.99 }, 0.9),
    (Phase::Mie { diameter_um: 50.0 }, 0.0),
];

/// A scattering table of the even phase function. It takes seconds.
fn even_table() -> Result<ScatteringTable> {
    let options = ScatteringOptions {
        resolution: [4, 8, 6, 12],
        optical_radius: [0.1, 30.0],
        remainder: 1e-2,
        ..Default::default()
    };
    ScatteringTable::bake(Phase::Hg { g: 0.0 }, 1.0, &options, &Silent)
}

/// A table for a medium at the end of a range. What is stressed is the frame, where the phase function
/// itself is evaluated; the table only tells the light of particles alone, and the exact
/// compositor reads the same. So the values may be those of the even phase function, and take
/// no minutes for each medium; without scattering there is no light in them.
fn stand_in(even: &ScatteringTable, phase: Phase, albedo: f64) -> Result<ScatteringTable> {
    let mut values = even.values().to_vec();
    // Natural logarithm of sources of order 2 and more: each order has the albedo once more.
    let fall = 2.0 * albedo.max(NO_ALBEDO).ln();
    for value in &mut values {
        *value = half::f16::from_f64(value.to_f64() + fall);
    }
    let (resolution, range) = (even.resolution(), even.optical_radius_range());
    ScatteringTable::from_parts(phase, albedo, resolution, range, values, even.report().clone())
}

/// Stands for an albedo of 0 in logarithms.
const NO_ALBEDO: f64 = 1e-6;

/// A device and the renderer of one medium and preset at a time.
pub struct Stress {
    gpu: Gpu,
    tables: TableSet,
    air: Option<KeptAir>,
    made: Option<Made>,
}

/// What cases of the same medium and preset share.
pub struct Made {
    medium: Medium,
    preset: Preset,
    way: Way,
    /// The renderer.
    pub renderer: Renderer,
    /// Of the medium.
    pub truncation: Truncation,
    /// Of the medium.
    pub halo: Halo,
}

impl Stress {
    /// Opens a device. `media` are those of the cases to come, besides the built-in tables'.
    pub fn new(media: &[(Phase, f64)]) -> Result<Self> {
        let built_in = TableSet::embedded()?;
        let mut scattering = built_in.scattering().to_vec();
        let known = built_in.scattering();
        let known = |p: &Phase, a: f64| known.iter().any(|t| t.phase() == p && t.albedo() == a);
        let lacking: Vec<_> = media.iter().filter(|(p, a)| !known(p, *a)).collect();
        if !lacking.is_empty() {
            let even = even_table()?;
            for (phase, albedo) in lacking {
                scattering.push(stand_in(&even, *phase, *albedo)?);
            }
        }
        let depth = built_in.optical_depth().to_vec();
        let tables = TableSet::new(depth, *built_in.optical_depth_options(), scattering)?;
        Ok(Self { gpu: Gpu::headless()?.watched(), tables, made: None, air: None })
    }

    /// The tables in use.
    pub fn tables(&self) -> &TableSet {
        &self.tables
    }

    /// The device in use.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// A renderer for a case: the last one where it fits.
    pub fn made(&mut self, case: &Case) -> Result<&mut Made> {
        let (medium, preset, way) = (case.scene.medium, case.preset, case.way);
        let fits = |m: &Made| m.medium == medium && m.preset == preset && m.way == way;
        let kept = self.made.take().filter(fits);
        let made = match kept {
            Some(made) => made,
            None => {
                let live = way == Way::Live;
                let settings = RenderSettings { preset, live, ..Default::default() };
                let renderer = Renderer::new(&self.gpu, &self.tables, &case.scene, &settings)?;
                let truncation = Truncation::new(&medium.phase);
                let halo = Halo::new(&medium.phase, &truncation);
                Made { medium, preset, way, renderer, truncation, halo }
            }
        };
        Ok(self.made.insert(made))
    }

    /// Makes the frame of a case and judges it. The picture is there where one was made.
    pub fn run(&mut self, case: &Case) -> (Row, Option<Picture>) {
        let mut row = Row { name: case.name.clone(), size: case.size, ..Row::default() };
        match self.judge(case, &mut row) {
            Ok(picture) => {
                row.failure = failure(&row);
                (row, Some(picture))
            }
            Err(error) => {
                row.failure = Some(error.to_string());
                // What a failed device leaves behind is not to be blamed for the next case.
                if matches!(error, Error::Gpu(_)) {
                    self.made = None;
                }
                (row, None)
            }
        }
    }

    fn judge(&mut self, case: &Case, row: &mut Row) -> Result<Picture> {
        if case.way == Way::Live {
            self.fly(case, row)?;
        }
        let like = case.like.as_ref().map(|like| self.frame(case, like, case.time)).transpose()?;
        let picture = self.frame(case, &case.scene, case.time)?;
        row.particles = picture.stats.counters.particles_generated;
        self.look_at(&case.scene, &picture, row)?;
        if let Some(made) = &self.made {
            let energy = Energy::new(&case.scene, made);
            row.composed = match like {
                Some(like) => Some(difference::like(&picture, &like, case.preset.quality().steps)),
                None => composed::Composed { made, tables: &self.tables, energy: &energy }
                    .difference(case, &picture, &mut self.air)?,
            };
        }
        Ok(picture)
    }

    /// A frame that is finished.
    fn frame(&mut self, case: &Case, scene: &Scene, time: f64) -> Result<Picture> {
        let renderer = &mut self.made(case)?.renderer;
        for _ in 0..live::MOST_FRAMES {
            let picture = renderer.render(scene, time, case.size)?;
            if !picture.stats.unfinished {
                return Ok(picture);
            }
        }
        Err(Error::Failed(format!("not finished after {} frames at rest", live::MOST_FRAMES)))
    }

    /// The frames before that of a case: each is judged like one that stays.
    fn fly(&mut self, case: &Case, row: &mut Row) -> Result<()> {
        self.made(case)?.renderer.forget();
        for (scene, time) in live::way(case) {
            let picture = self.made(case)?.renderer.render(&scene, time, case.size)?;
            self.look_at(&scene, &picture, row)?;
        }
        Ok(())
    }

    /// Judges all numbers of the last frame.
    fn look_at(&self, scene: &Scene, picture: &Picture, row: &mut Row) -> Result<()> {
        row.cut = row.cut.max(picture.stats.counters.cut);
        let solved = self.made.as_ref().and_then(|made| made.renderer.solved_light());
        let solved = solved.as_ref().map_or(&[][..], |both| both.as_slice());
        row.audit.add(audit::audit(&self.gpu, scene, solved)?);
        if let Some(made) = &self.made {
            let energy = Energy::new(scene, made).largest(scene, picture);
            // NaN stays.
            if energy > row.energy || energy.is_nan() {
                row.energy = energy;
            }
        }
        Ok(())
    }
}

fn failure(row: &Row) -> Option<String> {
    let audit = &row.audit;
    if let Some(first) = &audit.first {
        return Some(first.clone());
    }
    if row.cut > 0 {
        return Some(format!("{} rays or lists are too long for the device, as it told", row.cut));
    }
    // NaN fails too.
    if row.energy.is_nan() || row.energy > 1.0 {
        return Some(format!("radiance is {:.3} times what energy allows", row.energy));
    }
    row.composed.as_ref().and_then(Difference::failure)
}
