//! Each pass of the frame, and what passes share, against a plain computation of the same thing.

#[path = "../common/mod.rs"]
mod common;
mod functions;
mod growth;
mod guards;
mod light;
mod light_grid;
mod noise;
mod numerics;
mod pictures;
mod project;
mod reuse;
mod rings;
mod scan;
mod shadow;
mod sort;
mod tile_lists;
mod weather;
