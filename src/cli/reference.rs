//! `cumuli reference`: radiative transfer by path tracing, on its own.

use clap::{Args, Subcommand};

use super::{args, print};
use crate::error::{Error, Result};
use crate::medium::Phase;
use crate::reference::{Matter, Slab, scatterings, slab_fluxes, speed, verify};

/// Arguments of `cumuli reference`.
#[derive(Args, Debug)]
pub struct ReferenceArgs {
    /// What to compute
    #[command(subcommand)]
    pub what: ReferenceCommand,
}

/// What to compute.
#[derive(Debug, Subcommand)]
pub enum ReferenceCommand {
    /// Fluxes of a plane-parallel slab, as JSON: fractions of the incoming flux
    Slab(SlabArgs),
    /// Compare with published radiative transfer; exit code 1 where a row fails
    Verify(VerifyArgs),
    /// Measure paths a second in a clump of 200 overlapping spheres of optical thickness 30, as
    /// JSON
    Speed(SpeedArgs),
}

/// Arguments of `cumuli reference speed`.
#[derive(Args, Debug)]
pub struct SpeedArgs {
    /// Paths
    #[arg(long, value_name = "N", default_value = "1000000", value_parser = args::samples)]
    pub paths: u64,
}

/// Arguments of `cumuli reference slab`.
#[derive(Args, Debug)]
pub struct SlabArgs {
    /// Vertical optical depth, 0 to 1e6
    #[arg(long, value_name = "TAU", allow_negative_numbers = true, value_parser = args::optical_depth)]
    pub optical_depth: f64,
    /// Phase function: hg:G or mie:Dum
    #[arg(long, value_name = "PHASE", default_value = "hg:0")]
    pub phase: Phase,
    /// Single-scattering albedo, 0 to 1
    #[arg(long, value_name = "W", default_value = "1", allow_negative_numbers = true, value_parser = args::share)]
    pub albedo: f64,
    /// Cosine of the sun's zenith angle, above 0, up to 1
    #[arg(long, value_name = "MU", default_value = "1", allow_negative_numbers = true, value_parser = args::cosine)]
    pub mu0: f64,
    /// Photons [default: 1000000, fewer where they scatter more than 10000 times each]
    #[arg(long, value_name = "N", value_parser = args::samples)]
    pub photons: Option<u64>,
    /// Another seed is another set of photons
    #[arg(long, value_name = "N", default_value = "0")]
    pub seed: u64,
}

/// Arguments of `cumuli reference verify`.
#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// Paths a row
    #[arg(long, value_name = "N", default_value = "1000000", value_parser = args::samples)]
    pub samples: u64,
    /// Another seed is another set of paths
    #[arg(long, value_name = "N", default_value = "0")]
    pub seed: u64,
    /// Print JSON in place of a table
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
pub(super) fn run(args: &ReferenceArgs) -> Result<()> {
    match &args.what {
        ReferenceCommand::Slab(args) => slab(args),
        ReferenceCommand::Verify(args) => published(args),
        ReferenceCommand::Speed(args) => print(&json(&speed(args.paths))?),
    }
}

/// Photons of a slab if none are asked for, and the scatterings that they may come to: minutes on two
/// cores.
const PHOTONS: u64 = 1_000_000;
const SCATTERINGS: f64 = 1e10;
/// Scatterings that may be asked for: a night on two cores.
const MOST_SCATTERINGS: f64 = 1e12;

/// How many photons, refused where they would take for ever.
fn photons(args: &SlabArgs) -> Result<u64> {
    let each = scatterings(args.optical_depth, args.albedo);
    let Some(photons) = args.photons else {
        return Ok(PHOTONS.min((SCATTERINGS / each) as u64).max(1));
    };
    let most = MOST_SCATTERINGS / each;
    if photons as f64 > most {
        return Err(Error::input(
            format!("--photons {photons}"),
            format!("expected at most {most:.0}, since each scatters about {each:.0} times here"),
        ));
    }
    Ok(photons)
}

fn slab(args: &SlabArgs) -> Result<()> {
    let photons = photons(args)?;
    let matter = Matter { phase: args.phase.prepare(), albedo: args.albedo };
    let slab = Slab::new(args.optical_depth, 1.0);
    let fluxes = slab_fluxes(&slab, &matter, args.mu0, photons, args.seed);
    print(&json(&fluxes)?)
}

fn published(args: &VerifyArgs) -> Result<()> {
    let checks = verify(args.samples, args.seed)?;
    if args.json {
        print(&json(&checks)?)?;
    } else {
        let width = checks.iter().map(|c| c.name.len()).max().unwrap_or(0);
        let head = ["expected", "got", "std error", "z"];
        print(&format!(
            "{:width$} {:>13} {:>13} {:>11} {:>6}",
            "check", head[0], head[1], head[2], head[3]
        ))?;
        for check in &checks {
            let (got, verdict) = (check.got, if check.pass { "pass" } else { "FAIL" });
            print(&format!(
                "{:width$} {:13.8} {:13.8} {:11.2e} {:6.2} {verdict}",
                check.name, check.expected, got.value, got.standard_error, check.z
            ))?;
        }
    }
    match checks.iter().filter(|c| !c.pass).count() {
        0 => Ok(()),
        failed => Err(Error::Failed(format!("{failed} of {} checks failed", checks.len()))),
    }
}

fn json(value: &impl serde::Serialize) -> Result<String> {
    serde_json::to_string_pretty(value).map_err(|e| Error::Failed(format!("JSON: {e}")))
}
