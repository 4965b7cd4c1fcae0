//! Air shadow: what clouds change of the light of the air between the eye and what it sees, and of the ground.

use super::shadow::ShadowJob;
use crate::Result;
use crate::gpu::{Gpu, Kernel, ShaderLibrary, buffers};

/// Side of a workgroup; as in the shader.
const WORKGROUP: u32 = 8;
/// Most sides of a block of pixels, whose corners have rays.
const BLOCK: u32 = 8;
/// A block may be so wide in the middle of a picture, rad (4 degrees): between its corners light is linear, which that
/// next to the sun and over the horizon is not over much more. At 111 degrees, towards a sun on the horizon behind opaque clouds
/// (`random 3000:901`), the worst pixel of an open sky is off by 0.007 with blocks of 4 degrees, by 0.06 with 7, by 0.38 with 55.
const WIDEST_BLOCK: f64 = 0.07;
/// Rays up to which smaller blocks take next to no time: about those of a picture of 640x360.
const MOST_RAYS: u32 = 4096;
/// Nodes along a ray, behind the first; as in the shader.
pub const NODES: u32 = 24;
/// Numbers of a ray: those of its nodes and of the ground behind them; as in the shader.
pub const ENTRIES: usize = NODES as usize + 2;
/// Bytes of one.
const ENTRY_BYTES: usize = 8;

/// Rays across and up for a picture of this size with blocks of so many pixels a side.
pub fn corners(size: [u32; 2], block: u32) -> [u32; 2] {
    size.map(|s| s.div_ceil(block) + 1)
}

/// Whether blocks of half of this are small enough in number.
fn may_halve(size: [u32; 2], block: u32) -> bool {
    let [across, up] = corners(size, (block / 2).max(1)).map(u64::from);
    block > 1 && across * up <= u64::from(MOST_RAYS)
}

/// Sides of the blocks of a picture of this size (pixels), a power of 2: as many pixels as are seen under a small angle.
/// `half_width`: of the picture, at distance 1.
pub fn ray_block(size: [u32; 2], half_width: f64) -> u32 {
    let pixel = 2.0 * half_width / f64::from(size[0]);
    let mut block = BLOCK;
    while f64::from(block) * pixel > WIDEST_BLOCK && may_halve(size, block) {
        block /= 2;
    }
    block
}

/// Most rays of a picture of this size, however wide.
pub fn most_rays(size: [u32; 2]) -> usize {
    let mut block = BLOCK;
    while may_halve(size, block) {
        block /= 2;
    }
    corners(size, block).map(|c| c as usize).into_iter().product()
}

/// The pipeline.
pub struct AirShadowPass {
    kernel: Kernel,
}

impl AirShadowPass {
    /// Compiles the pass with `steps` steps from node to node. `groups`: the sky's tables that don't depend on the view, those that do, and the
    /// light field.
    pub fn new(
        gpu: &Gpu,
        library: &ShaderLibrary,
        steps: u32,
        groups: &[&wgpu::BindGroupLayout; 3],
    ) -> Result<Self> {
        let file = crate::shader_file!("frame/air_shadow.wgsl");
        Ok(Self { kernel: Kernel::new(gpu, library, file, &[("STEPS", steps)], groups)? })
    }

    /// What it leaves for a picture of this size, pixels.
    pub fn changed_light(&self, gpu: &Gpu, size: [u32; 2]) -> wgpu::Buffer {
        buffers::storage(gpu, "changed light", most_rays(size) * ENTRIES, ENTRY_BYTES)
    }

    /// Binds the shadow maps.
    pub fn bind(
        &self,
        gpu: &Gpu,
        frame: &wgpu::Buffer,
        shadow: &ShadowJob,
        changed_light: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        self.kernel.bind(
            gpu,
            &[
                frame.as_entire_binding(),
                changed_light.as_entire_binding(),
                shadow.uniforms.as_entire_binding(),
                shadow.texels.as_entire_binding(),
            ],
        )
    }

    /// Records the pass for a picture of this size with blocks of so many pixels a side.
    pub fn encode(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        (size, block): ([u32; 2], u32),
        bindings: &wgpu::BindGroup,
        groups: [&wgpu::BindGroup; 3],
    ) {
        let [across, up] = corners(size, block).map(|c| c.div_ceil(WORKGROUP));
        pass.set_pipeline(self.kernel.pipeline("air_shadow"));
        pass.set_bind_group(0, bindings, &[]);
        for (group, number) in groups.into_iter().zip(1..) {
            pass.set_bind_group(number, group, &[]);
        }
        pass.dispatch_workgroups(across, up, 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half the width of a picture of this angle, degrees, at distance 1.
    fn half_width(degrees: f64) -> f64 {
        (0.5 * degrees).to_radians().tan()
    }

    #[test]
    fn blocks_are_small_where_pixels_are_wide_and_few() {
        // Pictures of the usual size and angle.
        for size in [[640, 360], [1280, 720], [3840, 2160], [256, 144]] {
            assert_eq!(ray_block(size, half_width(70.0)), BLOCK, "{size:?}");
        }
        assert_eq!(ray_block([16, 9], half_width(111.0)), 1);
        assert_eq!(ray_block([64, 36], half_width(60.0)), 2);
        // Large pictures stay as quick as they are, however wide.
        assert_eq!(ray_block([1280, 720], half_width(179.0)), BLOCK);
        for size in
            [[1, 1], [16, 9], [64, 36], [65, 63], [128, 72], [300, 1], [8192, 1], [8192, 8192]]
        {
            for degrees in [1.0, 30.0, 90.0, 179.0] {
                let block = ray_block(size, half_width(degrees));
                let rays: u32 = corners(size, block).iter().product();
                assert!(rays as usize <= most_rays(size), "{size:?} {degrees}");
                assert!(block == BLOCK || rays <= MOST_RAYS, "{size:?} {degrees}");
            }
        }
    }
}
