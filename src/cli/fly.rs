//! `cumuli fly`: the window.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::args::{self, Size};
use super::progress::StageBar;
use super::{engine, render};
use crate::error::Result;
use crate::frame::Preset;
use crate::scene::CameraPath;
use crate::window::{self, WindowOptions};

/// Arguments of `cumuli fly`.
#[derive(Args, Debug)]
pub struct FlyArgs {
    /// Scene file; without it, the built-in fair-weather cumulus
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Width and height of the window in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720")]
    pub size: Size,
    /// Time at the start, in seconds
    #[arg(long, value_name = "S", default_value = "0", value_parser = args::time, allow_negative_numbers = true)]
    pub time: f64,
    /// Quality against time; without it, high on a graphics card and low without one
    #[arg(long, value_enum)]
    pub preset: Option<Preset>,
    /// Camera path to fly along with P
    #[arg(long, value_name = "FILE")]
    pub path: Option<PathBuf>,
    /// Table file made by precompute; without it, the built-in tables
    #[arg(long, value_name = "FILE")]
    pub tables: Option<PathBuf>,
}

impl Default for FlyArgs {
    /// What `cumuli` without arguments shows.
    fn default() -> Self {
        Self {
            scene: None,
            size: Size([1280, 720]),
            time: 0.0,
            preset: None,
            path: None,
            tables: None,
        }
    }
}

/// Runs the command.
pub(super) fn run(args: &FlyArgs) -> Result<()> {
    let begun = Instant::now();
    let (scene, place) = render::load_scene(args.scene.as_deref())?;
    let path = args.path.as_deref().map(CameraPath::load).transpose()?;
    let tables = engine::tables_of(args.tables.as_deref())?;
    let medium = &scene.medium;
    let tables = tables.with_scattering_for(&medium.phase, medium.albedo, &StageBar::new())?;
    scene.check_shapes(&place, &tables.shape_names().collect::<Vec<_>>())?;
    window::run(WindowOptions {
        scene,
        file: args.scene.clone(),
        path,
        tables,
        time: args.time,
        preset: args.preset,
        size: args.size.0,
        begun,
    })
}
