//! `cumuli render --reference`: a picture by path tracing that can be stopped at any moment and
//! goes on where it stopped.

use std::path::Path;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::engine::tables_of;
use super::progress::Progress;
use super::render::{RenderArgs, load_scene, tables_name, this_program};
use super::truth::Files;
use crate::error::{Error, Result};
use crate::output::fingerprint_of;
use crate::reference::{Exposure, Film, partial, picture};
use crate::scene::Scene;

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

/// Runs the command.
pub(super) fn run(args: &RenderArgs) -> Result<()> {
    let (scene, place) = load_scene(args.scene.as_deref())?;
    let files = args.truth.files(&args.out)?;
    let partial_path = files.partial()?;
    let exposure = args.truth.exposure(args.size.0, args.time)?;
    let tables = tables_of(args.tables.as_deref())?;
    scene.check_shapes(&place, &tables.shape_names().collect::<Vec<_>>())?;
    let key = Key {
        program: this_program(),
        scene: fingerprint_of(scene.to_toml()?.as_bytes()),
        tables: tables_name(args.tables.as_deref())?,
        exposure: &exposure,
    };
    let key = serde_json::to_string(&key).map_err(|e| Error::Failed(format!("JSON: {e}")))?;
    let wanted = args.truth.spp;
    let mut film = begin(&partial_path, &key, &exposure, wanted)?;

    let height = u64::from(exposure.size[1]);
    let done = |film: &Film| u64::from(film.samples) * height + u64::from(film.rows);
    let progress = Progress::new(u64::from(wanted) * height, "rows of samples");
    progress.advance(done(&film), true);
    let mut saved = Saved::new(done(&film), Duration::from_secs_f64(args.truth.save_every));
    let expose = || {
        exposure.expose(&scene, &tables, &mut film, wanted, |film| {
            progress.advance(done(film) - saved.rows, false);
            saved.rows = done(film);
            if saved.is_due() {
                let start = Instant::now();
                partial::save(&partial_path, &key, film)?;
                if film.samples > 0 {
                    write(&files, &scene, film)?;
                }
                saved.at(start);
            }
            Ok(())
        })
    };
    on_threads(args.truth.threads, expose)??;
    progress.finish();
    write(&files, &scene, &film)?;
    remove(&partial_path)?;
    files.print()
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
    rows: u64,
    last: Instant,
    every: Duration,
    wait: Duration,
}

impl Saved {
    fn new(rows: u64, every: Duration) -> Self {
        Self { rows, last: Instant::now(), every, wait: every }
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
