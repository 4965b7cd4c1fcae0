//! A sequence of frames that can be stopped at any moment and goes on where it stopped.
//!
//! Beside the frames lies `sequence.json`, which says what they show. Frames of other settings
//! are never mixed in: they are refused, or replaced where that is asked for.

use std::fmt::{Display, Formatter};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::Serialize;

use super::{Format, atomic, is_whole_picture, write_atomically, write_picture};
use crate::error::{Error, Result};
use crate::frame::{Picture, Preset};

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
    /// Quality.
    pub preset: Preset,
    /// Time of frame 0, s.
    pub start_time: f64,
    /// Frames per second of the scene's time.
    pub fps: f64,
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

impl Sequence {
    /// The file of a frame.
    pub fn path(&self, frame: u32) -> PathBuf {
        // Five digits sort right up to an hour at 25 frames a second.
        self.folder.join(format!("frame_{frame:05}.{}", self.format))
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
        mut done: impl FnMut(u32, FrameState, &Path),
    ) -> Result<SequenceReport> {
        let found = self.found()?;
        match found {
            Found::Same => {}
            Found::Others if !self.replace => return Err(self.refusal()),
            Found::Nothing | Found::Others => self.begin()?,
        }
        let mut report = SequenceReport::default();
        for frame in self.frames.start..self.frames.end {
            let path = self.path(frame);
            atomic::sweep(&path);
            if is_whole_picture(&path, self.key.size) {
                report.kept += 1;
                done(frame, FrameState::Kept, &path);
                continue;
            }
            let picture = render(frame, self.key.time(frame))?;
            write_picture(&path, &picture)?;
            report.written += 1;
            done(frame, FrameState::Written, &path);
        }
        Ok(report)
    }

    /// Removes the frames of other settings, then says whose frames follow. In this order, a run
    /// that is killed in between leaves no frame under a wrong description.
    fn begin(&self) -> Result<()> {
        for path in self.frame_files()? {
            std::fs::remove_file(&path).map_err(|e| Error::io(&path, "remove", e))?;
        }
        let path = self.folder.join(KEY_FILE);
        atomic::sweep(&path);
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
        // Compared as text, to the bit; a file of another length is not read.
        let text = self.key_text()?;
        let path = self.folder.join(KEY_FILE);
        let may_be =
            std::fs::metadata(&path).is_ok_and(|m| m.is_file() && m.len() == text.len() as u64);
        let same = may_be && std::fs::read(&path).is_ok_and(|bytes| bytes == text.as_bytes());
        Ok(if same { Found::Same } else { Found::Others })
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

fn is_frame_name(path: &Path) -> bool {
    let stem = path.file_stem().and_then(|s| s.to_str());
    let number = stem.and_then(|s| s.strip_prefix("frame_"));
    let numbered = number.is_some_and(|n| n.len() >= 5 && n.bytes().all(|b| b.is_ascii_digit()));
    numbered && Format::of(path).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::tests::gradient;

    fn sequence(folder: &Path) -> Sequence {
        Sequence {
            key: SequenceKey {
                program: "1".to_owned(),
                scene: "a scene".to_owned(),
                tables: "embedded".to_owned(),
                size: [16, 9],
                preset: Preset::Low,
                start_time: 10.0,
                fps: 4.0,
            },
            frames: FrameRange { start: 0, end: 6 },
            format: Format::Png,
            folder: folder.to_owned(),
            replace: false,
        }
    }

    fn fake(frame: u32, _: f64) -> Result<Picture> {
        Ok(gradient([16, 9], frame))
    }

    fn ignore(_: u32, _: FrameState, _: &Path) {}

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a temporary folder")
    }

    #[test]
    fn ranges_are_read_as_written() {
        assert_eq!("0..24".parse(), Ok(FrameRange { start: 0, end: 24 }));
        assert_eq!("3..=3".parse(), Ok(FrameRange { start: 3, end: 4 }));
        for bad in
            ["", "5", "..", "5..5", "6..5", "a..b", "-1..5", "0..5..6", "0..=4294967295", "0..1e3"]
        {
            assert!(bad.parse::<FrameRange>().is_err(), "{bad}");
        }
    }

    #[test]
    fn times_follow_from_the_frame_alone() {
        let dir = folder();
        let mut times = Vec::new();
        let mut sequence = sequence(dir.path());
        sequence.frames = FrameRange { start: 2, end: 5 };
        let render = |frame, time| {
            times.push(time);
            fake(frame, time)
        };
        sequence.run(render, ignore).expect("written");
        assert_eq!(times, [10.5, 10.75, 11.0]);
    }

    #[test]
    fn a_stopped_run_goes_on_where_it_stopped() {
        let (stopped, whole) = (folder(), folder());
        let first = sequence(stopped.path());
        let fail_at_3 = |frame, time| {
            if frame == 3 { Err(Error::Gpu("lost".to_owned())) } else { fake(frame, time) }
        };
        first.run(fail_at_3, ignore).expect_err("the device was lost");

        let mut rendered = Vec::new();
        let count = |frame, time| {
            rendered.push(frame);
            fake(frame, time)
        };
        let report = first.run(count, ignore).expect("written");
        assert_eq!(rendered, [3, 4, 5]);
        assert_eq!(report, SequenceReport { kept: 3, written: 3 });

        sequence(whole.path()).run(fake, ignore).expect("written");
        for frame in 0..6 {
            let read = |s: Sequence| std::fs::read(s.path(frame)).expect("readable");
            assert!(
                read(sequence(stopped.path())) == read(sequence(whole.path())),
                "frame {frame}"
            );
        }
    }

    #[test]
    fn a_damaged_frame_is_rendered_again() {
        let dir = folder();
        let sequence = sequence(dir.path());
        sequence.run(fake, ignore).expect("written");
        let bytes = std::fs::read(sequence.path(2)).expect("readable");
        std::fs::write(sequence.path(2), &bytes[..bytes.len() / 2]).expect("writable");
        let report = sequence.run(fake, ignore).expect("written");
        assert_eq!(report, SequenceReport { kept: 5, written: 1 });
        assert_eq!(std::fs::read(sequence.path(2)).expect("readable"), bytes);
    }

    #[test]
    fn frames_of_other_settings_are_refused_or_replaced_but_never_mixed() {
        let dir = folder();
        let old = sequence(dir.path());
        old.run(fake, ignore).expect("written");

        let mut longer = sequence(dir.path());
        longer.frames.end = 8;
        let report = longer.run(fake, ignore).expect("more frames of the same");
        assert_eq!(report, SequenceReport { kept: 6, written: 2 });

        let changes: [fn(&mut SequenceKey); 5] = [
            |k| k.scene.push('!'),
            |k| k.preset = Preset::High,
            |k| k.fps = 5.0,
            |k| k.start_time = -1.0,
            |k| k.tables = "other".to_owned(),
        ];
        for change in changes {
            let mut other = sequence(dir.path());
            change(&mut other.key);
            assert!(other.check().is_err());
            let message = other.run(fake, ignore).expect_err("other frames").to_string();
            assert!(message.contains("--overwrite"), "{message}");
        }
        assert_eq!(old.run(fake, ignore).expect("untouched").kept, 6);

        let mut other = sequence(dir.path());
        other.key.fps = 5.0;
        other.frames.end = 2;
        other.replace = true;
        assert_eq!(other.run(fake, ignore).expect("replaced").written, 2);
        assert!(!other.path(7).exists(), "a frame of the old settings stayed");
    }

    #[test]
    fn frames_without_a_description_are_somebody_elses() {
        let dir = folder();
        let sequence = sequence(dir.path());
        std::fs::write(sequence.path(4), "a picture of somebody").expect("writable");
        std::fs::write(dir.path().join("notes.txt"), "kept").expect("writable");
        assert!(sequence.run(fake, ignore).is_err());
        let replacing = Sequence { replace: true, ..sequence };
        assert_eq!(replacing.run(fake, ignore).expect("replaced").written, 6);
        assert!(dir.path().join("notes.txt").exists());
    }
}
