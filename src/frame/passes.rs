//! All passes, compiled.

use super::air_shadow::AirShadowPass;
use super::blend::BlendPass;
use super::light::LightPass;
use super::light_grid::{GridMedium, LightGridPass};
use super::opaque::OpaquePass;
use super::picture_lists::{ListPasses, ProjectPass};
use super::resolve::ResolvePass;
use super::reuse::ReusePass;
use super::rings::RingPass;
use super::sea::SeaPass;
use super::settings::Quality;
use super::shadow::ShadowPass;
use super::tonemap::TonemapPass;
use crate::Result;
use crate::gpu::{Gpu, ShaderLibrary};

/// The passes of a frame; those of the sky are in `sky`.
pub struct Passes {
    /// Cells to particles.
    pub rings: RingPass,
    /// Depth of the host to distances.
    pub opaque: OpaquePass,
    /// Scan, sort, lists.
    pub lists: ListPasses,
    /// To the screen.
    pub screen_project: ProjectPass,
    /// Along a light's lines.
    pub light_project: ProjectPass,
    /// Light at the particles.
    pub light: LightPass,
    /// Light among the clouds.
    pub light_grid: LightGridPass,
    /// Deep shadow maps.
    pub shadow: ShadowPass,
    /// Light of air and ground under clouds.
    pub air_shadow: AirShadowPass,
    /// Particles to pixels.
    pub blend: BlendPass,
    /// Pixels of the frame before.
    pub reuse: ReusePass,
    /// What a sea reflects; none before there is one.
    pub sea: Option<SeaPass>,
    /// The rest of the picture.
    pub resolve: ResolvePass,
    /// Display values.
    pub tonemap: TonemapPass,
}

impl Passes {
    /// Compiles them.
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        quality: &Quality,
        medium: &GridMedium<'_>,
        [tables, sky, weather, march]: [&wgpu::BindGroupLayout; 4],
    ) -> Result<Self> {
        // In two halves at once, of about the same time: nobody waits for one after the other.
        let (lit, others) = rayon::join(
            || -> Result<_> {
                let light_grid = LightGridPass::new(gpu, library, medium)?;
                let groups = [tables, sky, light_grid.layout()];
                let light = LightPass::new(gpu, library, quality.lighting, &groups)?;
                let blend = BlendPass::new(gpu, library, quality, &groups)?;
                let groups = [march, sky, light_grid.layout()];
                let air_shadow = AirShadowPass::new(gpu, library, quality.air_steps, &groups)?;
                Ok((light_grid, light, blend, air_shadow))
            },
            || -> Result<_> {
                let shadow = ShadowPass::new(gpu, library, quality.shadow_steps, tables)?;
                let resolve = ResolvePass::new(gpu, library, tables, sky)?;
                let rings = RingPass::new(gpu, library, weather)?;
                let lists = ListPasses::new(gpu, library)?;
                Ok((shadow, resolve, rings, lists))
            },
        );
        let ((light_grid, light, blend, air_shadow), (shadow, resolve, rings, lists)) =
            (lit?, others?);
        Ok(Self {
            rings,
            opaque: OpaquePass::new(gpu, library, quality.tile)?,
            lists,
            screen_project: ProjectPass::screen(gpu, library, quality.tile)?,
            light_project: ProjectPass::light(gpu, library)?,
            light,
            light_grid,
            shadow,
            air_shadow,
            blend,
            reuse: ReusePass::new(gpu, library)?,
            sea: None,
            resolve,
            tonemap: TonemapPass::new(gpu, library)?,
        })
    }
}
