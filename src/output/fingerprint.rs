//! What tells one file's contents from another's.

use std::fs::File;
use std::hash::{DefaultHasher, Hasher};
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};

/// 64 bits of a file's contents, as hexadecimal digits. Not against malice, and only to be
/// compared with what the same program says.
pub fn fingerprint(path: &Path) -> Result<String> {
    let unreadable = |e| Error::io(path, "read", e);
    let mut file = File::open(path).map_err(unreadable)?;
    let mut hasher = DefaultHasher::new();
    let mut chunk = vec![0; 1 << 16];
    loop {
        match file.read(&mut chunk).map_err(unreadable)? {
            0 => return Ok(format!("{:016x}", hasher.finish())),
            // Written as bytes, so how the file was cut into chunks makes no difference.
            read => hasher.write(&chunk[..read]),
        }
    }
}

/// The same of bytes in memory.
pub fn fingerprint_of(bytes: &[u8]) -> String {
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes);
    format!("{:016x}", hasher.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contents_count_and_nothing_else() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let write = |name: &str, bytes: &[u8]| {
            let path = dir.path().join(name);
            std::fs::write(&path, bytes).expect("written");
            fingerprint(&path).expect("readable")
        };
        let mut long = vec![7; 200_000];
        let first = write("a", &long);
        assert_eq!(write("b", &long), first);
        long[199_999] = 8;
        assert_ne!(write("a", &long), first);
        assert_eq!(write("a", &long), fingerprint_of(&long));
        assert_ne!(write("a", b""), write("a", b"\0"));
        assert!(fingerprint(&dir.path().join("none")).is_err());
    }
}
