//! `precompute compare`: ways to tabulate optical depth, at equal bytes, as a table of errors, and what
//! their look-ups cost on the device.

use clap::Args;
use cumuli::cli::StageBar;
use cumuli::gpu::Gpu;
use cumuli::medium::{Shape, ShapeKind, ShapeSpec};
use cumuli::tables::Progress;
use cumuli::tables::optical_depth::chord_lookups::lookup_times;
use cumuli::tables::optical_depth::compare::{Outcome, Way};
use cumuli::tables::optical_depth::measure::{DepthErrors, central_matter, test_chords};
use cumuli::{Error, Result};

use crate::print;

/// Arguments of `precompute compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// Noise shapes
    #[arg(long, value_name = "SHAPES", value_delimiter = ',', default_values = ["pyroclastic-1", "soft-1"])]
    shapes: Vec<ShapeSpec>,
    /// Sizes of the tables, KiB
    #[arg(long, value_name = "KIB", value_delimiter = ',', default_values_t = [256, 1024, 4096, 16384])]
    kib: Vec<usize>,
    /// Random chords a cell of a fitted table
    #[arg(long, value_name = "RAYS", default_value_t = 8)]
    rays: usize,
    /// Random chords that errors are measured on
    #[arg(long, value_name = "CHORDS", default_value_t = 40_000)]
    chords: usize,
    /// Only the errors: no device is asked what the look-ups cost
    #[arg(long)]
    no_gpu: bool,
}

/// Seed of the chords that errors are measured on.
const SEED: u64 = 0x636f_6d70;

/// Runs the command: a table in Markdown, as the README has it.
pub fn run(args: &CompareArgs) -> Result<()> {
    let check = |option: &str, value: usize, least: usize, most: usize| {
        if (least..=most).contains(&value) {
            return Ok(());
        }
        let expected = format!("expected a number from {least} to {most}, found {value}");
        Err(Error::input(option, expected))
    };
    args.kib.iter().try_for_each(|kib| check("--kib", *kib, 4, 32 * 1024))?;
    check("--rays", args.rays, 1, 64)?;
    check("--chords", args.chords, 100, 10_000_000)?;
    if let Some(spec) = args.shapes.iter().find(|spec| spec.kind == ShapeKind::Uniform) {
        return Err(Error::input("--shapes", format!("expected noise shapes, found {spec}")));
    }
    let bar = StageBar::new();
    let steps = args.shapes.len() * (Way::OTHERS.len() + args.kib.len() * Way::TABLES.len());
    bar.start(steps as u64, "ways");
    let mut lines = Vec::new();
    for spec in &args.shapes {
        let shape = Shape::new(*spec);
        let chords = test_chords(&shape, args.chords, SEED);
        let central = central_matter(&shape);
        lines.push(format!(
            "Errors of transmittance for {spec}, {} random chords, at central optical depth 1 / 10 / 50\n",
            chords.len()
        ));
        lines.push(
            "| way | nodes | KiB | fetches | RMS | 99th percentile | parts RMS | parts by length RMS |"
                .to_owned(),
        );
        lines.push("|---|---|---|---|---|---|---|---|".to_owned());
        let tables = args.kib.iter().flat_map(|kib| Way::TABLES.map(|way| (way, *kib)));
        for (way, kib) in tables.chain(Way::OTHERS.map(|way| (way, 0))) {
            let outcome = way.measure(&shape, kib << 10, args.rays, &chords, central);
            lines.push(line(&way, &outcome));
            bar.advance(1);
        }
        lines.push(String::new());
    }
    if let (false, Some(spec)) = (args.no_gpu, args.shapes.first()) {
        let gpu = Gpu::headless()?;
        let chords = test_chords(&Shape::new(*spec), args.chords, SEED);
        lines.push(format!("Time of a look-up on {}\n", gpu.adapter.get_info().name));
        lines.push("| way | ns a chord |".to_owned());
        lines.push("|---|---|".to_owned());
        for time in lookup_times(&gpu, &chords)? {
            lines.push(format!("| {} | {:.1} |", time.name, time.nanoseconds));
        }
    }
    drop(bar);
    lines.iter().try_for_each(|line| print(line))
}

fn line(way: &Way, outcome: &Outcome) -> String {
    let column = |value: fn(&DepthErrors) -> f64| {
        let depths = outcome.errors.iter();
        depths.map(|d| format!("{:.4}", value(d))).collect::<Vec<_>>().join(" / ")
    };
    let nodes =
        outcome.nodes.map_or(String::new(), |[a, b, c, d]| format!("{a} x {b} x {c} x {d}"));
    let fetches = way.fetches().map_or(String::new(), |n| n.to_string());
    let kib = outcome.nodes.map_or(String::new(), |_| (outcome.bytes >> 10).to_string());
    format!(
        "| {} | {nodes} | {kib} | {fetches} | {} | {} | {} | {} |",
        way.name(),
        column(|d| d.rms),
        column(|d| d.p99),
        column(|d| d.part_rms),
        column(|d| d.part_rms_by_length),
    )
}
