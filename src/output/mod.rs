//! Pictures on disk: PNG for looking at, OpenEXR for measuring, and sequences of them.
//!
//! A file is written under a temporary name and renamed when it is whole, so nobody ever sees
//! half a picture, and a run that was killed leaves only whole ones behind.

mod atomic;
mod cache_folder;
mod exr;
mod fingerprint;
mod layers;
mod opaque;
mod png;
mod sequence;
mod video;

use std::fmt::{Display, Formatter};
use std::path::Path;

pub use atomic::write_atomically;
pub(crate) use cache_folder::cache_folder;
pub use fingerprint::{fingerprint, fingerprint_of};
pub use layers::{Channel, Layers};
pub use opaque::{read_opaque, write_opaque};
#[cfg(feature = "window")]
pub(crate) use sequence::is_frame_name;
pub use sequence::{FrameRange, FrameState, Sequence, SequenceKey, SequenceReport};
pub use video::{VideoTarget, write_video};

use crate::error::{Error, Result};
use crate::frame::Picture;

/// A picture format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// 8-bit sRGB, exposed and tone mapped.
    Png,
    /// Linear radiance in 32-bit floats, and the opacity of the clouds in A.
    Exr,
}

impl Format {
    /// The format that a file name asks for.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match extension.as_str() {
            "png" => Ok(Self::Png),
            "exr" => Ok(Self::Exr),
            _ => Err(Error::input(
                path.display().to_string(),
                "expected a name that ends in .png or .exr",
            )),
        }
    }

    /// The end of a file name, without the dot.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr => "exr",
        }
    }
}

impl Display for Format {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.extension())
    }
}

/// Writes a picture in the format of the file name's end. The folder is made if need be, and what
/// a killed run left of the same picture is removed.
pub fn write_picture(path: &Path, picture: &Picture) -> Result<()> {
    let format = Format::of(path)?;
    let pixels = Picture::pixel_count(picture.size);
    let [width, height] = picture.size;
    if pixels == 0 || picture.pixels.len() != pixels || picture.radiance.len() != pixels {
        return Err(Error::input(
            path.display().to_string(),
            format!(
                "a picture of {width} x {height} needs {pixels} pixels, at least one; this one has {} and {}",
                picture.pixels.len(),
                picture.radiance.len()
            ),
        ));
    }
    match format {
        Format::Png => write_atomically(path, |out| png::encode(picture, out)),
        Format::Exr => write_atomically(path, |out| exr::encode(picture, out)),
    }
}

/// Writes display values as PNG: a pixel for every position, rows from the top.
pub fn write_png(path: &Path, size: [u32; 2], pixels: &[[u8; 3]]) -> Result<()> {
    write_atomically(path, |out| png::encode_bytes(size, pixels.as_flattened(), out))
}

/// Whether a file holds a picture of this size, readable to its end.
pub fn is_whole_picture(path: &Path, size: [u32; 2]) -> bool {
    match Format::of(path) {
        Ok(Format::Png) => png::is_whole(path, size),
        Ok(Format::Exr) => exr::is_whole(path, size),
        Err(_) => false,
    }
}

/// Refuses a path where a picture can't be written, before anything is rendered for it.
pub fn check_target(path: &Path) -> Result<()> {
    Format::of(path)?;
    check_file(path)
}

/// Refuses a path where a file can't be written.
pub fn check_file(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(Error::input(path.display().to_string(), "is a folder, expected a file name"));
    }
    atomic::check_plain(path)?;
    atomic::resolved(path)?.parent().map_or(Ok(()), check_folder)
}

/// Refuses a path that can't become a folder that files are written into: it, or what should contain it, is a file,
/// or nothing can be written there.
pub fn check_folder(path: &Path) -> Result<()> {
    let existing = path.ancestors().find(|p| !p.as_os_str().is_empty() && p.exists());
    match existing {
        Some(file) if !file.is_dir() => {
            Err(Error::input(file.display().to_string(), "is a file, expected a folder"))
        }
        // What can't be written shall not be computed first.
        _ => {
            let folder = existing.unwrap_or(Path::new("."));
            let probe = tempfile::tempfile_in(folder);
            probe.map(|_| ()).map_err(|e| Error::io(folder, "write into", e))
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::frame::FrameStats;

    /// A picture of distinct pixels, for tests of what becomes of them.
    pub fn gradient(size: [u32; 2], seed: u32) -> Picture {
        let count = Picture::pixel_count(size) as u32;
        let radiance =
            |i: u32| (i.wrapping_mul(2_654_435_761).wrapping_add(seed) >> 8) as f32 * 1e-4;
        Picture {
            size,
            radiance: (0..count).map(|i| [radiance(i), radiance(i + 1), 0.5, 0.25]).collect(),
            pixels: (0..count)
                .map(|i| [(i + seed) as u8, (i / 3) as u8, seed as u8, 255])
                .collect(),
            stats: FrameStats::default(),
        }
    }

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a temporary folder")
    }

    #[test]
    fn png_holds_the_tone_mapped_pixels() {
        let dir = folder();
        let path = dir.path().join("new/folder/a.png");
        let picture = gradient([7, 5], 3);
        write_picture(&path, &picture).expect("written");
        let read = image::open(&path).expect("a PNG").into_rgb8();
        assert_eq!(read.dimensions(), (7, 5));
        let expected: Vec<u8> = picture.pixels.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
        assert_eq!(read.into_raw(), expected);
    }

    #[test]
    fn exr_holds_the_radiance_to_the_bit() {
        let dir = folder();
        let path = dir.path().join("a.EXR");
        let mut picture = gradient([9, 4], 1);
        picture.radiance[3] = [f32::MAX, f32::MIN_POSITIVE, -0.0, 1e-45];
        write_picture(&path, &picture).expect("written");
        let read = image::open(&path).expect("an EXR").into_rgba32f();
        assert_eq!(read.dimensions(), (9, 4));
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read.into_raw()), bits(picture.radiance.as_flattened()));
    }

    #[test]
    fn the_same_picture_is_the_same_file() {
        let dir = folder();
        for extension in ["png", "exr"] {
            let paths = [0, 1].map(|i| dir.path().join(format!("{i}.{extension}")));
            let bytes = paths.map(|path| {
                write_picture(&path, &gradient([64, 48], 9)).expect("written");
                std::fs::read(&path).expect("readable")
            });
            assert!(bytes[0] == bytes[1], "{extension} differs from run to run");
        }
    }

    #[test]
    fn a_cut_or_foreign_file_is_not_whole() {
        let dir = folder();
        for extension in ["png", "exr"] {
            let path = dir.path().join(format!("a.{extension}"));
            write_picture(&path, &gradient([40, 30], 2)).expect("written");
            assert!(is_whole_picture(&path, [40, 30]));
            assert!(!is_whole_picture(&path, [30, 40]));
            let bytes = std::fs::read(&path).expect("readable");
            for keep in [0, 1, 20, bytes.len() / 2, bytes.len() - 20] {
                std::fs::write(&path, &bytes[..keep]).expect("writable");
                assert!(!is_whole_picture(&path, [40, 30]), "{extension} cut to {keep} bytes");
            }
            std::fs::remove_file(&path).expect("removable");
            assert!(!is_whole_picture(&path, [40, 30]));
        }
    }

    #[test]
    fn nothing_is_written_for_a_picture_without_its_pixels() {
        let dir = folder();
        let path = dir.path().join("a.png");
        let mut picture = gradient([4, 4], 0);
        picture.pixels.pop();
        assert!(write_picture(&path, &picture).is_err());
        assert!(write_picture(&path, &gradient([0, 4], 0)).is_err());
        assert_eq!(std::fs::read_dir(dir.path()).expect("readable").count(), 0);
    }

    #[test]
    fn targets_that_cannot_be_written_are_refused_beforehand() {
        let dir = folder();
        let file = dir.path().join("file.png");
        std::fs::write(&file, "x").expect("writable");
        assert!(check_target(&file).is_ok(), "an existing picture may be replaced");
        assert!(check_target(&dir.path().join("new/a.png")).is_ok());
        assert!(check_target(Path::new("a.png")).is_ok());
        assert!(check_target(&file.join("a.png")).is_err());
        assert!(check_target(&dir.path().join("a.jpeg")).is_err());
        assert!(check_target(&dir.path().join("png")).is_err());
        let folder = dir.path().join("folder.png");
        std::fs::create_dir(&folder).expect("a folder");
        assert!(check_target(&folder).is_err());
        assert!(check_folder(&file).is_err());
    }
}
