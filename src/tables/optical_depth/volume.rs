//! The density of a shape as bytes: what a march through it reads, here and in a texture.

use std::sync::LazyLock;

use glam::Vec3;

use crate::error::{Error, Result};
use crate::medium::Shape;
use crate::medium::shape::{VOLUME_NODES, volume_byte, volume_density};

/// Nodes of the full volume.
pub const NODES: usize = VOLUME_NODES * VOLUME_NODES * VOLUME_NODES;
/// Radii of a particle on screen, in pixels, below which the first and the second filtered copy are
/// read where matter is thin, and the optical radii at which they are half of that.
///
/// The mean of a pixel's transmittances is not that of its mean density: a copy spreads a little of
/// deep matter over the outline, which makes the whole pixel dark, the more the deeper it is.
/// `distant_tests` measures where each copy is closest to a supersampled picture of single particles: the
/// first begins to be closer than the density at 12, 9, 7, 6, 5, and 2 pixels for optical radii of 1, 4, 8, 16,
/// 32, and 64, and never from 256 on; the second closer than the first at 4.3, 2.6, and 1.7 pixels for 1, 4, and 8,
/// and never from 16 on. In pictures of crowds (`tests/frame/distant.rs`) the second serves a little less far,
/// and these constants are closest there: at an optical radius of 1.5 the error of radiance is 0.754 of that
/// without copies, that of opacity 0.888; by size alone, below 9 and 3 pixels, 0.757 and 0.898; with 5.5 and 3
/// for the second copy 0.764 and 0.925. A third one, of 8 nodes along an edge, is closest nowhere.
pub const COPY_PIXELS: [f32; VOLUMES - 1] = [11.0, 5.0];
/// See [`COPY_PIXELS`].
pub const COPY_DEPTHS: [f32; VOLUMES - 1] = [12.0, 2.0];
/// Volumes of a shape, the filtered copies among them.
pub const VOLUMES: usize = 3;

/// The densities that bytes hold.
static DENSITIES: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| volume_density(byte as u8).to_f32()));

/// Pixels in a radian around a ray, in a picture of so many pixels across half of which is `tangent` wide; `cosine`
/// is that of the ray's angle to the view axis. A rectilinear picture stretches things by 1 / cosine along circles
/// around its middle and by the square of that across them: here the mean by area. Twin of the function in the
/// shader.
pub fn pixels_per_radian(width: u32, tangent: f64, cosine: f64) -> f64 {
    0.5 * f64::from(width) / (tangent * cosine * cosine.sqrt())
}

/// The copy for a particle of this radius on screen, in pixels, and this optical depth of its mean
/// density over a radius; twin of `copy_for` in the shader.
pub fn copy_for(radius_pixels: f32, optical_radius: f32) -> usize {
    let serves = |most: &f32, half: &f32| radius_pixels * (1.0 + optical_radius / half) < *most;
    COPY_PIXELS.iter().zip(&COPY_DEPTHS).filter(|(most, half)| serves(most, half)).count()
}

/// The density of a noise shape over -1..1 in all axes: the same function as [`Shape::density`] in
/// the sphere; or a filtered copy.
///
/// A pixel that is wider than the distance of nodes shows the mean of many chords. The mean of
/// parallel chords is the chord of the averaged density, so filtering the three axes of the volume
/// filters all four of the chords, and no chord ever mixes with one that is not its neighbour.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityVolume {
    /// Nodes along an edge.
    nodes: usize,
    bytes: Vec<u8>,
}

impl DensityVolume {
    /// Of a noise shape.
    pub fn of(shape: &Shape) -> Self {
        let bytes = shape.volume().iter().map(|d| volume_byte(*d)).collect();
        Self { nodes: VOLUME_NODES, bytes }
    }

    /// From the bytes of a file, x fastest.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self> {
        if bytes.len() != NODES {
            return Err(Error::input(
                "density volume",
                format!("expected {NODES} values, found {}", bytes.len()),
            ));
        }
        Ok(Self { nodes: VOLUME_NODES, bytes })
    }

    /// Nodes along each edge.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// The nodes, x fastest, then y, then z; 255 is density 1.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The volume and its copies.
    pub(super) fn with_copies(self) -> Vec<Self> {
        let mut volumes = vec![self];
        for i in 1..VOLUMES {
            let copy = volumes[i - 1].halved();
            volumes.push(copy);
        }
        volumes
    }

    /// Half the nodes along each edge, each the mean of the finer nodes around it, weighted by a
    /// tent that reaches to the next coarse node.
    fn halved(&self) -> Self {
        let nodes = self.nodes / 2;
        let mut values: Vec<f32> = self.bytes.iter().map(|b| f32::from(*b)).collect();
        // Each round filters the fastest axis and makes it the slowest.
        for _ in 0..3 {
            values = tents(&values, self.nodes, nodes);
        }
        Self { nodes, bytes: values.into_iter().map(|v| v.round() as u8).collect() }
    }

    /// Density at a point of -1..1 in all axes, trilinear; the outermost nodes lie on the faces.
    pub fn density(&self, x: Vec3) -> f32 {
        let n = self.nodes;
        let p = (x + 1.0) * (0.5 * (n - 1) as f32);
        let cell = p.clamp(Vec3::ZERO, Vec3::splat((n - 2) as f32)).floor();
        let f = (p - cell).clamp(Vec3::ZERO, Vec3::ONE);
        let base = cell.x as usize + n * (cell.y as usize + n * cell.z as usize);
        // One bounds check for all eight corners.
        let Some(v) = self.bytes.get(base..base + n * n + n + 2) else { return 0.0 };
        let row = |i: usize| {
            let [a, b] = [v[i], v[i + 1]].map(|byte| DENSITIES[usize::from(byte)]);
            a + f.x * (b - a)
        };
        let near = row(0) + f.y * (row(n) - row(0));
        let far = row(n * n) + f.y * (row(n * n + n) - row(n * n));
        near + f.z * (far - near)
    }
}

/// Weighted means along the fastest axis of `fine` values, which becomes the slowest, of `coarse`.
/// The tents of all coarse nodes add up to 1 everywhere: matter and its centre are kept.
fn tents(values: &[f32], fine: usize, coarse: usize) -> Vec<f32> {
    let ratio = (fine - 1) as f32 / (coarse - 1) as f32;
    let rows = values.len() / fine;
    let mut means = Vec::with_capacity(coarse * rows);
    for node in 0..coarse {
        let middle = node as f32 * ratio;
        let weight = |k: usize| (1.0 - (k as f32 - middle).abs() / ratio).max(0.0);
        means.extend(
            values
                .chunks_exact(fine)
                .map(|row| row.iter().enumerate().map(|(k, v)| weight(k) * v).sum::<f32>() / ratio),
        );
    }
    means
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
        let copies = volume.with_copies();
        assert_eq!(copies.iter().map(DensityVolume::nodes).collect::<Vec<_>>(), [64, 32, 16]);
        let matter = |v: &DensityVolume| {
            let cell = (2.0 / (v.nodes() - 1) as f64).powi(3);
            v.bytes().iter().map(|b| f64::from(*b) * cell).sum::<f64>()
        };
        let centre = |v: &DensityVolume| {
            let n = v.nodes();
            let place = |i: usize| {
                let at = |k: usize| f64::from(2 * k as u32) / (n - 1) as f64 - 1.0;
                glam::DVec3::new(at(i % n), at(i / n % n), at(i / (n * n)))
            };
            let bytes = || v.bytes().iter().map(|b| f64::from(*b));
            bytes().enumerate().map(|(i, b)| place(i) * b).sum::<glam::DVec3>()
                / bytes().sum::<f64>()
        };
        for copy in &copies[1..] {
            // Filtering keeps the matter and its centre, but for rounding to whole bytes.
            assert!((matter(copy) / matter(&copies[0]) - 1.0).abs() < 2e-3);
            assert!((centre(copy) - centre(&copies[0])).length() < 2e-3);
        }
        assert!(DensityVolume::from_bytes(vec![0; NODES - 1]).is_err());
    }
}
