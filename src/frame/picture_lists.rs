//! One picture's worth of order: project all particles, sort them, list them per tile. Used two
//! times a frame: from the eye, from the sun.

use super::opaque::OpaqueJob;
use super::scan::ScanPass;
use super::sort::{SortJob, SortPass};
use super::tile_lists::{ListInputs, ListLimits, ListSize, TileListPass, TileLists};
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderFile, ShaderLibrary, buffers};

/// Invocations of a workgroup of both projections; as in the shaders.
const WORKGROUP: u32 = 64;

/// A projection pass: it writes keys, values and rectangles.
pub struct ProjectPass {
    kernel: Kernel,
}

impl ProjectPass {
    /// The projection to the screen, whose tiles are so many blocks of pixels a side.
    pub fn screen(gpu: &Gpu, library: &ShaderLibrary, tile: u32) -> Result<Self> {
        let file = crate::shader_file!("frame/screen_project.wgsl");
        Self::new(gpu, library, file, &[("SCREEN_TILE", tile)])
    }

    /// The projection along a light's lines.
    pub fn light(gpu: &Gpu, library: &ShaderLibrary) -> Result<Self> {
        Self::new(gpu, library, crate::shader_file!("frame/light_project.wgsl"), &[])
    }

    fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        file: ShaderFile,
        defs: &[(&str, u32)],
    ) -> Result<Self> {
        Ok(Self { kernel: Kernel::new(gpu, library, file, defs, &[])? })
    }
}

/// The passes that all pictures share.
pub struct ListPasses {
    /// Prefix sums.
    pub scan: ScanPass,
    /// Radix sort.
    pub sort: SortPass,
    /// Lists per tile.
    pub tile_lists: TileListPass,
}

impl ListPasses {
    /// Compiles them.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary) -> Result<Self> {
        Ok(Self {
            scan: ScanPass::new(gpu, library)?,
            sort: SortPass::new(gpu, library)?,
            tile_lists: TileListPass::new(gpu, library)?,
        })
    }
}

/// Buffers of one picture.
pub struct PictureLists {
    /// The lists.
    pub lists: TileLists,
    sort: SortJob,
    project: wgpu::BindGroup,
    particles: u32,
    bytes: u64,
}

/// What a projection reads besides the particles.
pub enum Projection<'a> {
    /// The screen's, with the word that counts what is in view.
    Screen {
        /// Counts the particles in view.
        visible: &'a wgpu::Buffer,
        /// What is opaque in view.
        opaque: &'a OpaqueJob,
    },
    /// A light's, with its `LightView`.
    Light {
        /// The view's uniforms.
        view: &'a wgpu::Buffer,
    },
}

impl PictureLists {
    /// Makes the buffers for one picture.
    #[expect(clippy::too_many_arguments, reason = "one argument per resource")]
    pub fn new(
        gpu: &Gpu,
        passes: &ListPasses,
        project: &ProjectPass,
        size: ListSize,
        frame: &wgpu::Buffer,
        particles: &wgpu::Buffer,
        particle_count: &wgpu::Buffer,
        projection: &Projection<'_>,
    ) -> Self {
        let sort = passes.sort.job(gpu, &passes.scan, size.particles);
        let rectangles =
            buffers::storage(gpu, "rectangles", size.particles as usize, 2 * size_of::<u32>());
        // Of what is opaque on screen; a light's lists have no limits.
        let opaque = match projection {
            Projection::Screen { opaque, .. } => Some(*opaque),
            Projection::Light { .. } => None,
        };
        let nearest = opaque.map(|opaque| {
            let key = buffers::storage(gpu, "nearest", size.particles as usize, size_of::<u32>());
            (key, &opaque.limits, opaque.is_some)
        });
        let shared = [
            particles.as_entire_binding(),
            sort.keys.as_entire_binding(),
            sort.values.as_entire_binding(),
            rectangles.as_entire_binding(),
            particle_count.as_entire_binding(),
        ];
        let mut resources = vec![frame.as_entire_binding()];
        if let Projection::Light { view } = projection {
            resources.push(view.as_entire_binding());
        }
        resources.extend(shared);
        if let (Projection::Screen { visible, .. }, Some((nearest, limits, _))) =
            (projection, &nearest)
        {
            resources.push(visible.as_entire_binding());
            resources.push(nearest.as_entire_binding());
            resources.extend(limits.iter().map(wgpu::BindingResource::TextureView));
        }
        let limits = nearest.as_ref().filter(|(_, _, is_some)| *is_some);
        let inputs = ListInputs {
            lengths: match projection {
                Projection::Screen { visible, .. } => visible,
                Projection::Light { .. } => particle_count,
            },
            length_index: 0,
            order: &sort.values,
            rectangles: &rectangles,
            limits: limits.map(|(nearest, keys, _)| ListLimits { nearest, keys }),
        };
        let lists = passes.tile_lists.lists(gpu, &passes.scan, size, &inputs);
        let bytes = sort.bytes()
            + rectangles.size()
            + nearest.as_ref().map_or(0, |(keys, ..)| keys.size())
            + lists.bytes();
        Self {
            project: project.kernel.bind(gpu, &resources),
            lists,
            sort,
            particles: size.particles,
            bytes,
        }
    }

    /// Records the projection.
    pub fn encode_project(&self, pass: &mut wgpu::ComputePass<'_>, project: &ProjectPass) {
        pass.set_pipeline(project.kernel.pipeline("project"));
        pass.set_bind_group(0, &self.project, &[]);
        pass.dispatch_workgroups(self.particles.div_ceil(WORKGROUP), 1, 1);
    }

    /// Records the sort.
    pub fn encode_sort(&self, pass: &mut wgpu::ComputePass<'_>, passes: &ListPasses) {
        passes.sort.encode(pass, &passes.scan, &self.sort);
    }

    /// Records the lists.
    pub fn encode_lists(&self, pass: &mut wgpu::ComputePass<'_>, passes: &ListPasses) {
        passes.tile_lists.encode(pass, &passes.scan, &self.lists);
    }

    /// Indices of the particles in order; those outside the picture come last.
    pub fn order(&self) -> &wgpu::Buffer {
        &self.sort.values
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}
