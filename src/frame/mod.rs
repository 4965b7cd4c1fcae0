//! One frame, pass by pass in the order data flows.

pub mod picture;
pub mod settings;

pub use picture::{Counters, FrameStats, PassTime, Picture};
pub use settings::{Preset, RenderSettings};
