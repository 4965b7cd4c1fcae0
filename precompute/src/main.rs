//! Computes Cumuli's lookup tables, and shows what is in a file of them.
//!
//! Bad input ends with one sentence on standard error and exit code 2. What a command tells goes
//! to standard output, progress to standard error.

mod bake;
mod compare;
mod info;
mod plot;
mod sample;
mod verify;

use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use cumuli::{Error, Result};

/// Computes and shows Cumuli's lookup tables.
#[derive(Debug, Parser)]
#[command(name = "precompute", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compute tables and write them to a file; without options, the tables built into cumuli
    Bake(bake::BakeArgs),
    /// Measure ways to tabulate optical depth against each other, at equal bytes
    Compare(compare::CompareArgs),
    /// Show what is in a table file: shapes, parameters, bytes, measured errors
    Info(info::InfoArgs),
    /// Draw a table file: shapes, errors, lit spheres, curves
    Plot(plot::PlotArgs),
    /// Answer rays through the tables, for comparison with other solvers
    Sample(sample::SampleArgs),
    /// Check a table file against integration, photons and closed forms; exit code 1 where one fails
    Verify(verify::VerifyArgs),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Bake(args) => bake::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Plot(args) => plot::run(&args),
        Command::Sample(args) => sample::run(&args),
        Command::Verify(args) => verify::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Nowhere is left to report a closed standard error.
            let _ = writeln!(std::io::stderr(), "precompute: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// A line to standard output. A reader that has gone away, as `head` does, is no error.
fn print(line: &str) -> Result<()> {
    match writeln!(std::io::stdout(), "{line}") {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::io(std::path::Path::new("standard output"), "write", e))
        }
        _ => Ok(()),
    }
}
