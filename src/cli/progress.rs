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
        self.advance(1, free);
    }

    /// So many steps are done.
    pub fn advance(&self, done: u64, free: bool) {
        let before = self.bar.position();
        self.bar.inc(done);
        if free {
            self.bar.reset_eta();
        }
        let steps = self.bar.length().unwrap_or(0);
        if self.lines && worth_a_line(before, before + done, steps) {
            let left = self.bar.eta().as_secs();
            // Nowhere is left to report a closed standard error.
            let _ = writeln!(
                std::io::stderr(),
                "{} {}/{steps}, about {left} s left",
                self.what,
                before + done
            );
        }
    }

    /// There are other steps in all than was thought.
    pub fn set_length(&self, steps: u64) {
        if self.bar.length() != Some(steps) {
            self.bar.set_length(steps);
        }
    }

    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Whether a log hears of these steps: every tenth of the way, and the last.
fn worth_a_line(before: u64, done: u64, steps: u64) -> bool {
    before < done && (done == steps || tenths(done, steps) != tenths(before, steps))
}

/// Tenths of the way that are done.
fn tenths(done: u64, all: u64) -> u64 {
    10 * done.min(all) / all.max(1)
}

/// Stages of computing tables: a bar for each on a terminal, a line for each in a log.
pub struct StageBar {
    bar: ProgressBar,
    lines: bool,
}

impl StageBar {
    /// Draws nothing before the first stage.
    pub fn new() -> Self {
        let bar = ProgressBar::new(0);
        if let Ok(style) =
            ProgressStyle::with_template("{msg:34} {wide_bar} {percent:>3} %  {eta} left")
        {
            bar.set_style(style);
        }
        let lines = bar.is_hidden();
        Self { bar, lines }
    }
}

impl Default for StageBar {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for StageBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl crate::tables::Progress for StageBar {
    fn start(&self, total: u64, what: &str) {
        if self.lines {
            // Nowhere is left to report a closed standard error.
            let _ = writeln!(std::io::stderr(), "{what}");
            return;
        }
        self.bar.set_length(total);
        self.bar.set_position(0);
        self.bar.reset_eta();
        self.bar.set_message(what.to_owned());
        self.bar.enable_steady_tick(Duration::from_millis(250));
    }

    fn rename(&self, what: &str) {
        if self.lines {
            let _ = writeln!(std::io::stderr(), "{what}");
        }
        self.bar.set_message(what.to_owned());
    }

    fn advance(&self, steps: u64) {
        let before = self.bar.position();
        self.bar.inc(steps);
        let all = self.bar.length().unwrap_or(0);
        if self.lines && tenths(before + steps, all) != tenths(before, all) {
            let percent = 10 * tenths(before + steps, all);
            let _ = writeln!(std::io::stderr(), "{} {percent} %", self.bar.message());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_hears_of_ten_steps_whatever_their_number() {
        for (steps, lines) in [(1, 1), (4, 4), (10, 10), (11, 10), (1000, 10), (12_345, 10)] {
            let told = (1..=steps).filter(|&done| worth_a_line(done - 1, done, steps)).count();
            assert_eq!(told, lines, "{steps} steps");
        }
        assert!(worth_a_line(999, 1000, 1000));
    }
}
