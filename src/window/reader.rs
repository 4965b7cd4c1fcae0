//! The thread that reads files: the window answers, however large they are.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};

use super::files::{self, Content, Found, Sources};
use super::guard::guarded;
use super::studio::Wake;
use crate::scene::{Channel, Scene, WeatherMap};
use crate::{Error, Result};

/// Something to read.
#[derive(Debug)]
pub(super) enum Job {
    /// A file of any kind; colours of a map mean `channels` where it has so many.
    Open { path: PathBuf, shapes: Vec<String>, channels: Vec<Channel> },
    /// A scene that has changed.
    Reload { path: PathBuf, shapes: Vec<String> },
    /// Maps whose files have changed.
    Maps(Vec<WeatherMap>),
    /// A map whose colours mean something else now.
    Channels(Box<WeatherMap>),
    /// What there is to choose from: all kinds in the folders, paths in `more` of them too.
    Find { folders: Vec<PathBuf>, more: Vec<PathBuf> },
}

/// What came of it.
#[derive(Debug)]
pub(super) enum Done {
    /// A file with what it depends on, as that was before it was read.
    Opened(PathBuf, Sources, Result<Content>),
    /// The same for a scene that has changed.
    Reloaded(PathBuf, Sources, Result<Box<Scene>>),
    /// Maps read again, each with its file.
    Maps(Vec<(PathBuf, Result<WeatherMap>)>),
    /// A map with its colours read anew.
    Channels(Result<Box<WeatherMap>>),
    /// What there is to choose from.
    Found(Found),
    /// A defect of the program showed itself while it was done.
    Broken(Error),
}

/// The thread, from the window's side. Jobs are done one after the other.
pub(super) struct Reader {
    jobs: Sender<Job>,
    done: Receiver<Done>,
    /// What is not done yet, for people; looking for files is no news.
    waiting: VecDeque<Option<String>>,
}

impl Reader {
    /// Starts the thread. It ends with the reader, after what is under way.
    pub fn start(wake: Wake) -> Self {
        Self::start_with(wake, Job::run)
    }

    /// The same with another way to do jobs.
    fn start_with(wake: Wake, run: fn(Job) -> Done) -> Self {
        let (jobs, to_do) = channel::<Job>();
        let (send, done) = channel();
        std::thread::spawn(move || {
            for job in to_do {
                let doing = format!("reading {}", job.name().as_deref().unwrap_or("folders"));
                // A panic must not end the thread: the next file has nothing to do with it.
                let done = guarded(&doing, || run(job)).unwrap_or_else(Done::Broken);
                // Nobody listens any more when the window is closed.
                if send.send(done).is_err() {
                    break;
                }
                wake();
            }
        });
        Self { jobs, done, waiting: VecDeque::new() }
    }

    /// Asks for something.
    pub fn send(&mut self, job: Job) {
        let name = job.name();
        // The thread lives as long as its sender.
        if self.jobs.send(job).is_ok() {
            self.waiting.push_back(name);
        }
    }

    /// The next thing that is done, if there is one.
    pub fn done(&mut self) -> Option<Done> {
        let done = self.done.try_recv().ok()?;
        self.waiting.pop_front();
        Some(done)
    }

    /// The file that is waited for.
    pub fn waits_for(&self) -> Option<String> {
        self.waiting.iter().flatten().next().cloned()
    }
}

impl Job {
    fn name(&self) -> Option<String> {
        let name = |path: &Path| Some(path.display().to_string());
        match self {
            Self::Open { path, .. } | Self::Reload { path, .. } => name(path),
            Self::Maps(maps) => maps.first().and_then(|map| name(&map.file)),
            Self::Channels(map) => name(&map.file),
            Self::Find { .. } => None,
        }
    }

    fn run(self) -> Done {
        match self {
            Self::Open { path, shapes, channels } => {
                let sources = Sources::of(&path);
                let content = files::read(&path, &shapes, &channels);
                Done::Opened(path, sources, content)
            }
            Self::Reload { path, shapes } => {
                let sources = Sources::of(&path);
                let scene = files::scene(&path, &shapes).map(Box::new);
                Done::Reloaded(path, sources, scene)
            }
            Self::Maps(maps) => {
                let read = |map: WeatherMap| (map.file.clone(), map.read_again());
                Done::Maps(maps.into_iter().map(read).collect())
            }
            Self::Channels(map) => Done::Channels(map.read_again().map(Box::new)),
            Self::Find { folders, more } => Done::Found(files::find(&folders, &more)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::time::{Duration, Instant};

    use super::*;

    /// For a file of a few bytes, on the slowest machine.
    const PATIENCE: Duration = Duration::from_secs(60);

    /// The next thing that is done.
    fn next(reader: &mut Reader) -> Done {
        let end = Instant::now() + PATIENCE;
        loop {
            if let Some(done) = reader.done() {
                return done;
            }
            assert!(Instant::now() < end, "nothing came");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn what_is_asked_for_comes_in_order_and_wakes_the_window() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("map.png");
        image::RgbImage::new(2, 2).save(&path).expect("written");
        let woken = Arc::new(AtomicU32::new(0));
        let count = woken.clone();
        let wake = Arc::new(move || {
            count.fetch_add(1, Ordering::Relaxed);
        });
        let mut reader = Reader::start(wake);
        let channels = vec![Channel::Height, Channel::Coverage];
        let open = |path: &Path| Job::Open {
            path: path.to_owned(),
            shapes: Vec::new(),
            channels: channels.clone(),
        };
        reader.send(Job::Find { folders: vec![dir.path().to_owned()], more: Vec::new() });
        assert_eq!(reader.waits_for(), None, "nothing that anybody has asked for");
        reader.send(open(&path));
        reader.send(open(&dir.path().join("none.toml")));
        assert_eq!(reader.waits_for(), Some(path.display().to_string()));
        assert!(matches!(next(&mut reader), Done::Found(found) if found.maps == [path.clone()]));
        let Done::Opened(of, sources, Ok(Content::Map(map))) = next(&mut reader) else {
            panic!("no map")
        };
        assert_eq!((of.as_path(), sources.scene.path()), (path.as_path(), path.as_path()));
        assert_eq!(map.channels, channels);
        assert!(matches!(next(&mut reader), Done::Opened(_, _, Err(_))));
        assert_eq!(reader.waits_for(), None);
        let end = Instant::now() + PATIENCE;
        while woken.load(Ordering::Relaxed) < 3 {
            assert!(Instant::now() < end, "the window sleeps");
        }
        // What is gone is told, what is there is read all the same, and maps stay as they were.
        let there = WeatherMap { file: dir.path().join("there.png"), ..(*map).clone() };
        image::RgbImage::new(3, 1).save(&there.file).expect("written");
        std::fs::remove_file(&path).expect("removed");
        reader.send(Job::Maps(vec![*map, there]));
        let Done::Maps(read) = next(&mut reader) else { panic!("no maps") };
        let [(gone, Err(_)), (_, Ok(there))] = &read[..] else { panic!("{read:?}") };
        assert_eq!((gone, there.image.size()), (&path, [3, 1]));
    }

    #[test]
    fn a_panic_is_told_and_the_next_file_is_read() {
        let run = |job: Job| match job {
            Job::Reload { path, .. } => panic!("a defect at {}", path.display()),
            job => job.run(),
        };
        let mut reader = Reader::start_with(Arc::new(|| {}), run);
        let path = PathBuf::from("scene.toml");
        for _ in 0..2 {
            reader.send(Job::Reload { path: path.clone(), shapes: Vec::new() });
            reader.send(Job::Find { folders: Vec::new(), more: Vec::new() });
            let Done::Broken(error) = next(&mut reader) else { panic!("no defect") };
            let told = error.to_string();
            assert!(told.contains("reading scene.toml") && told.contains("a defect at"), "{told}");
            assert!(matches!(next(&mut reader), Done::Found(_)), "it goes on");
            assert_eq!(reader.waits_for(), None);
        }
    }
}
