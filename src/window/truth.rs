//! The path-traced reference of the view at rest, refined on a thread of its own, and how far the
//! frame is from it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::guard::guarded;
use super::studio::{Image, Order, Wake};
use crate::compare::error_image::error_image;
use crate::compare::{Differences, Kind, Measured, Report, compare};
use crate::frame::Picture;
use crate::frame::view::{BASE_EXPOSURE, exposure};
use crate::reference::{Exposure, Film, Filter, Lens, picture};
use crate::scene::{Camera, Scene};
use crate::tables::TableSet;
use crate::{Error, Result};

/// Between two pictures of what there is so far.
const INTERVAL: Duration = Duration::from_secs(1);
/// Between two looks for a frame that is late.
const WAIT: Duration = Duration::from_millis(50);
/// Samples a pixel after which it is left at that: an error of a hundredth of one sample's.
const MOST_SAMPLES: u32 = 10_000;
/// Differences beyond so many standard errors are counted as errors.
const MOST_Z: f64 = 3.0;

/// What is shown beside the frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Beside {
    /// The reference.
    #[default]
    Reference,
    /// Where the frame is brighter (red) and darker (blue).
    Difference,
    /// How different it looks: FLIP from black to white.
    Flip,
}

/// What the thread has so far.
pub(super) struct News {
    /// Samples every pixel has.
    pub samples: u32,
    /// The reference as displayed.
    pub reference: Image,
    /// Difference and FLIP, with the figures, when there is a frame to compare.
    pub errors: Option<([Image; 2], Figures)>,
}

/// How far the frame is from the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Figures {
    /// Mean error over the mean of the reference.
    pub bias: Option<f64>,
    /// Mean squared error over the squared reference.
    pub rel_mse: Option<f64>,
    /// What of it noise alone would make.
    pub rel_mse_of_noise: Option<f64>,
    /// Of the pictures as displayed, dB.
    pub psnr: Option<f64>,
    /// Mean FLIP, 0 to 1.
    pub flip: f64,
}

/// The thread.
pub(super) struct Truth {
    /// What is traced.
    pub subject: Order,
    frame: Arc<Mutex<Option<Picture>>>,
    cancelled: Arc<AtomicBool>,
    news: Receiver<Result<News>>,
    thread: Option<JoinHandle<()>>,
}

impl Truth {
    /// Begins to trace what an order shows.
    pub fn start(subject: Order, tables: Arc<TableSet>, wake: Wake) -> Result<Self> {
        let (send, news) = channel();
        let (frame, cancelled) = (Arc::<Mutex<_>>::default(), Arc::<AtomicBool>::default());
        let work = Work {
            scene: Scene { camera: subject.camera, ..Scene::clone(&subject.scene) },
            exposure: exposure_of(&subject.camera, subject.size, subject.time),
            tables,
            frame: frame.clone(),
            cancelled: cancelled.clone(),
            send,
            wake,
        };
        let thread = std::thread::Builder::new()
            .name("reference".to_owned())
            .spawn(move || work.run())
            .map_err(|e| Error::Failed(format!("no thread for the reference: {e}")))?;
        Ok(Self { subject, frame, cancelled, news, thread: Some(thread) })
    }

    /// The frame that is to be compared.
    pub fn set_frame(&self, picture: Picture) {
        *self.frame.lock().unwrap_or_else(PoisonError::into_inner) = Some(picture);
    }

    /// The newest of what the thread tells.
    pub fn news(&self) -> Option<Result<News>> {
        self.news.try_iter().last()
    }
}

impl Drop for Truth {
    fn drop(&mut self) {
        self.cancelled.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn exposure_of(camera: &Camera, size: [u32; 2], time: f64) -> Exposure {
    let (aperture, focus) = (camera.aperture, camera.focus());
    let lens = (aperture > 0.0).then_some(Lens { aperture, focus });
    Exposure { size, time, shutter: camera.shutter, lens, filter: Filter::Box, seed: 0, aim: None }
}

/// What the thread needs.
struct Work {
    scene: Scene,
    exposure: Exposure,
    tables: Arc<TableSet>,
    frame: Arc<Mutex<Option<Picture>>>,
    cancelled: Arc<AtomicBool>,
    send: Sender<Result<News>>,
    wake: Wake,
}

impl Work {
    fn run(self) {
        // A core stays free for the window.
        let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(cores.saturating_sub(1).max(1));
        let pool = pool.build().map_err(|e| Error::Failed(format!("threads: {e}")));
        let doing = "tracing the reference";
        let done = guarded(doing, || pool.and_then(|pool| pool.install(|| self.trace()))).flatten();
        if let Err(error) = done
            && !self.cancelled.load(Ordering::Relaxed)
        {
            self.tell(Err(error));
        }
    }

    fn trace(&self) -> Result<()> {
        let mut film = Film::new(self.exposure.size);
        let mut told = Instant::now();
        self.exposure.expose(&self.scene, &self.tables, &mut film, MOST_SAMPLES, |film| {
            if self.cancelled.load(Ordering::Relaxed) {
                return Err(Error::Failed("the view has changed".to_owned()));
            }
            let whole = film.rows == 0 && film.samples > 0;
            if whole && (film.samples == 1 || told.elapsed() >= INTERVAL) {
                self.tell(self.develop(film));
                told = Instant::now();
            }
            Ok(())
        })?;
        // The frame may come later than the last sample.
        while self.frame().is_none() && !self.cancelled.load(Ordering::Relaxed) {
            std::thread::sleep(WAIT);
        }
        self.tell(self.develop(&film));
        Ok(())
    }

    /// The frame to compare with, if it is there.
    fn frame(&self) -> Option<Picture> {
        self.frame.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn tell(&self, news: Result<News>) {
        // Nobody listens any more when the view has changed.
        let _ = self.send.send(news);
        (self.wake)();
    }

    fn develop(&self, film: &Film) -> Result<News> {
        let reference = picture(&self.scene, film.size, film.radiance());
        let errors = self.frame().map(|frame| errors(&self.scene, &frame, film)).transpose()?;
        let image = Image::Pixels(film.size, reference.pixels);
        Ok(News { samples: film.samples, reference: image, errors })
    }
}

/// Pictures of the errors, and the figures.
fn errors(scene: &Scene, frame: &Picture, film: &Film) -> Result<([Image; 2], Figures)> {
    let a = measured("the frame", frame.size, &frame.radiance, None);
    let b = measured("the reference", film.size, &film.radiance(), Some(film));
    // The scene's unit of radiance is that of its sun.
    let ev = (exposure(scene) / BASE_EXPOSURE).log2();
    let how = Differences { least_opacity: None, exposure: ev, most_z: MOST_Z };
    let report = compare(&a, &b, &how)?;
    let ([across, _], panels) = error_image(&a, &b, &report, ev);
    let [width, height] = frame.size;
    let panel = |right: u32| {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| {
            let [r, g, b] = panels[((y + height) * across + x + right * width) as usize];
            [r, g, b, 255]
        });
        Image::Pixels(frame.size, pixels.collect())
    };
    Ok(([panel(0), panel(1)], figures(&report)))
}

fn figures(report: &Report) -> Figures {
    Figures {
        bias: report.relative_mean_error,
        rel_mse: report.rel_mse,
        rel_mse_of_noise: report.rel_mse_of_noise,
        psnr: report.psnr,
        flip: report.ldr_flip,
    }
}

fn measured(name: &str, size: [u32; 2], radiance: &[[f32; 4]], film: Option<&Film>) -> Measured {
    let light = |p: &[f32; 4]| DVec3::new(p[0].into(), p[1].into(), p[2].into());
    // The error of a single sample is unknown.
    let known = film.filter(|film| film.samples > 1);
    let error = |film: &Film| {
        let of_pixel = |i| {
            let [r, g, b, _] = film.estimates(i).map(|e| e.standard_error);
            DVec3::new(r, g, b)
        };
        (0..radiance.len()).map(of_pixel).collect()
    };
    Measured {
        name: name.to_owned(),
        size,
        kind: Kind::Radiance,
        light: radiance.iter().map(light).collect(),
        standard_error: known.map(error),
        opacity: Some(radiance.iter().map(|p| p[3].into()).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::RenderSettings;
    use crate::scene::Sky;

    const SIZE: [u32; 2] = [16, 12];

    /// Nothing but an even sky: the reference knows it without noise.
    fn order() -> Order {
        let scene = Scene { sky: Sky::Uniform { radiance: 0.05 }, ..Scene::default() };
        let settings = RenderSettings::default();
        Order {
            camera: scene.camera,
            scene: Arc::new(scene),
            time: 0.0,
            size: SIZE,
            settings,
            inside: None,
        }
    }

    fn wait(truth: &Truth, enough: impl Fn(&News) -> bool) -> News {
        let end = Instant::now() + Duration::from_secs(60);
        loop {
            if let Some(news) = truth.news() {
                let news = news.expect("no error");
                if enough(&news) {
                    return news;
                }
            }
            assert!(Instant::now() < end, "no news");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// A defect on the thread: here the window's own call, the first time.
    #[test]
    fn a_panic_on_the_thread_is_told() {
        let first = AtomicBool::new(true);
        let wake = move || assert!(!first.swap(false, Ordering::Relaxed), "stumbled");
        let tables = Arc::new(TableSet::embedded().expect("the built-in tables"));
        let truth = Truth::start(order(), tables, Arc::new(wake)).expect("a thread");
        let end = Instant::now() + Duration::from_secs(60);
        let error = loop {
            if let Some(Err(error)) = truth.news() {
                break error.to_string();
            }
            assert!(Instant::now() < end, "nothing is told");
            std::thread::sleep(Duration::from_millis(5));
        };
        assert!(error.ends_with("tracing the reference: stumbled"), "{error}");
    }

    #[test]
    fn errors_of_a_frame_are_told_as_they_are() {
        let tables = Arc::new(TableSet::embedded().expect("the built-in tables"));
        let truth = Truth::start(order(), tables, Arc::new(|| {})).expect("a thread");
        let brighter = Picture {
            size: SIZE,
            radiance: vec![[0.055, 0.055, 0.055, 0.0]; Picture::pixel_count(SIZE)],
            pixels: vec![[0; 4]; Picture::pixel_count(SIZE)],
            stats: Default::default(),
        };
        truth.set_frame(brighter);
        let news = wait(&truth, |news| news.errors.is_some() && news.samples > 1);
        let Some(([difference, _], figures)) = news.errors else { panic!("no errors") };
        // The sun's disc may be in no pixel of 16 x 12: the sky is 0.05 everywhere.
        let bias = figures.bias.expect("light");
        assert!((bias - 0.1).abs() < 1e-6, "{bias}");
        assert!(figures.flip > 0.0 && figures.psnr.is_some());
        let Image::Pixels(size, pixels) = difference else { panic!("not on the host") };
        assert_eq!((size, pixels.len()), (SIZE, Picture::pixel_count(SIZE)));
        assert!(pixels.iter().all(|p| p[0] > p[2]), "red: the frame is brighter");
        let start = Instant::now();
        drop(truth);
        assert!(start.elapsed() < Duration::from_secs(20), "it stops soon");
    }
}
