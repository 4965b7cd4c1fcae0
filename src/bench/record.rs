//! What a bench writes: the schema of `bench.json`, told field by field in docs/bench-schema.md.

use serde::{Deserialize, Serialize};

use crate::frame::{Counters, Lighting, PassTime};

/// Grows whenever a field changes its name, unit or meaning.
pub const SCHEMA: u32 = 1;

/// A whole run of the bench.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bench {
    /// [`SCHEMA`] of the program that wrote it.
    pub schema: u32,
    /// Where it ran.
    pub machine: Machine,
    /// What was asked for.
    pub settings: Settings,
    /// Frames of the cases.
    pub runs: Vec<Run>,
    /// Run time against error.
    pub curves: Vec<Curve>,
    /// What frames of a flight owe to the frames before them.
    pub motion: Vec<Motion>,
    /// A preset against another, frame by frame in turn; or pairs of cases.
    pub against: Vec<Ratio>,
    /// What borders of rings do to a flight.
    #[serde(default)]
    pub popping: Vec<Popping>,
    /// Light among overlapping particles.
    #[serde(default)]
    pub clumps: Option<Clumps>,
}

/// Where a bench ran.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Name of the processor, or "unknown".
    pub cpu: String,
    /// Threads that run at a time.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
    /// The graphics adapter.
    pub adapter: String,
    /// Its kind: Cpu for a software driver.
    pub kind: String,
    /// The interface it was reached by.
    pub backend: String,
    /// Its driver, with version.
    pub driver: String,
    /// Version of Cumuli.
    pub version: String,
    /// The commit it was built from, with "-dirty" for changes since, or "unknown".
    pub commit: String,
    /// "release", or "debug" with debug assertions.
    pub build: String,
}

/// What was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Pixels of the cases.
    pub size: [u32; 2],
    /// Pixels of run time against error, and of motion.
    pub error_size: [u32; 2],
    /// Frames before the first that counts.
    pub warmup: u32,
    /// Frames that count.
    pub frames: u32,
    /// Frames a second of the scene's time.
    pub fps: f64,
    /// The table file, or "embedded".
    pub tables: String,
    /// Numbers in place of the presets'.
    pub set: Vec<String>,
}

/// One case with one preset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Name of the case.
    pub case: String,
    /// Name of the preset.
    pub preset: String,
    /// Making the renderer, shaders included, ms.
    pub start_ms: f64,
    /// The first frame, for which nothing is there yet, ms.
    pub first_ms: f64,
    /// The frames that count.
    pub frames: Vec<Frame>,
    /// Wall time of a frame, ms.
    pub wall_ms: Spread,
    /// Processor time of a frame, of all threads, ms.
    pub cpu_ms: Spread,
    /// Passes, in the order they run.
    pub passes: Vec<PassSpread>,
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// From 0, the first of the warm-up.
    pub frame: u32,
    /// Time in the scene, s.
    pub time: f64,
    /// From its beginning until its counts are read back, ms.
    pub wall_ms: f64,
    /// Processor time of all threads, ms.
    pub cpu_ms: f64,
    /// The frame plan, with times.
    pub passes: Vec<PassTime>,
    /// How much there was to do.
    pub counters: Counters,
}

/// One pass over all frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassSpread {
    /// Name of the pass.
    pub name: String,
    /// Frames in which it ran.
    pub ran: u32,
    /// Its time in those, ms; none where it never ran.
    pub ms: Option<Spread>,
}

/// Numbers of many frames in short.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Half of them are less.
    pub median: f64,
    /// 95 % of them are at most this.
    pub p95: f64,
    /// 99 % of them are at most this.
    pub p99: f64,
    /// The least.
    pub min: f64,
    /// The greatest.
    pub max: f64,
    /// 1.4826 times the median distance from the median: the standard deviation of normal noise.
    pub spread: f64,
}

/// Run time against error in one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// The scene.
    pub scene: String,
    /// Paths a pixel of the reference; none without one.
    pub reference: Option<String>,
    /// What fronts and comparisons at equal error count as run time.
    #[serde(default)]
    pub cost: Cost,
    /// One for each preset, knob, and marcher.
    pub points: Vec<Point>,
}

/// What counts as run time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cost {
    /// Wall time.
    #[default]
    Wall,
    /// Processor time of all threads: where the processor does the work of a graphics card, and other
    /// work on the machine would count in wall time.
    Processor,
}

/// What a point of the curve is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PointKind {
    /// A preset as it is.
    Preset,
    /// The preset high with one number changed.
    Knob,
    /// Rays of eye and sun marched.
    March,
    /// Rays of the eye marched, light from the frame's passes.
    ViewMarch,
}

/// One way to make the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// A name.
    pub name: String,
    /// What it is.
    pub kind: PointKind,
    /// Wall time of a frame, ms.
    pub wall_ms: Spread,
    /// Processor time of a frame, ms.
    pub cpu_ms: Spread,
    /// Against the path-traced reference.
    pub model: Option<PictureError>,
    /// Against the exact compositor with the same light.
    pub algorithm: Option<PictureError>,
    /// Nothing measured here is both quicker and nearer to the reference.
    pub on_model_front: bool,
    /// Nothing measured here is both quicker and nearer to the exact compositor.
    pub on_algorithm_front: bool,
}

impl Point {
    /// Run time of a frame, ms.
    pub fn ms(&self, cost: Cost) -> f64 {
        match cost {
            Cost::Wall => self.wall_ms.median,
            Cost::Processor => self.cpu_ms.median,
        }
    }
}

/// How far a picture is off, over pixels with clouds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PictureError {
    /// Mean error over the reference's mean.
    pub bias: f64,
    /// Mean square error over the reference's square, as `cumuli compare` tells it.
    pub rel_mse: f64,
    /// What of it the reference's own noise makes.
    pub rel_mse_of_noise: f64,
    /// LDR FLIP.
    pub flip: f64,
    /// Pixels that count.
    pub pixels: usize,
}

impl PictureError {
    /// relMSE without the reference's noise; never below a tenth of what was measured, since the
    /// noise is known only so well.
    pub fn without_noise(&self) -> f64 {
        (self.rel_mse - self.rel_mse_of_noise).max(0.1 * self.rel_mse)
    }
}

/// Errors of frames in motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Name of the case.
    pub case: String,
    /// Name of the preset.
    pub preset: String,
    /// The frame of the flight.
    pub frame: u32,
    /// It against the same frame made alone.
    pub alone: PictureError,
    /// Residual between this frame and the one before, along the clouds' motion, RMS over the mean.
    pub flicker: Option<f64>,
    /// The same of the exact compositor.
    pub flicker_of_exact: Option<f64>,
    /// The same of paths; none where it is neither kept nor traced.
    #[serde(default)]
    pub flicker_of_reference: Option<TracedFlicker>,
    /// Pixels over which flicker was measured.
    pub flicker_pixels: usize,
}

/// Flicker by path tracing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TracedFlicker {
    /// RMS over the mean.
    pub flicker: f64,
    /// 95 % of what could have come out lie between these, by the spread over pixels.
    pub interval: [f64; 2],
    /// Pixels that were followed: every sixteenth of those of the other figures.
    pub pixels: usize,
    /// Pairs of paths for each.
    pub pairs: u32,
}

/// Residuals between the frames of a straight flight, with and without cross-fade between rings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Popping {
    /// Name of the case.
    pub case: String,
    /// Name of the preset.
    pub preset: String,
    /// Pairs of frames.
    pub frames: u32,
    /// Rings fade into each other, as they do.
    pub fading: Residual,
    /// Rings end at once.
    pub at_once: Residual,
}

/// What is left between frames along the clouds' motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Residual {
    /// RMS over the mean.
    pub rms: f64,
    /// 99.9 % of the pixels are off by less, over the mean.
    pub most: f64,
    /// Pixels of all pairs that were followed.
    pub pixels: usize,
}

/// Pictures of clumps and scenes, lit in several ways, against path tracing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clumps {
    /// Another seed is another layout.
    pub seed: u64,
    /// One for each clump, eye and sun, and for each scene with a kept reference.
    pub cases: Vec<LitCase>,
    /// What the frame's light costs in a scene; none where it was not asked for.
    pub cost: Option<LightCost>,
}

/// One scene, lit in several ways.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LitCase {
    /// Name of the clump or scene.
    pub case: String,
    /// Name of the preset.
    pub preset: String,
    /// Pixels.
    pub size: [u32; 2],
    /// The file of the reference.
    pub reference: String,
    /// Standard error of the reference's brightness in half of the pixels with clouds at most, over the brightness; none of one path.
    pub noise: Option<f64>,
    /// With the light grid, by octaves, each particle alone.
    pub lit: Vec<Lit>,
    /// relMSE of particles alone over that with the grid, both without the reference's noise.
    pub alone_over_grid: f64,
    /// Times with the grid over those by octaves and of particles alone: each frame made alone, in turn.
    pub times: Vec<Ratio>,
}

/// A picture lit in one way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lit {
    /// How.
    pub lighting: Lighting,
    /// Against the reference.
    pub error: PictureError,
    /// relMSE without the reference's noise.
    pub rel_mse_without_noise: f64,
    /// LDR FLIP of the picture against itself with noise of the reference's standard errors: a picture without error would
    /// have as much.
    pub flip_of_noise: f64,
    /// Wall time of a frame that takes nothing over from others, ms.
    pub wall_ms: Spread,
    /// Processor time of the same, ms.
    pub cpu_ms: Spread,
}

/// What light among particles costs in frames that follow each other, as in a window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightCost {
    /// Name of the case.
    pub case: String,
    /// Name of the preset.
    pub preset: String,
    /// Pixels.
    pub size: [u32; 2],
    /// Frames: at least one turn of the light grid.
    pub frames: u32,
    /// Mean time of the passes of a frame that are there for this light, ms.
    pub passes_ms: Vec<(String, f64)>,
    /// Mean time of all passes of a frame, ms.
    pub frame_ms: f64,
    /// The first over the second.
    pub share: f64,
    /// The same in a frame made alone, which solves for the whole grid.
    pub share_alone: f64,
    /// Times of these frames over those of frames lit by octaves, in turn.
    pub over_octaves: Vec<Ratio>,
}

/// A ratio of two run times with its noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// Name of the case.
    pub case: String,
    /// What was measured: "wall", "cpu", or a pass.
    pub what: String,
    /// The first, ms.
    pub old_ms: f64,
    /// The second, ms.
    pub new_ms: f64,
    /// Second over first, of the medians.
    pub ratio: f64,
    /// 95 % of bootstrap ratios lie between these.
    pub interval: [f64; 2],
}

impl Ratio {
    /// Whether the change is larger than its noise.
    pub fn is_change(&self) -> bool {
        self.interval[0] > 1.0 || self.interval[1] < 1.0
    }
}
