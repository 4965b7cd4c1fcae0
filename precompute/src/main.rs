//! Precompute.
fn main() {}
