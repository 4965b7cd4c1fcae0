//! The renderer: decides what a frame needs, records its passes, reads the picture back.

use super::composer::{ComposeInputs, Composer};
use super::cpu::light_grid::FieldSeen;
use super::gpu_data::{FrameUniforms, Particle, ParticleCount, ParticleLight};
use super::light_grid::{
    GridInputs, GridMedium, GridSize, GridWork, LightGrid, Spreads, scale_field, scale_particles,
};
use super::passes::Passes;
use super::picture::{FrameStats, Picture};
use super::plan::{FrameKey, FramePlan, Pass};
use super::population::Shapes;
use super::resources::{Capacities, Layout, ListCapacity, Resources};
use super::rings;
use super::settings::{Quality, RenderSettings};
use super::shadow::ShadowJob;
use super::sky::{SkyInputs, SkyKind, SkyPass, SkyWork};
use super::stats::{Counts, StatsReader, pass_times};
use super::view::{self, Bounds, SCREEN_TILE};
use crate::gpu::{Gpu, ShaderLibrary, buffers};
use crate::medium::{Halo, Truncation};
use crate::scene::{Medium, Scene, Sky, check_time};
use crate::tables::{TableSet, TablesGpu};
use crate::{Error, Result};
use glam::DVec3;

/// First capacities: a frame that needs more makes them grow.
const FIRST_LISTS: ListCapacity = ListCapacity { bins: 1 << 15, tiles: 1 << 17 };
const FIRST_PARTICLES: u32 = 1 << 14;
/// Growing one list can make room for more in the next: particles, bins, tiles, then once more
/// for whatever the fuller lists want.
const MOST_ATTEMPTS: usize = 5;

/// Epochs of light run from 1 to this and over: all of them are exact in f32. Buffers start with
/// 0, which is none.
const LAST_EPOCH: u32 = 1 << 24;

/// Makes frames of scenes with one phase function, on one device.
pub struct Renderer {
    gpu: Gpu,
    quality: Quality,
    medium: Medium,
    omit: Option<Pass>,
    composer: Option<Box<dyn Composer>>,
    passes: Passes,
    tables: TablesGpu,
    shapes: Shapes,
    truncation: Truncation,
    grid: LightGrid,
    phase: wgpu::Buffer,
    sky: SkyPass,
    shadow: ShadowJob,
    stats: StatsReader,
    capacities: Capacities,
    resources: Option<Resources>,
    last: Option<FrameKey>,
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
        let library = ShaderLibrary::new()?;
        let quality = settings.quality();
        let medium = &scene.medium;
        let tables_gpu = TablesGpu::new(gpu, tables, &medium.phase, medium.albedo)?;
        let sky = SkyPass::new(gpu, &library)?;
        let shapes = Shapes::new(tables);
        let spreads = Spreads::new(&shapes)?;
        let truncation = Truncation::new(&medium.phase);
        let halo = Halo::new(&medium.phase, &truncation);
        let grid = GridMedium { spreads: &spreads, halo: &halo, albedo: medium.albedo };
        let groups = [tables_gpu.layout(), sky.layout()];
        let passes = Passes::new(gpu, &library, &quality, &grid, groups)?;
        let shadow = passes.shadow.job(gpu, quality.shadow_resolution);
        let lists = FIRST_LISTS;
        Ok(Self {
            gpu: gpu.clone(),
            quality,
            medium: *medium,
            omit: settings.omit,
            composer: None,
            passes,
            shapes,
            truncation,
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
            },
            resources: None,
            last: None,
            light_epoch: 0,
        })
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
        for attempt in 1..=MOST_ATTEMPTS {
            let (mut stats, counts) = self.attempt(scene, time, size)?;
            stats.counters.attempts = attempt as u64;
            match counts.grown(&self.capacities) {
                None => return Ok(stats),
                Some(next) => self.grow(next)?,
            }
        }
        Err(Error::Gpu("the lists of this frame keep growing".to_owned()))
    }

    /// The last frame's particles and their light, read back; in the order of the device's buffers.
    /// Only particles in view have light.
    pub fn particles(&self) -> Result<(Vec<Particle>, Vec<ParticleLight>)> {
        let Some(resources) = &self.resources else {
            return Err(Error::Gpu("no frame was made".to_owned()));
        };
        let counts = self.gpu.read_buffer::<ParticleCount>(&resources.particle_count, 1)?;
        let capacity = resources.layout.capacities.particles;
        let count = counts.first().map_or(0, |c| c.particles.min(capacity)) as usize;
        let particles = self.gpu.read_buffer(&resources.particles, count)?;
        Ok((particles, self.gpu.read_buffer(&resources.particle_lights, count)?))
    }

    /// What the light grid sends to the last frame's eye, read back.
    pub fn field(&self) -> Result<FieldSeen> {
        self.grid.seen(&self.gpu)
    }

    /// Opacity-weighted distance of the clouds in every pixel of the last frame (m), read back; 0
    /// where there are none.
    pub fn distance(&self) -> Result<Vec<f32>> {
        let Some(resources) = &self.resources else {
            return Err(Error::Gpu("no frame was made".to_owned()));
        };
        self.gpu.read_texture(resources.targets.distance.texture())
    }

    /// Lets something else than the blend compose the particles from the next frame on, or again
    /// the blend.
    pub fn compose_with(&mut self, composer: Option<Box<dyn Composer>>) {
        let unneeded = |c: &Option<Box<dyn Composer>>| c.as_ref().map_or(&[][..], |c| c.unneeded());
        // The light grid holds what it was told it does only if its passes ran.
        if unneeded(&self.composer) != unneeded(&composer) {
            self.grid = LightGrid::default();
        }
        self.composer = composer;
        self.last = None;
    }

    /// Layouts of the bind groups that a composer is handed: tables, sky, light field.
    pub fn layouts(&self) -> [&wgpu::BindGroupLayout; 3] {
        [self.tables.layout(), self.sky.layout(), self.passes.light_grid.layout()]
    }

    /// Whether the times of passes are wanted from the next frame on, even where taking them makes
    /// frames slower.
    pub fn time_passes(&mut self, wanted: bool) -> Result<()> {
        self.stats.set_timing(&self.gpu, wanted)
    }

    /// Takes nothing of the frames before over into the next: it is made as the first one is.
    pub fn forget(&mut self) {
        self.last = None;
        self.grid = LightGrid::default();
    }

    /// The last frame's tone-mapped texture.
    pub fn display(&self) -> Option<&wgpu::Texture> {
        self.resources.as_ref().map(|r| &r.targets.display)
    }

    fn grow(&mut self, next: Capacities) -> Result<()> {
        let most = self.gpu.device.limits().max_storage_buffer_binding_size;
        let largest = [
            u64::from(next.particles) * size_of::<super::gpu_data::ParticleLight>() as u64,
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
        self.capacities = next;
        self.resources = None;
        Ok(())
    }

    fn attempt(
        &mut self,
        scene: &Scene,
        time: f64,
        size: [u32; 2],
    ) -> Result<(FrameStats, Counts)> {
        let settings = &self.quality.grid;
        let (shapes, truncation) = (&self.shapes, &self.truncation);
        let most = self.capacities.particles;
        let grid = GridInputs::new(scene, shapes, truncation, settings, time, most)?;
        let shift = grid.as_ref().map_or(DVec3::ZERO, |(_, shift)| *shift);
        let key = self.key(scene, time, size, shift)?;
        let sky_work = self.sky.update(&self.gpu, &sky_inputs(scene));
        let layout = Layout {
            size,
            columns: scene.clouds.as_ref().map_or(Ok(0), rings::columns)?,
            light_tiles: key.light.tiles,
            capacities: self.capacities,
        };
        let resources = match self.resources.take().filter(|r| r.layout == layout) {
            Some(resources) => resources,
            None => {
                self.last = None;
                self.gpu.begin_part("frame");
                Resources::new(&self.gpu, &self.passes, &self.phase, &self.shadow, layout)
            }
        };
        let work = grid.as_ref().map_or(GridWork::default(), |(inputs, shift)| {
            let size = GridSize { capacity: most, columns: layout.columns };
            self.grid.prepare(&self.gpu, &self.passes, size, inputs, *shift)
        });
        let unneeded = self.composer.as_ref().map_or(&[][..], |c| c.unneeded());
        let plan = FramePlan::new(self.last.as_ref(), &key, sky_work != SkyWork::None, work);
        let plan = unneeded.iter().fold(plan.without(self.omit), |p, pass| p.without(Some(*pass)));
        let grid = grid.as_ref().map(|(inputs, shift)| (inputs, *shift));
        self.record(&resources, &plan, &key, sky_work, grid)?;
        if let Some((inputs, shift)) = grid {
            self.grid.done(inputs, shift);
        }
        let times = self.stats.times(&self.gpu)?;
        let counts = self.stats.read(&self.gpu)?;
        let tiles = size.map(|s| s.div_ceil(SCREEN_TILE));
        let bytes = resources.bytes()
            + self.shadow.bytes()
            + self.tables.bytes()
            + self.sky.bytes()
            + self.grid.bytes();
        let stats = FrameStats {
            passes: pass_times(&plan, &times),
            counters: counts.counters(&self.capacities, tiles, bytes),
        };
        self.resources = Some(resources);
        self.last = Some(key);
        Ok((stats, counts))
    }

    /// Everything this frame's picture depends on.
    fn key(&self, scene: &Scene, time: f64, size: [u32; 2], shift: DVec3) -> Result<FrameKey> {
        let camera = &scene.camera;
        let scale = self.truncation.scale(scene.medium.albedo);
        let mut listed = self.shapes.listed(&scene.particles, camera.position)?;
        scale_particles(&mut listed, scale);
        let first_slot = listed.len() as u32;
        let mut clouds = self.shapes.field(scene, time, first_slot, self.capacities.particles)?;
        if let Some(clouds) = &mut clouds {
            scale_field(clouds, scale);
        }
        let has_clouds = (clouds.is_some() || !listed.is_empty()) && self.omit != Some(Pass::Blend);
        let bounds = bounds(scene, time);
        let samples = self.quality.light_samples;
        let light = view::light_view(scene.sun.direction, &bounds, camera.position, samples);
        Ok(FrameKey {
            frame: view::frame_uniforms(
                scene,
                camera,
                size,
                &self.truncation,
                shift,
                &self.quality,
                self.capacities.particles,
                has_clouds,
            ),
            clouds,
            listed,
            light,
            shadow: view::shadow_uniforms(camera.position, &bounds, self.quality.shadow_resolution),
        })
    }

    fn record(
        &mut self,
        resources: &Resources,
        plan: &FramePlan,
        key: &FrameKey,
        sky: SkyWork,
        grid: Option<(&GridInputs, DVec3)>,
    ) -> Result<()> {
        let gpu = &self.gpu;
        let passes = &self.passes;
        if plan.relit() {
            self.light_epoch = self.light_epoch % LAST_EPOCH + 1;
        }
        let frame = FrameUniforms { light_epoch: self.light_epoch, ..key.frame };
        gpu.queue.write_buffer(&resources.frame, 0, bytemuck::bytes_of(&frame));
        resources.write_view(gpu, &key.light);
        gpu.queue.write_buffer(&self.shadow.uniforms, 0, bytemuck::bytes_of(&key.shadow));
        if self.last.as_ref().is_none_or(|l| l.listed != key.listed) {
            gpu.queue.write_buffer(&resources.particles, 0, bytemuck::cast_slice(&key.listed));
        }
        if key.clouds.is_none() {
            let count = key.listed.len() as u32;
            gpu.queue.write_buffer(
                &resources.particle_count,
                0,
                bytemuck::cast_slice(&[count, count]),
            );
        }

        let (tables, sky_bindings) = (self.tables.bind_group(), self.sky.bind_group());
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        if plan.runs(Pass::Project) && plan.screen_order() {
            encoder.clear_buffer(&resources.visible, 0, None);
        }
        if plan.runs(Pass::Blend) {
            encoder.clear_buffer(&resources.blend_counts, 0, None);
        }
        let pictures: Vec<_> = [
            plan.screen_order().then_some((&resources.screen, &passes.screen_project)),
            plan.light_order().then_some((&resources.light.lists, &passes.light_project)),
        ]
        .into_iter()
        .flatten()
        .collect();
        for pass in Pass::ALL.into_iter().filter(|p| plan.runs(*p)) {
            self.stats.timed(gpu, pass, &mut encoder, |encoder| {
                if pass == Pass::Sky {
                    return self.sky.encode(encoder, sky);
                }
                if pass == Pass::LightGrid {
                    if let Some((inputs, _)) = grid {
                        passes.light_grid.encode_solve(gpu, encoder, passes, &self.grid, inputs);
                    }
                    return;
                }
                let compute = &mut compute_pass(encoder, pass);
                match pass {
                    Pass::Sky | Pass::LightGrid => {}
                    Pass::LightField => {
                        if let Some((inputs, shift)) = grid {
                            passes.light_grid.encode_field(gpu, compute, &self.grid, inputs, shift);
                        }
                    }
                    Pass::Rings => {
                        if let (Some(job), Some(clouds)) = (&resources.rings, &key.clouds) {
                            passes.rings.encode(gpu, compute, &passes.lists.scan, job, clouds);
                        }
                    }
                    Pass::Project => {
                        pictures.iter().for_each(|(lists, p)| lists.encode_project(compute, p));
                    }
                    Pass::Sort => {
                        pictures.iter().for_each(|(l, _)| l.encode_sort(compute, &passes.lists));
                    }
                    Pass::TileLists => {
                        pictures.iter().for_each(|(l, _)| l.encode_lists(compute, &passes.lists));
                    }
                    Pass::Light => {
                        if let Some(field) = self.grid.bind_group() {
                            let groups = [tables, sky_bindings, field];
                            passes.light.encode(compute, &resources.light.job, groups);
                        }
                    }
                    Pass::Shadow => {
                        passes.shadow.encode(
                            compute,
                            &self.shadow,
                            &resources.shadow_bindings,
                            tables,
                        );
                    }
                    Pass::Blend => {
                        let bindings = &resources.blend_bindings;
                        if let Some(field) = self.grid.bind_group() {
                            let groups = [tables, sky_bindings, field];
                            if let Some(composer) = &self.composer {
                                let inputs = ComposeInputs { resources, phase: &self.phase };
                                composer.encode(gpu, compute, &inputs, groups);
                            } else {
                                passes.blend.encode(compute, key.frame.size, bindings, groups);
                            }
                        }
                    }
                    Pass::Resolve => {
                        let bindings = &resources.resolve_bindings;
                        passes.resolve.encode(
                            compute,
                            key.frame.size,
                            bindings,
                            tables,
                            sky_bindings,
                        );
                    }
                    Pass::Tonemap => {
                        passes.tonemap.encode(compute, key.frame.size, &resources.tonemap_bindings);
                    }
                }
            })?;
        }
        let grid_count = self.grid.particle_count().filter(|_| grid.is_some());
        self.stats.gather(&mut encoder, resources, grid_count);
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    }
}

fn compute_pass(encoder: &mut wgpu::CommandEncoder, pass: Pass) -> wgpu::ComputePass<'_> {
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(pass.name()),
        timestamp_writes: None,
    })
}

/// What the sky of a scene depends on.
pub fn sky_inputs(scene: &Scene) -> SkyInputs {
    SkyInputs {
        kind: match scene.sky {
            Sky::Uniform { radiance } => SkyKind::Uniform { radiance: radiance as f32 },
            Sky::Atmosphere => SkyKind::Atmosphere,
        },
        sun_direction: scene.sun.direction.as_vec3(),
        sun_irradiance: scene.sun.irradiance as f32,
        angular_diameter: scene.sun.angular_diameter.to_radians() as f32,
        camera_altitude: scene.camera.position.y,
        ground_albedo: scene.effective_ground().map_or(DVec3::ZERO, |g| g.albedo).as_vec3(),
    }
}

/// A box around all particles of the scene.
fn bounds(scene: &Scene, time: f64) -> Bounds {
    let mut result = Bounds { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY, detail: 1e-3 };
    if let Some(field) = &scene.clouds {
        let reach = rings::reach(field);
        let largest = field.particle_size * field.cell_size;
        let camera = scene.camera.position;
        let base = field.base + field.wind.y * time;
        result.low = DVec3::new(camera.x - reach, base - largest, camera.z - reach);
        result.high =
            DVec3::new(camera.x + reach, base + 1.5 * field.thickness + largest, camera.z + reach);
        result.detail = largest;
    }
    if !scene.particles.is_empty() {
        let mut radii = 0.0;
        for particle in &scene.particles {
            result.low = result.low.min(particle.centre - particle.radius);
            result.high = result.high.max(particle.centre + particle.radius);
            radii += particle.radius;
        }
        result.detail = result.detail.max(radii / scene.particles.len() as f64);
    }
    if result.low.x > result.high.x {
        result = Bounds { low: DVec3::ZERO, high: DVec3::ONE, detail: 1.0 };
    }
    result
}
