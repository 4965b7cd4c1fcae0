//! Files that are whole or not there.

use std::ffi::OsString;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

use crate::error::{Error, Result};

/// End of the names of files that are being written.
const TEMPORARY: &str = ".tmp";

/// What files are written through.
pub trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

/// Writes a file under a temporary name in the same folder and renames it when it is whole. The
/// folder is made if need be. After an error nothing is left behind, and what stood under the
/// name before still does. What stands there must be a plain file: a device would be replaced by one.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
) -> Result<()> {
    check_plain(path)?;
    // A link stays one.
    let linked = path.is_symlink().then(|| std::fs::canonicalize(path).ok()).flatten();
    let path = linked.as_deref().unwrap_or(path);
    let folder = folder_of(path);
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create the folder", e))?;
    let refuse = |e| Error::io(path, "write", e);
    let mut builder = tempfile::Builder::new();
    let prefix = temporary_prefix(path);
    builder.prefix(&prefix).suffix(TEMPORARY);
    #[cfg(unix)]
    {
        // As any new file: readable for all that the user's mask allows.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(refuse)?;
    // The lock ends with the process, however that ends: it tells files of living writers from
    // those that a killed run left. A file system without locks still gets its file.
    let _ = file.as_file().try_lock();
    let mut out = BufWriter::new(file);
    write(&mut out).map_err(refuse)?;
    let file = out.into_inner().map_err(|e| refuse(e.into_error()))?;
    // Some file systems report a full disk only here.
    file.as_file().sync_all().map_err(refuse)?;
    file.persist(path).map_err(|e| refuse(e.error))?;
    Ok(())
}

/// Refuses to replace what is there and is no plain file.
pub(super) fn check_plain(path: &Path) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(there) if !there.is_file() => {
            let told = "is not a plain file, expected the name of one or of a new file";
            Err(Error::input(path.display().to_string(), told))
        }
        _ => Ok(()),
    }
}

/// Removes what killed runs left of writing `path`. Files of living writers are left alone.
pub(crate) fn sweep(path: &Path) {
    let prefix = temporary_prefix(path);
    let Ok(entries) = std::fs::read_dir(folder_of(path)) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.as_encoded_bytes();
        if !name.starts_with(prefix.as_encoded_bytes()) || !name.ends_with(TEMPORARY.as_bytes()) {
            continue;
        }
        let left = std::fs::File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok());
        if left {
            // What cannot be removed does no harm.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Hidden, and with the whole name of the file in it.
fn temporary_prefix(path: &Path) -> OsString {
    let mut prefix = OsString::from(".");
    prefix.push(path.file_name().unwrap_or_default());
    prefix.push(".");
    prefix
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("readable");
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn an_error_leaves_the_old_file_and_nothing_else() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("a.bin");
        write_atomically(&path, |out| out.write_all(b"old")).expect("written");
        let failed = write_atomically(&path, |out| {
            out.write_all(&[0; 100_000])?;
            Err(io::Error::other("disk full"))
        });
        let message = failed.expect_err("the writer failed").to_string();
        assert!(message.contains("a.bin") && message.contains("disk full"), "{message}");
        assert_eq!(std::fs::read(&path).expect("readable"), b"old");
        assert_eq!(names(dir.path()), ["a.bin"]);
    }

    #[cfg(unix)]
    #[test]
    fn only_plain_files_are_replaced_and_links_stay() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let (socket, link) = (dir.path().join("socket"), dir.path().join("link"));
        let _listener = std::os::unix::net::UnixListener::bind(&socket).expect("a socket");
        let refused = write_atomically(&socket, |out| out.write_all(b"x"));
        let message = refused.expect_err("no plain file").to_string();
        assert!(message.contains("socket: is not a plain file"), "{message}");
        assert!(crate::output::check_file(&socket).is_err());

        let target = dir.path().join("target");
        write_atomically(&target, |out| out.write_all(b"old")).expect("written");
        std::os::unix::fs::symlink(&target, &link).expect("a link");
        write_atomically(&link, |out| out.write_all(b"new")).expect("written");
        assert!(link.is_symlink());
        assert_eq!(std::fs::read(&target).expect("readable"), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_what_is_written() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().expect("a temporary folder");
        let (written, plain) = (dir.path().join("a"), dir.path().join("b"));
        write_atomically(&written, |out| out.write_all(b"x")).expect("written");
        std::fs::write(&plain, b"x").expect("written");
        let mode = |p: &Path| std::fs::metadata(p).expect("there").permissions().mode();
        assert_eq!(mode(&written), mode(&plain));
    }

    #[test]
    fn sweeping_spares_living_writers_and_other_files() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("a.png");
        let left = dir.path().join(".a.png.killed.tmp");
        let living = dir.path().join(".a.png.living.tmp");
        let other = dir.path().join(".b.png.other.tmp");
        for file in [&left, &living, &other] {
            std::fs::write(file, "part").expect("written");
        }
        let writer = std::fs::File::open(&living).expect("there");
        writer.try_lock().expect("a lock");
        sweep(&path);
        assert!(!left.exists() && living.exists() && other.exists(), "{:?}", names(dir.path()));
    }
}
