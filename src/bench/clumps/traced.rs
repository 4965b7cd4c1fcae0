//! Path-traced pictures that are kept: a second run takes them over, and goes on with those that were not finished.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::bench::session::Listener;
use crate::output::fingerprint_of;
use crate::reference::{Exposure, Film, Filter, partial};
use crate::scene::Scene;
use crate::tables::TableSet;
use crate::{Error, Result};

/// Between two savings.
const SAVE_EVERY: Duration = Duration::from_secs(20);

/// Where references lie, and what they are made with.
pub struct Traced<'a> {
    /// The folder.
    pub folder: &'a Path,
    /// What tells this build of the program from others.
    pub program: &'a str,
    /// The table file, or "embedded".
    pub tables_name: &'a str,
    /// The tables.
    pub tables: &'a TableSet,
    /// Paths a pixel.
    pub spp: u32,
}

/// What samples belong to.
#[derive(Serialize)]
struct Key<'a> {
    program: &'a str,
    scene: String,
    tables: &'a str,
    #[serde(flatten)]
    exposure: Exposure,
}

impl Traced<'_> {
    /// Where the samples of a picture are kept.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.samples"))
    }

    /// The picture of a scene at time 0; `listener` hears of every path of a pixel.
    pub fn film(
        &self,
        name: &str,
        scene: &Scene,
        size: [u32; 2],
        listener: &mut dyn Listener,
    ) -> Result<Film> {
        let filter = Filter::Box;
        let exposure =
            Exposure { size, time: 0.0, shutter: 0.0, lens: None, filter, seed: 0, aim: None };
        let key = Key {
            program: self.program,
            scene: fingerprint_of(scene.identity()?.as_bytes()),
            tables: self.tables_name,
            exposure,
        };
        let key = serde_json::to_string(&key).map_err(|e| Error::Failed(format!("JSON: {e}")))?;
        let file = self.file(name);
        // Samples of another scene or build are of no use, and made anew.
        let mut film = match partial::load(&file, &key, size)? {
            partial::Found::Same(film) => film,
            partial::Found::Nothing | partial::Found::Other => Film::new(size),
        };
        let (mut seen, mut saved) = (film.samples, Instant::now());
        listener.begin(u64::from(self.spp.saturating_sub(seen)), "paths of each pixel");
        exposure.expose(scene, self.tables, &mut film, self.spp, |film| {
            while seen < film.samples {
                listener.step();
                seen += 1;
            }
            if saved.elapsed() >= SAVE_EVERY {
                partial::save(&file, &key, film)?;
                saved = Instant::now();
            }
            Ok(())
        })?;
        partial::save(&file, &key, &film)?;
        Ok(film)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Steps(u64);

    impl Listener for Steps {
        fn begin(&mut self, _: u64, _: &'static str) {}
        fn step(&mut self) {
            self.0 += 1;
        }
    }

    #[test]
    fn what_is_there_is_taken_over_and_gone_on_with() {
        let folder = tempfile::tempdir().expect("a folder");
        let tables = TableSet::embedded().expect("built in");
        let clump = super::super::layout::clumps(&tables, 0).expect("clumps").remove(0);
        let traced = |spp, program| {
            let (folder, tables_name) = (folder.path(), "embedded");
            let traced = Traced { folder, program, tables_name, tables: &tables, spp };
            let mut steps = Steps(0);
            let film = traced.film("some", &clump.scene, [6, 4], &mut steps).expect("a film");
            (film, steps.0)
        };
        let (first, steps) = traced(3, "this");
        assert_eq!((first.samples, steps), (3, 3));
        assert_eq!(traced(3, "this"), (first.clone(), 0));
        let (more, steps) = traced(5, "this");
        assert_eq!((more.samples, steps), (5, 2));
        assert_eq!(traced(4, "another").1, 4, "another build takes nothing over");
        // Gone on with, it is what it is when it is made at once.
        assert_eq!(traced(5, "this"), (more, 5));
    }
}
