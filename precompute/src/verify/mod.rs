//! `precompute verify`: every check that applies to a table file, one row each.

mod depth;
mod device;
pub mod draws;
pub mod energy;
pub mod monte_carlo;
pub mod order;
mod precision;
pub mod quadrature;
mod row;

use std::path::PathBuf;

use clap::Args;
use cumuli::cli::StageBar;
use cumuli::gpu::Gpu;
use cumuli::tables::{Progress, ScatteringOptions, ScatteringTable, TableSet};
use cumuli::{Error, Result};

use self::row::Row;
use crate::print;

/// Arguments of `precompute verify`.
#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// Table file
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Fewer rays, paths and optical radii: seconds in place of minutes
    #[arg(long)]
    quick: bool,
    /// Paths traced for each ray that is compared with Monte Carlo [default: 40000, quick 4000]
    #[arg(long, value_name = "PATHS", value_parser = clap::value_parser!(u64).range(100..=1_000_000_000))]
    samples: Option<u64>,
    /// Another seed is another set of rays and paths
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Leave out what needs a graphics device
    #[arg(long)]
    no_gpu: bool,
    /// Print JSON in place of a table
    #[arg(long)]
    json: bool,
}

/// How much is done for the checks.
pub struct Effort {
    quick: bool,
    seed: u64,
    /// Chords and rays of each comparison that needs no tracing.
    chords: u64,
    /// Rays of each comparison with a quadrature.
    quadrature_rays: u64,
    /// Rays of each comparison with traced paths, and paths of each.
    traced_rays: u64,
    paths: u64,
    /// Photons for the balance of a medium that absorbs.
    photons: u64,
    /// Standard errors by which a noisy reference may be off.
    deviations: f64,
}

/// Optical radii at which radiances are compared: the range, a factor of 2.5 to 4 apart,
/// none of them a node of the built-in tables.
const OPTICAL_RADII: [f64; 8] = [0.1, 0.25, 0.7, 2.0, 5.0, 14.0, 30.0, 64.0];

/// Chance that a right table fails any of its noisy comparisons: that of 3 standard errors in one.
const FALSE_ALARM: f64 = 0.0027;

impl Effort {
    fn of(args: &VerifyArgs, media: usize) -> Self {
        let pick = |quick: u64, full: u64| if args.quick { quick } else { full };
        let traced_rays = pick(8, 24);
        let compared = traced_rays * media.max(1) as u64 * OPTICAL_RADII.len() as u64;
        Self {
            quick: args.quick,
            seed: args.seed,
            chords: pick(8_000, 40_000),
            quadrature_rays: pick(500, 4_000),
            traced_rays,
            paths: args.samples.unwrap_or(pick(4_000, 40_000)),
            photons: pick(1 << 18, 1 << 22),
            deviations: deviations(FALSE_ALARM / compared as f64),
        }
    }

    /// Those of [`OPTICAL_RADII`] that a table is for; the middle of its range where none is.
    fn radii(&self, table: &ScatteringTable) -> Vec<f64> {
        let [least, most] = table.optical_radius_range();
        let inside = OPTICAL_RADII.iter().copied().filter(|r| (least..=most).contains(r));
        let step = if self.quick { 2 } else { 1 };
        let radii: Vec<f64> = inside.step_by(step).collect();
        if radii.is_empty() { vec![(least * most).sqrt()] } else { radii }
    }

    /// Every optical radius of the table's nodes, and the middle between each two; in a quick run
    /// those of [`Self::radii`].
    fn energy_radii(&self, table: &ScatteringTable) -> Vec<f64> {
        if self.quick {
            return self.radii(table);
        }
        let options = ScatteringOptions {
            resolution: table.resolution(),
            optical_radius: table.optical_radius_range(),
            ..Default::default()
        };
        let nodes: Vec<f64> =
            (0..table.resolution()[0]).map(|i| options.optical_radius_at(i)).collect();
        let between = nodes.windows(2).map(|pair| [pair[0], (pair[0] * pair[1]).sqrt()]);
        between.flatten().chain(nodes.last().copied()).collect()
    }
}

/// A medium in the name of a row or a picture.
pub fn medium(table: &ScatteringTable) -> String {
    if table.albedo() == 1.0 {
        table.phase().to_string()
    } else {
        format!("{} albedo {}", table.phase(), table.albedo())
    }
}

/// How many standard deviations a normal number passes on either side with this small chance.
fn deviations(chance: f64) -> f64 {
    // Laplace's continued fraction of the tail: good to six digits from 2 on.
    let tail = |z: f64| {
        let fraction = (1..=40).rev().fold(z, |below, k| z + f64::from(k) / below);
        2.0 * (-0.5 * z * z).exp() / (std::f64::consts::TAU.sqrt() * fraction)
    };
    let (mut low, mut high) = (2.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if tail(middle) > chance { low = middle } else { high = middle }
    }
    low
}

/// Runs the command.
pub fn run(args: &VerifyArgs) -> Result<()> {
    let tables = TableSet::load(&args.file)?;
    let gpu = if args.no_gpu { None } else { Some(Gpu::headless()?) };
    let rows = check(&tables, gpu.as_ref(), &Effort::of(args, tables.scattering().len()))?;
    if args.json {
        let text =
            serde_json::to_string_pretty(&rows).map_err(|e| Error::Failed(format!("JSON: {e}")))?;
        print(&text)?;
    } else {
        print_table(&rows)?;
    }
    match rows.iter().filter(|row| !row.pass).count() {
        0 => Ok(()),
        failed => Err(Error::Failed(format!(
            "{}: {failed} of {} checks failed",
            args.file.display(),
            rows.len()
        ))),
    }
}

fn check(tables: &TableSet, gpu: Option<&Gpu>, effort: &Effort) -> Result<Vec<Row>> {
    let bar = StageBar::new();
    let mut rows = Vec::new();
    let shapes: Vec<&str> = tables.shape_names().collect();
    bar.start(shapes.len() as u64, "optical depth");
    for shape in shapes {
        rows.extend(depth::rows(tables, shape, effort)?);
        bar.advance(1);
    }
    rows.extend(order::escape_rows(tables)?);
    rows.extend(order::critical_rows(tables));
    for table in tables.scattering() {
        let medium = medium(table);
        let radii = effort.energy_radii(table).len() as u64;
        bar.start(radii, &format!("energy, {medium}"));
        rows.extend(energy::rows(table, effort, || bar.advance(1)));
        bar.start(1, &format!("order 1, {medium}"));
        rows.extend(order::rows(table, effort));
        let rays = effort.radii(table).len() as u64 * effort.traced_rays;
        bar.start(rays, &format!("radiance, {medium}"));
        rows.extend(monte_carlo::rows(table, effort, || bar.advance(1)));
        rows.extend(precision::rows(table, effort));
    }
    bar.start(1, "lookups on the device");
    rows.extend(device::rows(tables, gpu, effort)?);
    Ok(rows)
}

fn print_table(rows: &[Row]) -> Result<()> {
    let width = rows.iter().map(|row| row.name.len()).max().unwrap_or(0);
    print(&format!(
        "{:width$} {:>12} {:>12} {:>10} {:>10}",
        "check", "expected", "got", "error", "tolerance"
    ))?;
    for row in rows {
        print(&format!(
            "{:width$} {:>12} {:>12} {:10.2e} {:10.2e} {}",
            row.name,
            figure(row.expected),
            figure(row.got),
            row.error,
            row.tolerance,
            if row.pass { "pass" } else { "FAIL" }
        ))?;
    }
    Ok(())
}

/// Six digits behind the point, or an exponent where they would not show the value.
fn figure(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        format!("{value:.6}")
    } else {
        format!("{value:.5e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviations_are_those_of_the_normal_distribution() {
        // From any table of it.
        for (chance, z) in [(0.0027, 2.99998), (6.334e-5, 4.0), (5.733e-7, 5.0)] {
            assert!((deviations(chance) - z).abs() < 1e-4, "{chance}: {}", deviations(chance));
        }
    }
}
