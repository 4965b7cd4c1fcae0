//! Cumuli.
fn main() {}
