//! `precompute bake`: computes tables and writes them to a file.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use cumuli::medium::ShapeSpec;
use cumuli::tables::TableSet;
use cumuli::tables::optical_depth::OpticalDepthOptions;
use cumuli::{Error, Result};

use crate::print;
use crate::progress::Bar;

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
    /// Seed of the random chords
    #[arg(long, value_name = "SEED", default_value_t = OpticalDepthOptions::default().seed)]
    seed: u64,
    /// Threads to compute with; the bytes do not depend on it [default: one for each core]
    #[arg(long, value_name = "THREADS", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

fn default_shapes() -> Vec<ShapeSpec> {
    cumuli::tables::default_shapes()
}

/// Runs the command.
pub fn run(args: &BakeArgs) -> Result<()> {
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.into())
            .build_global()
            .map_err(|e| Error::input("--threads", e.to_string()))?;
    }
    let start = Instant::now();
    let options = OpticalDepthOptions {
        disc: args.disc,
        direction: args.direction,
        rays_per_cell: args.rays,
        iterations: args.iterations,
        seed: args.seed,
    };
    let bar = Bar::new();
    let tables = TableSet::bake(&args.shapes, &options, &bar);
    bar.finish();
    tables?.save(&args.out)?;
    print(&format!("{} in {:.1} s", args.out.display(), start.elapsed().as_secs_f64()))
}
