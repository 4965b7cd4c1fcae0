//! Plain Rust twins of the shader functions, for the tests, for quantities the host needs itself,
//! and for the reference. One file per WGSL file of the same stem.

pub mod air_shadow;
pub mod atmosphere;
pub mod blend;
pub mod light;
pub mod light_grid;
pub mod light_project;
pub mod lighting;
pub mod noise;
pub mod octaves;
pub mod rings;
pub mod scan;
pub mod screen_project;
pub mod sea;
pub mod segments;
pub mod shadow;
pub mod sky;
pub mod sky_march;
pub mod sort;
pub mod tile_lists;
pub mod tonemap;
pub mod weather;
