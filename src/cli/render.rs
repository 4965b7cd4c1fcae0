//! `cumuli render`: one picture, or a sequence of frames.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::args::{self, Size};
use super::print;
use super::progress::Progress;
use super::truth::TruthArgs;
use crate::error::{Error, Result};
use crate::frame::{FrameStats, Lighting, OpaquePicture, Picture, Preset, Quality, RenderSettings};
use crate::output::{
    self, Format, FrameRange, FrameState, Sequence, SequenceKey, SequenceReport, VideoTarget,
    check_target, write_atomically, write_picture, write_video,
};
use crate::scene::{CameraPath, DEFAULT_SCENE, Scene};

/// Arguments of `cumuli render`.
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// Scene file; without it, the built-in fair-weather cumulus
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720")]
    pub size: Size,
    /// Time of the picture, or of frame 0, in seconds
    #[arg(long, value_name = "S", default_value = "0", value_parser = args::time, allow_negative_numbers = true)]
    pub time: f64,
    /// Quality against time
    #[arg(long, value_enum, default_value = "high")]
    pub preset: Preset,
    /// How the light that clouds scatter among themselves is found: grid is solved for; octaves of attenuated sunlight and
    /// each particle alone are there to compare with [default: the preset's]
    #[arg(long, value_enum, value_name = "NAME", conflicts_with_all = ["reference", "exact"])]
    pub lighting: Option<Lighting>,
    /// The picture (.png or .exr), or with --frames the folder for the frames
    #[arg(long, value_name = "PATH")]
    pub out: PathBuf,
    /// Render a sequence: frames A to B, without B; frames that are there already are kept
    #[arg(long, value_name = "A..B")]
    pub frames: Option<FrameRange>,
    /// Frames per second of the scene's time
    #[arg(long, value_name = "N", default_value = "25", value_parser = args::fps, requires = "frames")]
    pub fps: f64,
    /// Format of the frames
    #[arg(long, value_enum, default_value = "png", requires = "frames")]
    pub format: Format,
    /// The camera follows a path: a TOML file of key times, positions and orientations; its time
    /// counts from frame 0
    #[arg(long, value_name = "FILE", requires = "frames")]
    pub path: Option<PathBuf>,
    /// Make a video of the frames too, by ffmpeg; `-` writes Y4M to standard output, and a name that
    /// ends in .y4m into a file
    #[arg(long, value_name = "FILE", requires = "frames", conflicts_with = "truth")]
    pub video: Option<PathBuf>,
    /// Frames per second that the video shows
    #[arg(long, value_name = "N", default_value = "25", value_parser = args::fps, requires = "video")]
    pub video_fps: f64,
    /// Replace frames of another scene or of other settings in the folder
    #[arg(long, requires = "frames")]
    pub overwrite: bool,
    /// Opaque things in the picture, seen by the scene's camera: an OpenEXR file of the picture's size with the
    /// channels distance (along the rays) or Z (along the view axis), m, R, G, B (radiance), and where clouds are to
    /// throw their shadow on them sunlit.R, sunlit.G, sunlit.B (what direct sunlight adds)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["frames", "reference"])]
    pub opaque: Option<PathBuf>,
    /// Table file made by precompute; without it, the built-in tables
    #[arg(long, value_name = "FILE")]
    pub tables: Option<PathBuf>,
    /// Print the time and the reason of each pass of the last frame to standard error
    #[arg(long)]
    pub timings: bool,
    /// Write the statistics of each rendered frame to a JSON file
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Reference pictures.
    #[command(flatten)]
    pub truth: TruthArgs,
}

/// A checked order for pictures: everything that can be known to be wrong without a graphics
/// device has been refused.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scene.
    pub scene: Scene,
    /// The scene's name in errors.
    pub place: String,
    /// What the renderer is made for.
    pub settings: RenderSettings,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Opaque things in the picture.
    pub opaque: Option<OpaquePicture>,
    target: Target,
    path: Option<CameraPath>,
    video: Option<(VideoTarget, f64)>,
    timings: bool,
    stats: Option<PathBuf>,
}

#[derive(Clone, Debug)]
enum Target {
    Picture { path: PathBuf, time: f64 },
    Sequence(Sequence),
}

/// Statistics of a frame, for the JSON file.
#[derive(Serialize)]
struct FrameRecord {
    frame: u32,
    time: f64,
    #[serde(flatten)]
    stats: FrameStats,
}

impl Job {
    /// Reads the scene and checks where the pictures go.
    pub fn new(args: &RenderArgs) -> Result<Self> {
        let (scene, place) = load_scene(args.scene.as_deref())?;
        let path = args.path.as_deref().map(CameraPath::load).transpose()?;
        if let Some(stats) = &args.stats {
            output::check_file(stats)?;
            if *stats == args.out {
                return Err(Error::input("--stats", "expected another file than --out"));
            }
        }
        if args.video.is_some() && args.format != Format::Png {
            return Err(Error::input("--video", "is made of PNG frames, expected --format png"));
        }
        let video = args.video.as_deref().map(VideoTarget::of).transpose()?;
        let target = match args.frames {
            None => {
                check_target(&args.out)?;
                Target::Picture { path: args.out.clone(), time: args.time }
            }
            Some(frames) => {
                let key = SequenceKey {
                    program: this_program(),
                    scene: scene.identity()?,
                    tables: tables_name(args.tables.as_deref())?,
                    size: args.size.0,
                    preset: Some(args.preset),
                    lighting: args.lighting,
                    reference: None,
                    start_time: args.time,
                    fps: args.fps,
                    path: path.as_ref().map(CameraPath::to_toml).transpose()?,
                };
                let sequence = Sequence {
                    key,
                    frames,
                    format: args.format,
                    folder: args.out.clone(),
                    replace: args.overwrite,
                };
                sequence.check()?;
                // The scene is the same for all frames, so their times are what is left to check.
                for frame in [frames.start, frames.end - 1] {
                    crate::scene::check_time("--frames", sequence.key.time(frame))?;
                }
                Target::Sequence(sequence)
            }
        };
        let read = |path: &PathBuf| output::read_opaque(path, &scene.camera, args.size.0);
        let opaque = args.opaque.as_ref().map(read).transpose()?;
        Ok(Self {
            scene,
            place,
            opaque,
            settings: RenderSettings {
                preset: args.preset,
                quality: args.lighting.map(|l| Quality { lighting: l, ..args.preset.quality() }),
                time_passes: args.timings,
                ..Default::default()
            },
            size: args.size.0,
            target,
            path,
            video: video.map(|target| (target, args.video_fps)),
            timings: args.timings,
            stats: args.stats.clone(),
        })
    }

    /// Renders what is asked for. `render` makes the picture of a scene at a time in seconds.
    pub fn run(&self, mut render: impl FnMut(&Scene, f64) -> Result<Picture>) -> Result<()> {
        let mut records = Vec::new();
        match &self.target {
            Target::Picture { path, time } => {
                let picture = render(&self.scene, *time)?;
                write_picture(path, &picture)?;
                print(&path.display().to_string())?;
                records.push(FrameRecord { frame: 0, time: *time, stats: picture.stats });
            }
            Target::Sequence(sequence) => self.run_sequence(sequence, render, &mut records)?,
        }
        if let (true, Some(record)) = (self.timings, records.last()) {
            eprint_timings(&record.stats);
        }
        if let Some(path) = &self.stats {
            write_atomically(path, |out| {
                serde_json::to_writer_pretty(&mut *out, &records).map_err(std::io::Error::other)?;
                out.write_all(b"\n")
            })?;
            print(&path.display().to_string())?;
        }
        Ok(())
    }

    fn run_sequence(
        &self,
        sequence: &Sequence,
        mut render: impl FnMut(&Scene, f64) -> Result<Picture>,
        records: &mut Vec<FrameRecord>,
    ) -> Result<()> {
        let mut scene = self.scene.clone();
        let progress = Progress::new(u64::from(sequence.frames.count()), "frames");
        let keep_stats = self.stats.is_some();
        let report = sequence.run(
            |frame, time| {
                if let Some(path) = &self.path {
                    let since_first = f64::from(frame) / sequence.key.fps;
                    scene.camera = path.camera(since_first, &self.scene.camera);
                }
                let mut picture = render(&scene, time)?;
                // Without a file for them, the last frame's statistics are enough.
                if !keep_stats {
                    records.clear();
                }
                let stats = std::mem::take(&mut picture.stats);
                records.push(FrameRecord { frame, time, stats });
                Ok(picture)
            },
            |_, state, _| progress.step(state == FrameState::Kept),
        );
        progress.finish();
        let report = report?;
        match &self.video {
            None => print_report(sequence, report),
            Some((target, rate)) => {
                let numbers = sequence.frames.start..sequence.frames.end;
                let frames: Vec<_> = numbers.map(|frame| sequence.path(frame)).collect();
                write_video(target, &frames, self.size, *rate)?;
                match target {
                    // It carries the video.
                    VideoTarget::StandardOutput => Ok(()),
                    VideoTarget::Y4m(path) | VideoTarget::Encoded(path) => {
                        print_report(sequence, report)?;
                        print(&path.display().to_string())
                    }
                }
            }
        }
    }
}

/// What a sequence came to.
pub(super) fn print_report(sequence: &Sequence, report: SequenceReport) -> Result<()> {
    let first = sequence.path(sequence.frames.start);
    let last = sequence.path(sequence.frames.end - 1);
    eprint_line(&format!("frames written: {}, kept: {}", report.written, report.kept));
    print(&first.display().to_string())?;
    if first != last {
        print(&last.display().to_string())?;
    }
    Ok(())
}

/// Runs the command.
pub(super) fn run(args: &RenderArgs) -> Result<()> {
    if args.truth.reference {
        return super::render_reference::run(args);
    }
    if args.truth.exact {
        return super::render_exact::run(args);
    }
    let job = Job::new(args)?;
    let render = super::engine::renderer(&job, args.tables.as_deref())?;
    job.run(render)
}

/// The named scene, or the built-in one, with its name for errors.
pub(super) fn load_scene(path: Option<&Path>) -> Result<(Scene, String)> {
    match path {
        Some(path) => Ok((Scene::load(path)?, path.display().to_string())),
        None => {
            let place = "the built-in scene".to_owned();
            Ok((Scene::from_toml(DEFAULT_SCENE, &place, Path::new(""))?, place))
        }
    }
}

/// What tells these tables from others.
pub(super) fn tables_name(path: Option<&Path>) -> Result<String> {
    match path {
        // What is no readable file is refused when it is read as a table.
        Some(path) if path.is_file() => output::fingerprint(path),
        Some(path) => Ok(path.display().to_string()),
        None => Ok("embedded".to_owned()),
    }
}

/// Version and contents of the program: another build may make other pictures.
pub(super) fn this_program() -> String {
    let version = env!("CARGO_PKG_VERSION");
    let contents = std::env::current_exe().ok().and_then(|path| output::fingerprint(&path).ok());
    contents.map_or_else(|| version.to_owned(), |contents| format!("{version} {contents}"))
}

/// A table of passes: name, time, whether it ran and why.
fn eprint_timings(stats: &FrameStats) {
    let width = stats.passes.iter().map(|p| p.name.len()).max().unwrap_or(0);
    for pass in &stats.passes {
        let time = match pass.milliseconds {
            Some(ms) => format!("{ms:9.3} ms"),
            None if pass.ran => "  no timer".to_owned() + "  ",
            None => "   skipped".to_owned() + "  ",
        };
        eprint_line(&format!("{:width$} {time}  {}", pass.name, pass.reason));
    }
    eprint_line(&format!("{:?}", stats.counters));
}

/// A line to standard error, which may be closed.
pub(super) fn eprint_line(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
