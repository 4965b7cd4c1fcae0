//! How far two pictures are apart.

pub mod flip;
