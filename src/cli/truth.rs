//! Options of pictures that tell how wrong a frame is: `--reference` and `--exact`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::args;
use crate::error::{Error, Result};
use crate::frame::Picture;
use crate::output::{self, Format, Layers, check_target, write_picture};
use crate::reference::{Aim, Exposure, Filter, Lens, PILOT};
use crate::scene::Camera;

/// The options.
#[derive(Args, Clone, Debug)]
pub struct TruthArgs {
    /// Unbiased path tracing on all cores in place of the frame's approximations: no graphics
    /// adapter is needed
    #[arg(long, group = "truth", conflicts_with_all = ["preset", "timings", "stats"])]
    pub reference: bool,
    /// The frame's own lighting, but what is visible and how it overlaps worked out exactly: tells
    /// errors of tables, lists and blending from those of the lighting
    #[arg(long, group = "truth", conflicts_with_all = ["frames", "timings", "stats"])]
    pub exact: bool,
    /// Paths a pixel of --reference
    #[arg(long, value_name = "N", default_value = "64", value_parser = args::samples_a_pixel, requires = "reference")]
    pub spp: u32,
    /// Give each pixel of --reference as many paths as take the standard error of its brightness to
    /// this share of it, up to --spp; three times that where --spp is not enough or clouds hide less than half
    #[arg(long, value_name = "SHARE", value_parser = args::noise, requires = "reference")]
    pub std_error: Option<f64>,
    /// Another seed is another set of paths
    #[arg(long, value_name = "N", default_value = "0", requires = "reference")]
    pub seed: u64,
    /// Threads of --reference; the picture does not depend on them [default: one a core]
    #[arg(long, value_name = "N", value_parser = args::threads, requires = "reference")]
    pub threads: Option<usize>,
    /// Where the paths of a pixel begin
    #[arg(long, value_enum, default_value = "box", requires = "reference")]
    pub filter: Filter,
    /// Diameter of a thin lens in metres, 0 for a pinhole [default: the scene's camera.aperture]
    #[arg(long, value_name = "M", value_parser = args::aperture, requires = "reference")]
    pub aperture: Option<f64>,
    /// Distance along the view axis in metres at which the lens is sharp [default: the scene's
    /// camera.focus_distance]
    #[arg(long, value_name = "M", value_parser = args::focus, requires = "reference")]
    pub focus: Option<f64>,
    /// Seconds from --time on during which the shutter is open: what moves is blurred [default: the
    /// scene's camera.shutter]
    #[arg(long, value_name = "S", value_parser = args::shutter, requires = "reference")]
    pub shutter: Option<f64>,
    /// Seconds between two savings of what --reference has so far; it goes on from there when the
    /// same command is given again
    #[arg(long, value_name = "S", default_value = "20", value_parser = args::interval, requires = "reference")]
    pub save_every: f64,
    /// 16-bit floats in the .exr file: half the size, three digits
    #[arg(long, requires = "truth")]
    pub half: bool,
    /// Write the tone-mapped picture too
    #[arg(long, value_name = "FILE", requires = "truth", conflicts_with = "frames")]
    pub png: Option<PathBuf>,
}

impl TruthArgs {
    /// What a reference picture is to show: options come before what the scene says.
    pub fn exposure(&self, camera: &Camera, size: [u32; 2], time: f64) -> Result<Exposure> {
        let shutter = self.shutter.unwrap_or(camera.shutter);
        crate::scene::check_time("--shutter", time + shutter)?;
        let aperture = self.aperture.unwrap_or(camera.aperture);
        let focus = self.focus.unwrap_or(camera.focus());
        let lens = (aperture > 0.0).then_some(Lens { aperture, focus });
        let &Self { filter, seed, .. } = self;
        if self.std_error.is_some() && self.spp <= PILOT {
            let told = format!(
                "expected more than {PILOT} with --std-error, which as many paths of every pixel decide about, found {}",
                self.spp
            );
            return Err(Error::input("--spp", told));
        }
        let aim = self.std_error.map(|standard_error| Aim { standard_error, most: self.spp });
        Ok(Exposure { size, time, shutter, lens, filter, seed, aim })
    }

    /// Where the picture goes.
    pub fn files(&self, out: &Path) -> Result<Files> {
        check_target(out)?;
        if let Some(png) = &self.png {
            check_target(png)?;
            if Format::of(png)? != Format::Png {
                let message = "expected a name that ends in .png";
                return Err(Error::input(format!("--png {}", png.display()), message));
            }
            if png == out {
                return Err(Error::input("--png", "expected another file than --out"));
            }
        }
        Ok(Files { out: out.to_owned(), png: self.png.clone(), half: self.half })
    }

    /// One frame of a sequence.
    pub fn frame(&self, path: &Path) -> Files {
        Files { out: path.to_owned(), png: None, half: self.half }
    }
}

/// Files of one picture.
#[derive(Clone, Debug)]
pub struct Files {
    /// Linear channels, or the tone-mapped picture.
    pub out: PathBuf,
    png: Option<PathBuf>,
    half: bool,
}

impl Files {
    /// Writes all of them.
    pub fn write(&self, layers: &Layers, picture: &Picture) -> Result<()> {
        match Format::of(&self.out)? {
            Format::Exr => layers.write(&self.out, self.half)?,
            Format::Png => write_picture(&self.out, picture)?,
        }
        self.png.as_deref().map_or(Ok(()), |png| write_picture(png, picture))
    }

    /// Prints the paths.
    pub fn print(&self) -> Result<()> {
        for path in std::iter::once(&self.out).chain(&self.png) {
            super::print(&path.display().to_string())?;
        }
        Ok(())
    }

    /// Where the samples of an unfinished picture are kept.
    pub fn partial(&self) -> Result<PathBuf> {
        let mut name = self.out.clone().into_os_string();
        name.push(".partial");
        let path = PathBuf::from(name);
        output::check_file(&path).map(|()| path)
    }
}
