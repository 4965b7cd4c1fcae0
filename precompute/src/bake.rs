//! `precompute bake`: computes tables and writes them to a file.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use cumuli::cli::StageBar;
use cumuli::medium::{Phase, ShapeSpec};
use cumuli::tables::optical_depth::OpticalDepthOptions;
use cumuli::tables::{
    BakeOptions, Precision, ScatteringOptions, TableSet, default_media, default_shapes,
};
use cumuli::{Error, Result};

use crate::print;

/// Arguments of `precompute bake`.
#[derive(Args, Debug)]
pub struct BakeArgs {
    /// File to write; it appears when it is whole
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Noise shapes, as in pyroclastic-3,soft-1
    #[arg(long, value_name = "SHAPES", value_delimiter = ',', default_values_t = default_shapes())]
    shapes: Vec<ShapeSpec>,
    /// Nodes along each of the two axes that say where a line passes the centre
    #[arg(long, value_name = "NODES", default_value_t = OpticalDepthOptions::default().disc)]
    disc: usize,
    /// Nodes along each of the two axes that say a line's direction
    #[arg(long, value_name = "NODES", default_value_t = OpticalDepthOptions::default().direction)]
    direction: usize,
    /// Random chords in each cell of an optical depth table
    #[arg(long, value_name = "RAYS", default_value_t = OpticalDepthOptions::default().rays_per_cell)]
    rays: usize,
    /// Steps of the least-squares solution of an optical depth table
    #[arg(long, value_name = "STEPS", default_value_t = OpticalDepthOptions::default().iterations)]
    iterations: usize,
    /// Phase functions of the scattering tables, as in mie:20um,hg:0.85; Henyey-Greenstein is known
    /// to be within 1 % at mean cosines of 0 to 0.95, and for others a warning is printed
    #[arg(long, value_name = "PHASES", value_delimiter = ',', default_values_t = default_phases())]
    phase: Vec<Phase>,
    /// Single-scattering albedo of the scattering tables
    #[arg(long, value_name = "ALBEDO", default_value_t = 1.0)]
    albedo: f64,
    /// Nodes of the scattering tables: optical radius, incidence, azimuth, view-sun angle
    #[arg(long, value_name = "NODES", value_delimiter = ',',
        default_values_t = ScatteringOptions::default().resolution)]
    scattering: Vec<usize>,
    /// Least and greatest optical radius of the scattering tables
    #[arg(long, value_name = "LEAST,MOST", value_delimiter = ',',
        default_values_t = ScatteringOptions::default().optical_radius)]
    optical_radius: Vec<f64>,
    /// Scattering orders are summed until a step changes the light by less than this share
    #[arg(long, value_name = "SHARE", default_value_t = ScatteringOptions::default().remainder)]
    remainder: f64,
    /// Numbers that the scattering tables are stored as; the device always gets f16
    #[arg(long, value_name = "PRECISION", value_enum, default_value_t = Precision::F16)]
    precision: Precision,
    /// Seed of the random chords
    #[arg(long, value_name = "SEED", default_value_t = OpticalDepthOptions::default().seed)]
    seed: u64,
    /// Threads to compute with; the bytes do not depend on it [default: one for each core]
    #[arg(long, value_name = "THREADS", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

/// Mean cosines of Henyey-Greenstein lobes whose tables meet the targets of `verify`, as measured; the README
/// has what becomes of narrower and of backward ones.
const MEASURED: [f64; 2] = [0.0, 0.95];

/// Tells of phase functions whose tables may miss the targets.
fn warn_of_other_lobes(phases: &[Phase]) {
    let [least, most] = MEASURED;
    for phase in phases {
        if let Phase::Hg { g } = phase
            && !(least..=most).contains(g)
        {
            eprintln!(
                "warning: --phase {phase}: tables of Henyey-Greenstein lobes are known to be within 1 % \
                 at mean cosines of {least} to {most} only; look at precompute verify"
            );
        }
    }
}

fn default_phases() -> Vec<Phase> {
    default_media().into_iter().map(|(phase, _)| phase).collect()
}

/// Exactly as many numbers as an option takes.
fn numbers<T: Copy, const N: usize>(option: &str, values: &[T]) -> Result<[T; N]> {
    values.try_into().map_err(|_| {
        Error::input(
            option,
            format!("expected {N} numbers separated by commas, found {}", values.len()),
        )
    })
}

/// What the library calls a thing that it refuses, and the option that it came from.
const OPTIONS: [(&str, &str); 9] = [
    ("nodes of the disc", "--disc"),
    ("nodes of the direction", "--direction"),
    ("rays per cell", "--rays"),
    ("iterations", "--iterations"),
    ("albedo", "--albedo"),
    ("scattering resolution", "--scattering"),
    ("optical radius range", "--optical-radius"),
    ("scattering remainder", "--remainder"),
    ("shape", "--shapes"),
];

/// The same refusal with the name of the option.
fn named(error: Error) -> Error {
    let Error::Input { place, message } = error else { return error };
    let known =
        OPTIONS.iter().find_map(|(thing, option)| Some((option, place.strip_prefix(thing)?)));
    match known {
        Some((option, rest)) => Error::input(format!("{option}{rest}"), message),
        None => Error::Input { place, message },
    }
}

/// Refuses a value that a list holds twice.
fn distinct<T: ToString>(option: &str, values: &[T]) -> Result<()> {
    let mut seen = std::collections::HashSet::new();
    match values.iter().map(ToString::to_string).find(|value| !seen.insert(value.clone())) {
        Some(value) => Err(Error::input(option, format!("expected {value} once, found it twice"))),
        None => Ok(()),
    }
}

/// Runs the command.
pub fn run(args: &BakeArgs) -> Result<()> {
    // Before minutes of computing, not after them.
    cumuli::output::check_file(&args.out)?;
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.into())
            .build_global()
            .map_err(|e| Error::input("--threads", e.to_string()))?;
    }
    distinct("--shapes", &args.shapes)?;
    distinct("--phase", &args.phase)?;
    warn_of_other_lobes(&args.phase);
    let start = Instant::now();
    let options = BakeOptions {
        shapes: args.shapes.clone(),
        optical_depth: OpticalDepthOptions {
            disc: args.disc,
            direction: args.direction,
            rays_per_cell: args.rays,
            iterations: args.iterations,
            seed: args.seed,
        },
        media: args.phase.iter().map(|phase| (*phase, args.albedo)).collect(),
        scattering: ScatteringOptions {
            resolution: numbers("--scattering", &args.scattering)?,
            optical_radius: numbers("--optical-radius", &args.optical_radius)?,
            remainder: args.remainder,
            precision: args.precision,
        },
    };
    let bar = StageBar::new();
    let baked = TableSet::bake_to(&args.out, &options, &bar);
    drop(bar);
    baked.map_err(named)?;
    print(&format!("{} in {:.1} s", args.out.display(), start.elapsed().as_secs_f64()))
}
