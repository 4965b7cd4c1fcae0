//! Blend: each pixel marches through its tile's particles, near to far, and composes them volume-aware.

use super::blend_areas::{AREA, AreasInputs, AreasJob, BlendAreas};
use super::picture_lists::PictureLists;
use super::settings::{Lighting, Quality};
use super::shadow::ShadowJob;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary};

/// The pipeline.
pub struct BlendPass {
    kernel: Kernel,
    lighting: Lighting,
    /// Where there is something to do; none where it goes over the whole picture.
    areas: Option<BlendAreas>,
}

/// What the pass is bound to.
pub struct BlendJob {
    bindings: wgpu::BindGroup,
    areas: Option<AreasJob>,
}

/// What the blend reads.
pub struct BlendInputs<'a> {
    /// `FrameUniforms`.
    pub frame: &'a wgpu::Buffer,
    /// `PhaseParams`.
    pub phase: &'a wgpu::Buffer,
    /// Particles.
    pub particles: &'a wgpu::Buffer,
    /// Their light.
    pub lights: &'a wgpu::Buffer,
    /// The screen's lists.
    pub lists: &'a PictureLists,
    /// Deep shadow maps.
    pub shadow: &'a ShadowJob,
    /// Distances of what is opaque, m.
    pub opaque: &'a wgpu::TextureView,
    /// Words: table look-ups, pixels in tiles with particles, tiles without, pixels whose march was cut; then the areas
    /// with particles.
    pub counts: &'a wgpu::Buffer,
}

/// Of tables, sky and light field those that a lighting reads.
pub(super) fn groups_of<'a, T>(groups: &'a [&'a T; 3], lighting: Lighting) -> &'a [&'a T] {
    if lighting.has_grid() { groups } else { &groups[..2] }
}

impl BlendPass {
    /// Compiles the pass; it reads the tables (group 1), the sky (group 2) and the light field (group 3).
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        quality: &Quality,
        groups: &[&wgpu::BindGroupLayout; 3],
    ) -> Result<Self> {
        let areas = Some(BlendAreas::new(gpu, library, quality.tile)?);
        Ok(Self { areas, ..Self::with(gpu, library, quality, &[("LISTED", 1)], groups)? })
    }

    /// The same, but it writes the number of its steps and look-ups in place of the clouds' distance.
    pub fn counting(
        gpu: &Gpu,
        library: &ShaderLibrary,
        quality: &Quality,
        groups: &[&wgpu::BindGroupLayout; 3],
    ) -> Result<Self> {
        Self::with(gpu, library, quality, &[("COUNT_STEPS", 1)], groups)
    }

    /// The same, but it writes where it looks things up behind its counts (see the shader).
    pub fn recording(
        gpu: &Gpu,
        library: &ShaderLibrary,
        quality: &Quality,
        groups: &[&wgpu::BindGroupLayout; 3],
    ) -> Result<Self> {
        Self::with(gpu, library, quality, &[("RECORD", 1)], groups)
    }

    fn with(
        gpu: &Gpu,
        library: &ShaderLibrary,
        quality: &Quality,
        more: &[(&str, u32)],
        groups: &[&wgpu::BindGroupLayout; 3],
    ) -> Result<Self> {
        let file = crate::shader_file!("frame/blend.wgsl");
        let lighting = quality.lighting;
        let mut defs = [&[("STEPS", quality.steps), ("SCREEN_TILE", quality.tile)], more].concat();
        defs.extend(lighting.definition());
        let kernel = Kernel::new(gpu, library, file, &defs, groups_of(groups, lighting))?;
        Ok(Self { kernel, lighting, areas: None })
    }

    /// Binds inputs, and the textures it writes: clouds, distance.
    pub fn bind(
        &self,
        gpu: &Gpu,
        inputs: &BlendInputs<'_>,
        [clouds, distance]: [&wgpu::TextureView; 2],
    ) -> BlendJob {
        let mut resources = vec![
            inputs.frame.as_entire_binding(),
            inputs.phase.as_entire_binding(),
            inputs.particles.as_entire_binding(),
            inputs.lights.as_entire_binding(),
            inputs.lists.lists.tile_offsets.as_entire_binding(),
            inputs.lists.lists.tile_entries.as_entire_binding(),
            inputs.counts.as_entire_binding(),
            wgpu::BindingResource::TextureView(clouds),
            wgpu::BindingResource::TextureView(distance),
            wgpu::BindingResource::TextureView(inputs.opaque),
        ];
        if self.lighting.has_maps() {
            resources.push(inputs.shadow.uniforms.as_entire_binding());
            resources.push(inputs.shadow.texels.as_entire_binding());
        }
        let bindings = self.kernel.bind(gpu, &resources);
        let areas = self.areas.as_ref().map(|areas| {
            let (frame, tile_offsets) = (inputs.frame, &inputs.lists.lists.tile_offsets);
            let (counts, targets) = (inputs.counts, [clouds, distance]);
            areas.job(gpu, &AreasInputs { frame, tile_offsets, counts, targets })
        });
        BlendJob { bindings, areas }
    }

    /// Records the pass over blocks of pixels: columns, rows, and how many pixels of each. `groups`: tables, sky and,
    /// for what has a light grid, the light field.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        blocks: [u32; 3],
        job: &BlendJob,
        groups: &[&wgpu::BindGroup],
    ) {
        let areas = self.areas.as_ref().zip(job.areas.as_ref());
        if let Some((areas, job)) = areas {
            areas.encode(gpu, pass, blocks, job);
        }
        pass.set_pipeline(self.kernel.pipeline("blend"));
        pass.set_bind_group(0, &job.bindings, &[]);
        for (index, group) in (1..).zip(groups) {
            pass.set_bind_group(index, *group, &[]);
        }
        match areas {
            Some((_, job)) => pass.dispatch_workgroups_indirect(job.groups(), 0),
            None => {
                let [columns, rows, pixels] = blocks;
                let [width, height] = [columns, rows].map(|s| s.div_ceil(AREA));
                pass.dispatch_workgroups(width, height, pixels);
            }
        }
    }
}

impl BlendJob {
    /// Arguments of the dispatch, where the device counts them.
    pub fn groups(&self) -> Option<&wgpu::Buffer> {
        self.areas.as_ref().map(AreasJob::groups)
    }
}
