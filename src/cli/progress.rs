//! What is done, what remains, and how long that will take, on standard error.

use std::io::Write;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Progress over a known number of steps: a bar on a terminal, and a line now and then in a log.
pub(super) struct Progress {
    bar: ProgressBar,
    what: &'static str,
    lines: bool,
}

impl Progress {
    pub fn new(steps: u64, what: &'static str) -> Self {
        let bar = ProgressBar::new(steps).with_message(what);
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}  {eta} left")
        {
            bar.set_style(style);
        }
        let lines = bar.is_hidden();
        if !lines {
            bar.enable_steady_tick(Duration::from_millis(250));
        }
        Self { bar, what, lines }
    }

    /// One step is done; `free` says that it took no time, so the estimate starts after it.
    pub fn step(&self, free: bool) {
        let before = self.bar.position();
        self.bar.inc(1);
        if free {
            self.bar.reset_eta();
        }
        let steps = self.bar.length().unwrap_or(0);
        if self.lines && worth_a_line(before + 1, steps) {
            // Nowhere is left to report a closed standard error.
            let _ = writeln!(std::io::stderr(), "{} {}/{steps}", self.what, before + 1);
        }
    }

    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Whether a log hears of this step: every tenth of the way, and the last.
fn worth_a_line(done: u64, steps: u64) -> bool {
    const LINES: u64 = 10;
    done == steps || done * LINES / steps.max(1) != (done - 1) * LINES / steps.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_hears_of_ten_steps_whatever_their_number() {
        for (steps, lines) in [(1, 1), (4, 4), (10, 10), (11, 10), (1000, 10), (12_345, 10)] {
            let told = (1..=steps).filter(|&done| worth_a_line(done, steps)).count();
            assert_eq!(told, lines, "{steps} steps");
        }
        assert!(worth_a_line(1000, 1000));
    }
}
