//! How a long computation tells how far it is.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Hears of the steps of a long computation, from any of its threads.
pub trait Progress: Sync {
    /// A stage begins: `total` steps of `what`, in a few words ("optical depth of soft-1").
    /// It replaces the stage before.
    fn start(&self, total: u64, what: &str);

    /// `steps` more steps of the stage are done.
    fn advance(&self, steps: u64);
}

/// Nobody listens.
pub struct Silent;

impl Progress for Silent {
    fn start(&self, _total: u64, _what: &str) {}

    fn advance(&self, _steps: u64) {}
}

/// Counts the stages of a computation that has several: "2/7 optical depth of soft-1".
pub struct Numbered<'a> {
    inner: &'a dyn Progress,
    stages: usize,
    begun: AtomicUsize,
}

impl<'a> Numbered<'a> {
    /// Tells `inner` of `stages` stages.
    pub fn new(inner: &'a dyn Progress, stages: usize) -> Self {
        Self { inner, stages, begun: AtomicUsize::new(0) }
    }
}

impl Progress for Numbered<'_> {
    fn start(&self, total: u64, what: &str) {
        let stage = self.begun.fetch_add(1, Ordering::Relaxed) + 1;
        self.inner.start(total, &format!("{stage}/{} {what}", self.stages));
    }

    fn advance(&self, steps: u64) {
        self.inner.advance(steps);
    }
}
