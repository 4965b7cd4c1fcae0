//! `cumuli bench`: run time against error.

use std::path::{Path, PathBuf};

use clap::Args;

use super::args::Size;
use super::progress::{Progress, StageBar};
use super::render::{eprint_line, load_scene, tables_name, this_program};
use super::{args, engine, print};
use crate::bench::clumps::{ClumpOrder, table};
use crate::bench::record::Bench;
use crate::bench::run::Flight;
use crate::bench::session::{Listener, Order, REFERENCE_SIZE, tables_for};
use crate::bench::variants::Setting;
use crate::bench::{compare, readme, report, tables};
use crate::error::{Error, Result};
use crate::frame::Preset;
use crate::gpu::Gpu;
use crate::output::{check_file, check_folder, write_atomically};
use crate::reference::check_composed;
use crate::tables::TableSet;

/// Arguments of `cumuli bench`.
#[derive(Args, Debug)]
pub struct BenchArgs {
    /// Scene file, paused and animated, in place of the built-in cases; may be given again
    #[arg(long, value_name = "FILE")]
    pub scene: Vec<PathBuf>,
    /// Preset of the cases [default: high, with --quick low]; may be given again
    #[arg(long, value_enum)]
    pub preset: Vec<Preset>,
    /// Width and height in pixels [default: 640x360, with --quick 256x144, with --clumps 96x54]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
    /// Frames before the first that counts [default: 2, with --quick 1]
    #[arg(long, value_name = "N", value_parser = args::frame_count)]
    pub warmup: Option<u32>,
    /// Frames that count [default: 32, with --quick 3, with --clumps 5]
    #[arg(long, value_name = "N", value_parser = args::frame_count)]
    pub frames: Option<u32>,
    /// Folder for bench.json, bench.csv, trace.json and report.html
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    pub out: PathBuf,
    /// Few frames, one scene, and what of it takes less than two minutes on a software driver
    #[arg(long)]
    pub quick: bool,
    /// In place of the cases: how much longer the blend takes than its look-ups alone, ray marchers than the frame at equal
    /// error, frames with one more ring, with ten times the particles, with clouds out of view than without any, and when
    /// nothing changes; and what borders of rings do to a straight flight
    #[arg(long, conflicts_with_all = ["scene", "against", "readme", "more_tables", "spp", "flicker_pairs"])]
    pub ratios: bool,
    /// In place of the cases: clumps of 200 overlapping particles of optical thickness 5, 20 and 60, the sun in front, beside
    /// and behind, the eye outside and inside, and the scenes with references, lit with the light grid, by octaves and
    /// each particle alone, against path tracing, whose pictures stay in --out
    #[arg(long, conflicts_with_all = ["scene", "against", "ratios", "quick", "more_tables", "flicker_pairs", "warmup"])]
    pub clumps: bool,
    /// Another seed is another layout of --clumps
    #[arg(long, value_name = "N", default_value = "0", requires = "clumps")]
    pub seed: u64,
    /// Only cases of --clumps with this in their names, or, as `cost`, what light costs; may be given again
    #[arg(long, value_name = "TEXT", requires = "clumps")]
    pub only: Vec<String>,
    /// A preset that takes turns with the first, frame by frame; the ratio is told with its noise
    #[arg(long, value_enum, value_name = "PRESET")]
    pub against: Option<Preset>,
    /// A number in place of the presets': steps, transmittance_stop, shadow_steps,
    /// shadow_resolution, air_steps, tile_size, grid_fineness, grid_slice, pixel_stride, or scale (of curves); may be
    /// given again
    #[arg(long, value_name = "NAME=NUMBER")]
    pub set: Vec<Setting>,
    /// Folder of path-traced references, NAME.exr for each scene
    #[arg(long, value_name = "DIR", default_value = "tests/references")]
    pub references: PathBuf,
    /// Trace references that are not there, with so many paths a pixel [with --clumps, default: 256]
    #[arg(long, value_name = "N", value_parser = args::samples_a_pixel)]
    pub spp: Option<u32>,
    /// Trace the reference's own flicker where it is not kept, with so many pairs of paths a pixel (20000
    /// take a quarter of an hour of a processor), and keep it in the folder of references
    #[arg(long, value_name = "N", value_parser = args::samples_a_pixel)]
    pub flicker_pairs: Option<u32>,
    /// Table file made by precompute; without it, the built-in tables
    #[arg(long, value_name = "FILE")]
    pub tables: Option<PathBuf>,
    /// Another table file with the same shapes, a point of run time against error; may be given again
    #[arg(long, value_name = "FILE")]
    pub more_tables: Vec<PathBuf>,
    /// Make the table of presets, or of --clumps, between the marks of this file anew
    #[arg(long, value_name = "FILE")]
    pub readme: Option<PathBuf>,
    /// Measure nothing, but set one bench.json against another: ratios with their noise
    #[arg(long, value_names = ["OLD.json", "NEW.json"], num_args = 2,
        conflicts_with_all = ["scene", "preset", "size", "warmup", "frames", "quick", "ratios", "against",
            "set", "spp", "flicker_pairs", "clumps", "tables", "more_tables", "readme", "out", "references"])]
    pub compare: Option<Vec<PathBuf>>,
}

/// Pixels of clumps: their light changes slowly over the picture, and paths take long.
const CLUMP_SIZE: [u32; 2] = [96, 54];
/// Paths a pixel: standard errors below 5 % in half of the pixels.
const CLUMP_PATHS: u32 = 256;
/// Frames of each lighting whose times are taken.
const CLUMP_FRAMES: u32 = 5;
/// What the cost of light is called among the cases.
const COST: &str = "cost";
/// Pixels of the frames in which the cost of light is measured: fewer than a window has, where its share is smaller.
const COST_SIZE: [u32; 2] = [640, 360];
/// How many: ten a second, of an epoch of the default scene's light, 3.5 s.
const COST_FRAMES: u32 = 35;

/// Shows how far the bench is.
#[derive(Default)]
struct Bar(Option<Progress>);

impl Bar {
    fn end(&mut self) {
        if let Some(bar) = self.0.take() {
            bar.finish();
        }
    }
}

impl Listener for Bar {
    fn begin(&mut self, steps: u64, what: &'static str) {
        self.end();
        self.0 = Some(Progress::new(steps, what));
    }

    fn step(&mut self) {
        if let Some(bar) = &self.0 {
            bar.step(false);
        }
    }
}

/// Runs the command.
pub(super) fn run(args: &BenchArgs) -> Result<()> {
    if let Some([old, new]) = args.compare.as_deref() {
        return compare_files(old, new);
    }
    check_folder(&args.out)?;
    let readme = args.readme.as_deref().map(|path| read(path, "a text")).transpose()?;
    // Before anything is measured.
    if let (Some(path), Some(text)) = (&args.readme, &readme) {
        readme::around(text, &path.display().to_string(), args.clumps)?;
    }
    let mut order = order(args)?;
    let tables = engine::tables_of(args.tables.as_deref())?;
    let tables = tables_for(&order.scenes, tables, &StageBar::new())?;
    for path in &args.more_tables {
        let more = more_tables(path, &tables)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        order.more_tables.push((name, tables_for(&order.scenes, more, &StageBar::new())?));
    }
    let gpu = Gpu::headless()?;
    let mut bar = Bar::default();
    let bench = order.run(&gpu, &tables, &mut bar);
    bar.end();
    let bench = bench?;
    let refreshed = match (&args.readme, readme) {
        (Some(path), Some(text)) => {
            Some((path, readme::refreshed(&text, &path.display().to_string(), &bench)?))
        }
        _ => None,
    };
    match &bench.clumps {
        Some(clumps) => {
            write_text(&args.out.join("clumps.csv"), &table::csv(clumps))?;
            write_text(&args.out.join("bench.json"), &json(&bench)?)?;
        }
        None => write(&args.out, &bench)?,
    }
    if let Some((path, text)) = refreshed {
        write_text(path, &text)?;
    }
    bench.clumps.iter().flat_map(table::lines).try_for_each(|line| print(&line))?;
    compare::lines(&bench.against)
        .iter()
        .filter(|_| !bench.against.is_empty())
        .try_for_each(|line| print(line))?;
    print(&bench.summary())?;
    bench.check()
}

fn order(args: &BenchArgs) -> Result<Order> {
    let mut scenes: Vec<(String, _)> = Vec::new();
    for path in &args.scene {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        // Figures and references are told apart by it.
        if scenes.iter().any(|(other, _)| *other == stem) {
            let message = format!("expected files of different names, found `{stem}` twice");
            return Err(Error::input("--scene", message));
        }
        let scene = load_scene(Some(path))?.0;
        // Errors are those to the exact compositor, too.
        check_composed(&scene).map_err(|e| match e {
            Error::Input { place, message } => {
                Error::input(format!("{}: {place}", path.display()), message)
            }
            other => other,
        })?;
        scenes.push((stem, scene));
    }
    let default = if args.quick { Preset::Low } else { Preset::High };
    let presets = if args.preset.is_empty() { vec![default] } else { args.preset.clone() };
    if let Some(twice) = presets.iter().enumerate().find(|(i, p)| presets[..*i].contains(p)) {
        return Err(Error::input("--preset", format!("`{}` is given twice", twice.1)));
    }
    if args.against.is_some_and(|against| presets.contains(&against)) {
        return Err(Error::input("--against", "expected another preset than --preset"));
    }
    let quick = |quick: u32, full: u32| if args.quick { quick } else { full };
    let size = match (args.quick, args.clumps) {
        (_, true) => CLUMP_SIZE,
        (true, _) => REFERENCE_SIZE,
        _ => [640, 360],
    };
    let frames = if args.clumps { CLUMP_FRAMES } else { quick(3, 32) };
    let has_cost = args.only.is_empty() || args.only.iter().any(|name| name == COST);
    let clumps = args.clumps.then(|| ClumpOrder {
        seed: args.seed,
        only: args.only.clone(),
        folder: args.out.clone(),
        program: this_program(),
        spp: args.spp.unwrap_or(CLUMP_PATHS),
        cost: has_cost.then_some((COST_SIZE, COST_FRAMES)),
    });
    Ok(Order {
        scenes,
        presets,
        against: args.against,
        set: args.set.clone(),
        flight: Flight {
            size: args.size.map_or(size, |size| size.0),
            warmup: args.warmup.unwrap_or(quick(1, 2)),
            frames: args.frames.unwrap_or(frames),
        },
        clumps,
        ratios: args.ratios,
        quick: args.quick,
        references: args.references.clone(),
        spp: args.spp,
        flicker_pairs: args.flicker_pairs,
        tables: tables_name(args.tables.as_deref())?,
        more_tables: Vec::new(),
    })
}

/// Tables to compare with others. They must hold the same shapes: clouds take all that there are.
fn more_tables(path: &Path, others: &TableSet) -> Result<TableSet> {
    let tables = TableSet::load(path)?;
    if !tables.shape_names().eq(others.shape_names()) {
        let names = others.shape_names().collect::<Vec<_>>().join(", ");
        let message = format!("expected tables of the shapes {names}, in this order");
        return Err(Error::input(format!("--more-tables {}", path.display()), message));
    }
    Ok(tables)
}

fn no_json(e: serde_json::Error) -> Error {
    Error::Failed(format!("JSON: {e}"))
}

fn json(bench: &Bench) -> Result<String> {
    Ok(serde_json::to_string_pretty(bench).map_err(no_json)? + "\n")
}

fn write(folder: &Path, bench: &Bench) -> Result<()> {
    let trace = serde_json::to_string(&tables::trace(bench)).map_err(no_json)? + "\n";
    let files = [
        ("bench.csv", tables::csv(bench)?),
        ("trace.json", trace),
        ("report.html", report::html(bench)?),
        // Last: where it is there, the others are.
        ("bench.json", json(bench)?),
    ];
    for (name, text) in files {
        write_text(&folder.join(name), &text)?;
    }
    Ok(())
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    check_file(path)?;
    write_atomically(path, |out| out.write_all(text.as_bytes()))?;
    print(&path.display().to_string())
}

/// Reads a file that the user names.
fn read(path: &Path, what: &str) -> Result<String> {
    std::fs::read_to_string(path).map_err(|e| {
        Error::input(path.display().to_string(), format!("cannot be read ({e}), expected {what}"))
    })
}

fn compare_files(old: &PathBuf, new: &PathBuf) -> Result<()> {
    let [old, new] = [old, new].map(|path| -> Result<Bench> {
        compare::read(&read(path, "a bench.json")?, &path.display().to_string())
    });
    let (old, new) = (old?, new?);
    for difference in compare::differences(&old, &new) {
        eprint_line(&format!("not measured alike: {difference}"));
    }
    let ratios = compare::ratios(&old, &new);
    if ratios.is_empty() {
        return Err(Error::input("--compare", "the two have no case and preset in common"));
    }
    compare::lines(&ratios).iter().try_for_each(|line| print(line))
}
