//! The reference: light through the very particles, density and phase function of the frame, by
//! unbiased path tracing on the host. It says how wrong a picture is.

mod fluxes;
mod geometry;
mod particles;
mod random;
mod slab;
mod statistics;
mod transport;

pub use fluxes::{SlabFluxes, slab_fluxes};
pub use geometry::{Medium, Piece, Ray, first_collision, transmittance};
pub use particles::{ParticleGrid, WorldParticle};
pub use random::Random;
pub use slab::Slab;
pub use statistics::{Estimate, Moments};
pub use transport::{Flight, Matter, Surroundings, cone_direction, fly, radiance, scatter, turned};
