//! `precompute plot`: the tables as pictures that a person can judge.

mod canvas;
mod charts;
mod shapes;
mod spheres;

use std::path::PathBuf;

use clap::Args;
use cumuli::Result;
use cumuli::cli::StageBar;
use cumuli::medium::{Shape, ShapeSpec};
use cumuli::tables::sample::Sampler;
use cumuli::tables::{Progress, TableSet};

use self::canvas::Canvas;
use crate::print;
use crate::verify::medium;

/// Arguments of `precompute plot`.
#[derive(Args, Debug)]
pub struct PlotArgs {
    /// Table file
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Folder for the pictures; it is made if need be
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Paths traced for each dot of the charts of radiance
    #[arg(long, value_name = "PATHS", default_value_t = 10_000,
        value_parser = clap::value_parser!(u64).range(100..=1_000_000_000))]
    samples: u64,
}

/// Runs the command: prints the path of each picture.
pub fn run(args: &PlotArgs) -> Result<()> {
    cumuli::output::check_folder(&args.out)?;
    let tables = TableSet::load(&args.file)?;
    let specs: Vec<ShapeSpec> = tables.optical_depth().iter().map(|t| t.spec()).collect();
    let media = tables.scattering();
    let bar = StageBar::new();
    bar.start(2 * specs.len() as u64 + 4 * media.len() as u64, "pictures");
    let save = |name: String, canvas: Canvas| {
        // A colon is no part of a file's name everywhere.
        let path = args.out.join(format!("{}.png", name.replace([':', ' '], "-")));
        canvas.save(&path)?;
        bar.advance(1);
        print(&path.display().to_string())
    };
    let mut shapes = Vec::with_capacity(specs.len());
    for (index, spec) in specs.into_iter().enumerate() {
        let shape = Shape::new(spec);
        save(shape.name(), shapes::picture(&tables, index as u32 + 1, &shape)?)?;
        shapes.push(shape);
    }
    if !shapes.is_empty() {
        save("errors-whole-chords".to_owned(), charts::depth_errors(&tables, &shapes, false)?)?;
        save("errors-parts-of-chords".to_owned(), charts::depth_errors(&tables, &shapes, true)?)?;
    }
    for table in media {
        let name = medium(table);
        let sampler = Sampler::new(&tables, "uniform", table.phase(), table.albedo())?;
        save(format!("{name}-spheres"), spheres::lit(&sampler, table, &name)?)?;
        save(format!("{name}-order-1-errors"), spheres::errors(&sampler, table, &name)?)?;
        save(format!("{name}-energy"), charts::energy(table, &name)?)?;
        save(format!("{name}-radiance"), charts::radiance(table, &name, args.samples)?)?;
    }
    Ok(())
}
