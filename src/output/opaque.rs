//! Opaque things of a picture as OpenEXR: their distances and colours.

use std::path::Path;

use super::Layers;
use crate::error::{Error, Result};
use crate::frame::opaque::{NOTHING, OpaquePicture};
use crate::scene::Camera;

/// What the channels mean.
const MEANING: &str = "distance: from the eye along the pixel's ray, m; 1e30 where there is nothing. R, G, B: linear \
    Rec. 709 radiance without direct sunlight, unit: solar irradiance per steradian; sunlit.R, sunlit.G, sunlit.B: \
    what direct sunlight adds where no cloud dims the sun.";

/// Writes a picture of opaque things as [`read_opaque`] reads it.
pub fn write_opaque(path: &Path, picture: &OpaquePicture) -> Result<()> {
    let comment = MEANING.to_owned();
    let mut layers = Layers { size: picture.size, comment, ..Layers::default() };
    layers.add("distance", picture.distance.iter().copied());
    for (prefix, colours) in [("", &picture.radiance), ("sunlit.", &picture.sunlit)] {
        for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
            layers.add(&format!("{prefix}{name}"), colours.iter().map(|c| c[axis]));
        }
    }
    layers.write(path, false)
}

/// Reads opaque things as a camera sees them in a picture of this size. Channels: `distance` along the rays, or `Z`
/// along the view axis, m; R, G, B; and where they are told apart from light that no cloud dims, sunlit.R, sunlit.G and
/// sunlit.B.
pub fn read_opaque(path: &Path, camera: &Camera, size: [u32; 2]) -> Result<OpaquePicture> {
    let name = path.display().to_string();
    let bad = |message: String| Error::input(name.clone(), message);
    let layers = Layers::read(path, size[0].max(size[1]))?;
    if layers.size != size {
        let [[w, h], [x, y]] = [size, layers.size];
        return Err(bad(format!("expected {w}x{h} pixels as the picture, found {x}x{y}")));
    }
    let forward = camera.basis().forward;
    let distance: Vec<f32> = match (layers.channel("distance"), layers.channel("Z")) {
        (Some(distance), _) => distance.to_vec(),
        (None, Some(depth)) => {
            let along = |(pixel, depth): (usize, &f32)| {
                let slant = OpaquePicture::ray(camera, size, pixel as u32).dot(forward);
                (f64::from(*depth) / slant) as f32
            };
            depth.iter().enumerate().map(along).collect()
        }
        (None, None) => {
            return Err(bad("expected a channel `distance`, or `Z`, found neither".to_owned()));
        }
    };
    let is_there = |pixel: usize| (0.0..NOTHING).contains(&distance[pixel]);
    let colour = |prefix: &str| -> Result<Option<Vec<[f32; 3]>>> {
        let channels = ["R", "G", "B"].map(|c| layers.channel(&format!("{prefix}{c}")));
        let [Some(r), Some(g), Some(b)] = channels else { return Ok(None) };
        let colours: Vec<_> = (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect();
        let wrong = |(pixel, colour): (usize, &[f32; 3])| {
            is_there(pixel) && colour.iter().any(|v| !(*v >= 0.0 && v.is_finite()))
        };
        match colours.iter().enumerate().position(wrong) {
            None => Ok(Some(colours)),
            Some(i) => Err(bad(format!(
                "pixel {}, {} holds {:?} in the channels {prefix}R, {prefix}G and {prefix}B, expected no \
                 negative numbers",
                i as u32 % size[0],
                i as u32 / size[0],
                colours[i]
            ))),
        }
    };
    let radiance =
        colour("")?.ok_or_else(|| bad("expected channels named R, G and B".to_owned()))?;
    let sunlit = colour("sunlit.")?.unwrap_or_else(|| vec![[0.0; 3]; distance.len()]);
    Ok(OpaquePicture { size, distance, radiance, sunlit })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::frame::opaque::Surface;

    const SIZE: [u32; 2] = [6, 4];

    fn some() -> OpaquePicture {
        // A wall across the view axis, on one side of it.
        let camera = Camera::default();
        let forward = camera.basis().forward;
        OpaquePicture::cast(&camera, SIZE, |dir| {
            let surface = Surface {
                distance: 100.0 / dir.dot(forward),
                radiance: DVec3::new(0.1, 0.2, 0.3),
                sunlit: DVec3::splat(0.5),
            };
            (dir.x > 0.0).then_some(surface)
        })
    }

    #[test]
    fn what_is_written_is_read_back() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("opaque.exr");
        let picture = some();
        write_opaque(&path, &picture).expect("written");
        assert_eq!(read_opaque(&path, &Camera::default(), SIZE).expect("readable"), picture);
        let small = read_opaque(&path, &Camera::default(), [6, 3]).expect_err("of another size");
        assert!(small.to_string().contains("6x3"), "{small}");
    }

    #[test]
    fn depth_along_the_axis_becomes_distance() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("z.exr");
        let wanted = some();
        let mut layers = Layers { size: SIZE, ..Layers::default() };
        let there = |i: usize| wanted.surface(i).is_some();
        layers.add("Z", (0..24).map(|i| if there(i) { 100.0 } else { f32::INFINITY }));
        for name in ["R", "G", "B"] {
            layers.add(name, [0.25; 24]);
        }
        layers.write(&path, false).expect("written");
        let read = read_opaque(&path, &Camera::default(), SIZE).expect("readable");
        for i in 0..24 {
            let [found, wanted] = [&read, &wanted].map(|p| p.surface(i).map(|s| s.distance));
            let off = found.zip(wanted).map_or(0.0, |(a, b)| (a / b - 1.0).abs());
            assert!(found.is_some() == wanted.is_some() && off < 1e-6, "{i}: {found:?} {wanted:?}");
        }
        assert_eq!(read.sunlit, [[0.0; 3]; 24]);
    }

    #[test]
    fn what_is_no_radiance_is_refused() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("bad.exr");
        let mut picture = some();
        let seen = (0..24).find(|i| picture.surface(*i).is_some()).expect("a wall");
        for value in [-1.0, f32::NAN, f32::INFINITY] {
            picture.sunlit[seen][1] = value;
            write_opaque(&path, &picture).expect("written");
            let message = read_opaque(&path, &Camera::default(), SIZE).expect_err("no radiance");
            let message = message.to_string();
            assert!(message.contains("bad.exr") && message.contains("sunlit.G"), "{message}");
        }
    }
}
