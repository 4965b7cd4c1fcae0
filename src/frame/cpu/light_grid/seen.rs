//! Twin of `shaders/shared/light_field.wgsl`.

use glam::{DVec3, DVec4};

use super::cells::{corners, index, low, side};
use crate::frame::gpu_data::{GridLevel, LightGridUniforms};

/// What the cells send towards one eye.
#[derive(Clone, Debug)]
pub struct FieldSeen {
    uniforms: LightGridUniforms,
    field: Vec<DVec4>,
    shares: Vec<Vec<[f64; 2]>>,
    eye: DVec3,
}

/// Weight of a cell by its optical depth from bottom to top; as in the shader.
pub(super) fn cell_weight(tau: f64) -> f64 {
    1.0 + 50.0 * tau.min(20.0)
}

/// Cells at the border of a level over which it fades into the coarser one.
const FADE_CELLS: f64 = 3.0;

impl FieldSeen {
    /// With these values in the cells, light times a weight and the weight, seen from an eye relative to the
    /// anchor (m). All of the ground's light is left.
    pub fn new(uniforms: LightGridUniforms, field: Vec<DVec4>, eye: DVec3) -> Self {
        let bare = |level: &GridLevel| vec![[1.0; 2]; (level.size[0] * level.size[2]) as usize];
        let shares = uniforms.level[..uniforms.levels as usize].iter().map(bare).collect();
        Self { uniforms, field, shares, eye }
    }

    /// With this left of the ground's light below the columns of each level, row by row: lit by the sun, by the sky.
    pub fn with_shares(self, shares: Vec<Vec<[f64; 2]>>) -> Self {
        Self { shares, ..self }
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
        let sum = self.sum(point + self.eye, false, |l, corners| {
            let row = self.uniforms.level[l].size[0] as usize;
            let share = |[x, _, z]: [usize; 3]| self.shares[l][z * row + x];
            corners.iter().map(|(c, w)| *w * DVec3::new(share(*c)[0], share(*c)[1], 0.0)).sum()
        });
        [sum.x, sum.y]
    }

    /// At a point relative to the eye: light of the three kinds.
    pub fn at(&self, point: DVec3) -> DVec3 {
        self.light(point, false)
    }

    /// The same in the air around clouds, above and below them as coarser cells know it.
    pub fn from_afar(&self, point: DVec3) -> DVec3 {
        self.light(point, true)
    }

    fn light(&self, point: DVec3, afar: bool) -> DVec3 {
        self.sum(point + self.eye, afar, |l, corners| {
            let level = &self.uniforms.level[l];
            let light: DVec4 = corners.iter().map(|(c, w)| *w * self.field[index(level, *c)]).sum();
            light.truncate() / light.w.max(1e-3)
        })
    }

    /// Of all levels, at a point relative to the anchor.
    fn sum(
        &self,
        point: DVec3,
        afar: bool,
        of_level: impl Fn(usize, &[([usize; 3], f64); 8]) -> DVec3,
    ) -> DVec3 {
        let (mut sum, mut left) = (DVec3::ZERO, 1.0);
        // Without a level there is no light.
        if self.uniforms.levels == 0 {
            return sum;
        }
        let last = self.uniforms.widest as usize;
        for l in 0..=last {
            let level = self.uniforms.level[l];
            let size = DVec3::new(level.size[0].into(), level.size[1].into(), level.size[2].into());
            let at = (point - low(&level)) / side(&level);
            let margin = at.min(size - at);
            let inside = if self.uniforms.of_list == 0 {
                let sides = margin.x.min(margin.z);
                let height = if self.uniforms.has_above == 0 { sides } else { margin.y };
                sides.min(height) - 0.5
            } else {
                margin.min_element() + FADE_CELLS
            };
            let share = |margin: f64| (margin / FADE_CELLS).clamp(0.0, 1.0);
            let afar = afar && self.uniforms.of_list == 0;
            let by_height = if afar { share(margin.y - 0.5) } else { 1.0 };
            let weight = if l == last { 1.0 } else { share(inside) * by_height };
            if weight > 0.0 {
                let held = low(&level) + at.clamp(DVec3::splat(0.5), size - 0.5) * side(&level);
                let found = corners(&level, held).map_or(DVec3::ZERO, |c| of_level(l, &c));
                sum += left * weight * found;
                left *= 1.0 - weight;
                if left <= 0.0 {
                    break;
                }
            }
        }
        sum
    }
}
