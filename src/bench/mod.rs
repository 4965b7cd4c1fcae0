//! Measurements of the renderer: run time against error.
//!
//! `cases` are the fixed scenes, `run` flies them, `curve` sets run time against error, `motion`
//! tells what frames owe to the frames before them (`flicker`, `traced_flicker`), `popping` what borders of rings
//! do to a flight, `clumps` how near light
//! among overlapping particles comes to path tracing, beside cheaper lightings, `scaling` how the cost grows, `fetches` what of the blend are look-ups, `march` is the
//! ray marcher to beat, `marched` sets it beside the frame at equal error. `record` is what comes of it, `tables` and `report` write it, `compare` sets two of them side by side.

pub mod cases;
pub mod clumps;
pub mod compare;
pub mod curve;
pub mod errors;
pub mod fetches;
pub mod flicker;
pub mod front;
pub mod machine;
pub mod march;
pub mod marched;
pub mod motion;
pub mod popping;
pub mod readme;
pub mod record;
pub mod report;
pub mod run;
#[cfg(test)]
mod samples;
pub mod scaling;
pub mod session;
pub mod statistics;
pub mod summary;
pub mod tables;
pub mod traced_flicker;
pub mod variants;
