//! The buffers and bind groups of a frame, for one picture size and one set of capacities.

use super::blend::{BlendInputs, BlendJob};
use super::blend_areas::area_words;
use super::gpu_data::{FrameUniforms, LightView, Particle, ParticleLight};
use super::light::{LightJob, view_buffer};
use super::light_grid::GridRoom;
use super::opaque::OpaqueJob;
use super::passes::Passes;
use super::picture_lists::{PictureLists, Projection};
use super::reuse::ReuseJob;
use super::rings::{RingJob, particle_count_buffer};
use super::sea::Reflected;
use super::shadow::ShadowJob;
use super::targets::Targets;
use super::tile_lists::ListSize;
use crate::gpu::{Gpu, buffers};

/// Entries of one picture's lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListCapacity {
    /// Entries of all bins.
    pub bins: u32,
    /// Entries of all tiles.
    pub tiles: u32,
}

/// How much fits. Grows when a frame reports that it needed more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacities {
    /// Particles.
    pub particles: u32,
    /// The screen's lists.
    pub screen: ListCapacity,
    /// The sun's.
    pub light: ListCapacity,
    /// Cells of the light grid.
    pub grid: GridRoom,
}

impl Capacities {
    /// Those of a frame's own buffers: the light grid has its own.
    pub fn of_frame(&self) -> Self {
        Self { grid: GridRoom::default(), ..*self }
    }
}

/// What the resources are made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Pixels.
    pub size: [u32; 2],
    /// Sides of a block of pixels.
    pub stride: u32,
    /// Sides of a tile of blocks.
    pub tile: u32,
    /// Columns of cells in the cloud field; 0 without one.
    pub columns: u32,
    /// Tiles of the sun's picture.
    pub light_tiles: [u32; 2],
    /// Whether there may be something opaque.
    pub has_opaque: bool,
    /// Whether the ground is a sea.
    pub has_sea: bool,
    /// How much fits.
    pub capacities: Capacities,
}

impl Layout {
    /// Screen tiles.
    pub fn tiles(&self) -> [u32; 2] {
        self.size.map(|s| s.div_ceil(self.stride).div_ceil(self.tile))
    }
}

/// One light's view, lists and job.
pub struct LightResources {
    /// `LightView`.
    pub view: wgpu::Buffer,
    /// Order and lists.
    pub lists: PictureLists,
    /// Binding of the light pass.
    pub job: LightJob,
}

/// All of it.
pub struct Resources {
    /// What it was made for.
    pub layout: Layout,
    /// `FrameUniforms`.
    pub frame: wgpu::Buffer,
    /// Particles.
    pub particles: wgpu::Buffer,
    /// Their number.
    pub particle_count: wgpu::Buffer,
    /// Their light.
    pub particle_lights: wgpu::Buffer,
    /// The rings' buffers, where there is a cloud field.
    pub rings: Option<RingJob>,
    /// What is opaque, along the pixels' rays.
    pub opaque: OpaqueJob,
    /// Particles in view.
    pub visible: wgpu::Buffer,
    /// The screen's order and lists.
    pub screen: PictureLists,
    /// The sun's.
    pub light: LightResources,
    /// Binding of the shadow pass.
    pub shadow_bindings: wgpu::BindGroup,
    /// What clouds change of the light of air and ground.
    pub changed_light: wgpu::Buffer,
    /// Binding of the air shadow pass.
    pub air_shadow_bindings: wgpu::BindGroup,
    /// What a sea reflects, on the same rays.
    pub reflected: Option<Reflected>,
    /// Counts of the blend: look-ups, pixels, empty tiles; then where it has something to do.
    pub blend_counts: wgpu::Buffer,
    /// Binding of the blend, to the pixels.
    pub blend_bindings: BlendJob,
    /// The last frame's pixels and the blend's binding to blocks, where blocks are more than a pixel.
    pub reuse: Option<(ReuseJob, BlendJob)>,
    /// Binding of the resolve.
    pub resolve_bindings: wgpu::BindGroup,
    /// Binding of the tone map.
    pub tonemap_bindings: wgpu::BindGroup,
    /// Textures.
    pub targets: Targets,
}

/// Words of `blend_counts` that count.
pub const BLEND_COUNTS: usize = 4;

impl Resources {
    /// Makes everything.
    pub fn new(
        gpu: &Gpu,
        passes: &Passes,
        phase: &wgpu::Buffer,
        shadow: &ShadowJob,
        layout: Layout,
    ) -> Self {
        let capacity = layout.capacities.particles;
        let frame =
            buffers::uniform(gpu, "frame", &<FrameUniforms as bytemuck::Zeroable>::zeroed());
        let particles =
            buffers::storage(gpu, "particles", capacity as usize, size_of::<Particle>());
        let particle_lights =
            buffers::storage(gpu, "particle lights", capacity as usize, size_of::<ParticleLight>());
        let particle_count = particle_count_buffer(gpu, 0);
        let rings = (layout.columns > 0).then(|| {
            passes.rings.job(gpu, &passes.lists.scan, layout.columns, &particles, &particle_count)
        });
        let opaque = if layout.has_opaque {
            OpaqueJob::new(gpu, layout.size, layout.tiles())
        } else {
            OpaqueJob::none(gpu)
        };
        let visible = buffers::storage(gpu, "visible", 1, size_of::<u32>());
        let list_size = |tiles, entries: ListCapacity| ListSize {
            tiles,
            particles: capacity,
            bin_entries: entries.bins,
            tile_entries: entries.tiles,
        };
        let screen = PictureLists::new(
            gpu,
            &passes.lists,
            &passes.screen_project,
            list_size(layout.tiles(), layout.capacities.screen),
            &frame,
            &particles,
            &particle_count,
            &Projection::Screen { visible: &visible, opaque: &opaque },
        );
        let light = {
            let view = view_buffer(gpu);
            let lists = PictureLists::new(
                gpu,
                &passes.lists,
                &passes.light_project,
                list_size(layout.light_tiles, layout.capacities.light),
                &frame,
                &particles,
                &particle_count,
                &Projection::Light { view: &view },
            );
            let job = passes.light.job(
                gpu,
                &frame,
                &view,
                &particles,
                &lists,
                &visible,
                &screen,
                &particle_lights,
            );
            LightResources { view, lists, job }
        };
        let shadow_bindings =
            passes.shadow.bind(gpu, shadow, &frame, &light.view, &particles, &light.lists);
        let targets = Targets::new(gpu, layout.size);
        let words = BLEND_COUNTS + area_words(layout.size.map(|s| s.div_ceil(layout.stride)));
        let blend_counts = buffers::storage(gpu, "blend counts", words, size_of::<u32>());
        let inputs = BlendInputs {
            frame: &frame,
            phase,
            particles: &particles,
            lights: &particle_lights,
            lists: &screen,
            shadow,
            opaque: &opaque.distances,
            counts: &blend_counts,
        };
        let blend_bindings = passes.blend.bind(gpu, &inputs, [&targets.clouds, &targets.distance]);
        let reuse = (layout.stride > 1).then(|| {
            let job = {
                let distances = (&opaque.distances, layout.has_opaque);
                passes.reuse.job(gpu, &frame, &targets, layout.stride, distances)
            };
            let bindings = passes.blend.bind(gpu, &inputs, [&job.fresh, &job.fresh_distance]);
            (job, bindings)
        });
        let changed_light = passes.air_shadow.changed_light(gpu, layout.size);
        let air_shadow_bindings = passes.air_shadow.bind(gpu, &frame, shadow, &changed_light);
        let [radiance, sunlit] = opaque.radiance(None);
        let of_opaque = [&opaque.distances, radiance, sunlit];
        let sea = passes.sea.as_ref().filter(|_| layout.has_sea);
        let reflected = sea.map(|sea| sea.buffers(gpu, layout.size));
        let of_rays = [Some(&changed_light), reflected.as_ref().map(|r| &r.light)];
        let resolve = sea.map_or(&passes.resolve, |sea| &sea.resolve);
        let resolve_bindings = resolve.bind(gpu, &frame, shadow, of_rays, &targets, of_opaque);
        let tonemap_bindings = passes.tonemap.bind(gpu, &frame, &targets);
        Self {
            layout,
            frame,
            particles,
            particle_count,
            particle_lights,
            rings,
            opaque,
            visible,
            screen,
            light,
            shadow_bindings,
            changed_light,
            air_shadow_bindings,
            reflected,
            blend_counts,
            blend_bindings,
            reuse,
            resolve_bindings,
            tonemap_bindings,
            targets,
        }
    }

    /// Writes the sun's view.
    pub fn write_view(&self, gpu: &Gpu, view: &LightView) {
        gpu.queue.write_buffer(&self.light.view, 0, bytemuck::bytes_of(view));
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.particles.size()
            + self.particle_lights.size()
            + self.rings.as_ref().map_or(0, RingJob::bytes)
            + self.opaque.bytes()
            + self.screen.bytes()
            + self.light.lists.bytes()
            + self.targets.bytes()
            + self.changed_light.size()
            + self.reflected.as_ref().map_or(0, Reflected::bytes)
            + self.reuse.as_ref().map_or(0, |(job, _)| job.bytes())
    }
}
