//! An X server without a screen.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// For a server to end.
const PATIENCE: Duration = Duration::from_secs(5);

/// Whether a program is installed.
pub fn is_there(program: &str) -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&paths).any(|folder| folder.join(program).is_file())
}

/// A running server.
pub struct Display {
    server: Child,
    name: String,
    /// What it shows, in a file in the format of xwd.
    screen: PathBuf,
}

impl Display {
    /// Starts a server. It keeps its picture in the folder.
    pub fn start(folder: &Path) -> Self {
        // Servers that look for a free number at the same time can find the same one, so the
        // number follows from the process and a count. The last is 59535: port 65535.
        static COUNT: AtomicU32 = AtomicU32::new(0);
        super::until("an X server answers", || {
            let number = (4 * std::process::id() + COUNT.fetch_add(1, Ordering::Relaxed)) % 59_000;
            let name = format!(":{}", 100 + number);
            // Without -noreset it starts anew, and refuses others meanwhile, when its first client
            // goes.
            let server = Command::new("Xvfb")
                .args([&name, "-noreset", "-nolisten", "tcp", "-screen", "0", "1024x768x24"])
                .arg("-fbdir")
                .arg(folder)
                .stderr(Stdio::null())
                .spawn()
                .expect("Xvfb starts");
            let mut display = Self { server, name, screen: folder.join("Xvfb_screen0") };
            super::until("the X server answers, or ends", || {
                let has_ended = display.server.try_wait().expect("a state").is_some();
                let answers = !display.tool(&["getdisplaygeometry"]).is_empty();
                (has_ended || answers).then_some(())
            });
            // One that was killed left its number taken: the next may be free.
            display.server.try_wait().expect("a state").is_none().then_some(display)
        })
    }

    /// As programs want it in `DISPLAY`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Runs xdotool; what it says.
    pub fn tool(&self, arguments: &[&str]) -> String {
        let output = Command::new("xdotool")
            .args(arguments)
            .env("DISPLAY", &self.name)
            .output()
            .expect("xdotool starts");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// The upper left corner of the screen.
    pub fn screen(&self, size: [u32; 2]) -> image::RgbImage {
        let bytes = std::fs::read(&self.screen).expect("the server's picture");
        // XWDFile.h: 32-bit numbers, the most significant byte first.
        let number = |index: usize| {
            let at = 4 * index;
            u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize
        };
        let (header, bits, line, colours) = (number(0), number(11), number(12), number(19));
        assert_eq!(bits, 32, "bits a pixel");
        let pixels = &bytes[header + 12 * colours..];
        image::RgbImage::from_fn(size[0], size[1], |x, y| {
            let at = y as usize * line + 4 * x as usize;
            // Blue, green, red in memory.
            image::Rgb([pixels[at + 2], pixels[at + 1], pixels[at]])
        })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // Asked to end, it frees its number; killed, it would not.
        let id = self.server.id().to_string();
        let _ = Command::new("kill").arg(&id).stderr(Stdio::null()).status();
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end && matches!(self.server.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(10));
        }
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
