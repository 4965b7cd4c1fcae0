//! How a long computation tells how far it is.

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
