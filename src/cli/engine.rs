//! Joins the command line to the renderer.

use std::path::Path;

use super::render::Job;
use crate::error::Result;
use crate::frame::{Picture, Renderer};
use crate::gpu::Gpu;
use crate::tables::TableSet;

/// Makes the device and the renderer for a job: a function from time (s) to picture.
pub(super) fn renderer(
    job: &Job,
    tables: Option<&Path>,
) -> Result<impl FnMut(f64) -> Result<Picture>> {
    let _ = tables;
    let tables = TableSet::embedded()?;
    job.scene.check_shapes(&job.place, &tables.shape_names().collect::<Vec<_>>())?;
    let gpu = Gpu::headless()?;
    let mut renderer = Renderer::new(&gpu, &tables, &job.scene, &job.settings)?;
    let (scene, size) = (job.scene.clone(), job.size);
    Ok(move |time| renderer.render(&scene, time, size))
}

pub(super) fn tables_summary(_path: Option<&Path>) -> Result<Vec<String>> {
    Ok(Vec::new())
}
