//! Sequences as video: encoded by ffmpeg, or as Y4M, which encoders and players read.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::atomic;
use crate::error::{Error, Result};

/// The encoder's name.
const FFMPEG: &str = "ffmpeg";
/// Denominator of frame rates: three digits after the point.
const RATE_UNIT: u32 = 1000;

/// Where a video goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum VideoTarget {
    /// Y4M to standard output.
    StandardOutput,
    /// Y4M into a file.
    Y4m(PathBuf),
    /// Whatever ffmpeg makes of the file name's end.
    Encoded(PathBuf),
}

impl VideoTarget {
    /// What a name on the command line means: "-", a name that ends in .y4m, or any other. Refused
    /// where it cannot be done.
    pub fn of(name: &Path) -> Result<Self> {
        if name.as_os_str() == "-" {
            return Ok(Self::StandardOutput);
        }
        super::check_file(name)?;
        if name.extension().is_some_and(|e| e.eq_ignore_ascii_case("y4m")) {
            return Ok(Self::Y4m(name.to_owned()));
        }
        let version = Command::new(FFMPEG).arg("-version").stdin(Stdio::null()).output();
        if !version.is_ok_and(|output| output.status.success()) {
            return Err(Error::input(
                format!("--video {}", name.display()),
                "ffmpeg, which would encode it, is not installed; expected -, for Y4M on standard \
                 output, or a name that ends in .y4m",
            ));
        }
        Ok(Self::Encoded(name.to_owned()))
    }
}

/// Makes a video of PNG files of one size, shown at `rate` frames a second.
pub fn write_video(
    target: &VideoTarget,
    frames: &[PathBuf],
    size: [u32; 2],
    rate: f64,
) -> Result<()> {
    match target {
        VideoTarget::StandardOutput => {
            let out = io::stdout().lock();
            match y4m(&mut io::BufWriter::new(out), frames, size, rate) {
                // A reader that has gone away, as `head` does, is no error.
                Err(Error::Io { source, .. }) if source.kind() == io::ErrorKind::BrokenPipe => {
                    Ok(())
                }
                done => done,
            }
        }
        VideoTarget::Y4m(path) => {
            let mut failed = None;
            let written = atomic::write_atomically(path, |out| {
                y4m(out, frames, size, rate).map_err(|error| {
                    let reason = io::Error::other(error.to_string());
                    failed = Some(error);
                    reason
                })
            });
            failed.map_or(written, Err)
        }
        VideoTarget::Encoded(path) => encode(path, frames, size, rate),
    }
}

/// Hands the frames to ffmpeg. The file appears when it is whole.
fn encode(path: &Path, frames: &[PathBuf], size: [u32; 2], rate: f64) -> Result<()> {
    let path = &atomic::resolved(path)?;
    atomic::sweep(path);
    // The name's end tells ffmpeg the format, so it stays the end.
    let end = path.extension().unwrap_or_default().to_string_lossy();
    let temporary = atomic::temporary(path, &format!(".{end}"))?;
    // There a lock keeps others from writing, not only from sweeping.
    #[cfg(windows)]
    let _ = temporary.as_file().unlock();
    let mut child = Command::new(FFMPEG)
        .args(["-hide_banner", "-loglevel", "error", "-y", "-f", "yuv4mpegpipe", "-i", "-"])
        // Half the colours, which all players know, and even sides, which they need.
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
        .args(["-color_range", "tv", "-colorspace", "bt709"])
        .arg(temporary.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .map_err(|e| Error::Failed(format!("ffmpeg does not start: {e}")))?;
    let fed = match child.stdin.take() {
        Some(pipe) => y4m(&mut io::BufWriter::new(pipe), frames, size, rate),
        None => Err(Error::Failed("ffmpeg takes no input".to_owned())),
    };
    let status = child.wait().map_err(|e| Error::Failed(format!("ffmpeg: {e}")))?;
    if !status.success() {
        // It has said why on standard error.
        return Err(Error::Failed(format!("ffmpeg could not encode {}: {status}", path.display())));
    }
    fed?;
    atomic::put_in_place(temporary, path)
}

/// Writes Y4M: 8 bits, full colour resolution, BT.709.
fn y4m(out: &mut dyn Write, frames: &[PathBuf], size: [u32; 2], rate: f64) -> Result<()> {
    let refuse = |e| Error::io(Path::new("the video"), "write", e);
    let [width, height] = size;
    let [over, under] = fraction(rate);
    writeln!(out, "YUV4MPEG2 W{width} H{height} F{over}:{under} Ip A1:1 C444 XCOLORRANGE=LIMITED")
        .map_err(refuse)?;
    for path in frames {
        let bad = |e: String| Error::input(path.display().to_string(), e);
        let frame = image::open(path).map_err(|e| bad(e.to_string()))?.into_rgb8();
        if frame.dimensions() != (width, height) {
            let (w, h) = frame.dimensions();
            return Err(bad(format!("expected {width}x{height} pixels, found {w}x{h}")));
        }
        out.write_all(b"FRAME\n").map_err(refuse)?;
        for plane in 0..3 {
            let bytes: Vec<u8> = frame.pixels().map(|p| video_levels(p.0)[plane]).collect();
            out.write_all(&bytes).map_err(refuse)?;
        }
    }
    out.flush().map_err(refuse)
}

/// Luma and the two differences of colour, in the ranges 16 to 235 and 16 to 240 (ITU-R BT.709-6,
/// items 3.2 and 4.6).
fn video_levels(rgb: [u8; 3]) -> [u8; 3] {
    let [r, g, b] = rgb.map(|v| f64::from(v) / 255.0);
    let luma = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let byte = |v: f64| v.round().clamp(0.0, 255.0) as u8;
    [
        byte(16.0 + 219.0 * luma),
        byte(128.0 + 224.0 * (b - luma) / 1.8556),
        byte(128.0 + 224.0 * (r - luma) / 1.5748),
    ]
}

/// A frame rate as a fraction in lowest terms.
fn fraction(rate: f64) -> [u32; 2] {
    let over = (rate * f64::from(RATE_UNIT)).round().clamp(1.0, f64::from(u32::MAX)) as u32;
    let (mut a, mut b) = (over, RATE_UNIT);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    [over / a, RATE_UNIT / a]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_those_of_the_standard() {
        for (rgb, levels) in [
            ([0, 0, 0], [16, 128, 128]),
            ([255, 255, 255], [235, 128, 128]),
            // 16 + 219 * 0.2126 = 62.6; red's difference is at its end.
            ([255, 0, 0], [63, 102, 240]),
            ([0, 0, 255], [32, 240, 118]),
        ] {
            assert_eq!(video_levels(rgb), levels, "{rgb:?}");
        }
    }

    #[test]
    fn rates_are_fractions() {
        for (rate, expected) in
            [(25.0, [25, 1]), (29.97, [2997, 100]), (0.5, [1, 2]), (23.976, [2997, 125])]
        {
            assert_eq!(fraction(rate), expected);
        }
    }

    #[test]
    fn frames_follow_each_other_plane_by_plane() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let paths: Vec<_> = [10u8, 200]
            .iter()
            .map(|v| {
                let path = dir.path().join(format!("{v}.png"));
                super::super::write_png(&path, [3, 2], &[[*v; 3]; 6]).expect("written");
                path
            })
            .collect();
        let out = dir.path().join("a.y4m");
        let target = VideoTarget::of(&out).expect("a target");
        write_video(&target, &paths, [3, 2], 12.5).expect("written");
        let bytes = std::fs::read(&out).expect("readable");
        let header = b"YUV4MPEG2 W3 H2 F25:2 Ip A1:1 C444 XCOLORRANGE=LIMITED\n";
        assert!(bytes.starts_with(header));
        let frame = |v: u8| [b"FRAME\n".to_vec(), vec![v; 6], vec![128; 12]].concat();
        assert_eq!(bytes[header.len()..], [frame(25), frame(188)].concat());

        std::fs::remove_file(&out).expect("removed");
        let message = write_video(&target, &paths, [2, 2], 25.0).expect_err("size").to_string();
        assert!(message.contains("expected 2x2") && !out.exists(), "{message}");
    }
}
