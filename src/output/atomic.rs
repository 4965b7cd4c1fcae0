//! Files that are whole or not there.

use std::ffi::OsString;
use std::fs::{File, TryLockError};
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// End of the names of files that are being written.
const TEMPORARY: &str = ".tmp";

/// What files are written through.
pub trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

/// Links followed before they are taken for a loop, as many as Linux follows.
const MOST_LINKS: usize = 40;

/// Attempts at a temporary file that no other run takes away while it is being made. Each needs
/// that run to look at the folder in the moment between two system calls.
const MOST_ATTEMPTS: usize = 100;

/// Writes a file under a temporary name in the same folder and renames it when it is whole. The
/// folder is made if need be, and what killed runs left of the same file is removed. After an error
/// nothing is left behind, and what stood under the name before still does. What stands there must
/// be a plain file, for a device would be replaced by one, or a link, which stays one.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
) -> Result<()> {
    check_plain(path)?;
    let path = &resolved(path)?;
    sweep(path);
    let refuse = |e| Error::io(path, "write", e);
    let mut out = BufWriter::new(temporary(path, "")?);
    write(&mut out).map_err(refuse)?;
    let file = out.into_inner().map_err(|e| refuse(e.into_error()))?;
    put_in_place(file, path)
}

/// Makes a file that has become whole the one at `path`.
pub(super) fn put_in_place(file: NamedTempFile, path: &Path) -> Result<()> {
    let refuse = |e| Error::io(path, "write", e);
    // Some file systems report a full disk only here.
    file.as_file().sync_all().map_err(refuse)?;
    file.persist(path).map_err(|e| refuse(e.error))?;
    Ok(())
}

/// An empty file beside `path`, locked, whose name ends with `end`; removed when dropped. The folder
/// is made if need be.
pub(super) fn temporary(path: &Path, end: &str) -> Result<NamedTempFile> {
    let folder = folder_of(path);
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create the folder", e))?;
    let refuse = |e| Error::io(path, "write", e);
    let mut builder = tempfile::Builder::new();
    let prefix = temporary_prefix(path);
    let suffix = format!("{TEMPORARY}{end}");
    builder.prefix(&prefix).suffix(&suffix);
    #[cfg(unix)]
    {
        // As any new file: readable for all that the user's mask allows.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    for _ in 0..MOST_ATTEMPTS {
        let file = builder.tempfile_in(folder).map_err(refuse)?;
        // The lock ends with the process, however that ends: it tells files of living writers from
        // those that a killed run left. Before it is taken, the file looks like one of those: who
        // sweeps then has the lock, or had it and the name is gone.
        match file.as_file().try_lock() {
            Ok(()) if file.path().exists() => return Ok(file),
            Ok(()) | Err(TryLockError::WouldBlock) => {}
            // A file system without locks still gets its file; nothing is swept there.
            Err(TryLockError::Error(_)) => return Ok(file),
        }
    }
    Err(refuse(io::Error::other("its temporary files are taken away again and again")))
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
    let Ok(path) = resolved(path) else { return };
    let prefix = temporary_prefix(&path);
    let Ok(entries) = std::fs::read_dir(folder_of(&path)) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some(rest) = name.as_encoded_bytes().strip_prefix(prefix.as_encoded_bytes()) else {
            continue;
        };
        let is_temporary = is_temporary(rest, &path);
        let Some(file) = is_temporary.then(|| File::open(entry.path()).ok()).flatten() else {
            continue;
        };
        // The lock is held until the file is gone, see `temporary`.
        if file.try_lock().is_ok() {
            // What cannot be removed does no harm.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Whether this follows the prefix of a temporary file of `path`: a random part without dots, the end of
/// all of them, and for files that others write by name the end of `path`'s own.
fn is_temporary(rest: &[u8], path: &Path) -> bool {
    let dot = rest.iter().position(|b| *b == b'.').unwrap_or(rest.len());
    let end = &rest[dot..];
    let own = path.extension().map(|e| [b".", e.as_encoded_bytes()].concat());
    end.strip_prefix(TEMPORARY.as_bytes())
        .is_some_and(|after| after.is_empty() || own.is_some_and(|own| after == own))
}

/// Where a file of this name really lies or will lie: links are followed, also to what is not
/// there yet.
pub(super) fn resolved(path: &Path) -> Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        match std::fs::read_link(&path) {
            Ok(target) => path = folder_of(&path).join(target),
            // No link, or nothing there.
            Err(_) => return Ok(path),
        }
    }
    let told = "is a link that leads to itself, expected a file or the name of a new one";
    Err(Error::input(path.display().to_string(), told))
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

        // To what is not there yet, and in another folder; what a killed run left lies there too.
        let below = dir.path().join("below");
        std::fs::create_dir(&below).expect("a folder");
        let (far, dangling) = (below.join("far"), dir.path().join("dangling"));
        std::os::unix::fs::symlink("below/far", &dangling).expect("a link");
        std::fs::write(below.join(".far.killed.tmp"), "part").expect("written");
        write_atomically(&dangling, |out| out.write_all(b"first")).expect("written");
        assert!(dangling.is_symlink());
        assert_eq!(std::fs::read(&far).expect("readable"), b"first");
        assert_eq!(names(&below), ["far"]);

        let circle = dir.path().join("circle");
        std::os::unix::fs::symlink("circle", &circle).expect("a link");
        let refused = write_atomically(&circle, |out| out.write_all(b"x"));
        let message = refused.expect_err("a loop").to_string();
        assert!(message.contains("circle: is a link that leads to itself"), "{message}");
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
        let video = dir.path().join(".a.png.killed.tmp.png");
        let kept = [".a.png.old.tmpl", ".a.png.of.mine.tmp", ".a.png.killed.tmp.mp4"];
        for name in kept {
            std::fs::write(dir.path().join(name), "mine").expect("written");
        }
        let living = dir.path().join(".a.png.living.tmp");
        let other = dir.path().join(".b.png.other.tmp");
        for file in [&left, &video, &living, &other] {
            std::fs::write(file, "part").expect("written");
        }
        let writer = std::fs::File::open(&living).expect("there");
        writer.try_lock().expect("a lock");
        sweep(&path);
        assert!(!left.exists() && !video.exists(), "{:?}", names(dir.path()));
        assert!(living.exists() && other.exists(), "{:?}", names(dir.path()));
        assert!(kept.iter().all(|name| dir.path().join(name).exists()), "{:?}", names(dir.path()));
    }

    /// Who sweeps must not take a file between its making and its lock, nor after.
    #[test]
    fn writers_and_sweepers_at_once() {
        // Without the look at the name under the lock, one file in about 400 is lost.
        const FILES: usize = 4000;
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("a.bin");
        let writing = std::sync::atomic::AtomicBool::new(true);
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    while writing.load(std::sync::atomic::Ordering::Relaxed) {
                        sweep(&path);
                    }
                });
            }
            let lost = (0..FILES)
                .filter(|_| !temporary(&path, "").is_ok_and(|file| file.path().exists()))
                .count();
            writing.store(false, std::sync::atomic::Ordering::Relaxed);
            assert_eq!(lost, 0);
        });
        assert!(names(dir.path()).is_empty(), "{:?}", names(dir.path()));
    }
}
