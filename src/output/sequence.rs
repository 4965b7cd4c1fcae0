//! A sequence of frames that can be stopped at any moment and goes on where it stopped.
//!
//! Beside the frames lies `sequence.json`, which says what they show. Frames of other settings
//! are never mixed in: they are refused, or replaced where that is asked for.

use std::fmt::{Display, Formatter};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::Serialize;

use super::{Format, atomic, is_whole_picture, write_atomically, write_picture};
use crate::error::{Error, Result};
use crate::frame::{Lighting, Picture, Preset};

/// Frames `start` to `end`, `end` not included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    /// The first frame.
    pub start: u32,
    /// The frame after the last.
    pub end: u32,
}

impl FrameRange {
    /// Number of frames.
    pub fn count(self) -> u32 {
        self.end.saturating_sub(self.start)
    }
}

impl FromStr for FrameRange {
    type Err = String;

    /// "0..24", without frame 24, or "0..=23".
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let bad = || format!("expected frames as in 0..24 (24 is not included), found `{text}`");
        let (start, end) = text.split_once("..").ok_or_else(bad)?;
        let start: u32 = start.trim().parse().map_err(|_| bad())?;
        let end = match end.strip_prefix('=') {
            Some(last) => {
                last.trim().parse::<u32>().map_err(|_| bad())?.checked_add(1).ok_or_else(bad)?
            }
            None => end.trim().parse().map_err(|_| bad())?,
        };
        if start >= end {
            return Err(format!("expected at least one frame, as in 0..24; `{text}` has none"));
        }
        Ok(Self { start, end })
    }
}

impl Display for FrameRange {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}..{}", self.start, self.end)
    }
}

/// What all frames of a folder have in common.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SequenceKey {
    /// The program: version and fingerprint.
    pub program: String,
    /// The scene as TOML, with all its particles.
    pub scene: String,
    /// The fingerprint of the table file, or "embedded".
    pub tables: String,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Quality of frames; none of reference pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<Preset>,
    /// How clouds are lit, where it is not as the preset says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lighting: Option<Lighting>,
    /// What else reference pictures are made from, as JSON; none for frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// Time of frame 0, s.
    pub start_time: f64,
    /// Frames per second of the scene's time.
    pub fps: f64,
    /// The camera's path as TOML, where it follows one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
}

impl SequenceKey {
    /// The time of a frame, s.
    pub fn time(&self, frame: u32) -> f64 {
        self.start_time + f64::from(frame) / self.fps
    }
}

/// Frames to be written into a folder.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// What they show.
    pub key: SequenceKey,
    /// Which of them.
    pub frames: FrameRange,
    /// In which format.
    pub format: Format,
    /// Where to.
    pub folder: PathBuf,
    /// Whether frames of other settings that lie in the folder may be replaced.
    pub replace: bool,
}

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameState {
    /// It was there, whole.
    Kept,
    /// It was rendered and written.
    Written,
}

/// What a run did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SequenceReport {
    /// Frames that were there.
    pub kept: u32,
    /// Frames rendered and written.
    pub written: u32,
}

/// Name of the file that says what the frames show.
const KEY_FILE: &str = "sequence.json";
/// Beginning of the frames' names.
const FRAME: &str = "frame_";

/// Attempts at a folder. One is enough, unless another run of other frames comes in between or ends
/// just then.
const MOST_CLAIMS: usize = 4;

impl Sequence {
    /// The file of a frame.
    pub fn path(&self, frame: u32) -> PathBuf {
        // Five digits sort right up to an hour at 25 frames a second.
        self.folder.join(format!("{FRAME}{frame:05}.{}", self.format))
    }

    /// Refuses a folder that can't be used, before anything is rendered for it.
    pub fn check(&self) -> Result<()> {
        super::check_folder(&self.folder)?;
        if !self.replace && self.found()? == Found::Others {
            return Err(self.refusal());
        }
        Ok(())
    }

    /// Renders and writes the frames that are missing. `render` makes the picture of a frame at a
    /// time in seconds, `done` hears of each frame.
    pub fn run(
        &self,
        mut render: impl FnMut(u32, f64) -> Result<Picture>,
        done: impl FnMut(u32, FrameState, &Path),
    ) -> Result<SequenceReport> {
        self.run_files(|frame, time, path| write_picture(path, &render(frame, time)?), done)
    }

    /// The same where `make` writes the file of a frame itself.
    pub fn run_files(
        &self,
        mut make: impl FnMut(u32, f64, &Path) -> Result<()>,
        mut done: impl FnMut(u32, FrameState, &Path),
    ) -> Result<SequenceReport> {
        let _shared = self.claim()?;
        let mut report = SequenceReport::default();
        for frame in self.frames.start..self.frames.end {
            let path = self.path(frame);
            atomic::sweep(&path);
            if is_whole_picture(&path, self.key.size) {
                report.kept += 1;
                done(frame, FrameState::Kept, &path);
                continue;
            }
            make(frame, self.key.time(frame), &path)?;
            report.written += 1;
            done(frame, FrameState::Written, &path);
        }
        Ok(report)
    }

    /// Says what the frames of the folder show, while no other run writes into it; then shares it
    /// with runs of the same frames for as long as the returned lock lives. The lock is the
    /// folder's own: it leaves no file, and ends with the process however that ends.
    fn claim(&self) -> Result<Option<File>> {
        std::fs::create_dir_all(&self.folder)
            .map_err(|e| Error::io(&self.folder, "create the folder", e))?;
        // Not all systems open folders or lock them: there a run is alone by the user's care.
        let Ok(folder) = File::open(&self.folder) else {
            self.begin_unless_same()?;
            return Ok(None);
        };
        for _ in 0..MOST_CLAIMS {
            match folder.try_lock() {
                Ok(()) => {
                    self.begin_unless_same()?;
                    let _ = folder.unlock();
                }
                Err(TryLockError::WouldBlock) => {}
                Err(TryLockError::Error(_)) => {
                    self.begin_unless_same()?;
                    return Ok(None);
                }
            }
            // Waits while another run says what its frames show.
            folder.lock_shared().map_err(|e| Error::io(&self.folder, "lock the folder", e))?;
            if self.is_described()? {
                return Ok(Some(folder));
            }
            let _ = folder.unlock();
        }
        Err(Error::input(
            self.folder.display().to_string(),
            "is being written by another run with other settings; name another folder",
        ))
    }

    fn begin_unless_same(&self) -> Result<()> {
        match self.found()? {
            Found::Same => Ok(()),
            Found::Others if !self.replace => Err(self.refusal()),
            Found::Nothing | Found::Others => self.begin(),
        }
    }

    /// Removes the frames of other settings, then says whose frames follow. In this order, a run
    /// that is killed in between leaves no frame under a wrong description.
    fn begin(&self) -> Result<()> {
        for path in self.frame_files()? {
            std::fs::remove_file(&path).map_err(|e| Error::io(&path, "remove", e))?;
        }
        let path = self.folder.join(KEY_FILE);
        let text = self.key_text()?;
        write_atomically(&path, |out| out.write_all(text.as_bytes()))
    }

    fn key_text(&self) -> Result<String> {
        let path = self.folder.join(KEY_FILE);
        serde_json::to_string_pretty(&self.key)
            .map(|text| text + "\n")
            .map_err(|e| Error::io(&path, "write", std::io::Error::other(e)))
    }

    fn found(&self) -> Result<Found> {
        if self.frame_files()?.is_empty() {
            return Ok(Found::Nothing);
        }
        Ok(if self.is_described()? { Found::Same } else { Found::Others })
    }

    /// Whether the folder says that its frames show what these do.
    fn is_described(&self) -> Result<bool> {
        // Compared as text, to the bit; a file of another length is not read.
        let text = self.key_text()?;
        let path = self.folder.join(KEY_FILE);
        let may_be =
            std::fs::metadata(&path).is_ok_and(|m| m.is_file() && m.len() == text.len() as u64);
        Ok(may_be && std::fs::read(&path).is_ok_and(|bytes| bytes == text.as_bytes()))
    }

    /// Everything in the folder that has the name of a frame, of whatever number and format.
    fn frame_files(&self) -> Result<Vec<PathBuf>> {
        let entries = match std::fs::read_dir(&self.folder) {
            Ok(entries) => entries,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(e) => return Err(Error::io(&self.folder, "list the folder", e)),
        };
        Ok(entries.flatten().map(|e| e.path()).filter(|path| is_frame_name(path)).collect())
    }

    fn refusal(&self) -> Error {
        Error::input(
            self.folder.display().to_string(),
            "holds frames of another scene or of other settings; name another folder, or replace \
             them with --overwrite",
        )
    }
}

/// What a folder holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Found {
    Nothing,
    Same,
    Others,
}

/// Whether a file is called like a frame of a sequence.
pub(crate) fn is_frame_name(path: &Path) -> bool {
    let stem = path.file_stem().and_then(|s| s.to_str());
    let number = stem.and_then(|s| s.strip_prefix(FRAME));
    let numbered = number.is_some_and(|n| n.len() >= 5 && n.bytes().all(|b| b.is_ascii_digit()));
    numbered && Format::of(path).is_ok()
}

#[cfg(test)]
mod tests;
