//! The renderer: decides what a frame needs, has it recorded, reads the picture back. `key` says what
//! a frame depends on, `record` records its passes, `hooks` is for measurements.

mod hooks;
mod key;
mod record;

pub use key::sky_inputs;
use record::Work;

use glam::DVec3;

use super::changes::{Changes, Product};
use super::composer::Composer;
use super::gpu_data::ParticleLight;
use super::in_view::{InView, in_view};
use super::light_grid::{
    GridInputs, GridMedium, GridOrder, GridRoom, GridSize, GridWork, LightGrid, Spreads,
};
use super::opaque::Opaque;
use super::passes::Passes;
use super::picture::{Counters, FrameStats, Picture};
use super::plan::{FramePlan, Pass};
use super::population::Shapes;
use super::resources::{Capacities, Layout, ListCapacity, Resources};
use super::reuse::{History, Seen};
use super::rings;
use super::sea::SeaPass;
use super::settings::{Quality, RenderSettings};
use super::shadow::ShadowJob;
use super::sky::{SkyPass, SkyWork};
use super::stats::{Counts, StatsReader, pass_times, with_earlier};
use super::sun_at::SunAtPass;
use super::weather::WeatherBuffer;
use crate::gpu::{Gpu, ShaderLibrary, buffers};
use crate::medium::{Halo, Truncation};
use crate::scene::{Medium, Scene, check_time};
use crate::tables::{TableSet, TablesGpu};
use crate::{Error, Result};

/// First capacities: a frame that needs more makes them grow.
const FIRST_LISTS: ListCapacity = ListCapacity { bins: 1 << 15, tiles: 1 << 17 };
const FIRST_PARTICLES: u32 = 1 << 14;
/// Growing one list can make room for more in the next: particles, bins, tiles, then once more
/// for whatever the fuller lists want.
const MOST_ATTEMPTS: usize = 5;

/// Makes frames of scenes with one phase function, on one device.
pub struct Renderer {
    gpu: Gpu,
    quality: Quality,
    medium: Medium,
    omit: Option<Pass>,
    make_unseen: bool,
    rings_end_at_once: bool,
    has_told_of_cuts: bool,
    composer: Option<Box<dyn Composer>>,
    passes: Passes,
    tables: TablesGpu,
    weather: WeatherBuffer,
    shapes: Shapes,
    truncation: Truncation,
    grid: LightGrid,
    phase: wgpu::Buffer,
    sky: SkyPass,
    shadow: ShadowJob,
    stats: StatsReader,
    capacities: Capacities,
    resources: Option<Resources>,
    changes: Changes,
    history: History,
    opaque: Option<Opaque>,
    sun_at: Option<SunAtPass>,
    sun_asked: bool,
    /// Whether the last frame's scene had no particles.
    is_clear: Option<bool>,
    eye: DVec3,
    light_epoch: u32,
}

impl Renderer {
    /// Compiles the passes and uploads the tables for the scene's medium.
    pub fn new(
        gpu: &Gpu,
        tables: &TableSet,
        scene: &Scene,
        settings: &RenderSettings,
    ) -> Result<Self> {
        scene.validate()?;
        gpu.forget_parts();
        gpu.begin_part("sky");
        let quality = settings.quality();
        let medium = &scene.medium;
        let shapes = Shapes::new(tables);
        let peak = Truncation::new(&medium.phase);
        // A third of a second each: nobody waits for one after the other.
        let ((spreads, halo), compiled) = rayon::join(
            || (Spreads::new(&shapes), Halo::new(&medium.phase, &peak)),
            || -> Result<_> {
                let library = ShaderLibrary::new()?;
                let tables = TablesGpu::new(gpu, tables, &medium.phase, medium.albedo)?;
                let sky = SkyPass::new(gpu, &library)?;
                Ok((library, tables, sky))
            },
        );
        let (spreads, (library, tables_gpu, sky)) = (spreads?, compiled?);
        let tables_layout = tables_gpu.layout();
        let grid = GridMedium {
            spreads: &spreads,
            tables: tables_layout,
            halo: &halo,
            albedo: medium.albedo,
        };
        let weather = WeatherBuffer::new(gpu);
        let march = sky.march_layout();
        let groups = [tables_gpu.layout(), sky.layout(), weather.layout(), march];
        let passes = Passes::new(gpu, &library, &quality, &grid, groups)?;
        let shadow = passes.shadow.job(gpu, quality.shadow_resolution);
        let lists = FIRST_LISTS;
        Ok(Self {
            gpu: gpu.clone(),
            quality,
            medium: *medium,
            omit: settings.omit,
            make_unseen: false,
            rings_end_at_once: false,
            has_told_of_cuts: false,
            composer: None,
            passes,
            weather,
            shapes,
            truncation: quality.lighting.truncation(&medium.phase),
            grid: LightGrid::default(),
            phase: buffers::uniform(gpu, "phase", &tables_gpu.phase_params()),
            tables: tables_gpu,
            sky,
            shadow,
            stats: StatsReader::new(gpu, settings.time_passes)?,
            capacities: Capacities {
                particles: FIRST_PARTICLES.max(scene.particles.len() as u32),
                screen: lists,
                light: lists,
                grid: GridRoom::default(),
            },
            resources: None,
            changes: Changes::default(),
            history: History::default(),
            opaque: None,
            sun_at: None,
            sun_asked: false,
            is_clear: None,
            eye: DVec3::ZERO,
            light_epoch: 0,
        })
    }

    /// What is opaque in the next frames: clouds end there, throw their shadows on it, and the picture shows it behind
    /// them and the air. Drawn with the scene's camera, at the picture's size, until it is set to something else; a frame
    /// refuses textures of another size or kind. After drawing anew into the same textures, set it with another revision.
    ///
    /// ```no_run
    /// use cumuli::frame::{DepthKind, Opaque, Renderer};
    ///
    /// /// `near`: m, of the host's reversed projection without a far plane; clears its depth to 0.
    /// fn clouds_around(
    ///     renderer: &mut Renderer,
    ///     [depth, colour, in_sunlight]: [&wgpu::Texture; 3],
    ///     near: f32,
    ///     frame: u64,
    /// ) {
    ///     let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
    ///     renderer.set_opaque(Some(Opaque {
    ///         depth: view(depth),
    ///         kind: DepthKind::infinite_reversed(near),
    ///         radiance: view(colour),
    ///         sunlit: Some(view(in_sunlight)),
    ///         revision: frame,
    ///     }));
    /// }
    /// ```
    pub fn set_opaque(&mut self, opaque: Option<Opaque>) {
        self.opaque = opaque;
    }

    /// What the clouds of the last frame let through of the sunlight on its way to points of the scene (m, in the world), 0 to 1:
    /// for things that are lit elsewhere. The points may lie anywhere, also out of view. As in the frame itself, light that is
    /// scattered forward, within the delta-M peak, counts as let through: the optical depth is `Truncation::scale` times that of
    /// the scene's extinction. Waits for the device.
    ///
    /// # Errors
    /// Before the first frame; for points that are not finite; and, at the first call only, after a frame that saw nothing that
    /// sunlight falls on: from then on every frame makes what is needed here.
    pub fn sun_transmittance(&mut self, points: &[DVec3]) -> Result<Vec<f32>> {
        self.sun_asked = true;
        self.sun_transmittance_if_known(points)?.ok_or_else(|| {
            Error::Failed(
                "the sun's lists are those of no frame: expected one after the first call, or one with clouds or surfaces in view"
                    .to_owned(),
            )
        })
    }

    /// The same; nothing where the last frame made no lists for it.
    pub(crate) fn sun_transmittance_if_known(
        &mut self,
        points: &[DVec3],
    ) -> Result<Option<Vec<f32>>> {
        if let Some(i) = points.iter().position(|p| !p.is_finite()) {
            let message = format!("expected finite numbers, found {} at {i}", points[i]);
            return Err(Error::input("points", message));
        }
        if self.is_clear == Some(true) {
            return Ok(Some(vec![1.0; points.len()]));
        }
        let is_made = !self.changes.is_stale(Product::LightLists, &[]);
        let (Some(resources), true) = (&self.resources, is_made) else {
            return Ok(None);
        };
        let pass = match self.sun_at.take() {
            Some(pass) => pass,
            None => SunAtPass::new(&self.gpu, self.tables.layout())?,
        };
        let pass = self.sun_at.insert(pass);
        let relative: Vec<_> =
            points.iter().map(|p| (*p - self.eye).as_vec3().extend(0.0).to_array()).collect();
        pass.transmittances(&self.gpu, resources, self.tables.bind_group(), &relative).map(Some)
    }

    /// Makes one frame and reads it back. `time` in s, `size` in pixels.
    pub fn render(&mut self, scene: &Scene, time: f64, size: [u32; 2]) -> Result<Picture> {
        let stats = self.frame(scene, time, size)?;
        let Some(resources) = &self.resources else {
            return Err(Error::Gpu("no frame was made".to_owned()));
        };
        let radiance = self.gpu.read_texture(&resources.targets.picture)?;
        let pixels = self.gpu.read_texture(&resources.targets.display)?;
        Ok(Picture { size, radiance, pixels, stats })
    }

    /// Makes one frame and leaves it on the device. What is out of range, or of another medium than
    /// the renderer was made for, is an error of input.
    pub fn frame(&mut self, scene: &Scene, time: f64, size: [u32; 2]) -> Result<FrameStats> {
        scene.validate()?;
        check_time("time", time)?;
        if scene.medium != self.medium {
            return Err(Error::input(
                "medium",
                format!(
                    "expected {} with albedo {}, which the renderer was made for, found {} with {}",
                    self.medium.phase, self.medium.albedo, scene.medium.phase, scene.medium.albedo
                ),
            ));
        }
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        if size.iter().any(|&s| s == 0 || s > most) {
            return Err(Error::input(
                "size",
                format!("expected 1 to {most} pixels a side, found {}x{}", size[0], size[1]),
            ));
        }
        if let Some(opaque) = &self.opaque {
            opaque.check(size)?;
        }
        // Listed particles are written before anything is counted.
        let listed = scene.particles.len() as u32;
        if listed > self.capacities.particles {
            self.grow(Capacities { particles: listed, ..self.capacities })?;
        }
        let mut made = Vec::new();
        for attempt in 1..=MOST_ATTEMPTS {
            let (mut stats, counts) = self.attempt(scene, time, size)?;
            stats.counters.attempts = attempt as u64;
            stats.passes = with_earlier(&made, stats.passes);
            made = stats.passes.clone();
            match counts.grown(&self.capacities) {
                None => {
                    self.tell_of_cuts(stats.counters.cut);
                    return Ok(stats);
                }
                Some(next) => self.grow(next)?,
            }
        }
        Err(Error::Gpu("the lists of this frame keep growing".to_owned()))
    }

    /// Once, and again after frames without.
    fn tell_of_cuts(&mut self, cut: u64) {
        if cut > 0 && !self.has_told_of_cuts {
            tracing::warn!(
                "{cut} rays or lists meet more particles than this driver follows: the picture lacks \
                 what lies behind"
            );
        }
        self.has_told_of_cuts = cut > 0;
    }

    /// The last frame's tone-mapped texture.
    pub fn display(&self) -> Option<&wgpu::Texture> {
        self.resources.as_ref().map(|r| &r.targets.display)
    }

    fn grow(&mut self, next: Capacities) -> Result<()> {
        let most = self.gpu.device.limits().max_storage_buffer_binding_size;
        let largest = [
            u64::from(next.particles) * size_of::<ParticleLight>() as u64,
            u64::from(next.screen.tiles) * 4,
            u64::from(next.light.tiles) * 4,
        ];
        if largest.iter().any(|&bytes| bytes > most) {
            return Err(Error::Gpu(format!(
                "the scene has {} particles: their lists pass the adapter's {most} bytes a buffer",
                next.particles
            )));
        }
        tracing::debug!(?next, "growing buffers");
        if next.grid != self.capacities.grid && self.grid.drop_last() {
            // Pixels of this attempt are lit by what lacks light.
            self.history.forget();
        }
        if next.of_frame() != self.capacities.of_frame() {
            self.resources = None;
        }
        self.capacities = next;
        Ok(())
    }

    fn attempt(
        &mut self,
        scene: &Scene,
        time: f64,
        size: [u32; 2],
    ) -> Result<(FrameStats, Counts)> {
        if scene.is_sea() {
            self.compile_sea()?;
        }
        let in_view = if self.make_unseen { InView::ALL } else { in_view(scene, time, size) };
        let columns = scene.clouds.as_ref().map_or(Ok(0), rings::columns)?;
        let (grid, shift) = if in_view.clouds && self.quality.lighting.has_grid() {
            self.prepare_grid(scene, time, columns)?
        } else {
            Default::default()
        };
        let key = self.key(scene, time, size, shift, in_view)?;
        self.is_clear = Some(key.is_empty());
        let sky_work = self.sky.update(&self.gpu, &sky_inputs(scene));
        let layout = Layout {
            size,
            stride: self.stride(),
            tile: self.quality.tile,
            columns,
            light_tiles: key.light.tiles,
            has_opaque: key.opaque.is_some(),
            has_sea: key.is_sea,
            capacities: self.capacities.of_frame(),
        };
        let resources = match self.resources.take().filter(|r| r.layout == layout) {
            Some(resources) => resources,
            None => {
                self.changes.forget();
                self.history.forget();
                self.gpu.begin_part("frame");
                Resources::new(&self.gpu, &self.passes, &self.phase, &self.shadow, layout)
            }
        };
        // Without memory for them nothing is begun: what a driver compiles on the way may need the rest.
        self.gpu.check()?;
        let unneeded = self.composer.as_ref().map_or(&[][..], |c| c.unneeded());
        let sky_changed = sky_work != SkyWork::None;
        self.changes.observe(&key, sky_changed, &grid);
        let plan = FramePlan::new(
            &self.changes,
            &key,
            sky_changed,
            &grid,
            self.history.is_unfinished(layout.stride),
        );
        let plan = unneeded.iter().fold(plan.without(self.omit), |p, pass| p.without(Some(*pass)));
        let wind = scene.clouds.as_ref().map_or(DVec3::ZERO, |field| field.wind);
        let seen = Seen { frame: key.frame, eye: scene.camera.position, time, wind };
        let shading = self.history.shading(layout.stride, plan.clouds_changed(), &seen);
        let work = Work { plan: &plan, key: &key, sky: sky_work, grid: &grid, shift, shading };
        self.record(&resources, &work, self.history.uniforms(&seen))?;
        if !in_view.clouds {
            self.history.forget();
        } else if plan.makes(Product::Clouds) {
            self.history.done(layout.stride, shading, seen);
        }
        if in_view.clouds && self.quality.lighting.has_grid() {
            self.grid.done(shift);
        }
        let times = self.stats.times(&self.gpu)?;
        let counts = self.stats.read(&self.gpu)?;
        let tiles = layout.tiles();
        let bytes = resources.bytes()
            + self.shadow.bytes()
            + self.tables.bytes()
            + self.sky.bytes()
            + self.weather.bytes()
            + self.grid.bytes();
        let stats = FrameStats {
            passes: pass_times(&plan, &times),
            unfinished: grid.progress[0] < grid.progress[1]
                || self.history.is_unfinished(layout.stride),
            counters: Counters {
                grid_steps_made: grid.progress[0].into(),
                grid_steps: grid.progress[1].into(),
                ..counts.of_plan(&plan, tiles).counters(
                    &self.capacities,
                    tiles,
                    bytes,
                    self.gpu.is_software(),
                )
            },
        };
        self.resources = Some(resources);
        self.eye = scene.camera.position;
        plan.made().iter().for_each(|product| self.changes.done(*product));
        Ok((stats, counts))
    }

    /// What a sea needs, for the first frame that has one.
    fn compile_sea(&mut self) -> Result<()> {
        if self.passes.sea.is_none() {
            let layouts = [self.tables.layout(), self.sky.march_layout(), self.sky.layout()];
            let library = ShaderLibrary::new()?;
            let sea = SeaPass::new(&self.gpu, &library, layouts, &self.passes.light_grid)?;
            self.passes.sea = Some(sea);
        }
        Ok(())
    }

    /// Sides of a block of pixels: what stands in for the blend shades all of them.
    fn stride(&self) -> u32 {
        if self.composer.is_some() { 1 } else { self.quality.pixel_stride.clamp(1, 2) }
    }

    /// What of the light grid a frame has to make, and the anchor of what it shows relative to the
    /// eye, m.
    fn prepare_grid(
        &mut self,
        scene: &Scene,
        time: f64,
        columns: u32,
    ) -> Result<(GridWork, DVec3)> {
        let (settings, capacity) = (&self.quality.grid, self.capacities.particles);
        let (shapes, truncation) = (&self.shapes, &self.truncation);
        let room = (capacity, self.capacities.grid);
        let inputs = GridInputs::new(scene, shapes, truncation, settings, time, room)?;
        let Some(inputs) = &inputs else { return Ok(Default::default()) };
        self.capacities.grid = inputs.room;
        let size = GridSize { capacity, columns };
        let (slice, eye) = (settings.slice, scene.camera.position);
        let draft = settings.draft;
        let order = GridOrder { inputs, size, slice, draft, time, eye };
        Ok(self.grid.prepare(&self.gpu, &self.passes, &order))
    }
}
