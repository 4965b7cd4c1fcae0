//! What the thread that makes pictures does.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::counter::StepCounter;
use super::{Errand, Image, Inside, Number, Order, Reply, Shared, Shown, insides, lock};
use crate::frame::composer::Composer;
use crate::frame::{Picture, RenderSettings, Renderer};
use crate::gpu::Gpu;
use crate::output::write_picture;
use crate::scene::{Medium, Scene};
use crate::tables::{Progress, TableSet};
use crate::{Error, Result};

/// Takes replies, from any thread of a computation.
type Tell<'a> = &'a (dyn Fn(Reply) + Sync);

/// Does errands until the window closes or the device fails.
pub(super) fn run(
    shared: &Shared,
    gpu: Option<Gpu>,
    tables: Arc<TableSet>,
    reply: &(dyn Fn(Number, Reply) + Sync),
) {
    let of_window = gpu.is_some();
    let gpu = match gpu.map_or_else(Gpu::headless, Ok) {
        Ok(gpu) => gpu,
        Err(error) => return reply(0, Reply::Failed(error)),
    };
    let of_processor = cpu_time::ProcessTime::now().as_duration().as_secs_f64();
    tracing::info!("device ready after {of_processor:.3} s of processor time");
    let gpu = match crate::output::cache_folder() {
        Some(folder) => gpu.keeping_pipelines(&folder),
        None => gpu,
    };
    *lock(&shared.gpu) = Some(gpu.clone());
    let mut maker = Maker {
        gpu,
        of_window,
        tables,
        clouds: None,
        scene: Scene::default(),
        whole: None,
        compiled: false,
    };
    let tell = |news| reply(0, news);
    let mut kept = 0;
    while let Some((number, errand)) = shared.next() {
        let done = match errand {
            Errand::Show(order) => {
                maker.show(order, &tell).map(|shown| Reply::Picture(Box::new(shown)))
            }
            Errand::Measure(order) => maker
                .render(&order, &tell)
                .map(|picture| Reply::Measured(Box::new((order, picture)))),
            Errand::Save(order, paths) => maker.save(&order, paths, &tell).map(Reply::Saved),
        };
        match done {
            Ok(done) => reply(number, done),
            Err(error @ (Error::Gpu(_) | Error::NoAdapter(_))) => {
                return reply(number, Reply::Failed(error));
            }
            // A bad value or a full disk is no reason to end.
            Err(error) => reply(number, Reply::Refused(error)),
        }
        // After the picture, which nobody should wait longer for.
        if std::mem::replace(&mut kept, maker.gpu.compiled()) < maker.gpu.compiled() {
            maker.gpu.keep_pipelines();
        }
    }
}

struct Maker {
    gpu: Gpu,
    /// Whether the window shows what is on the device.
    of_window: bool,
    tables: Arc<TableSet>,
    clouds: Option<Clouds>,
    /// The last order's scene with its camera, and the scene it was made from.
    scene: Scene,
    whole: Option<Arc<Scene>>,
    /// Whether a picture was made since the renderer was: drivers compile until then.
    compiled: bool,
}

/// A renderer with what it was made for.
struct Clouds {
    renderer: Renderer,
    settings: RenderSettings,
    medium: Medium,
    /// Whether it counts steps in place of distances.
    counting: bool,
}

impl Clouds {
    /// Lets the blend count steps where they are to be seen, and otherwise do its usual work.
    fn compose(&mut self, gpu: &Gpu, inside: Option<Inside>) -> Result<()> {
        let counting = inside == Some(Inside::Steps);
        if counting != self.counting {
            let quality = self.settings.quality();
            let counter = |layouts| StepCounter::new(gpu, &quality, layouts);
            let composer = counting.then(|| counter(self.renderer.layouts())).transpose()?;
            self.renderer.compose_with(composer.map(|c| Box::new(c) as Box<dyn Composer>));
            self.counting = counting;
        }
        Ok(())
    }
}

impl Maker {
    fn show(&mut self, order: Order, reply: Tell<'_>) -> Result<Shown> {
        let start = Instant::now();
        let was_cold = self.make_ready(&order, reply)?;
        let Some(clouds) = &mut self.clouds else { return Err(nothing_made()) };
        clouds.compose(&self.gpu, order.inside)?;
        let stats = clouds.renderer.frame(&self.scene, order.time, order.size)?;
        let display = clouds.renderer.display().ok_or_else(nothing_made)?;
        let mut legend = None;
        let image = if let Some(inside) = order.inside {
            let made =
                insides::view(inside, &mut clouds.renderer, &self.tables, &self.scene, &order)?;
            legend = Some(made.legend);
            Image::Pixels(order.size, made.pixels)
        } else if self.of_window {
            Image::Texture(display.clone())
        } else {
            Image::Pixels(order.size, self.gpu.read_texture(display)?)
        };
        self.compiled = true;
        if was_cold {
            reply(Reply::Stage(None));
        }
        let seconds = start.elapsed().as_secs_f64();
        Ok(Shown { order, image, stats, seconds, cold: was_cold, legend })
    }

    fn save(
        &mut self,
        order: &Order,
        paths: Vec<PathBuf>,
        reply: Tell<'_>,
    ) -> Result<Vec<PathBuf>> {
        let picture = self.render(order, reply)?;
        paths.iter().try_for_each(|path| write_picture(path, &picture))?;
        Ok(paths)
    }

    /// The picture of an order, read back.
    fn render(&mut self, order: &Order, reply: Tell<'_>) -> Result<Picture> {
        let was_cold = self.make_ready(order, reply)?;
        let Some(clouds) = &mut self.clouds else { return Err(nothing_made()) };
        clouds.compose(&self.gpu, None)?;
        // As `cumuli render` makes it.
        let picture = clouds.renderer.render_alone(&self.scene, order.time, order.size)?;
        self.compiled = true;
        if was_cold {
            reply(Reply::Stage(None));
        }
        Ok(picture)
    }

    /// Takes the order's scene over, and makes tables and renderer where those there are do not fit.
    /// Returns whether it will take longer than another picture of the kind.
    fn make_ready(&mut self, order: &Order, reply: Tell<'_>) -> Result<bool> {
        if !self.whole.as_ref().is_some_and(|whole| Arc::ptr_eq(whole, &order.scene)) {
            self.scene = Scene::clone(&order.scene);
            self.whole = Some(order.scene.clone());
        }
        self.scene.camera = order.camera;
        let medium = self.scene.medium;
        let fits = |c: &Clouds| c.settings == order.settings && c.medium == medium;
        if self.clouds.as_ref().is_some_and(fits) {
            return Ok(!self.compiled);
        }
        // Before it costs the renderer that there is.
        self.scene.validate()?;
        if self.tables.scattering_for(&medium.phase, medium.albedo).is_none() {
            let told = Told { reply, stage: Mutex::default() };
            let tables = TableSet::clone(&self.tables);
            let tables = tables.with_scattering_for(&medium.phase, medium.albedo, &told)?;
            self.tables = Arc::new(tables);
        }
        reply(Reply::Stage(Some("preparing shaders".to_owned())));
        self.clouds = None;
        self.compiled = false;
        let renderer = Renderer::new(&self.gpu, &self.tables, &self.scene, &order.settings)?;
        let of_processor = cpu_time::ProcessTime::now().as_duration().as_secs_f64();
        tracing::info!("shaders ready after {of_processor:.3} s of processor time");
        self.clouds = Some(Clouds { renderer, settings: order.settings, medium, counting: false });
        reply(Reply::Stage(Some("first picture".to_owned())));
        Ok(true)
    }
}

fn nothing_made() -> Error {
    Error::Gpu("no frame was made".to_owned())
}

/// Progress of a computation of tables, as stages.
struct Told<'a> {
    reply: Tell<'a>,
    stage: Mutex<(String, u64, u64)>,
}

impl Told<'_> {
    /// Changes what is known of the stage, and tells it where a per cent more is done.
    fn change(&self, change: impl FnOnce(&mut (String, u64, u64))) {
        let mut stage = lock(&self.stage);
        let percent = |(what, done, total): &(String, u64, u64)| {
            (what.clone(), 100 * done.min(total) / total.max(&1))
        };
        let before = percent(&stage);
        change(&mut stage);
        let now = percent(&stage);
        if now != before {
            (self.reply)(Reply::Stage(Some(format!("computing {}: {} %", now.0, now.1))));
        }
    }
}

impl Progress for Told<'_> {
    fn start(&self, total: u64, what: &str) {
        self.change(|stage| *stage = (what.to_owned(), 0, total));
    }

    fn rename(&self, what: &str) {
        self.change(|stage| stage.0 = what.to_owned());
    }

    fn advance(&self, steps: u64) {
        self.change(|stage| stage.1 = stage.1.saturating_add(steps));
    }
}
