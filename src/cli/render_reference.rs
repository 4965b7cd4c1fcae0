//! `cumuli render --reference`: a picture by path tracing that can be stopped at any moment and
//! goes on where it stopped.

use std::path::Path;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::engine::tables_of;
use super::progress::Progress;
use super::render::{RenderArgs, eprint_line, load_scene, print_report, tables_name, this_program};
use super::truth::Files;
use crate::error::{Error, Result};
use crate::output::{FrameRange, Sequence, SequenceKey, fingerprint_of};
use crate::reference::{Exposure, Film, partial, picture};
use crate::scene::{CameraPath, Scene, check_time};
use crate::tables::TableSet;

/// Saving takes at most one part in so many of the time.
const SAVE_SHARE: u32 = 20;

/// What samples belong to: those of another picture are never mixed in.
#[derive(Serialize)]
struct Key<'a> {
    program: String,
    scene: String,
    tables: String,
    #[serde(flatten)]
    exposure: &'a Exposure,
}

/// Everything that the pictures of a command share.
struct Work<'a> {
    args: &'a RenderArgs,
    scene: Scene,
    path: Option<CameraPath>,
    tables: TableSet,
    tables_name: String,
}

/// Runs the command.
pub(super) fn run(args: &RenderArgs) -> Result<()> {
    let (scene, place) = load_scene(args.scene.as_deref())?;
    let tables_name = tables_name(args.tables.as_deref())?;
    if let Some(frames) = args.frames {
        let path = args.path.as_deref().map(CameraPath::load).transpose()?;
        let sequence = sequence(args, &scene, &tables_name, frames, path.as_ref())?;
        let mut work = Work::new(args, scene, &place, tables_name)?;
        work.path = path;
        return work.sequence(&sequence);
    }
    let files = args.truth.files(&args.out)?;
    let work = Work::new(args, scene, &place, tables_name)?;
    work.picture(&work.scene, &files, args.time, true)?;
    files.print()
}

/// Frames to be written, checked.
fn sequence(
    args: &RenderArgs,
    scene: &Scene,
    tables: &str,
    frames: FrameRange,
    path: Option<&CameraPath>,
) -> Result<Sequence> {
    // The time of each frame is the sequence's own.
    let exposure = args.truth.exposure(&scene.camera, args.size.0, args.time)?;
    let reference = serde_json::to_string(&(&exposure, args.truth.spp))
        .map_err(|e| Error::Failed(format!("JSON: {e}")))?;
    let key = SequenceKey {
        program: this_program(),
        scene: scene.identity()?,
        tables: tables.to_owned(),
        size: args.size.0,
        preset: None,
        lighting: None,
        reference: Some(reference),
        start_time: args.time,
        fps: args.fps,
        path: path.map(CameraPath::to_toml).transpose()?,
    };
    let (folder, replace) = (args.out.clone(), args.overwrite);
    let sequence = Sequence { key, frames, format: args.format, folder, replace };
    sequence.check()?;
    for frame in [frames.start, frames.end - 1] {
        check_time("--frames", sequence.key.time(frame) + exposure.shutter)?;
    }
    Ok(sequence)
}

impl<'a> Work<'a> {
    fn new(args: &'a RenderArgs, scene: Scene, place: &str, tables_name: String) -> Result<Self> {
        let tables = tables_of(args.tables.as_deref())?;
        scene.check_shapes(place, &tables.shape_names().collect::<Vec<_>>())?;
        Ok(Self { args, scene, path: None, tables, tables_name })
    }

    fn sequence(&self, sequence: &Sequence) -> Result<()> {
        let mut scene = self.scene.clone();
        let make = |frame: u32, time: f64, path: &Path| {
            eprint_line(&format!("frame {frame} of {}", sequence.frames));
            // A frame that is there counts as finished: what there is of one stays apart until it is.
            if let Some(path) = &self.path {
                let since_first = f64::from(frame) / sequence.key.fps;
                scene.camera = path.camera(since_first, &self.scene.camera);
            }
            self.picture(&scene, &self.args.truth.frame(path), time, false)
        };
        let report = sequence.run_files(make, |_, _, _| {})?;
        print_report(sequence, report)
    }

    /// Makes one picture; `early` writes what there is of it while it goes on.
    fn picture(&self, scene: &Scene, files: &Files, time: f64, early: bool) -> Result<()> {
        let args = self.args;
        let partial_path = files.partial()?;
        let exposure = args.truth.exposure(&scene.camera, args.size.0, time)?;
        let key = Key {
            program: this_program(),
            scene: fingerprint_of(scene.identity()?.as_bytes()),
            tables: self.tables_name.clone(),
            exposure: &exposure,
        };
        let key = serde_json::to_string(&key).map_err(|e| Error::Failed(format!("JSON: {e}")))?;
        let wanted = args.truth.spp;
        if args.overwrite
            && !matches!(
                partial::load(&partial_path, &key, exposure.size)?,
                partial::Found::Same(_)
            )
        {
            remove(&partial_path)?;
        }
        let mut film = begin(&partial_path, &key, &exposure, wanted)?;

        let progress = Progress::new(all_paths(&film, &exposure, wanted), "paths");
        progress.advance(film.total(), true);
        let mut saved = Saved::new(film.total(), Duration::from_secs_f64(args.truth.save_every));
        let expose = || {
            exposure.expose(scene, &self.tables, &mut film, wanted, |film| {
                progress.set_length(all_paths(film, &exposure, wanted));
                let done = film.total();
                progress.advance(done - saved.paths, false);
                saved.paths = done;
                if saved.is_due() {
                    let start = Instant::now();
                    partial::save(&partial_path, &key, film)?;
                    if early && film.samples > 0 {
                        write(files, scene, film)?;
                    }
                    saved.at(start);
                }
                Ok(())
            })
        };
        on_threads(args.truth.threads, expose)??;
        progress.finish();
        write(files, scene, &film)?;
        remove(&partial_path)
    }
}

/// Paths of the whole picture, as far as that is known: before it is decided how many each pixel
/// gets, as if it were the most.
fn all_paths(film: &Film, exposure: &Exposure, wanted: u32) -> u64 {
    if film.wanted.is_empty() {
        return u64::from(wanted) * exposure.size.map(u64::from).iter().product::<u64>();
    }
    film.wanted.iter().map(|n| u64::from(*n)).sum()
}

/// The samples there are.
fn begin(path: &Path, key: &str, exposure: &Exposure, wanted: u32) -> Result<Film> {
    let refuse = |message: &str| Err(Error::input(path.display().to_string(), message));
    match partial::load(path, key, exposure.size)? {
        partial::Found::Nothing => Ok(Film::new(exposure.size)),
        partial::Found::Same(film)
            if film.samples > wanted || film.samples == wanted && film.rows > 0 =>
        {
            refuse("holds more samples a pixel than --spp asks for; ask for more, or remove it")
        }
        partial::Found::Same(film) => Ok(film),
        partial::Found::Other => refuse(
            "holds samples of another scene, of other settings, or of another build of the \
             program; remove it, or name another --out",
        ),
    }
}

fn write(files: &Files, scene: &Scene, film: &Film) -> Result<()> {
    files.write(&film.layers(), &picture(scene, film.size, film.radiance()))
}

fn remove(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(path, "remove", e)),
        _ => Ok(()),
    }
}

fn on_threads<R: Send>(threads: Option<usize>, work: impl FnOnce() -> R + Send) -> Result<R> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0));
    let pool = builder.build().map_err(|e| Error::Failed(format!("threads: {e}")))?;
    Ok(pool.install(work))
}

/// When what there is was saved last.
struct Saved {
    paths: u64,
    last: Instant,
    every: Duration,
    wait: Duration,
}

impl Saved {
    fn new(paths: u64, every: Duration) -> Self {
        Self { paths, last: Instant::now(), every, wait: every }
    }

    fn is_due(&self) -> bool {
        self.last.elapsed() >= self.wait
    }

    /// It has been saved, from `start` to now.
    fn at(&mut self, start: Instant) {
        self.wait = self.every.max(start.elapsed() * SAVE_SHARE);
        self.last = Instant::now();
    }
}
