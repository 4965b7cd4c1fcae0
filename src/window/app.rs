//! The running program: session, window, device, and the thread that makes pictures.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::window::{CursorGrabMode, Window};

use super::files::{Sources, Watched};
use super::graphics::Graphics;
use super::panel::{self, Report};
use super::reader::Reader;
use super::saving;
use super::session::Session;
use super::studio::{Errand, Order, Reply, Shown, Studio, Wake};
use super::truth::{Beside, News, Truth};
use super::wishes::Wish;
use super::{WindowOptions, window_error};
use crate::frame::Preset;
use crate::output::Format;
use crate::scene::Scene;
use crate::tables::TableSet;
use crate::{Error, Result};

/// A device that is lost again sooner than this is given up.
const PATIENCE: Duration = Duration::from_secs(10);
/// What a frame after a rest counts for, s: a tap on a key then moves as far as it should.
const FIRST_STEP: f64 = 1.0 / 60.0;
/// Share of a new picture in the shown times.
const SMOOTHING: f64 = 0.2;
/// A view that rests so long is shown sharp.
const REST: Duration = Duration::from_millis(300);
/// How often a stage that takes long is painted.
const STAGE_INTERVAL: Duration = Duration::from_millis(200);

/// The running program.
pub(super) struct App {
    pub(super) session: Session,
    pub(super) report: Report,
    options: WindowOptions,
    pub(super) tables: Arc<TableSet>,
    pub(super) wake: Wake,
    // What is on the device before the window it is shown in.
    pub(super) studio: Option<Studio>,
    pub(super) graphics: Option<Graphics>,
    pub(super) window: Option<Arc<Window>>,
    pub(super) looking: bool,
    /// The reference of the view, while it is wanted and the view rests.
    pub(super) truth: Option<Truth>,
    /// What it has told last.
    pub(super) news: Option<News>,
    /// What of it is on the screen.
    pub(super) beside: Beside,
    #[cfg(feature = "gamepad")]
    pads: super::gamepad::Pads,
    /// The thread that reads files.
    pub(super) reader: Reader,
    /// The scene's file.
    pub(super) watched: Option<Watched>,
    /// The weather map of a scene's file that could not be read: mended, it makes the scene whole.
    pub(super) watched_cause: Option<Watched>,
    /// The files of the weather maps that are shown, or come with a reset.
    pub(super) watched_maps: Vec<Watched>,
    /// When files are looked at next.
    pub(super) look_at: Instant,
    /// The scene that orders share until it is changed.
    ordered: Arc<Scene>,
    /// Whether the quality at the start was chosen for the adapter.
    adapted: bool,
    last_frame: Option<Instant>,
    last_picture: Option<Instant>,
    last_loss: Option<Instant>,
    /// What the times that resolution adapts to were measured with.
    preset: Preset,
    /// Whether the window is minimised, as the last look at it told.
    pub(super) hidden: bool,
    /// Since when nothing moves.
    resting_since: Option<Instant>,
    /// When the window wants to be painted again.
    pub(super) repaint_at: Option<Instant>,
    /// Why the program ends, if not because it was asked to.
    pub failure: Option<Error>,
}

impl App {
    /// The program before there is a window.
    pub fn new(options: WindowOptions, wake: Wake) -> Self {
        let mut session = Session::new(options.scene.clone(), options.time);
        if let Some(preset) = options.preset {
            session.settings.preset = preset;
        }
        let file = options.file.clone();
        let shapes = options.tables.shape_names().map(str::to_owned).collect();
        let tables = Arc::new(options.tables.clone());
        let mut app = Self {
            ordered: Arc::new(session.scene.clone()),
            session,
            report: Report { shapes, tables: Some(tables.clone()), ..Report::default() },
            tables,
            options,
            #[cfg(feature = "gamepad")]
            pads: super::gamepad::Pads::start(wake.clone()),
            reader: Reader::start(wake.clone()),
            wake,
            studio: None,
            graphics: None,
            window: None,
            looking: false,
            truth: None,
            news: None,
            beside: Beside::default(),
            watched: None,
            watched_cause: None,
            watched_maps: Vec::new(),
            look_at: Instant::now(),
            adapted: false,
            last_frame: None,
            last_picture: None,
            last_loss: None,
            hidden: false,
            resting_since: None,
            preset: Preset::default(),
            repaint_at: None,
            failure: None,
        };
        if let Some(path) = &app.options.path {
            app.session.path.set(path, app.options.time);
        }
        app.report.file = file;
        app.watched = app.report.file.as_ref().map(|path| Sources::of(path).scene);
        app.find_files();
        app
    }

    /// Opens the window.
    pub fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let [width, height] = self.options.size;
        let attributes = Window::default_attributes()
            .with_title("Cumuli")
            .with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop.create_window(attributes);
        self.window = Some(Arc::new(window.map_err(|e| window_error(&e.to_string()))?));
        Ok(())
    }

    /// A device for the window, a quality that suits it, and the thread that makes pictures.
    fn make_graphics(&mut self, window: &Arc<Window>) -> Result<()> {
        let graphics = Graphics::new(window)?;
        (self.report.adapter, self.report.software) = graphics.adapter();
        if self.report.software && !self.adapted {
            self.session.for_software();
            if let Some(preset) = self.options.preset {
                self.session.settings.preset = preset;
            }
        }
        self.adapted = true;
        // On a software driver the window would wait for the clouds' queue.
        let shared = (!self.report.software).then(|| graphics.gpu().clone());
        self.graphics = Some(graphics);
        self.studio = Some(Studio::new(shared, self.tables.clone(), self.wake.clone())?);
        Ok(())
    }

    /// Lets time go by, orders the picture that belongs to it, and paints what there is.
    pub fn redraw(&mut self) -> Result<()> {
        let Some(window) = self.window.clone() else { return Ok(()) };
        let size: [u32; 2] = window.inner_size().into();
        self.hidden = size.contains(&0) || window.is_minimized() == Some(true);
        if self.hidden {
            // Nothing is made that nobody sees, and the time of the flight stands.
            self.last_frame = None;
            return Ok(());
        }
        self.step();
        if self.graphics.is_none() {
            self.make_graphics(&window)?;
        }
        self.take_replies()?;
        self.order(size);
        self.attend_truth(size)?;
        self.report.compiled = self.studio.as_ref().map_or(0, Studio::compiled);
        let (session, report) = (&mut self.session, &self.report);
        let Some(graphics) = &mut self.graphics else { return Ok(()) };
        let split = session.compare.split;
        let again = graphics.present(split, |ctx| panel::show(ctx, session, report))?;
        let mut repaint_at = again.and_then(|wait| Instant::now().checked_add(wait));
        let mut at_latest = |wait: Duration| {
            let at = Instant::now() + wait;
            repaint_at = Some(repaint_at.map_or(at, |other| other.min(at)));
        };
        if self.report.stage.is_some() {
            at_latest(STAGE_INTERVAL);
        }
        if let Some(since) = self.resting_since
            && since.elapsed() < REST
        {
            at_latest(REST - since.elapsed());
        }
        self.repaint_at = repaint_at;
        Ok(())
    }

    /// Lets the time since the last frame go by.
    fn step(&mut self) {
        let now = Instant::now();
        let seconds = self.last_frame.replace(now).map(|last| now.duration_since(last));
        self.session.step(seconds.map_or(FIRST_STEP, |s| s.as_secs_f64()));
        if self.session.is_lively() {
            self.resting_since = None;
        } else {
            // The time at rest is no part of the next frame's.
            self.last_frame = None;
            self.resting_since.get_or_insert(now);
        }
    }

    /// The order that belongs to the present moment.
    pub(super) fn present_order(&mut self, size: [u32; 2]) -> Order {
        if *self.ordered != self.session.scene {
            self.ordered = Arc::new(self.session.scene.clone());
        }
        Order {
            scene: self.ordered.clone(),
            camera: self.session.fly.camera(),
            time: self.session.clock.time,
            size,
            settings: self.session.settings,
            inside: None,
        }
    }

    fn order(&mut self, window: [u32; 2]) {
        let most = self.graphics.as_ref().map_or(1, Graphics::most_pixels);
        let size = self.session.picture_size(window, most, self.rests());
        let order = Order { inside: self.session.inside, ..self.present_order(size) };
        if self.session.settings.preset != self.preset {
            self.preset = self.session.settings.preset;
            self.session.resolution.begin();
        }
        // Light that is made over several pictures goes on in the next.
        let unfinished = self.report.stats.unfinished && !self.is_busy();
        if let Some(studio) = &mut self.studio {
            studio.order(order, unfinished);
        }
    }

    /// Whether the view has rested for a while.
    pub(super) fn rests(&self) -> bool {
        self.report.has_picture && self.resting_since.is_some_and(|since| since.elapsed() >= REST)
    }

    /// Takes over what the thread has made.
    pub fn take_replies(&mut self) -> Result<()> {
        self.take_read();
        #[cfg(feature = "gamepad")]
        self.take_pads();
        while let Some(reply) = self.studio.as_mut().and_then(Studio::reply) {
            match reply {
                Reply::Stage(stage) => self.report.stage = stage,
                Reply::Picture(shown) => self.take_picture(*shown),
                Reply::Measured(measured) => self.compare_with(*measured),
                Reply::Saved(paths) => {
                    let names: Vec<_> = paths.iter().map(|p| p.display().to_string()).collect();
                    self.report.message.tell(format!("saved {}", names.join(" and ")));
                }
                Reply::Refused(error) => {
                    self.report.stage = None;
                    self.report.message.tell(error.to_string());
                }
                Reply::Failed(error) => return Err(error),
            }
        }
        self.take_news();
        Ok(())
    }

    /// Does what gamepads ask for, where the window has the keyboard.
    #[cfg(feature = "gamepad")]
    fn take_pads(&mut self) {
        use super::gamepad::News;
        let focused = self.window.as_ref().is_some_and(|window| window.has_focus());
        while let Some(news) = self.pads.news() {
            match news {
                News::Message(message) => self.tell(Ok(message)),
                _ if !focused => {}
                News::Lean(lean) => self.session.fly.lean(lean),
                News::Key(key, down) => self.session.key(key, down, false),
                News::Speed(notches) => {
                    self.session.fly.wheel(notches);
                    self.report.message.tell(format!("{:.0} m/s", self.session.fly.speed));
                }
            }
        }
    }

    fn take_picture(&mut self, shown: Shown) {
        if let Some(graphics) = &mut self.graphics {
            graphics.set_picture(0, Some(&shown.image));
        }
        let now = Instant::now();
        if !self.report.has_picture {
            let seconds = self.options.begun.elapsed().as_secs_f64();
            let of_processor = cpu_time::ProcessTime::now().as_duration().as_secs_f64();
            tracing::info!(
                "first picture after {seconds:.3} s, {of_processor:.3} s of processor time"
            );
            self.report.first_picture = seconds;
            for pass in shown.stats.passes.iter().filter(|pass| pass.ran) {
                tracing::debug!("first picture: {} {:?} ms", pass.name, pass.milliseconds);
            }
        }
        let since_last = self.last_picture.replace(now).map(|last| now.duration_since(last));
        if let (Some(interval), true) = (since_last, self.session.is_lively()) {
            let (shown, new) = (&mut self.report.interval, interval.as_secs_f64());
            *shown = if *shown == 0.0 { new } else { *shown + SMOOTHING * (new - *shown) };
        }
        self.report.has_picture = true;
        self.report.size = shown.order.size;
        self.report.seconds = shown.seconds;
        self.report.history.add(&shown.stats);
        self.report.stats = shown.stats;
        self.report.legend = shown.legend;
        let window = self.window.as_ref().map(|w| w.inner_size().into()).unwrap_or([1, 1]);
        let most = self.graphics.as_ref().map_or(1, Graphics::most_pixels);
        if shown.order.inside != self.report.inside {
            self.report.inside = shown.order.inside;
            tracing::info!("shows {:?}", shown.order.inside);
        }
        let usual = self.session.picture_size(window, most, false) == shown.order.size;
        if usual && !shown.cold {
            self.session.resolution.took(shown.seconds);
        } else {
            self.session.resolution.forget();
        }
    }

    /// Does what keys and buttons asked for.
    pub fn grant(&mut self, event_loop: &ActiveEventLoop) {
        for wish in std::mem::take(&mut self.session.wishes) {
            match wish {
                Wish::SaveScene(path) => {
                    let saved = self.save_scene(path.as_deref());
                    self.tell(saved);
                }
                Wish::SavePath => {
                    let saved = self.save_path();
                    self.tell(saved);
                }
                Wish::Open(path) => self.load(&path),
                Wish::TakeChannels(channels) => self.take_channels(channels),
                Wish::Quit => event_loop.exit(),
                // While the device is made anew there is nobody to do it.
                Wish::Screenshot(_) if self.studio.is_none() => self.session.wishes.push(wish),
                Wish::Screenshot(formats) => self.screenshot(&formats),
                Wish::LoseSurface => {
                    if let Some(graphics) = &mut self.graphics {
                        graphics.lose_surface();
                    }
                    self.request_redraw();
                }
                Wish::LoseDevice => {
                    if let Some(studio) = &self.studio {
                        studio.lose_device();
                    }
                    if let Some(graphics) = &self.graphics {
                        graphics.gpu().lose();
                    }
                    self.request_redraw();
                }
            }
        }
    }

    /// Saves the view at the window's full size into the current folder.
    fn screenshot(&mut self, formats: &[Format]) {
        let Some(window) = &self.window else { return };
        let most = self.graphics.as_ref().map_or(1, Graphics::most_pixels);
        let size = <[u32; 2]>::from(window.inner_size()).map(|side| side.clamp(1, most));
        match saving::free_names(Path::new(""), saving::PICTURE, formats) {
            Ok(paths) => {
                let order = self.present_order(size);
                if let Some(studio) = &self.studio {
                    studio.send(Errand::Save(order, paths));
                }
            }
            Err(error) => self.report.message.tell(error.to_string()),
        }
    }

    /// Ends with an error, or starts again with a new device where the old one was lost, or the thread
    /// that makes pictures fell over a defect.
    pub fn fail(&mut self, event_loop: &ActiveEventLoop, error: Error) {
        let kind = matches!(error, Error::Gpu(_) | Error::Failed(_));
        let lost = kind && self.graphics.is_some();
        let soon = self.last_loss.is_some_and(|at| at.elapsed() < PATIENCE);
        if lost && !soon {
            tracing::warn!("{error}; starting again with a new device");
            self.studio = None;
            self.graphics = None;
            self.truth = None;
            self.last_loss = Some(Instant::now());
            self.report.message.tell(format!("{error}; the flight goes on with a new device"));
            self.request_redraw();
        } else {
            self.failure = Some(error);
            event_loop.exit();
        }
    }

    /// Starts or ends looking around. The pointer stays in the window and out of sight meanwhile.
    pub fn look(&mut self, looking: bool) {
        self.looking = looking;
        let Some(window) = &self.window else { return };
        window.set_cursor_visible(!looking);
        let grabbed = if looking {
            window
                .set_cursor_grab(CursorGrabMode::Locked)
                .or_else(|_| window.set_cursor_grab(CursorGrabMode::Confined))
        } else {
            window.set_cursor_grab(CursorGrabMode::None)
        };
        if let Err(error) = grabbed {
            // It works without, as far as the edge of the screen.
            tracing::debug!("the pointer can't be held: {error}");
        }
    }

    /// Whether a picture is under way.
    pub fn is_busy(&self) -> bool {
        self.studio.as_ref().is_some_and(Studio::is_busy)
    }

    pub fn request_redraw(&self) {
        if let Some(window) = &self.window {
            window.request_redraw();
        }
    }

    /// Lets go of everything, while the connection to the display still stands.
    pub fn close(&mut self) {
        self.truth = None;
        self.studio = None;
        self.graphics = None;
        self.window = None;
    }
}
