//! The density of a shape as bytes: what a march through it reads, here and in a texture.

use glam::Vec3;

use crate::error::{Error, Result};
use crate::medium::Shape;
use crate::medium::shape::{VOLUME_CELL, VOLUME_FULL, VOLUME_NODES};

/// Nodes of a volume.
pub const NODES: usize = VOLUME_NODES * VOLUME_NODES * VOLUME_NODES;

/// The density volume of a noise shape: the same function as [`Shape::density`] in the sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityVolume(Vec<u8>);

impl DensityVolume {
    /// Of a noise shape.
    pub fn of(shape: &Shape) -> Self {
        Self(shape.volume().iter().map(|d| (d * VOLUME_FULL).round() as u8).collect())
    }

    /// From the bytes of a file, x fastest.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self> {
        if bytes.len() != NODES {
            return Err(Error::input(
                "density volume",
                format!("expected {NODES} values, found {}", bytes.len()),
            ));
        }
        Ok(Self(bytes))
    }

    /// The nodes, x fastest, then y, then z; 255 is density 1.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// Density at a point of -1..1 in all axes, trilinear.
    pub fn density(&self, x: Vec3) -> f32 {
        const N: usize = VOLUME_NODES;
        let p = (x + 1.0) * (1.0 / VOLUME_CELL as f32);
        let cell = p.clamp(Vec3::ZERO, Vec3::splat((N - 2) as f32)).floor();
        let f = (p - cell).clamp(Vec3::ZERO, Vec3::ONE);
        let base = cell.x as usize + N * (cell.y as usize + N * cell.z as usize);
        // One bounds check for all eight corners.
        let Some(v) = self.0.get(base..base + N * N + N + 2) else { return 0.0 };
        let row = |i: usize| {
            let (a, b) = (f32::from(v[i]), f32::from(v[i + 1]));
            a + f.x * (b - a)
        };
        let near = row(0) + f.y * (row(N) - row(0));
        let far = row(N * N) + f.y * (row(N * N + N) - row(N * N));
        (near + f.z * (far - near)) / VOLUME_FULL
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::optical_depth::random::Stream;

    #[test]
    fn is_the_shape_itself() {
        let shape = Shape::new("soft-3".parse().expect("a shape"));
        let volume = DensityVolume::of(&shape);
        for i in 0..2000 {
            let mut random = Stream::new(5, i);
            let x = random.on_sphere() * random.uniform();
            let difference = f64::from(volume.density(x.as_vec3())) - shape.density(x);
            // A place in f32 is off by 4e-6 cells, neighbours differ by less than 1.
            assert!(difference.abs() < 1e-5, "{x} {difference}");
        }
        assert!(DensityVolume::from_bytes(vec![0; NODES - 1]).is_err());
    }
}
