//! The command line: `cumuli render`, `cumuli info`, and the window where it is built in.
//!
//! Bad input ends with one sentence on standard error and exit code 2, before a device is made
//! and before anything is written. Paths of what was written go to standard output, everything
//! else to standard error.

mod args;
mod bench;
mod compare;
mod engine;
#[cfg(feature = "window")]
mod fly;
mod info;
mod progress;
mod reference;
mod render;
mod render_exact;
mod render_reference;
mod stress;
mod truth;

use std::io::{IsTerminal, Write};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub use args::{MAX_SIDE, Size};
pub use bench::BenchArgs;
pub use compare::CompareArgs;
#[cfg(feature = "window")]
pub use fly::FlyArgs;
pub use info::InfoArgs;
pub use progress::StageBar;
pub use reference::{ReferenceArgs, ReferenceCommand};
pub use render::{Job, RenderArgs};
pub use stress::StressArgs;
pub use truth::TruthArgs;

use crate::error::{Error, Result};

/// Real-time volumetric clouds from precomputed particle tables.
#[derive(Debug, Parser)]
#[command(name = "cumuli", version, about, infer_subcommands = false)]
pub struct Cli {
    /// What to do; without a command, fly.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Open a window and fly through a scene
    #[cfg(feature = "window")]
    Fly(FlyArgs),
    /// Render one picture or a sequence of frames
    Render(RenderArgs),
    /// Show the graphics adapter, its limits, and the tables
    Info(InfoArgs),
    /// Tell how far two pictures are apart
    Compare(CompareArgs),
    /// Measure run time against error
    Bench(BenchArgs),
    /// Radiative transfer by path tracing, on its own
    Reference(ReferenceArgs),
    /// Judge every number of frames at the corners of what is allowed, and of random ones
    Stress(StressArgs),
}

/// Reads the arguments, runs the command and tells the exit code: 0, 1 for what failed on good
/// input, 2 for bad input.
pub fn main() -> ExitCode {
    start_log();
    match run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Nowhere is left to report a closed standard error.
            let _ = writeln!(std::io::stderr(), "cumuli: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(cli: Cli) -> Result<()> {
    match cli.command {
        Some(Command::Render(args)) => render::run(&args),
        Some(Command::Info(args)) => info::run(&args),
        Some(Command::Compare(args)) => compare::run(&args),
        Some(Command::Bench(args)) => bench::run(&args),
        Some(Command::Reference(args)) => reference::run(&args),
        Some(Command::Stress(args)) => stress::run(&args),
        #[cfg(feature = "window")]
        Some(Command::Fly(args)) => fly::run(&args),
        #[cfg(feature = "window")]
        None => fly::run(&FlyArgs::default()),
        #[cfg(not(feature = "window"))]
        None => print(&format!("{}", <Cli as clap::CommandFactory>::command().render_help())),
    }
}

/// Warnings to standard error; `RUST_LOG` asks for more.
fn start_log() {
    use tracing_subscriber::EnvFilter;
    // The Vulkan loader complains of drivers without their hardware; that no adapter is left is an
    // error of ours and said in one sentence.
    const WARNINGS: &str = "warn,wgpu_hal::vulkan::instance=off,winit=error";
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(WARNINGS));
    let log = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr);
    // A program that has set up its own log keeps it.
    let _ = log.try_init();
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
