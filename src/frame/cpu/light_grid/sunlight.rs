//! Sunlight, followed from every cell through the matter of the others.
//!
//! A ray through the middle of each cell is what was measured best. Rays through the corners of a tetrahedron in it
//! (mean of four) are four times the work and make clouds flatter, as all means over cells do: relMSE of the scenes'
//! pictures (opacity above 0.9) 0.063, 0.059 and 0.023 with one ray, 0.073, 0.062 and 0.027 with four; of seven clumps of spheres only one,
//! dense and isotropic, is better with four (mean error -0.3 % in place of -5.3 %). Passed on from plane to plane, by
//! shares of what cells let through, sunlight spreads sideways, by two cells over twenty planes: into the dark sides
//! of clouds.

use glam::DVec3;

use super::GridLight;
use super::cells::{cells, centre, index, low, side};
use super::sweep::mean_transmittance;
use crate::frame::gpu_data::GridLevel;

/// Optical depth beyond which no sunlight counts; as in the shader.
const DEEPEST: f64 = 20.0;

/// Lengths of a ray from fractions of a cell to its borders along each axis, forward; m.
fn to_borders(fraction: DVec3, rate: DVec3) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|axis| {
        let left = if rate[axis] > 0.0 { 1.0 - fraction[axis] } else { fraction[axis] };
        if rate[axis] == 0.0 { f64::INFINITY } else { left / rate[axis].abs() }
    }))
}

/// Length of a ray from a point to the sides of a level, m.
fn to_sides(level: &GridLevel, origin: DVec3, rate: DVec3) -> f64 {
    let size = DVec3::from_array([0, 1, 2].map(|i| level.size[i].into()));
    let at = (origin - low(level)) / side(level) / size;
    let left = to_borders(at, rate / size);
    left.x.min(left.z)
}

impl GridLight {
    /// Optical depth towards the sun from where a ray through the middle of a cell of level `inner` leaves it.
    fn sun_depth(&self, inner: usize, own: [usize; 3]) -> f64 {
        let sun = self.sun_direction();
        let origin = centre(&self.level(inner), own.map(|v| v as f64));
        let (mut depth, mut t) = (0.0, 0.0);
        let widest = if self.uniforms.of_list == 0 {
            inner.max(self.uniforms.widest as usize)
        } else {
            inner
        };
        for l in inner..=widest {
            let level = self.level(l);
            let rate = sun / side(&level);
            let place = (origin + t * sun - low(&level)) / side(&level);
            let (mut cell, at) = if t == 0.0 {
                (own.map(|v| v as i64), DVec3::splat(0.5))
            } else {
                (place.floor().as_i64vec3().to_array(), place - place.floor())
            };
            let mut next = (t + to_borders(at, rate)).to_array();
            while inside(&level, cell) && depth < DEEPEST {
                let leave = next[0].min(next[1]).min(next[2]);
                if t > 0.0 {
                    let at = index(&level, cell.map(|v| v as usize));
                    depth += self.extinction[at] * (leave - t).max(0.0);
                }
                t = t.max(leave);
                let axis = (0..3).find(|i| next[*i] <= leave).unwrap_or(2);
                cell[axis] += if rate[axis] > 0.0 { 1 } else { -1 };
                next[axis] += 1.0 / rate[axis].abs();
            }
            // Above and below a level of a field there is no matter but of listed particles, only that which coarser
            // cells spread to there.
            if self.uniforms.has_above == 0 {
                t = t.max(to_sides(&level, origin, rate));
            }
            if t == f64::INFINITY {
                break;
            }
        }
        depth
    }

    /// Mean over every cell of the sunlight that reaches it, where it is asked for.
    pub(super) fn sunlight(&mut self, inner: usize) {
        let level = self.level(inner);
        let rate = self.sun_direction() / side(&level);
        let chord = 2.0 * to_borders(DVec3::splat(0.5), rate).min_element();
        for cell in cells(&level) {
            let at = index(&level, cell);
            let extinction = self.extinction[at];
            if extinction <= 0.0 && cell[1] > 0 {
                continue;
            }
            let before = self.sun_depth(inner, cell);
            self.sun[at] = (-before).exp() * mean_transmittance(extinction * chord);
        }
    }
}

fn inside(level: &GridLevel, cell: [i64; 3]) -> bool {
    (0..3).all(|i| cell[i] >= 0 && cell[i] < i64::from(level.size[i]))
}
