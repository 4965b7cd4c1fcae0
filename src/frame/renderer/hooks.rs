//! What measurements need of a renderer besides its pictures: buffers read back, another method in
//! the blend's place, a fresh start.

use super::Renderer;
use crate::frame::Picture;
use crate::frame::air_shadow::{ENTRIES, corners};
use crate::frame::composer::Composer;
use crate::frame::cpu::light_grid::FieldSeen;
use crate::frame::gpu_data::{
    FrameUniforms, Particle, ParticleCount, ParticleLight, ShadowUniforms,
};
use crate::frame::light_grid::{GridSettings, LightGrid};
use crate::scene::Scene;
use crate::{Error, Result};

/// What a frame knows of the air under clouds.
pub struct AirShadow {
    /// Where the shadow maps lie.
    pub maps: ShadowUniforms,
    /// Their texels.
    pub texels: Vec<[u32; 4]>,
    /// Sides of the blocks of pixels whose corners have rays.
    pub block: u32,
    /// Entry after entry of ray after ray of [`crate::frame::air_shadow`].
    pub entries: Vec<[u32; 2]>,
}

impl Renderer {
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

    /// Where the deep shadow maps of the last frame that made them lie, read back.
    pub fn shadow_places(&self) -> Result<ShadowUniforms> {
        let read = self.gpu.read_buffer::<ShadowUniforms>(&self.shadow.uniforms, 1)?;
        read.first().copied().ok_or_else(|| Error::Gpu("no frame was made".to_owned()))
    }

    /// What the light grid sends to the last frame's eye, read back; nothing where no frame had clouds in view yet.
    pub fn field(&self) -> Result<FieldSeen> {
        match self.solved_light() {
            Some(_) => self.grid.seen(&self.gpu),
            None => Ok(FieldSeen::dark()),
        }
    }

    /// The buffers of the light that the light grid shows, whose solution is whole: sources and lights.
    pub fn solved_light(&self) -> Option<[&wgpu::Buffer; 2]> {
        self.grid.solved()
    }

    /// What the last frame knows of the air under clouds, read back.
    pub fn air_shadow(&self) -> Result<AirShadow> {
        let Some(resources) = &self.resources else {
            return Err(Error::Gpu("no frame was made".to_owned()));
        };
        let maps = self.gpu.read_buffer::<ShadowUniforms>(&self.shadow.uniforms, 1)?;
        let maps = *maps.first().ok_or_else(|| Error::Gpu("no shadow maps".to_owned()))?;
        let texels = self.shadow.bytes() as usize / size_of::<[u32; 4]>();
        let frame = self.gpu.read_buffer::<FrameUniforms>(&resources.frame, 1)?;
        let frame = frame.first().ok_or_else(|| Error::Gpu("no frame".to_owned()))?;
        let (size, block) = (frame.size, frame.ray_block);
        // There is room for more rays than this picture has.
        let rays: u32 = corners(size, block).iter().product();
        let entries = rays as usize * ENTRIES;
        Ok(AirShadow {
            maps,
            block,
            texels: self.gpu.read_buffer(&self.shadow.texels, texels)?,
            entries: self.gpu.read_buffer(&resources.changed_light, entries)?,
        })
    }

    /// Lengths of the lists of the last frame's tiles on screen, row by row; read back.
    pub fn tile_entries(&self) -> Result<Vec<u32>> {
        let Some(resources) = &self.resources else {
            return Err(Error::Gpu("no frame was made".to_owned()));
        };
        let lists = &resources.screen.lists;
        let ends = lists.tile_total_index() as usize + 1;
        let offsets = self.gpu.read_buffer::<u32>(&lists.tile_offsets, ends)?;
        Ok(offsets.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect())
    }

    /// How many workgroups of the blend the last whole frame dispatched: along x, y and z; read back.
    pub fn blend_groups(&self) -> Result<Vec<u32>> {
        let groups = self.resources.as_ref().and_then(|r| r.blend_bindings.groups());
        let none = || Error::Gpu("no frame was made".to_owned());
        self.gpu.read_buffer(groups.ok_or_else(none)?, 3)
    }

    /// Texels of the last frame's deep shadow maps that are in use, map after map, read back.
    pub fn shadow_texels(&self) -> Result<Vec<[u32; 4]>> {
        let uniforms = self.gpu.read_buffer::<ShadowUniforms>(&self.shadow.uniforms, 1)?;
        let used = uniforms.first().map_or(0, |u| u.maps * u.resolution * u.resolution);
        self.gpu.read_buffer(&self.shadow.texels, used as usize)
    }

    /// Sides of those tiles, pixels.
    pub fn tile_side(&self) -> u32 {
        self.quality.tile * self.stride()
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
        self.history.forget();
        self.changes.forget();
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

    /// Whether what can't be in view is made all the same from the next frame on: pictures must not
    /// differ.
    pub fn make_unseen(&mut self, wanted: bool) {
        self.make_unseen = wanted;
    }

    /// Whether rings end at once from the next frame on, in place of fading into each other: for measuring what that
    /// is worth. The light grid's own particles fade all the same.
    pub fn end_rings_at_once(&mut self, wanted: bool) {
        self.rings_end_at_once = wanted;
    }

    /// Makes one frame as it is alone and reads it back, in a stream too: nothing of the frames before
    /// is taken over, and nothing is spread over several.
    pub fn render_alone(&mut self, scene: &Scene, time: f64, size: [u32; 2]) -> Result<Picture> {
        self.forget();
        let grid = self.quality.grid;
        self.quality.grid = GridSettings { slice: 0, draft: false, ..grid };
        let picture = self.render(scene, time, size);
        self.quality.grid = grid;
        picture
    }

    /// Takes nothing of the frames before over into the next: it is made as the first one is.
    pub fn forget(&mut self) {
        self.history.forget();
        self.changes.forget();
        self.grid = LightGrid::default();
    }
}
