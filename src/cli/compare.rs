//! `cumuli compare`: how far two pictures are apart.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{args, print};
use crate::compare::{Differences, Measured, Report, compare, error_image::error_image};
use crate::error::{Error, Result};
use crate::output::{Format, check_file, check_target, write_atomically, write_png};

/// Arguments of `cumuli compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// A picture, .exr or .png
    #[arg(value_name = "A")]
    pub a: PathBuf,
    /// The picture it is measured by, of the same size
    #[arg(value_name = "B")]
    pub b: PathBuf,
    /// Only pixels with cloud: where the opacity of A or B (channels A or T) is at least this
    #[arg(long, value_name = "OPACITY", num_args = 0..=1, require_equals = true, default_missing_value = "0.01", value_parser = args::share)]
    pub mask: Option<f64>,
    /// Exposure (EV) of radiance where numbers are of tone-mapped pictures
    #[arg(long, value_name = "EV", default_value = "0", allow_negative_numbers = true, value_parser = args::exposure)]
    pub exposure: f64,
    /// Count pixels that differ by more standard errors
    #[arg(long, value_name = "Z", default_value = "3", value_parser = args::z_score)]
    pub z: f64,
    /// Write the numbers as JSON; `-` prints them in place of the table
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a picture of the differences: A, B, brighter (red) or darker (blue), FLIP
    #[arg(long, value_name = "FILE.png")]
    pub out: Option<PathBuf>,
}

/// Runs the command.
pub(super) fn run(args: &CompareArgs) -> Result<()> {
    let to_console = args.json.as_deref() == Some(Path::new("-"));
    if let Some(json) = args.json.as_deref().filter(|_| !to_console) {
        check_file(json)?;
    }
    if let Some(out) = &args.out {
        check_target(out)?;
        if Format::of(out)? != Format::Png {
            let message = "expected a name that ends in .png";
            return Err(Error::input(format!("--out {}", out.display()), message));
        }
    }
    let (a, b) = (Measured::read(&args.a)?, Measured::read(&args.b)?);
    let how = Differences { least_opacity: args.mask, exposure: args.exposure, most_z: args.z };
    let report = compare(&a, &b, &how)?;
    let json =
        serde_json::to_string_pretty(&report).map_err(|e| Error::Failed(format!("JSON: {e}")))?;
    if to_console {
        print(&json)?;
    } else {
        table(&report).iter().try_for_each(|line| print(line))?;
    }
    if let Some(path) = args.json.as_deref().filter(|_| !to_console) {
        write_atomically(path, |out| out.write_all((json + "\n").as_bytes()))?;
    }
    if let Some(path) = &args.out {
        let (size, pixels) = error_image(&a, &b, &report, args.exposure);
        write_png(path, size, &pixels)?;
    }
    Ok(())
}

/// The numbers in lines for people.
fn table(report: &Report) -> Vec<String> {
    let line = |name: &str, value: String| format!("{name:26} {value}");
    let number = |v: f64| format!("{v:.6}");
    let percent = |v: f64| format!("{:.4} %", 100.0 * v);
    let colour = |v: [f64; 3]| v.map(number).join(" ");
    let [width, height] = report.size;
    let mut lines = vec![
        line("pixels", format!("{} of {width}x{height}", report.pixels)),
        line("mean of A, rgb", colour(report.mean_a)),
        line("mean of B, rgb", colour(report.mean_b)),
        line("mean error", number(report.mean_error)),
    ];
    let mut add = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            lines.push(line(name, value));
        }
    };
    add("mean error over mean of B", report.relative_mean_error.map(percent));
    add("RMSE", Some(number(report.rmse)));
    add("RMSE over mean of B", report.relative_rmse.map(percent));
    add("relMSE", report.rel_mse.map(number));
    add("relMSE of noise alone", report.rel_mse_of_noise.map(number));
    add("PSNR, tone mapped", report.psnr.map(|v| format!("{v:.2} dB")));
    add("LDR FLIP", Some(number(report.ldr_flip)));
    add("HDR FLIP", report.hdr_flip.map(number));
    if let Some(z) = &report.z {
        let name = format!("pixels beyond {} std errors", z.limit);
        add(&name, Some(percent(z.beyond)));
        add("mean error in std errors", Some(format!("{:.2}", z.of_mean)));
    }
    if let Some(noise) = &report.noise {
        add("std error, median pixel", Some(percent(noise.median)));
        add("pixels with less than 2 %", Some(percent(noise.below_2_percent)));
    }
    lines
}
