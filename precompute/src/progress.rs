//! A bar on standard error for the stages of a bake.

use std::time::Duration;

use cumuli::tables::Progress;
use indicatif::{ProgressBar, ProgressStyle};

/// Draws one bar, which begins anew with every stage. Where standard error is not a terminal
/// nothing is drawn.
pub struct Bar(ProgressBar);

impl Bar {
    /// A bar before its first stage.
    pub fn new() -> Self {
        let bar = ProgressBar::new(0);
        let template = "{msg:32} {wide_bar} {percent:>3} %  {eta} left, {elapsed} so far";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(250));
        Self(bar)
    }

    /// Takes the bar off the screen.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

impl Progress for Bar {
    fn start(&self, total: u64, what: &str) {
        self.0.set_length(total);
        self.0.set_position(0);
        self.0.reset_eta();
        self.0.set_message(what.to_owned());
    }

    fn advance(&self, steps: u64) {
        self.0.inc(steps);
    }
}
