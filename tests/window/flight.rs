//! The program, flying in a window that nobody sees.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::display::{Display, is_there};

/// For whatever should happen soon, on the slowest machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// The program, flying.
pub struct Flight {
    dir: tempfile::TempDir,
    pub display: Display,
    child: Child,
    pub window: String,
    saved: u32,
}

impl Flight {
    /// Starts it with a scene, and stops the time; none where this machine has no X server to try
    /// it on.
    pub fn start(scene: &str, size: &str) -> Option<Self> {
        Self::start_at_scale(scene, size, Some("1"))
    }

    /// The same with more files in its folder.
    pub fn start_beside(scene: &str, size: &str, files: impl FnOnce(&Path)) -> Option<Self> {
        Self::start_in(scene, size, Some("1"), files)
    }

    /// The same on a display with so many pixels to a point, or as many as the display says.
    pub fn start_at_scale(scene: &str, size: &str, scale: Option<&str>) -> Option<Self> {
        Self::start_in(scene, size, scale, |_| ())
    }

    fn start_in(
        scene: &str,
        size: &str,
        scale: Option<&str>,
        files: impl FnOnce(&Path),
    ) -> Option<Self> {
        if !is_there("Xvfb") || !is_there("xdotool") {
            println!("skipped: Xvfb and xdotool are needed to try the window");
            return None;
        }
        let dir = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(dir.path().join("scene.toml"), scene).expect("written");
        files(dir.path());
        let display = Display::start(dir.path());
        let log = std::fs::File::create(dir.path().join("log")).expect("a log");
        let mut program = Command::new(env!("CARGO_BIN_EXE_cumuli"));
        match scale {
            Some(scale) => program.env("WINIT_X11_SCALE_FACTOR", scale),
            None => program.env_remove("WINIT_X11_SCALE_FACTOR"),
        };
        let child = program
            .args(["fly", "--scene", "scene.toml", "--size", size])
            .current_dir(dir.path())
            .env("DISPLAY", display.name())
            .env("XDG_RUNTIME_DIR", dir.path())
            .env("RUST_LOG", "cumuli=info")
            .env_remove("WAYLAND_DISPLAY")
            .stdin(Stdio::null())
            .stderr(log)
            .spawn()
            .expect("the program starts");
        let window = until("the window is there", || {
            let found = display.tool(&["search", "--onlyvisible", "--name", "^Cumuli$"]);
            found.lines().next().map(str::to_owned)
        });
        // Without a window manager nobody gives it the keyboard.
        display.tool(&["windowfocus", "--sync", &window]);
        let flight = Self { dir, display, child, window, saved: 0 };
        until("the first picture", || flight.log().contains("first picture").then_some(()));
        // Not before: a key that comes with the focus may be lost.
        flight.keys(&["space"]);
        Some(flight)
    }

    /// Presses keys, one after the other.
    pub fn keys(&self, keys: &[&str]) {
        self.display.tool(&[&["key"], keys].concat());
    }

    /// Clicks a place of the window. Press and release follow at once: what is held long is no click.
    pub fn click(&self, place: [u32; 2]) {
        let [x, y] = place.map(|v| v.to_string());
        self.display.tool(&["mousemove", "--window", &self.window, &x, &y]);
        std::thread::sleep(Duration::from_millis(300));
        self.display.tool(&["click", "1"]);
    }

    /// Drags the mouse from one place of the window to another.
    pub fn drag(&self, from: [u32; 2], to: [u32; 2]) {
        let to_text = |place: [u32; 2]| place.map(|v| v.to_string());
        let ([x, y], [u, v]) = (to_text(from), to_text(to));
        let pause = || std::thread::sleep(Duration::from_millis(300));
        self.display.tool(&["mousemove", "--window", &self.window, &x, &y]);
        pause();
        self.display.tool(&["mousedown", "1"]);
        pause();
        self.display.tool(&["mousemove", "--window", &self.window, &u, &v]);
        pause();
        self.display.tool(&["mouseup", "1"]);
        pause();
    }

    /// What the program has logged so far.
    pub fn log(&self) -> String {
        std::fs::read_to_string(self.path("log")).expect("a log")
    }

    /// A file in the folder that it runs in.
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Presses a key that saves a file, and waits for the file.
    pub fn saved(&self, key: &str, name: &str) -> PathBuf {
        self.keys(&[key]);
        let path = self.path(name);
        until(name, || path.exists().then_some(()));
        path
    }

    /// Saves the view and reads it.
    pub fn picture(&mut self) -> image::RgbImage {
        self.saved += 1;
        let path = self.saved("F12", &format!("cumuli-{:04}.png", self.saved));
        image::open(path).expect("a whole PNG").into_rgb8()
    }

    /// Presses Escape; the exit code.
    pub fn quit(mut self) -> Option<i32> {
        self.keys(&["Escape"]);
        until("the program ends", || self.child.try_wait().expect("a state")).code()
    }

    /// Processor time that it has taken so far, of all its threads.
    pub fn processor_time(&self) -> Duration {
        // proc(5): the 14th and 15th words, in clock ticks, of which Linux has 100 a second.
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id()));
        let stat = stat.expect("it runs");
        let after_name = stat.rsplit(')').next().expect("words").split_whitespace();
        let ticks = after_name.skip(11).take(2).map(|word| word.parse::<u64>().expect("ticks"));
        Duration::from_millis(10 * ticks.sum::<u64>())
    }

    /// Whether it is still there.
    pub fn is_alive(&mut self) -> bool {
        self.child.try_wait().expect("a state").is_none()
    }

    /// The program without a window, in the same folder.
    pub fn other(&self, arguments: &[&str]) {
        let status = Command::new(env!("CARGO_BIN_EXE_cumuli"))
            .args(arguments)
            .current_dir(self.dir.path())
            .env("XDG_RUNTIME_DIR", self.dir.path())
            .stdout(Stdio::null())
            .status()
            .expect("the program starts");
        assert_eq!(status.code(), Some(0), "{arguments:?}");
    }

    /// The screen, when it has not changed for a second.
    pub fn screen_at_rest(&self, size: [u32; 2]) -> image::RgbImage {
        let mut last = self.display.screen(size);
        until("nothing moves on the screen", || {
            std::thread::sleep(Duration::from_secs(1));
            let now = self.display.screen(size);
            let same = now == last && now.pixels().any(|p| p.0 != [0; 3]);
            last = now;
            same.then(|| last.clone())
        })
    }

    /// Keeps a picture of the screen for people, where `CUMULI_SCREENS` names a folder.
    pub fn keep_screen(&self, name: &str, size: [u32; 2]) {
        if let Some(folder) = std::env::var_os("CUMULI_SCREENS") {
            let screen = self.display.screen(size);
            screen.save(Path::new(&folder).join(name)).expect("saved");
        }
    }
}

impl Drop for Flight {
    fn drop(&mut self) {
        if std::thread::panicking() {
            println!("{}", self.log());
        }
        // After a test that failed; otherwise it has ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Waits until something is so.
pub fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < end, "in vain: {what}");
        std::thread::sleep(Duration::from_millis(50));
    }
}
