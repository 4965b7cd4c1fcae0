//! Twin of `shaders/frame/light_grid.wgsl`, `light_field.wgsl` and what they stand on, in double
//! precision.
//!
//! The method. Sunlight is followed to every cell by a ray (`sunlight.rs`); it is the first source of what is
//! scattered. That light is followed along the directions to the corners of regular solids (`Directions`)
//! through nested grids of cells (discrete ordinates). In a cell it is scattered by the smooth part
//! of the phase function (degree 2, which all sets of directions integrate exactly). A direction goes
//! from cell to cell by shares of what flows out of them; a cell attenuates what flows in, and feeds
//! it with a source that changes evenly across it. What a cell takes is exactly what it scatters: the
//! light that leaves a cloud that does not absorb is the sunlight that it took. Scattering and
//! sweeping take turns, each as long a step as `relaxation` says. A level starts from the next coarser
//! one, where light crosses the cloud in a few cells: what is left for the turns of the fine level is
//! its own detail.
//!
//! What else was measured, with twelve directions. Mean over that of path traced pictures, cumulus scene, sun only:
//! - light interpolated between planes of cells (short characteristics, Kunasz and Auer 1988), which
//!   neither keeps what it carries nor what it scatters: 1.18, in an isotropic medium 1.32;
//! - the conservative sweep along an icosahedron with four horizontal directions: 1.14 and 1.19;
//!   light along those never leaves a layer of clouds;
//! - the same tilted so that they have |y| = 1/6: 1.056 and 1.14. What is left are dark sides of
//!   clouds whose cells are several mean free paths wide.
//!
//! A source without change across the cell takes nothing from thick cells' neighbours: the wrong limit
//! of diffusion. With the change taken from values on the faces, weighted so that light diffuses
//! equally fast on both sides, cells may be thick.
//!
//! On a clump of 200 spheres (thickness 30, isotropic; over the path traced light, seen from the lit
//! side, from aside, from the dark side): characteristics 0.85, 0.93, 1.66; conservative with nine plain
//! turns a level 0.81, 0.88, 1.22, with nine relaxed ones 0.85, 0.92, 1.30, as with 17 plain ones (before sunlight came by rays and the
//! coarsest level of a list had 33 turns).
//! What is left, in the cumulus scene with sun alone and two rings: its large cloud in cells of 86 m, isotropic with
//! an extinction of 0.008/m, the mean light at the places where rays of the eye first scatter, from the lit top to
//! the dark base, over the path traced light there. Grid: 1.04, 0.98, 1.00, 1.21, 1.17. Monte Carlo through the
//! matter of the cells, without their directions and planes: 1.05, 1.07, 1.08, 1.08, 1.15; with the true
//! density's mean over each cell in place of even balls 1.04, 1.05, 1.05, 1.07, 1.06. So a third to all of the light
//! that was too much came from matter spread too evenly; since then noise shapes are in the cells by their own density
//! (`matter.rs`). What was tried for the rest:
//! - flows that are linear across cells along both axes of a plane (van Leer slopes), without slanted planes: the
//!   cells' light against Monte Carlo in the same cells 0.057 of its mean, here 0.078; of the scenes' pictures (relMSE,
//!   opacity above 0.9) 0.0626, 0.0580 and 0.0235, here 0.0630, 0.0591 and 0.0231, for twice the time;
//! - 128 directions: 0.065; cells of half the side 0.040; 17 turns a level: the pictures' dark sides the same to 1 %;
//! - a correction of the field by the sunlight at the place over that of its cell: explains 3 % of the error.
//!
//! Before, with HG 0.85 and seen from aside (relMSE of the picture): twelve directions 0.0040; 4 x 6
//! Gauss directions of degree 2 0.0050, of degree 3 0.0026 at cells of 0.21 radii, for twice the work;
//! 8 directions of degree 1 0.011.

mod cells;
mod ground;
mod kept;
mod matter;
mod seen;
mod sunlight;
mod sweep;
#[cfg(test)]
mod tests;

pub use seen::FieldSeen;
use seen::cell_weight;

use std::f64::consts::PI;

use glam::{DVec3, DVec4};
use half::f16;

use self::cells::{Crossing, cells, centre, corners, index, side};
use self::kept::{EMPTY_CELL, NO_SLOT};
use crate::frame::gpu_data::{GridLevel, LightGridUniforms, Particle};
use crate::frame::light_grid::{Directions, least_eigenvalue, relaxations};
use crate::tables::TableSet;

/// How many directions of travel there are.
fn directions(uniforms: &LightGridUniforms) -> usize {
    2 * uniforms.axes as usize
}

/// The first of each pair of opposite directions, and their weight, in double precision.
fn axes(uniforms: &LightGridUniforms) -> &'static [DVec4] {
    Directions::with_axes(uniforms.axes).unwrap_or_default().axes()
}

/// A direction of travel; opposite ones are neighbours in number.
pub fn direction(uniforms: &LightGridUniforms, index: usize) -> DVec3 {
    let along = axes(uniforms)[index >> 1].truncate();
    if index & 1 == 0 { along } else { -along }
}

/// Share of the sphere that a direction stands for.
fn weight(uniforms: &LightGridUniforms, index: usize) -> f64 {
    axes(uniforms)[index >> 1].w
}

/// Share of light from above, even over the hemisphere, in what a cell scatters against a view.
pub fn share_from_above(uniforms: &LightGridUniforms, view: DVec3) -> f64 {
    let moments = [f64::from(uniforms.moment_first), f64::from(uniforms.moment_second)];
    (0..directions(uniforms))
        .filter(|d| direction(uniforms, *d).y < 0.0)
        .map(|d| weight(uniforms, d) * phase(moments, -direction(uniforms, d).dot(view)))
        .sum()
}

/// Light of a cell: scattered sunlight per unit irradiance; light that came from above, at radiance
/// 1; light that came from all sides at radiance 1.
pub type CellLight = DVec3;

/// Phase function of degree 2 times 4 pi.
fn phase(moments: [f64; 2], cosine: f64) -> f64 {
    1.0 + 3.0 * moments[0] * cosine + 5.0 * moments[1] * (1.5 * cosine * cosine - 0.5)
}

/// Sources without negative parts, of the same sum: a phase function of degree 2 is negative at some
/// angles, and the directions that are left give what it would add there.
fn positive(scattered: &mut [CellLight], weights: &[f64]) {
    let sum: DVec3 = scattered.iter().zip(weights).map(|(s, w)| *w * *s).sum();
    let kept: DVec3 = scattered.iter().zip(weights).map(|(s, w)| *w * s.max(DVec3::ZERO)).sum();
    let share =
        |sum: f64, kept: f64| if sum >= kept { 1.0 } else { sum.max(0.0) / kept.max(1e-30) };
    let balance = DVec3::new(share(sum.x, kept.x), share(sum.y, kept.y), share(sum.z, kept.z));
    for s in scattered {
        *s = balance * s.max(DVec3::ZERO);
    }
}

/// Light where none is kept, far from matter; as in the shader.
const OUTSIDE: CellLight = DVec3::new(0.0, 0.5, 1.0);

/// Light from outside of all levels along a direction of travel.
fn outside(index: usize, uniforms: &LightGridUniforms) -> CellLight {
    let uneven = f64::from(uniforms.sky.as_flattened()[index / 2]);
    DVec3::new(0.0, if direction(uniforms, index).y < 0.0 { 1.0 + uneven } else { 0.0 }, 1.0)
}

/// The most that the sky sends along a direction, over that of an even one.
fn most_from_above(uniforms: &LightGridUniforms) -> f64 {
    1.0 + f64::from(uniforms.sky.as_flattened().iter().copied().fold(0.0, f32::max))
}

/// The grid's light.
#[derive(Clone, Debug)]
pub struct GridLight {
    uniforms: LightGridUniforms,
    /// 1/m, of every cell.
    pub extinction: Vec<f64>,
    /// Sunlight, mean over a cell, where it is asked for: in matter, and in the lowest layer.
    pub sun: Vec<f64>,
    /// Of every cell; `NO_SLOT` where it keeps no light.
    slots: Vec<u32>,
    /// How many keep light.
    kept: usize,
    /// By direction and slot, means over the cell.
    lights: Vec<CellLight>,
    sources: Vec<CellLight>,
}

impl GridLight {
    /// The light as a device made it: `words` are its packed lights, `packed` (one or two) for each,
    /// and whatever it keeps behind them; `sun` is by slot, `entries` are by cell, with extinctions behind them.
    pub fn from_device(
        uniforms: &LightGridUniforms,
        words: &[u32],
        packed: usize,
        sun: &[f32],
        entries: &[u32],
    ) -> Self {
        let half = |bits: u32| f16::from_bits(bits as u16).to_f64();
        let light = |w: &[u32]| {
            DVec3::new(half(w[0]), half(w[0] >> 16), w.get(1).map_or(1.0, |sum| half(*sum)))
        };
        let kept = uniforms.kept_room as usize;
        let (entries, extinctions) = entries.split_at(uniforms.cells as usize);
        let slot = |entry: &u32| if *entry == NO_SLOT { NO_SLOT } else { *entry & !EMPTY_CELL };
        let extinction = |entry: &u32| {
            let bits = extinctions.get(*entry as usize).copied();
            f64::from(bits.map_or(0.0, f32::from_bits))
        };
        let slots: Vec<u32> = entries.iter().map(slot).collect();
        let lit = |slot: &u32| f64::from(sun.get(*slot as usize).copied().unwrap_or(0.0));
        Self {
            uniforms: *uniforms,
            extinction: entries.iter().map(extinction).collect(),
            sun: slots.iter().map(lit).collect(),
            slots,
            kept,
            lights: words
                .chunks_exact(packed.max(1))
                .take(directions(uniforms) * kept)
                .map(light)
                .collect(),
            sources: Vec::new(),
        }
    }

    /// Solves for particles given relative to the anchor. `spreads` by shape, of the tables; `turns` of
    /// scattering and sweeping for the coarsest level and for each finer one.
    pub fn solve(
        uniforms: &LightGridUniforms,
        particles: &[Particle],
        (spreads, tables): (&[f32], &TableSet),
        turns: [u32; 2],
    ) -> Self {
        let mut grid = Self::empty(uniforms);
        for particle in particles {
            grid.splat(particle, f64::from(spreads[particle.shape as usize]), tables);
        }
        grid.keep();
        let [coarsest, finer] = turns.map(|turns| relaxations(turns, least_eigenvalue(uniforms)));
        let levels = grid.levels();
        for inner in (0..levels).rev() {
            grid.start(inner);
            let steps = if inner + 1 == levels { &coarsest } else { &finer };
            for (turn, step) in steps.iter().enumerate() {
                grid.turn(inner, f64::from(*step), turn + 1 == steps.len());
            }
        }
        grid
    }

    fn empty(uniforms: &LightGridUniforms) -> Self {
        let count = uniforms.cells as usize;
        Self {
            uniforms: *uniforms,
            extinction: vec![0.0; count],
            sun: vec![0.0; count],
            slots: (0..uniforms.cells).collect(),
            kept: count,
            lights: vec![DVec3::ZERO; directions(uniforms) * count],
            sources: vec![DVec3::ZERO; directions(uniforms) * count],
        }
    }

    fn start(&mut self, inner: usize) {
        self.begin(inner);
        self.sunlight(inner);
    }

    /// Scatters and sweeps, by a step from the sources of before. What leaves the level by direction,
    /// in faces across it. In the last turn nothing is left negative.
    fn turn(&mut self, inner: usize, step: f64, is_last: bool) -> Vec<CellLight> {
        self.scatter(inner, step, is_last);
        (0..self.directions()).map(|d| self.sweep(inner, d)).collect()
    }

    /// Where the light of a cell along a direction is; none where it keeps none.
    fn light_at(&self, d: usize, cell: usize) -> Option<usize> {
        let slot = self.slots[cell];
        (slot != NO_SLOT).then_some(d * self.kept + slot as usize)
    }

    fn sun_direction(&self) -> DVec3 {
        let [x, y, z, _] = self.uniforms.sun.map(f64::from);
        DVec3::new(x, y, z)
    }

    /// m, of sunlight through a cell.
    fn sun_path(&self, level: &GridLevel) -> f64 {
        Crossing::new(-self.sun_direction(), side(level)).path
    }

    fn directions(&self) -> usize {
        directions(&self.uniforms)
    }

    fn direction(&self, index: usize) -> DVec3 {
        direction(&self.uniforms, index)
    }

    fn weight(&self, index: usize) -> f64 {
        weight(&self.uniforms, index)
    }

    fn level(&self, index: usize) -> GridLevel {
        self.uniforms.level[index]
    }

    fn levels(&self) -> usize {
        self.uniforms.levels as usize
    }

    fn inflow(&self, inner: usize, d: usize, point: DVec3) -> CellLight {
        if inner + 1 < self.levels() {
            let outer = self.level(inner + 1);
            if let Some(corners) = corners(&outer, point) {
                let light = |c| self.light_at(d, index(&outer, c)).map(|at| self.lights[at]);
                return corners
                    .iter()
                    .map(|(c, w)| *w * light(*c).unwrap_or(outside(d, &self.uniforms)))
                    .sum();
            }
        }
        outside(d, &self.uniforms)
    }

    fn begin(&mut self, inner: usize) {
        let level = self.level(inner);
        for d in 0..self.directions() {
            for cell in cells(&level) {
                if let Some(at) = self.light_at(d, index(&level, cell)) {
                    self.lights[at] = self.inflow(inner, d, centre(&level, cell.map(|v| v as f64)));
                }
            }
        }
    }

    fn scatter(&mut self, inner: usize, step: f64, is_last: bool) {
        let level = self.level(inner);
        let moments =
            [f64::from(self.uniforms.moment_first), f64::from(self.uniforms.moment_second)];
        let sun = self.sun_direction();
        let weights: Vec<f64> = (0..self.directions()).map(|d| self.weight(d)).collect();
        let along: Vec<DVec3> = (0..self.directions()).map(|d| self.direction(d)).collect();
        let mut scattered = vec![DVec3::ZERO; self.directions()];
        for cell in cells(&level) {
            let at = index(&level, cell);
            let Some(slot) = self.light_at(0, at) else { continue };
            for (d, scattered) in scattered.iter_mut().enumerate() {
                let mut sum = DVec3::ZERO;
                for e in 0..along.len() {
                    let weight = weights[e] * phase(moments, along[d].dot(along[e]));
                    sum += weight * self.lights[e * self.kept + slot];
                }
                let once = self.sun[at] * phase(moments, -along[d].dot(sun)) / (4.0 * PI);
                let once = DVec3::new(once, 0.0, 0.0);
                let wanted = f64::from(self.uniforms.albedo) * (sum + once);
                let before = self.sources[d * self.kept + slot];
                *scattered = before + step * (wanted - before);
            }
            if is_last {
                positive(&mut scattered, &weights);
            }
            for (d, source) in scattered.iter().enumerate() {
                self.sources[d * self.kept + slot] = *source;
            }
        }
    }

    /// What the cells send towards an eye at a point relative to the anchor.
    pub fn seen_from(&self, eye: DVec3) -> FieldSeen {
        let outside = f64::from(self.uniforms.albedo) * OUTSIDE;
        let mut field = vec![DVec4::ZERO; self.uniforms.cells as usize];
        let shares = self.ground_shares();
        for l in 0..self.levels() {
            let level = self.level(l);
            for cell in cells(&level) {
                let offset = centre(&level, cell.map(|v| v as f64)) - eye;
                let distance = offset.length();
                let view = offset / distance.max(1e-6);
                let t = (distance / side(&level).max_element()).clamp(0.0, 1.0);
                let sharp = t * t * (3.0 - 2.0 * t);
                let moments = [self.uniforms.moment_first, self.uniforms.moment_second]
                    .map(|m| f64::from(m) * sharp);
                let at = index(&level, cell);
                let Some(slot) = self.light_at(0, at) else {
                    field[at] = outside.extend(1.0);
                    continue;
                };
                let mut sum: DVec3 = (0..self.directions())
                    .map(|d| {
                        let towards = phase(moments, -self.direction(d).dot(view));
                        self.weight(d) * towards * self.lights[d * self.kept + slot]
                    })
                    .sum();
                sum.y = sum.y.min(most_from_above(&self.uniforms) * sum.z);
                let light = f64::from(self.uniforms.albedo) * sum.max(DVec3::ZERO);
                field[at] = cell_weight(self.extinction[at] * side(&level).y) * light.extend(1.0);
            }
        }
        FieldSeen::new(self.uniforms, field, eye).with_shares(shares)
    }
}
