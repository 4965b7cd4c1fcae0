//! The reference: light through the very particles, density and phase function of the frame, by
//! unbiased path tracing on the host. It says how wrong a picture is.

mod air_light;
mod allotment;
mod atmosphere_sky;
mod bounds;
mod develop;
mod exact;
mod exact_frame;
mod film;
mod fluxes;
mod geometry;
mod grid;
mod job;
pub mod partial;
mod particles;
mod points;
mod published;
mod random;
mod sea;
mod sky_map;
mod slab;
mod speed;
mod statistics;
mod sunlight;
mod transport;
mod uniform_sky;
mod view;
mod walk;
mod world;

pub use air_light::air_change;
pub use allotment::{Aim, PILOT};
pub use atmosphere_sky::AtmosphereSky;
pub use develop::picture;
pub use exact::{AIR_STEPS, Exact, ExactPixel, SunTruth};
pub use exact_frame::{Window, check_composed, exact_frame, exact_frame_before};
pub use film::{CHANNELS, Film, Pixel};
pub use fluxes::{SlabFluxes, scatterings, slab_fluxes};
pub use geometry::{Medium, Piece, Ray, first_collision, transmittance};
pub use grid::ParticleGrid;
pub use job::Exposure;
pub use particles::WorldParticle;
pub use points::Points;
pub use published::{Check, MOST_Z, verify};
pub use random::Random;
pub use slab::Slab;
pub use speed::{Speed, speed};
pub use statistics::{Estimate, Moments};
pub use sunlight::Lobes;
pub use transport::{
    AirHere, AirLobe, Flight, Matter, Seen, Surroundings, cosine_direction, fly, look, radiance,
    scatter, turned,
};
pub use uniform_sky::{SunDisc, UniformSky, distance_to_ground, ground_normal};
pub use view::{Filter, Lens, View};
pub use world::{Densities, Place, World};
