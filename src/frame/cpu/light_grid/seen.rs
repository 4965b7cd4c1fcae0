//! Twin of `shaders/shared/light_field.wgsl`.

use glam::{DVec3, DVec4};

use super::cells::{corners, index, low, side};
use crate::frame::gpu_data::LightGridUniforms;

/// What the cells send towards one eye.
#[derive(Clone, Debug)]
pub struct FieldSeen {
    uniforms: LightGridUniforms,
    field: Vec<DVec4>,
    eye: DVec3,
}

/// Cells at the border of a level over which it fades into the coarser one.
const FADE_CELLS: f64 = 3.0;

impl FieldSeen {
    /// With these values in the cells, seen from an eye relative to the anchor (m).
    pub fn new(uniforms: LightGridUniforms, field: Vec<DVec4>, eye: DVec3) -> Self {
        Self { uniforms, field, eye }
    }

    /// Without cells, and so without light.
    pub fn dark() -> Self {
        Self::new(bytemuck::Zeroable::zeroed(), Vec::new(), DVec3::ZERO)
    }

    /// Where the cells lie.
    pub fn uniforms(&self) -> &LightGridUniforms {
        &self.uniforms
    }

    /// The cells, level after level.
    pub fn cells(&self) -> &[DVec4] {
        &self.field
    }

    /// What the clouds leave of the light of the ground below a point relative to the eye, over that
    /// of bare ground: lit by the sun, by the sky.
    pub fn ground_shares(&self, point: DVec3) -> [f64; 2] {
        [0.5, 1.5].map(|layer| self.sum(point + self.eye, Some(layer)).w)
    }

    /// At a point relative to the eye: light of the three kinds.
    pub fn at(&self, point: DVec3) -> DVec4 {
        self.sum(point + self.eye, None)
    }

    /// Of all levels, at a height in a layer of each or at that of the point (m relative to the anchor).
    fn sum(&self, point: DVec3, layer: Option<f64>) -> DVec4 {
        let (mut sum, mut left) = (DVec4::ZERO, 1.0);
        // Without a level there is no light.
        let Some(last) = (self.uniforms.levels as usize).checked_sub(1) else { return sum };
        for l in 0..=last {
            let level = self.uniforms.level[l];
            let size = DVec3::new(level.size[0].into(), level.size[1].into(), level.size[2].into());
            let mut at = (point - low(&level)) / side(&level);
            at.y = if layer.is_some() { 0.5 * size.y } else { at.y };
            let margin = at.min(size - at).min_element() - 0.5;
            let weight = if l == last { 1.0 } else { (margin / FADE_CELLS).clamp(0.0, 1.0) };
            if weight > 0.0 {
                at.y = layer.unwrap_or(at.y);
                let held = low(&level) + at.clamp(DVec3::splat(0.5), size - 0.5) * side(&level);
                let light: DVec4 = corners(&level, held).map_or(DVec4::ZERO, |corners| {
                    corners.iter().map(|(c, w)| *w * self.field[index(&level, *c)]).sum()
                });
                sum += left * weight * light;
                left *= 1.0 - weight;
                if left <= 0.0 {
                    break;
                }
            }
        }
        sum
    }
}
