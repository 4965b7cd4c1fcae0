//! `precompute sample`: answers of the tables for rays from a file.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use cumuli::gpu::Gpu;
use cumuli::medium::Phase;
use cumuli::tables::sample::Sampler;
use cumuli::tables::{ScatteringTable, TableSet, rays};
use cumuli::{Error, Result};
use rayon::prelude::*;

use crate::print;

/// Arguments of `precompute sample`.
#[derive(Args, Debug)]
pub struct SampleArgs {
    /// Table file
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Rays, in JSON
    #[arg(long, value_name = "RAYS.json")]
    rays: PathBuf,
    /// File to write the answers to, in JSON; it appears when it is whole
    #[arg(long, value_name = "OUT.json")]
    out: PathBuf,
    /// Shape by name, as `precompute info` shows it
    #[arg(long, value_name = "NAME", default_value = "uniform")]
    shape: String,
    /// Phase function of the medium [default: that of the file's first medium]
    #[arg(long, value_name = "PHASE")]
    phase: Option<Phase>,
    /// Albedo of the medium [default: that of the file's first medium with the phase function]
    #[arg(long, value_name = "ALBEDO", allow_negative_numbers = true)]
    albedo: Option<f64>,
    /// Look up on the graphics device, with the frame's shaders
    #[arg(long)]
    gpu: bool,
}

/// Runs the command.
pub fn run(args: &SampleArgs) -> Result<()> {
    cumuli::output::check_file(&args.out)?;
    let rays = rays::read(&args.rays)?;
    let tables = TableSet::load(&args.file)?;
    let medium = medium(args, &tables)?;
    let (phase, albedo) = (medium.phase(), medium.albedo());
    let sampler = Sampler::new(&tables, &args.shape, phase, albedo)?;
    let [least, most] = medium.optical_radius_range();
    let beyond = rays.iter().filter(|ray| {
        let radius = sampler.source_radius(ray);
        radius > 0.0 && !(least..=most).contains(&radius)
    });
    let beyond = beyond.count();
    if beyond > 0 {
        // Nowhere is left to report a closed standard error.
        let _ = writeln!(
            std::io::stderr(),
            "precompute: {beyond} of {} rays have optical radii beyond the table's, {least} to \
             {most}: they got the light of the nearest, as in a frame",
            rays.len()
        );
    }
    let samples = if args.gpu {
        sampler.sample_on(&Gpu::headless()?, &rays)?
    } else {
        rays.par_iter().map(|ray| sampler.sample(ray)).collect()
    };
    rays::write(&args.out, &samples)?;
    print(&format!(
        "{}: {} rays, {}, {phase}, albedo {albedo}",
        args.out.display(),
        rays.len(),
        args.shape
    ))
}

/// The medium that is asked for, or the file's first.
fn medium<'a>(args: &SampleArgs, tables: &'a TableSet) -> Result<&'a ScatteringTable> {
    let fits = |table: &&ScatteringTable| {
        args.phase.is_none_or(|phase| *table.phase() == phase)
            && args.albedo.is_none_or(|albedo| table.albedo() == albedo)
    };
    tables.scattering().iter().find(fits).ok_or_else(|| {
        let phase = args.phase.map_or("any phase function".to_owned(), |p| p.to_string());
        let albedo = args.albedo.map_or(String::new(), |a| format!(" with albedo {a}"));
        Error::input(
            format!("{}: medium {phase}{albedo}", args.file.display()),
            format!("expected one that the file holds: {}", tables.media()),
        )
    })
}
