//! A picture by path tracing as an order: what is wanted, and the work in small steps.

use serde::Serialize;

use super::allotment::{Aim, PILOT};
use super::film::Film;
use super::points::Points;
use super::view::{Filter, Lens, View};
use super::world::World;
use crate::error::Result;
use crate::scene::Scene;
use crate::tables::TableSet;

/// What a picture is to show, apart from the scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Exposure {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// When the shutter opens, s of the scene's time.
    pub time: f64,
    /// How long it stays open, s; clouds move and change meanwhile.
    pub shutter: f64,
    /// In place of the pinhole.
    pub lens: Option<Lens>,
    /// Where samples lie in a pixel.
    pub filter: Filter,
    /// Another seed is another set of paths.
    pub seed: u64,
    /// How noisy pixels may be that get as many paths as that takes; none where all get the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aim: Option<Aim>,
}

/// Paths of one step of work: a second or so, with clouds.
const STEP_PATHS: u32 = 1 << 14;

/// The stream of points for times is no pixel's.
const NO_PIXEL: u64 = u64::MAX;

impl Exposure {
    /// The time that a round of samples sees, s: over all rounds evenly spread over the time that
    /// the shutter is open. All pixels share it, since moving the clouds takes as long as many
    /// paths.
    pub fn sample_time(&self, sample: u32) -> f64 {
        self.time + self.shutter * Points::new(self.seed, NO_PIXEL, 0).at(sample)[0]
    }

    /// Samples a pixel after which it is decided how many each pixel is to get in all, if that is.
    pub fn pilot(&self) -> Option<u32> {
        self.aim.filter(|aim| aim.most > PILOT).map(|_| PILOT)
    }

    /// Adds samples to a film until every pixel has `samples`, or as many as it wants where there is
    /// an aim. `step` hears of every step, and may end the work by an error.
    pub fn expose(
        &self,
        scene: &Scene,
        tables: &TableSet,
        film: &mut Film,
        samples: u32,
        mut step: impl FnMut(&Film) -> Result<()>,
    ) -> Result<()> {
        if film.samples >= samples {
            return Ok(());
        }
        let view = View::new(&scene.camera, self.size, self.lens, self.filter);
        let mut time = self.sample_time(film.samples);
        let mut world = World::new(scene, tables, time)?;
        let rows = STEP_PATHS.div_ceil(self.size[0]);
        let last = |film: &Film| film.wanted.iter().copied().max().unwrap_or(samples).min(samples);
        while film.samples < last(film) {
            if let Some(aim) = self.aim.filter(|_| Some(film.samples) == self.pilot())
                && film.rows == 0
            {
                film.wanted = aim.allot(film);
            }
            let wanted = self.sample_time(film.samples);
            if wanted != time {
                world.set_time(wanted)?;
                time = wanted;
            }
            world.expose_rows(film, &view, self.seed, rows);
            step(film)?;
        }
        Ok(())
    }
}
