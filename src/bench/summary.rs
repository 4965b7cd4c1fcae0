//! A bench on one line, and what is wrong with it whatever the clock says.

use super::record::{Bench, PictureError, PointKind};
use crate::{Error, Result};

impl Bench {
    /// The figures that matter on one line, as NAME=VALUE separated by spaces.
    pub fn summary(&self) -> String {
        let word = |text: &str| text.replace(char::is_whitespace, "_");
        let [width, height] = self.settings.size;
        let mut words = vec![
            format!("bench schema={}", self.schema),
            format!("commit={}", word(&self.machine.commit)),
            format!("adapter={}", word(&self.machine.adapter)),
            format!("size={width}x{height}"),
        ];
        let runs = self
            .runs
            .iter()
            .map(|run| format!("{}:{}_ms={:.3}", word(&run.case), run.preset, run.wall_ms.median));
        words.extend(runs);
        for curve in &self.curves {
            for point in curve.points.iter().filter(|p| p.kind == PointKind::Preset) {
                let name = format!("{}:{}", word(&curve.scene), point.name);
                let mut add = |what: &str, error: Option<PictureError>| {
                    if let Some(error) = error {
                        words.push(format!("{name}_{what}_relmse={:.6}", error.rel_mse));
                    }
                };
                add("model", point.model);
                add("algorithm", point.algorithm);
            }
        }
        words.join(" ")
    }

    /// What can be wrong with the frames without any clock: a sentence, where something is.
    pub fn check(&self) -> Result<()> {
        for run in &self.runs {
            for frame in &run.frames {
                if frame.counters.overflowed != 0 {
                    return Err(Error::Failed(format!(
                        "frame {} of {} left {} particles and list entries out",
                        frame.frame, run.case, frame.counters.overflowed
                    )));
                }
            }
        }
        Ok(())
    }
}
