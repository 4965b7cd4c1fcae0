//! Resolve: puts sky, ground and air around the clouds; linear radiance out.

use super::shadow::ShadowJob;
use super::targets::Targets;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary};

/// Side of a workgroup; as in the shader.
const WORKGROUP: u32 = 8;

/// The pipeline.
pub struct ResolvePass {
    kernel: Kernel,
}

impl ResolvePass {
    /// Compiles the pass; it reads the sky (group 2) and leaves group 1 to the tables' layout.
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        tables: &wgpu::BindGroupLayout,
        sky: &wgpu::BindGroupLayout,
    ) -> Result<Self> {
        Self::with(gpu, library, &[], [tables, sky])
    }

    /// The same where the ground is a sea.
    pub fn over_sea(
        gpu: &Gpu,
        library: &ShaderLibrary,
        tables: &wgpu::BindGroupLayout,
        sky: &wgpu::BindGroupLayout,
    ) -> Result<Self> {
        Self::with(gpu, library, &[("SEA", 1)], [tables, sky])
    }

    fn with(
        gpu: &Gpu,
        library: &ShaderLibrary,
        defs: &[(&str, u32)],
        groups: [&wgpu::BindGroupLayout; 2],
    ) -> Result<Self> {
        let file = crate::shader_file!("frame/resolve.wgsl");
        Ok(Self { kernel: Kernel::new(gpu, library, file, defs, &groups)? })
    }

    /// Binds clouds, shadows, the picture, and what is opaque: its distances, radiance, and what sunlight adds.
    /// `changed_light`: what clouds change of the light of air and ground, and where the ground is a sea, what that reflects.
    pub fn bind(
        &self,
        gpu: &Gpu,
        frame: &wgpu::Buffer,
        shadow: &ShadowJob,
        [changed_light, reflected]: [Option<&wgpu::Buffer>; 2],
        targets: &Targets,
        [distances, radiance, sunlit]: [&wgpu::TextureView; 3],
    ) -> wgpu::BindGroup {
        let picture = targets.picture.create_view(&Default::default());
        let of_rays = [changed_light, reflected].into_iter().flatten();
        let first = [
            frame.as_entire_binding(),
            wgpu::BindingResource::TextureView(&targets.clouds),
            wgpu::BindingResource::TextureView(&targets.distance),
            wgpu::BindingResource::TextureView(&picture),
            wgpu::BindingResource::TextureView(radiance),
            wgpu::BindingResource::TextureView(sunlit),
            wgpu::BindingResource::TextureView(distances),
            shadow.uniforms.as_entire_binding(),
            shadow.texels.as_entire_binding(),
        ];
        let of_rays = of_rays.map(wgpu::Buffer::as_entire_binding);
        self.kernel.bind(gpu, &first.into_iter().chain(of_rays).collect::<Vec<_>>())
    }

    /// Records the pass.
    pub fn encode(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        size: [u32; 2],
        bindings: &wgpu::BindGroup,
        tables: &wgpu::BindGroup,
        sky: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(self.kernel.pipeline("resolve"));
        pass.set_bind_group(0, bindings, &[]);
        pass.set_bind_group(1, tables, &[]);
        pass.set_bind_group(2, sky, &[]);
        pass.dispatch_workgroups(size[0].div_ceil(WORKGROUP), size[1].div_ceil(WORKGROUP), 1);
    }
}
