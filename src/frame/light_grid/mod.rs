//! Light grid: the light that clouds scatter among themselves, by discrete ordinates on nested
//! grids. `levels` says where they lie, `inputs` what they depend on, `pass` runs the shaders
//! `light_grid.wgsl` (solves) and `light_field.wgsl` (what the eye sees of it).

mod inputs;
mod levels;
mod pass;

pub use inputs::{GridInputs, GridSettings, Spreads, scale_field, scale_particles};
pub use levels::{Levels, of_field, of_list};
pub use pass::{GridMedium, GridSize, GridWork, LightGrid, LightGridPass};
