//! The samples of an unfinished picture on disk: all digits, so that a picture that was
//! interrupted comes out as if it never had been.

use std::hash::{DefaultHasher, Hasher};
use std::path::Path;

use super::film::{Film, Pixel};
use crate::error::{Error, Result};
use crate::output::write_atomically;

/// First bytes of the file; the number is the version of what follows.
const MAGIC: &[u8; 16] = b"cumuli partial 2";
/// The same of any version.
const ANY_VERSION: &[u8] = b"cumuli partial ";

/// Fixed bytes: magic, length of the key, size, samples, rows, and for how many pixels (all or none)
/// it is told how many samples they want.
const HEAD: usize = MAGIC.len() + 6 * 4;

/// Bytes of the sum at the end.
const SUM: usize = 8;

fn sum(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes);
    hasher.finish()
}

/// Writes the samples so far. `key` says what the picture shows.
pub fn save(path: &Path, key: &str, film: &Film) -> Result<()> {
    let mut bytes = Vec::with_capacity(HEAD + key.len() + size_of_val(&film.pixels[..]) + SUM);
    bytes.extend_from_slice(MAGIC);
    let [width, height] = film.size;
    let numbers =
        [key.len() as u32, width, height, film.samples, film.rows, film.wanted.len() as u32];
    bytes.extend(numbers.into_iter().flat_map(u32::to_le_bytes));
    bytes.extend_from_slice(key.as_bytes());
    for pixel in &film.pixels {
        bytes.extend(pixel.mean.iter().chain(&pixel.spread).flat_map(|v| v.to_le_bytes()));
    }
    bytes.extend(film.wanted.iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(sum(&bytes).to_le_bytes());
    write_atomically(path, |out| out.write_all(&bytes))
}

/// What a file of samples turned out to be.
#[derive(Debug, PartialEq)]
pub enum Found {
    /// No file.
    Nothing,
    /// The samples of the same picture.
    Same(Film),
    /// Samples of another picture.
    Other,
}

fn u32_of(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |n, byte| n << 8 | u32::from(*byte))
}

/// Reads the samples so far of the picture that `key` describes.
pub fn load(path: &Path, key: &str, size: [u32; 2]) -> Result<Found> {
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Found::Nothing),
        Err(e) => return Err(Error::io(path, "read", e)),
    };
    let damaged =
        || Error::input(path.display().to_string(), "is no whole file of samples; remove it");
    if bytes.starts_with(ANY_VERSION) && bytes.len() >= MAGIC.len() && !bytes.starts_with(MAGIC) {
        return Ok(Found::Other);
    }
    if bytes.len() < HEAD + SUM || !bytes.starts_with(MAGIC) {
        return Err(damaged());
    }
    let (body, end) = bytes.split_at(bytes.len() - SUM);
    if end != sum(body).to_le_bytes() {
        return Err(damaged());
    }
    let number = |i: usize| -> u32 {
        let at = MAGIC.len() + 4 * i;
        u32_of(&body[at..at + 4])
    };
    let pixels_at = HEAD + number(0) as usize;
    if body.get(HEAD..pixels_at) != Some(key.as_bytes()) {
        return Ok(Found::Other);
    }
    let film = Film::new(size);
    let [samples, rows] = [number(3), number(4)];
    let wanted_at = pixels_at + size_of_val(&film.pixels[..]);
    let told = number(5) as usize;
    let whole = [number(1), number(2)] == size
        && rows < size[1]
        && (told == 0 || told == film.pixels.len())
        && body.len() == wanted_at + 4 * told;
    if !whole {
        return Err(damaged());
    }
    let (pixels, wanted) = (&body[pixels_at..wanted_at], &body[wanted_at..]);
    let wanted = wanted.as_chunks::<4>().0.iter().map(|bytes| u32_of(bytes)).collect();
    let mut numbers = pixels.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b));
    let mut four = || [0; 4].map(|_| numbers.next().unwrap_or_default());
    let pixels = film.pixels.iter().map(|_| Pixel { mean: four(), spread: four() }).collect();
    Ok(Found::Same(Film { size, samples, rows, pixels, wanted }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film() -> Film {
        let mut film = Film::new([3, 2]);
        (film.samples, film.rows) = (7, 1);
        for (i, pixel) in film.pixels.iter_mut().enumerate() {
            pixel.mean = [i as f64 / 3.0; 4];
            pixel.spread = [-1.0, 0.0, 1e300, 5e-324];
        }
        film
    }

    #[test]
    fn what_is_saved_comes_back_to_the_bit() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("a.partial");
        assert_eq!(load(&path, "key", [3, 2]).expect("no file"), Found::Nothing);
        save(&path, "key", &film()).expect("written");
        assert_eq!(load(&path, "key", [3, 2]).expect("whole"), Found::Same(film()));
        assert_eq!(load(&path, "another", [3, 2]).expect("whole"), Found::Other);
        let decided = Film { wanted: vec![8, 0, u32::MAX, 128, 7, 9], ..film() };
        save(&path, "key", &decided).expect("written");
        assert_eq!(load(&path, "key", [3, 2]).expect("whole"), Found::Same(decided));
    }

    #[test]
    fn damage_is_noticed() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("a.partial");
        save(&path, "key", &film()).expect("written");
        let whole = std::fs::read(&path).expect("readable");
        for cut in [0, 10, HEAD, whole.len() - 1] {
            std::fs::write(&path, &whole[..cut]).expect("written");
            assert!(load(&path, "key", [3, 2]).is_err(), "cut at {cut}");
        }
        // Samples of another version are none of these, and may be replaced.
        let mut old = whole.clone();
        old[MAGIC.len() - 1] ^= 1;
        std::fs::write(&path, &old).expect("written");
        assert_eq!(load(&path, "key", [3, 2]).expect("another version"), Found::Other);
        for place in (0..whole.len()).filter(|place| *place != MAGIC.len() - 1) {
            let mut other = whole.clone();
            other[place] ^= 1;
            std::fs::write(&path, &other).expect("written");
            assert!(load(&path, "key", [3, 2]).is_err(), "byte {place}");
        }
    }
}
