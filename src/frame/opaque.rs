//! Opaque things of the program that clouds are drawn into: their depth ends the clouds' chords and lists, clouds
//! throw their shadow on them, and the picture shows them behind the clouds.
//!
//! The passes keep distances along the pixels' rays, in metres: the blend marches by them, they have the same relative
//! precision (6e-8) near and far, and nobody has to know of planes. What hosts commonly have is turned into them
//! ([`DepthKind`]): infinite reversed depth loses nothing on the way, the usual depth of a near and a far plane has
//! lost its digits before.

mod picture;

pub use picture::{OpaquePicture, Surface};

use std::borrow::Cow;

use bytemuck::{Pod, Zeroable};

use super::gpu_data::gpu_struct;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};
use crate::{Error, Result};

/// Side of a workgroup, pixels or tiles; as in the shader.
const WORKGROUP: u32 = 8;
/// Distance of pixels without anything, m; as in the shader.
pub const NOTHING: f32 = 1e30;
/// Limit of a list that nothing ends.
const NO_LIMIT: u32 = u32::MAX;

/// What the texels of a depth texture are. Whatever is negative, infinite or not a number is nothing; at 0 m something
/// hides all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthKind {
    /// Distance from the eye along the pixel's ray, m; 1e30 and more, or infinity, where there is nothing.
    Distance,
    /// Depth along the view axis, m, as the channel Z of OpenEXR pictures; the same of nothing.
    AlongAxis,
    /// Depth of a projection, 0 to 1: `scale / (depth - offset)` is the depth along the view axis, m.
    Projected {
        /// m.
        scale: f32,
        /// Depth that is infinitely far.
        offset: f32,
        /// What pixels without anything were cleared to: exactly this depth is nothing.
        empty: f32,
    },
}

impl DepthKind {
    /// Reversed depth without a far plane: 1 at the near plane (m), 0 infinitely far and where there is nothing. The
    /// one to be preferred: floats have as many digits far away as near by.
    pub fn infinite_reversed(near: f32) -> Self {
        Self::Projected { scale: near, offset: 0.0, empty: 0.0 }
    }

    /// Reversed depth between two planes (m): 1 at the near one, 0 at the far one and where there is nothing.
    pub fn reversed(near: f32, far: f32) -> Self {
        let between = far - near;
        Self::Projected { scale: near * (far / between), offset: -near / between, empty: 0.0 }
    }

    /// Depth between two planes (m): 0 at the near one, 1 at the far one and where there is nothing.
    pub fn standard(near: f32, far: f32) -> Self {
        let between = far - near;
        Self::Projected { scale: -near * (far / between), offset: far / between, empty: 1.0 }
    }

    /// Refuses a projection that has nothing ahead, or whose empty pixels lie before others.
    fn check(self) -> Result<()> {
        let Self::Projected { scale, offset, empty } = self else { return Ok(()) };
        let [between, nothing] = [0.5, empty].map(|depth| scale / (depth - offset));
        let is_ahead = between > 0.0 && between.is_finite() && empty.is_finite();
        if is_ahead && !(nothing > 0.0 && nothing < between) {
            return Ok(());
        }
        let message = format!(
            "expected a projection with 0 < near < far, its empty pixels the farthest, found {self:?}"
        );
        Err(Error::input("opaque.kind", message))
    }

    fn uniforms(self) -> OpaqueUniforms {
        let none = OpaqueUniforms::zeroed();
        match self {
            Self::Distance => none,
            Self::AlongAxis => OpaqueUniforms { kind: 1, ..none },
            Self::Projected { scale, offset, empty } => {
                OpaqueUniforms { scale, offset, empty, kind: 2 }
            }
        }
    }
}

/// Opaque things as the host has drawn them with the scene's camera, each texture of the size of the picture, on the
/// renderer's device, with the usage `TEXTURE_BINDING`, one layer and one level. What draws them is submitted before the
/// frame is made: that submits its own work and waits for it. The scene's ground, if it has one, hides what lies below it.
#[derive(Clone, Debug, PartialEq)]
pub struct Opaque {
    /// Depth, in the first channel; of a format with floats, 16- or 32-bit, or a depth format, of which a stencil is not
    /// read, whichever aspects the view has.
    pub depth: wgpu::TextureView,
    /// What its texels are.
    pub kind: DepthKind,
    /// What they send to the eye where they are: linear Rec. 709 radiance, in the unit of the scene's sun. Air and
    /// clouds before them are added. Read only where there is something.
    pub radiance: wgpu::TextureView,
    /// What direct sunlight adds to it where no cloud dims the sun.
    pub sunlit: Option<wgpu::TextureView>,
    /// Another number says that the textures hold something else than in the frame before.
    pub revision: u64,
}

impl Opaque {
    /// A view of the depth that may be bound.
    fn depth_view(&self) -> Cow<'_, wgpu::TextureView> {
        let texture = self.depth.texture();
        if !texture.format().is_combined_depth_stencil_format() {
            return Cow::Borrowed(&self.depth);
        }
        let aspect = wgpu::TextureAspect::DepthOnly;
        let only_depth = wgpu::TextureViewDescriptor { aspect, ..Default::default() };
        Cow::Owned(texture.create_view(&only_depth))
    }

    /// Checks the textures against the picture's size.
    pub fn check(&self, size: [u32; 2]) -> Result<()> {
        self.kind.check()?;
        let parts = [
            ("opaque.depth", Some(&self.depth)),
            ("opaque.radiance", Some(&self.radiance)),
            ("opaque.sunlit", self.sunlit.as_ref()),
        ];
        for (name, view) in parts {
            let Some(texture) = view.map(|v| v.texture()) else { continue };
            let found = [texture.width(), texture.height()];
            if found != size {
                let [[w, h], [x, y]] = [size, found];
                let message = format!("expected {w}x{h} pixels as the picture, found {x}x{y}");
                return Err(Error::input(name, message));
            }
            let [layers, levels] = [texture.depth_or_array_layers(), texture.mip_level_count()];
            if texture.dimension() != wgpu::TextureDimension::D2 || [layers, levels] != [1, 1] {
                let message = format!(
                    "expected a 2D texture of one layer and one level, found {:?} with {layers} and {levels}",
                    texture.dimension()
                );
                return Err(Error::input(name, message));
            }
            let aspect = (name == "opaque.depth").then_some(wgpu::TextureAspect::DepthOnly);
            let format = texture.format();
            let aspect = aspect.filter(|_| format.is_combined_depth_stencil_format());
            let kind = format.sample_type(aspect, None);
            let is_read = matches!(
                kind,
                Some(wgpu::TextureSampleType::Float { .. } | wgpu::TextureSampleType::Depth)
            );
            if !is_read || texture.sample_count() != 1 {
                let message = format!(
                    "expected a format with floats and one sample a pixel, found {:?} with {}",
                    texture.format(),
                    texture.sample_count()
                );
                return Err(Error::input(name, message));
            }
            let usage = texture.usage();
            if !usage.contains(wgpu::TextureUsages::TEXTURE_BINDING) {
                let message = format!("expected the usage TEXTURE_BINDING, found {usage:?}");
                return Err(Error::input(name, message));
            }
        }
        Ok(())
    }
}

gpu_struct! {
    /// What the texels of the host's depth are.
    OpaqueUniforms {
        /// m: of a projection, scale / (depth - offset) is the depth along the view axis.
        scale: f32,
        /// Depth that is infinitely far.
        offset: f32,
        /// Depth of pixels without anything, of a projection.
        empty: f32,
        /// 0: distance along the ray; 1: along the view axis; 2: depth of a projection.
        kind: u32,
    }
}

/// The pass.
pub struct OpaquePass {
    kernel: Kernel,
}

/// What the pass leaves for the others; where there is nothing opaque, one texel that says so.
pub struct OpaqueJob {
    /// Along every pixel's ray, m.
    pub distances: wgpu::TextureView,
    /// Whether there is something opaque, at which lists end.
    pub is_some: bool,
    /// Of the farthest pixel of every tile and of every bin of tiles, as keys of the lists.
    pub limits: [wgpu::TextureView; 2],
    /// Stands for radiance that nobody gave.
    black: wgpu::TextureView,
    uniforms: wgpu::Buffer,
    bins: [u32; 2],
    bytes: u64,
}

impl OpaquePass {
    /// Compiles the pass for tiles of so many blocks of pixels a side.
    pub fn new(gpu: &Gpu, library: &ShaderLibrary, tile: u32) -> Result<Self> {
        let file = crate::shader_file!("frame/opaque.wgsl");
        Ok(Self { kernel: Kernel::new(gpu, library, file, &[("SCREEN_TILE", tile)], &[])? })
    }

    /// Records the pass.
    pub fn encode(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass<'_>,
        frame: &wgpu::Buffer,
        size: [u32; 2],
        (job, opaque): (&OpaqueJob, &Opaque),
    ) {
        gpu.queue.write_buffer(&job.uniforms, 0, bytemuck::bytes_of(&opaque.kind.uniforms()));
        let texture = wgpu::BindingResource::TextureView;
        let depth = opaque.depth_view();
        let bindings = self.kernel.bind(
            gpu,
            &[
                frame.as_entire_binding(),
                job.uniforms.as_entire_binding(),
                texture(&depth),
                texture(&job.distances),
                texture(&job.limits[0]),
                texture(&job.limits[1]),
            ],
        );
        pass.set_bind_group(0, &bindings, &[]);
        let [width, height] = size.map(|s| s.div_ceil(WORKGROUP));
        pass.set_pipeline(self.kernel.pipeline("distances"));
        pass.dispatch_workgroups(width, height, 1);
        pass.set_pipeline(self.kernel.pipeline("limits"));
        pass.dispatch_workgroups(job.bins[0], job.bins[1], 1);
    }
}

impl OpaqueJob {
    /// Makes the textures for a picture with opaque things, and so many tiles.
    pub fn new(gpu: &Gpu, size: [u32; 2], tiles: [u32; 2]) -> Self {
        let bins = tiles.map(|s| s.div_ceil(WORKGROUP));
        Self { is_some: true, ..Self::with(gpu, [size, tiles, bins]) }
    }

    /// Stands for nothing opaque.
    pub fn none(gpu: &Gpu) -> Self {
        let job = Self::with(gpu, [[1; 2]; 3]);
        let fill = |view: &wgpu::TextureView, word: u32| {
            let texture = view.texture();
            let layout = wgpu::TexelCopyBufferLayout::default();
            let bytes = word.to_ne_bytes();
            gpu.queue.write_texture(texture.as_image_copy(), &bytes, layout, texture.size());
        };
        fill(&job.distances, NOTHING.to_bits());
        job.limits.iter().for_each(|limits| fill(limits, NO_LIMIT));
        job
    }

    fn with(gpu: &Gpu, [size, tiles, bins]: [[u32; 2]; 3]) -> Self {
        let mut bytes = 0;
        let mut texture = |label, size: [u32; 2], format: wgpu::TextureFormat| {
            let texels = u64::from(size[0]) * u64::from(size[1]);
            bytes += texels * u64::from(format.block_copy_size(None).unwrap_or(0));
            let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::STORAGE_BINDING
                    | wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_SRC
                    | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let (metres, keys) = (wgpu::TextureFormat::R32Float, wgpu::TextureFormat::R32Uint);
        let distances = texture("opaque distances", size, metres);
        let limits =
            [texture("limits of tiles", tiles, keys), texture("limits of bins", bins, keys)];
        let black = texture("no radiance", [1; 2], wgpu::TextureFormat::Rgba32Float);
        let uniforms = buffers::uniform(gpu, "opaque", &OpaqueUniforms::zeroed());
        Self { distances, is_some: false, limits, black, uniforms, bins, bytes }
    }

    /// Radiance of what is opaque, and what sunlight adds: of the host, or nothing.
    pub fn radiance<'a>(&'a self, opaque: Option<&'a Opaque>) -> [&'a wgpu::TextureView; 2] {
        let radiance = opaque.map_or(&self.black, |o| &o.radiance);
        [radiance, opaque.and_then(|o| o.sunlit.as_ref()).unwrap_or(&self.black)]
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}
