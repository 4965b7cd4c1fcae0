//! A bench on one line, and what is wrong with it whatever the clock says.

use super::record::{Bench, PictureError, PointKind};
use crate::{Error, Result};

impl Bench {
    /// The figures that matter on one line, as NAME=VALUE separated by spaces.
    pub fn summary(&self) -> String {
        let word = |text: &str| text.replace(|c: char| c.is_whitespace() || c == '=', "_");
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
        for popping in &self.popping {
            let name = format!("{}:{}", word(&popping.case), popping.preset);
            words.push(format!("{name}_popping={:.6}", popping.fading.rms));
            words.push(format!("{name}_popping_at_once={:.6}", popping.at_once.rms));
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

#[cfg(test)]
mod tests {
    use crate::bench::samples::bench;

    /// Whatever files and adapters are called, a script finds every figure by its name.
    #[test]
    fn every_word_is_a_name_and_a_value() {
        let mut odd = bench("my=clouds, \"new\"\n1", &[1.5, 2.5]);
        odd.machine.adapter = "a = b".to_owned();
        let line = odd.summary();
        assert!(!line.contains('\n'), "{line}");
        let mut words = line.split(' ');
        assert_eq!(words.next(), Some("bench"));
        let words: Vec<_> = words.map(|w| w.split_once('=').expect(w)).collect();
        assert!(words.iter().all(|(_, value)| !value.is_empty() && !value.contains('=')), "{line}");
        let find = |name: &str| words.iter().find(|w| w.0 == name).expect(name).1;
        assert_eq!(find("my_clouds,_\"new\"_1:low_ms"), "2.000");
        assert_eq!(find("adapter"), "a___b");
    }

    #[test]
    fn what_was_left_out_is_told() {
        let mut short = bench("case", &[1.0]);
        assert!(short.check().is_ok());
        short.runs[0].frames[0].counters.overflowed = 3;
        let message = short.check().expect_err("lists that overflowed").to_string();
        assert!(message.contains("left 3 particles"), "{message}");
    }
}
