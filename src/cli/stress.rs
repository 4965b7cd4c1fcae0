//! `cumuli stress`: every number of every buffer, at the corners of what is allowed and at random.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::args::{self, Size};
use super::print;
use super::progress::Progress;
use crate::error::{Error, Result};
use crate::frame::{Picture, Preset};
use crate::output::{check_file, check_folder, write_atomically, write_picture};
use crate::stress::corners::corners;
use crate::stress::large::large;
use crate::stress::soak::{Moment, STEP, soak};
use crate::stress::{Case, MEDIA, Row, Stress, random};

/// Most random scenes: they take weeks, and their rows some hundred MiB.
const MOST_CASES: u64 = 1_000_000;

/// Arguments of `cumuli stress`.
#[derive(Args, Debug)]
pub struct StressArgs {
    /// Random scenes, after all corners; up to a million
    #[arg(long, value_name = "N", default_value = "200",
          value_parser = clap::value_parser!(u64).range(..=MOST_CASES))]
    pub cases: u64,
    /// Another seed draws other scenes
    #[arg(long, value_name = "N", default_value = "0")]
    pub seed: u64,
    /// Only cases with this in their name
    #[arg(long, value_name = "NAME")]
    pub only: Option<String>,
    /// Width and height in pixels, where a case is not about it
    #[arg(long, value_name = "WxH", default_value = "16x9")]
    pub size: Size,
    /// Quality; without it, high at the corners and any at random
    #[arg(long, value_enum)]
    pub preset: Option<Preset>,
    /// The cases too that take gigabytes or minutes: 8K, a row of 300,000, a million particles
    #[arg(long)]
    pub large: bool,
    /// In place of all cases: fly for so many seconds of the scene's time, a frame every two, and
    /// tell whether memory or the work of a frame grows (Linux)
    #[arg(long, value_name = "SECONDS", value_parser = args::interval)]
    pub soak: Option<f64>,
    /// Print failed cases and the summary only
    #[arg(long)]
    pub quiet: bool,
    /// Write the rows as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the scenes and pictures of failed cases into this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// The JSON file.
#[derive(Serialize)]
struct Report<'a> {
    cases: usize,
    failed: usize,
    numbers: u64,
    rows: &'a [Row],
}

/// Runs the command. Exit code 1 where a case fails.
pub(super) fn run(args: &StressArgs) -> Result<()> {
    if let Some(json) = &args.json {
        check_file(json)?;
    }
    if let Some(folder) = &args.out {
        check_folder(folder)?;
    }
    if let Some(seconds) = args.soak {
        return run_soak(seconds, args);
    }
    let wanted = |name: &str| args.only.as_deref().is_none_or(|part| name.contains(part));
    let mut named = corners(args.size.0, args.preset.unwrap_or_default());
    if args.large {
        named.extend(large());
    }
    named.retain(|case| wanted(&case.name));
    let needs_media = args.cases > 0 || named.iter().any(|c| c.name.contains("albedo"));
    let mut stress = Stress::new(if needs_media { &MEDIA } else { &[] })?;
    let numbers = (0..args.cases).filter(|number| wanted(&random::name(args.seed, *number)));
    let numbers: Vec<u64> = numbers.collect();
    let count = named.len() + numbers.len();
    if count == 0 {
        return Err(Error::input("--only", "expected a part of the name of a case"));
    }
    print(&head())?;
    let progress = Progress::new(count as u64, "cases");
    let mut rows = Vec::with_capacity(count);
    let mut judge = |stress: &mut Stress, case: &Case| {
        let (row, picture) = stress.run(case);
        if !(args.quiet && row.passes()) {
            print(&line(&row))?;
        }
        if let (Some(folder), false) = (&args.out, row.passes()) {
            keep(folder, case, picture.as_ref())?;
        }
        rows.push(row);
        progress.step(false);
        Ok(())
    };
    for case in &named {
        judge(&mut stress, case)?;
    }
    // Drawn when their turn comes: a million scenes would fill the memory.
    for number in numbers {
        let case = random::case(args.seed, number, args.size.0, args.preset, stress.tables());
        judge(&mut stress, &case)?;
    }
    progress.finish();
    let failed = rows.iter().filter(|row| !row.passes()).count();
    let numbers = rows.iter().map(|row| row.audit.numbers).sum();
    if let Some(path) = &args.json {
        write_json(path, &Report { cases: rows.len(), failed, numbers, rows: &rows })?;
    }
    print(&format!("{} cases, {failed} failed, {numbers} numbers looked at", rows.len()))?;
    match failed {
        0 => Ok(()),
        _ => Err(Error::Failed(format!("{failed} of {} cases failed", rows.len()))),
    }
}

fn run_soak(seconds: f64, args: &StressArgs) -> Result<()> {
    let frames = (seconds / STEP).ceil() as u64;
    let progress = Progress::new(frames, "frames");
    let flight = soak(seconds, args.size.0, args.preset.unwrap_or(Preset::Low), |_| {
        progress.step(false);
    })?;
    progress.finish();
    let line = |name: &str, m: &Moment| {
        print(&format!(
            "{name:14} {:8.1} MiB resident, {:6.1} MiB on the device, {:8.1} ms of processor time a frame",
            m.memory, m.device, m.work
        ))
    };
    print(&format!("{} frames, {} s of flight", flight.frames, flight.seconds))?;
    line("first quarter", &flight.first)?;
    line("last quarter", &flight.last)?;
    print(&format!("most {:16.1} MiB resident", flight.most))?;
    if let Some(path) = &args.json {
        write_json(path, &flight)?;
    }
    flight.failure().map_or(Ok(()), |why| Err(Error::Failed(why)))
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let json =
        serde_json::to_string_pretty(value).map_err(|e| Error::Failed(format!("JSON: {e}")))?;
    write_atomically(path, |out| out.write_all((json + "\n").as_bytes()))
}

fn head() -> String {
    format!(
        "{:52} {:>9} {:>9} {:>5} {:>5} {:>5} {:>5} {:>6} {:>7} {:>7}",
        "case", "particles", "numbers", "NaN", "inf", "neg", "out", "energy", "T RMS", "L RMS"
    )
}

fn line(row: &Row) -> String {
    let a = &row.audit;
    let composed = row.composed.map_or_else(
        || format!("{:>7} {:>7}", "-", "-"),
        |d| format!("{:7.4} {:6.2}%", d.transmittance, 100.0 * d.radiance),
    );
    let verdict = row.failure.as_ref().map_or(String::new(), |why| format!("  FAIL: {why}"));
    format!(
        "{:52} {:9} {:9} {:5} {:5} {:5} {:5} {:6.3} {composed}{verdict}",
        row.name, row.particles, a.numbers, a.nan, a.infinite, a.negative, a.outside, row.energy
    )
}

/// Writes what shows the failure again.
fn keep(folder: &Path, case: &Case, picture: Option<&Picture>) -> Result<()> {
    let stem: String =
        case.name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let text =
        format!("# --time {:?} --preset {}\n{}", case.time, case.preset, case.scene.to_toml()?);
    let path = folder.join(format!("{stem}.toml"));
    write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
    picture.map_or(Ok(()), |picture| write_picture(&folder.join(format!("{stem}.exr")), picture))
}
