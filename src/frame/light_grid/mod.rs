//! Light grid: the light that clouds scatter among themselves, by discrete ordinates on nested
//! grids. `levels` says where they lie, `directions` where light travels, `inputs` what they depend on, `sky_light` what comes in from above, `relaxation` how far the turns
//! go, `job` holds the buffers, `pass` runs the shaders `light_grid_matter.wgsl` (fills the cells),
//! `light_grid.wgsl` (solves) and `light_field.wgsl` (what the eye sees of it), `grid` says when.

mod directions;
mod grid;
mod inputs;
mod job;
mod levels;
mod pass;
mod relaxation;
mod sky_light;
mod slots;

pub use directions::Directions;
pub use grid::{GridOrder, GridWork, LightGrid};
pub use inputs::{GridInputs, GridSettings, Spreads, scale_field, scale_particles};
pub use job::GridSize;
pub use levels::{GridRoom, Levels, of_field, of_list};
pub use pass::{GridMedium, GridWith, LightGridPass};
pub use relaxation::{LARGEST_EIGENVALUE, least_eigenvalue, relaxations};
