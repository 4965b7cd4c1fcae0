//! Twin of `shaders/frame/shadow.wgsl` and `shaders/shared/shadow_maps.wgsl`, in double precision
//! and without lists: every particle is asked.

use glam::{DQuat, DVec2, DVec3};

use crate::frame::gpu_data::{Particle, ShadowUniforms};
use crate::tables::TableSet;
use crate::tables::optical_depth::volume::copy_for;

/// Optical depths of the nodes of a texel; as in the shader.
pub const NODES: [f64; 7] = [0.02, 0.25, 0.6, 1.1, 1.8, 3.0, 5.0];
/// Bins of a block.
const BINS: usize = 8;
/// Least step over the distance.
const LEAST_STEP: f64 = 1e-6;
/// Optical depth at which the march ends.
const ENOUGH: f64 = 8.0;
/// Least distance of two nodes, in units of a map's range.
const LEAST_GAP: f64 = 7.6e-6;
/// Depth beyond which there is no sun.
const DARKEST: f64 = 80.0;
/// Texels at the border of a map that the next one shows.
const BORDER: f64 = 1.5;
/// Depth of a texel beyond which it counts as no deeper.
const MOST_DEPTH: f64 = 20.0;
/// The largest number of 16 bits.
const FULL: f64 = 65_535.0;

/// A direction of the maps.
fn axis(v: [f32; 4]) -> DVec3 {
    DVec3::new(v[0].into(), v[1].into(), v[2].into())
}

/// Where on a texel's ray its nodes lie, in units of the map's range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nodes {
    /// Of [`NODES`].
    pub at: [f64; 7],
    /// Of columns that reach the seventh half the place of an eighth, of the others 1/2 and half the
    /// transmittance of all their matter.
    pub rest: f64,
}

impl Nodes {
    /// Where there is nothing.
    pub const EMPTY: Self = Self { at: [1.0; 7], rest: 1.0 };

    /// From a texel.
    pub fn unpack(texel: [u32; 4]) -> Self {
        let half = |i: usize| f64::from(texel[i / 2] >> (16 * (i % 2)) & 0xffff) / FULL;
        Self { at: std::array::from_fn(half), rest: half(7) }
    }

    /// The same in 16 bits each, as the device keeps it.
    pub fn rounded(&self) -> Self {
        let round = |x: f64| (x.clamp(0.0, 1.0) * FULL).round() / FULL;
        Self { at: self.at.map(round), rest: round(self.rest) }
    }

    /// Optical depth at a place on the ray.
    pub fn depth(&self, at: f64) -> f64 {
        let all = if self.rest < 0.5 {
            DARKEST
        } else {
            -(2.0 * self.rest - 1.0).max((-DARKEST).exp()).ln()
        };
        let next = |i: usize| self.at.get(i + 1).map_or(2.0 * self.rest, |at| *at);
        let gap = |i: usize| (next(i) - self.at[i]).max(LEAST_GAP);
        if all <= NODES[0] {
            return all * ((at - self.at[0]) / gap(0)).clamp(0.0, 1.0);
        }
        let mut depth = NODES[0];
        for (i, node) in NODES.iter().enumerate() {
            let step = NODES.get(i + 1).unwrap_or(&ENOUGH) - node;
            let low = if i == 0 { -node / step } else { 0.0 };
            let high = if i == 6 { DARKEST } else { 1.0 };
            depth += step * ((at - self.at[i]) / gap(i)).clamp(low, high);
        }
        depth.min(all)
    }
}

/// A clump seen from the sun: which particles, through which tables.
pub struct Column<'a> {
    /// Where the matter lies.
    pub tables: &'a TableSet,
    /// All particles, relative to the camera.
    pub particles: &'a [Particle],
    /// Where the maps lie.
    pub maps: &'a ShadowUniforms,
    /// Steps in a radius.
    pub steps: u32,
}

impl Column<'_> {
    /// Part of the ray through a place of the maps in a particle, m from the plane through the camera.
    fn span(&self, particle: &Particle, place: DVec2) -> Option<(f64, f64)> {
        let centre = DVec3::from(particle.centre.map(f64::from));
        let across = place
            - DVec2::new(centre.dot(axis(self.maps.axis_u)), centre.dot(axis(self.maps.axis_v)));
        let square = f64::from(particle.radius).powi(2) - across.length_squared();
        let half = (square > 0.0).then(|| square.sqrt())?;
        let middle = -centre.dot(axis(self.maps.towards));
        Some((middle - half, middle + half))
    }

    /// Where the ray through the middle of a texel of a map runs: place on the maps, m.
    pub fn place(&self, map: usize, texel: [u32; 2]) -> DVec2 {
        let [x, y, side, _] = self.maps.corner[map].map(f64::from);
        DVec2::new(x, y) + (DVec2::new(texel[0].into(), texel[1].into()) + 0.5) * side
    }

    /// Nodes of a texel.
    pub fn nodes(&self, map: usize, texel: [u32; 2]) -> Nodes {
        let place = self.place(map, texel);
        let texel_side = f64::from(self.maps.corner[map][2]);
        let [range_begin, range, _, range_end] = self.maps.range[map].map(f64::from);
        let towards = axis(self.maps.towards);
        let origin = place.x * axis(self.maps.axis_u) + place.y * axis(self.maps.axis_v);
        let met: Vec<_> = self
            .particles
            .iter()
            .filter_map(|p| self.span(p, place).map(|span| (p, span)))
            .collect();
        let (mut cursor, mut depth) = (f64::NEG_INFINITY, 0.0);
        let (mut first, mut last) = (f64::INFINITY, 0.0f64);
        let (mut at, mut eighth) = ([f64::INFINITY; 7], f64::INFINITY);
        while depth < ENOUGH {
            let open = met.iter().filter(|(_, (_, end))| *end > cursor);
            let (mut begin, mut smallest) = (f64::INFINITY, f64::INFINITY);
            // In the order of the lists: a smaller particle counts if it begins before the block's
            // first radius ends.
            let mut open: Vec<_> = open.collect();
            open.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
            let mut order: Vec<_> = open.iter().map(|(p, span)| (p, *span)).collect();
            let nearest = |p: &Particle| {
                -DVec3::from(p.centre.map(f64::from)).dot(towards) - f64::from(p.radius)
            };
            order.sort_by(|a, b| nearest(a.0).total_cmp(&nearest(b.0)));
            for (particle, (near, _)) in order {
                if nearest(particle) >= begin + smallest {
                    break;
                }
                let from_here = near.max(cursor);
                begin = begin.min(from_here);
                let up_to = (from_here - begin) * f64::from(self.steps) / BINS as f64;
                smallest = smallest.min(f64::from(particle.radius).max(up_to));
            }
            if !begin.is_finite() || begin >= range_end {
                break;
            }
            let step = (smallest / f64::from(self.steps)).max(LEAST_STEP * begin.abs());
            let mut bins = [0.0; BINS];
            for (particle, (near, far)) in &met {
                let (from, to) = (near.max(begin), far.min(begin + BINS as f64 * step));
                if to <= from {
                    continue;
                }
                last = last.max(to);
                let radius = f64::from(particle.radius);
                let centre = DVec3::from(particle.centre.map(f64::from));
                let turn = DQuat::from_array(particle.orientation.map(f64::from));
                let copy = copy_for((radius / texel_side) as f32, particle.optical_radius);
                for (i, bin) in bins.iter_mut().enumerate() {
                    let (a, b) = (begin + step * i as f64, begin + step * (i + 1) as f64);
                    let (a, b) = (a.max(from), b.min(to));
                    if b > a {
                        let point = origin - 0.5 * (a + b) * towards;
                        let own = turn * ((point - centre) / radius);
                        let density = self.tables.density(particle.shape, own, copy);
                        *bin += f64::from(particle.extinction) * (b - a) * density;
                    }
                }
            }
            for (i, tau) in bins.into_iter().enumerate() {
                let front = begin + step * i as f64;
                let next = depth + tau;
                if depth <= 0.0 && next > 0.0 {
                    first = front;
                }
                if depth < ENOUGH && next >= ENOUGH {
                    eighth = front + (ENOUGH - depth) / tau * step;
                }
                for (level, node) in NODES.iter().zip(&mut at) {
                    if *level >= depth && *level < next {
                        *node = front + (level - depth) / tau * step;
                    }
                }
                depth = next;
            }
            cursor = begin + BINS as f64 * step;
        }
        if depth <= 0.0 {
            return Nodes::EMPTY;
        }
        if depth < NODES[0] {
            at = [last; 7];
            at[0] = first;
        } else {
            // Nodes that are not reached: where they would be if matter went on as it ended.
            let reached = at.iter().rposition(|a| a.is_finite()).unwrap_or(0);
            let thickness = (last - at[reached]).max(0.0) / (depth - NODES[reached]).max(1e-20);
            for i in reached + 1..NODES.len() {
                at[i] = at[reached] + (NODES[i] - NODES[reached]) * thickness;
            }
            if eighth.is_infinite() {
                eighth = at[reached] + (ENOUGH - NODES[reached]) * thickness;
            }
        }
        let share = |t: f64| ((t - range_begin) / range).clamp(0.0, 1.0);
        let is_deep = depth > NODES[6];
        let rest =
            if is_deep { (0.5 * share(eighth)).min(0.4999) } else { 0.5 + 0.5 * (-depth).exp() };
        Nodes { at: at.map(share), rest }
    }
}

/// Maps that have been made: texels of all of them, row after row.
pub struct Maps<'a> {
    /// Where they lie.
    pub uniforms: &'a ShadowUniforms,
    /// Four words each.
    pub texels: &'a [[u32; 4]],
}

impl Maps<'_> {
    fn nodes(&self, map: usize, [x, y]: [i64; 2]) -> Nodes {
        let side = i64::from(self.uniforms.resolution);
        let index = (map as i64 * side + y) * side + x;
        let texel = usize::try_from(index).ok().and_then(|i| self.texels.get(i));
        texel.map_or(Nodes::EMPTY, |t| Nodes::unpack(*t))
    }

    /// Optical depth from a point (m, relative to the camera) to the sun.
    pub fn depth(&self, point: DVec3) -> f64 {
        self.depth_up_to(MOST_DEPTH, point)
    }

    /// The same where octaves look: they see light through more.
    pub fn depth_for_octaves(&self, point: DVec3) -> f64 {
        self.depth_up_to(DARKEST, point)
    }

    fn depth_up_to(&self, most: f64, point: DVec3) -> f64 {
        let Some(look_up) = LookUp::new(self.uniforms, point) else { return 0.0 };
        look_up.mix(most, |texel| self.nodes(look_up.map, texel).depth(look_up.at))
    }
}

/// Optical depth from a point to the sun by the nodes of a map's texels, whoever tells them.
pub fn through_nodes(
    maps: &ShadowUniforms,
    point: DVec3,
    nodes: impl Fn(usize, [i64; 2]) -> Nodes,
) -> f64 {
    let Some(look_up) = LookUp::new(maps, point) else { return 0.0 };
    look_up.mix(MOST_DEPTH, |texel| nodes(look_up.map, texel).depth(look_up.at))
}

/// What a look-up of a point reads: a place between four texels of a map.
struct LookUp {
    map: usize,
    /// Along the sun's ray, in units of the map's range.
    at: f64,
    /// Of the four the first.
    first: [i64; 2],
    /// From it to the next ones.
    share: DVec2,
}

impl LookUp {
    /// None off the maps.
    fn new(maps: &ShadowUniforms, point: DVec3) -> Option<Self> {
        let place = DVec2::new(point.dot(axis(maps.axis_u)), point.dot(axis(maps.axis_v)));
        let along = -point.dot(axis(maps.towards));
        (0..maps.maps as usize).find_map(|map| {
            let [x, y, side, _] = maps.corner[map].map(f64::from);
            let texel = (place - DVec2::new(x, y)) / side - 0.5;
            let margin = texel.min(f64::from(maps.resolution) - 1.0 - texel).min_element();
            let [begin, range, least, most] = maps.range[map].map(f64::from);
            let is_inside = margin >= BORDER && along >= least && along <= most;
            is_inside.then(|| {
                let first = texel.floor();
                let (at, share) = ((along - begin) / range, texel - first);
                Self { map, at, first: [first.x as i64, first.y as i64], share }
            })
        })
    }

    /// Depths of the four texels, none of which counts as deeper than the most, weighted.
    fn mix(&self, most: f64, depth: impl Fn([i64; 2]) -> f64) -> f64 {
        let ([x, y], [u, v]) = (self.first, self.share.to_array());
        let four = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]];
        let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
        let depth = |texel| depth(texel).min(most);
        four.map(depth).iter().zip(weights).map(|(d, w)| d * w).sum()
    }
}

/// Optical depth from a point to the sun between texels that are exact along their rays: what maps that lie so would
/// tell if they had any number of nodes. `truth` is the depth from any point.
pub fn between_texels(maps: &ShadowUniforms, point: DVec3, truth: impl Fn(DVec3) -> f64) -> f64 {
    let Some(look_up) = LookUp::new(maps, point) else { return 0.0 };
    let side = f64::from(maps.corner[look_up.map][2]);
    look_up.mix(MOST_DEPTH, |texel| {
        let texel = DVec2::new(texel[0] as f64, texel[1] as f64);
        let first = DVec2::new(look_up.first[0] as f64, look_up.first[1] as f64);
        let beside = (texel - first - look_up.share) * side;
        truth(point + beside.x * axis(maps.axis_u) + beside.y * axis(maps.axis_v))
    })
}

/// Side of a texel of the map that tells of a point, m; 0 off the maps, where nothing has a shadow.
pub fn texel_side(maps: &ShadowUniforms, point: DVec3) -> f64 {
    LookUp::new(maps, point).map_or(0.0, |look_up| maps.corner[look_up.map][2].into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_texels_what_is_linear_is_exact_and_nothing_is_deeper_than_the_most() {
        let mut maps: ShadowUniforms = bytemuck::Zeroable::zeroed();
        maps.axis_u = [1.0, 0.0, 0.0, 0.0];
        maps.axis_v = [0.0, 0.0, 1.0, 0.0];
        maps.towards = [0.0, 1.0, 0.0, 0.0];
        (maps.maps, maps.resolution) = (1, 32);
        maps.corner[0] = [-160.0, -160.0, 10.0, 0.0];
        maps.range[0] = [-500.0, 1000.0, -1e30, 1e30];
        let linear = |p: DVec3| 8.0 + 0.02 * p.x - 0.03 * p.z - 0.01 * p.y;
        for point in [DVec3::ZERO, DVec3::new(33.3, 120.0, -71.0), DVec3::new(-99.0, -7.0, 5.5)] {
            assert!(
                (between_texels(&maps, point, linear) - linear(point)).abs() < 1e-12,
                "{point}"
            );
            assert_eq!(between_texels(&maps, point, |_| 5000.0), MOST_DEPTH);
            assert_eq!(texel_side(&maps, point), 10.0);
        }
        // A step between two texels is halved in the middle of them.
        let step = |p: DVec3| if p.x > 0.0 { 1e4 } else { 0.0 };
        assert_eq!(between_texels(&maps, DVec3::ZERO, step), 0.5 * MOST_DEPTH);
        let outside = DVec3::X * 1e4;
        assert_eq!(
            (between_texels(&maps, outside, linear), texel_side(&maps, outside)),
            (0.0, 0.0)
        );
    }
}
