//! One frame, pass by pass in the order data flows:
//! rings → project → sort → tile lists → light → shadow → air shadow → blend → resolve → tone map.

pub mod air_shadow;
pub mod blend;
pub mod blend_areas;
pub mod changes;
pub mod composer;
pub mod cpu;
pub mod gpu_data;
pub mod in_view;
pub mod light;
pub mod light_grid;
pub mod opaque;
pub mod passes;
pub mod picture;
pub mod picture_lists;
pub mod plan;
pub mod population;
pub mod renderer;
pub mod resolve;
pub mod resources;
pub mod reuse;
pub mod rings;
pub mod scan;
pub mod sea;
pub mod settings;
pub mod shadow;
pub mod sky;
pub mod sort;
pub mod stats;
pub mod sun_at;
pub mod targets;
pub mod tile_lists;
pub mod tonemap;
pub mod view;
pub mod weather;

pub use light_grid::Directions;
pub use opaque::{DepthKind, Opaque, OpaquePicture, Surface};
pub use picture::{Counters, FrameStats, PassTime, Picture};
pub use plan::{FramePlan, Pass};
pub use renderer::Renderer;
pub use settings::{Lighting, Preset, Quality, RenderSettings};
