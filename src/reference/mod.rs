//! The reference: light through the very particles, density and phase function of the frame, by
//! unbiased path tracing on the host. It says how wrong a picture is.

mod atmosphere_sky;
mod fluxes;
mod geometry;
mod particles;
mod picture;
mod random;
mod slab;
mod statistics;
mod transport;
mod uniform_sky;
mod world;

pub use atmosphere_sky::AtmosphereSky;
pub use fluxes::{SlabFluxes, slab_fluxes};
pub use geometry::{Medium, Piece, Ray, first_collision, transmittance};
pub use particles::{ParticleGrid, WorldParticle};
pub use picture::{Film, Pixel};
pub use random::Random;
pub use slab::Slab;
pub use statistics::{Estimate, Moments};
pub use transport::{
    Flight, Matter, Seen, Surroundings, cone_direction, fly, look, radiance, scatter, turned,
};
pub use uniform_sky::{SunDisc, UniformSky, distance_to_ground, ground_normal};
pub use world::{Place, World};
