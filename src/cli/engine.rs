//! Joins the command line to the renderer.

use std::path::Path;

use super::progress::StageBar;
use super::render::{Job, eprint_line};
use crate::error::Result;
use crate::frame::{Picture, Renderer};
use crate::gpu::Gpu;
use crate::scene::Scene;
use crate::tables::TableSet;

/// Makes the device and the renderer for a job: a function from scene and time (s) to picture.
pub(super) fn renderer(
    job: &Job,
    tables: Option<&Path>,
) -> Result<impl FnMut(&Scene, f64) -> Result<Picture>> {
    let (mut renderer, _) = made(job, tables)?;
    let size = job.size;
    Ok(move |scene: &Scene, time| renderer.render(scene, time, size))
}

/// Makes the device and the renderer for a job, and the tables with its medium.
pub(super) fn made(job: &Job, tables: Option<&Path>) -> Result<(Renderer, TableSet)> {
    let tables = tables_of(tables)?;
    let medium = &job.scene.medium;
    if tables.scattering_for(&medium.phase, medium.albedo).is_none() {
        eprint_line(&format!(
            "the tables hold no scattering of {} with albedo {}: it is computed now, in a minute \
             or so, and kept for the next time",
            medium.phase, medium.albedo
        ));
    }
    let tables = tables.with_scattering_for(&medium.phase, medium.albedo, &StageBar::new())?;
    job.scene.check_shapes(&job.place, &tables.shape_names().collect::<Vec<_>>())?;
    let gpu = Gpu::headless()?;
    let mut renderer = Renderer::new(&gpu, &tables, &job.scene, &job.settings)?;
    renderer.set_opaque(job.opaque.as_ref().map(|picture| picture.upload(&gpu, 0)).transpose()?);
    Ok((renderer, tables))
}

/// What the tables of a file, or the built-in ones, hold, in lines for people.
pub(super) fn tables_summary(path: Option<&Path>) -> Result<Vec<String>> {
    // What is indented is detail: `precompute info` shows it.
    Ok(tables_of(path)?.summary().into_iter().filter(|line| !line.starts_with(' ')).collect())
}

/// The tables of a file, or the built-in ones.
pub(super) fn tables_of(path: Option<&Path>) -> Result<TableSet> {
    path.map_or_else(TableSet::embedded, TableSet::load)
}
