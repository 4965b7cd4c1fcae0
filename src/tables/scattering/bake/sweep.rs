//! Light along straight flights through the grid: the operator between two scatterings.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::super::single::opacity;
use super::GaussRule;
use super::grid::FieldGrid;

/// Points along a flight, spread evenly over the light that arrives.
const POINTS: usize = 8;
/// Points of the rule over the local zenith angle that corrects each place's share of escape.
const ESCAPE_POINTS: usize = 24;

/// Light scattered at each place against each direction, by direction's angle from the sun,
/// radius, zenith angle, azimuth. Azimuths are twice as fine as the grid's and read linearly;
/// between radii and zenith angles a parabola is read: in thick spheres, where a mean free path is
/// much shorter than a cell, linear reading would act like diffusion many times the true one.
pub struct Emission {
    nodes: Vec<Node>,
    size: [usize; 3],
}

/// A value and its second differences along radius and zenith angle.
#[derive(Clone, Copy)]
struct Node {
    value: f32,
    bend_radius: f32,
    bend_zenith: f32,
}

impl Emission {
    /// From values by radius, zenith angle, `angles` angles from the sun, and fine azimuth.
    pub fn new(grid: &FieldGrid, values: &[f32], angles: usize) -> Self {
        let size = grid.size;
        let turns = fine(size.azimuth);
        let slices: Vec<Vec<Node>> = (0..angles)
            .into_par_iter()
            .map(|angle| {
                let at = |i: usize, j: usize, k: usize| {
                    values[((i * size.zenith + j) * angles + angle) * turns + k]
                };
                let mut nodes = Vec::with_capacity(size.radius * size.zenith * turns);
                for i in 0..size.radius {
                    // At the ends the parabola of the last cells but one goes on.
                    let middle = i.clamp(1, size.radius - 2);
                    for j in 0..size.zenith {
                        for k in 0..turns {
                            // Across the axis the place's azimuth turns by half a circle.
                            let back = turns - 1 - k;
                            let low = if j > 0 { at(i, j - 1, k) } else { at(i, 1, back) };
                            let high = if j + 1 < size.zenith {
                                at(i, j + 1, k)
                            } else {
                                at(i, size.zenith - 2, back)
                            };
                            let value = at(i, j, k);
                            nodes.push(Node {
                                value,
                                bend_radius: bend(
                                    at(middle - 1, j, k),
                                    at(middle, j, k),
                                    at(middle + 1, j, k),
                                ),
                                bend_zenith: bend(low, value, high),
                            });
                        }
                    }
                }
                nodes
            })
            .collect();
        Self { nodes: slices.concat(), size: [size.radius, size.zenith, turns] }
    }

    /// The values against the directions at one angle from the sun.
    fn slice(&self, angle: usize) -> &[Node] {
        let len = self.size.iter().product::<usize>();
        &self.nodes[angle * len..][..len]
    }

    /// Value at a point against a direction at a node's angle from the sun.
    pub fn at(&self, angle: usize, point: Point) -> f32 {
        point.read(self.slice(angle), self.strides())
    }

    fn strides(&self) -> [usize; 2] {
        [self.size[1] * self.size[2], self.size[2]]
    }
}

/// Nodes of an axis refined twofold.
pub fn fine(count: usize) -> usize {
    2 * count - 1
}

/// Second difference, no larger than twice the lesser slope where both slopes have one sign: next
/// to a shadow's edge the parabola would swing below zero.
fn bend(low: f32, middle: f32, high: f32) -> f32 {
    let (before, after) = (middle - low, high - middle);
    let bend = after - before;
    if before * after > 0.0 {
        let most = 2.0 * before.abs().min(after.abs());
        bend.clamp(-most, most)
    } else {
        bend
    }
}

/// A point on the grid of an [`Emission`]: the cell and the shares of the upper neighbours.
#[derive(Clone, Copy)]
pub struct Point {
    base: u32,
    radius: f32,
    zenith: f32,
    azimuth: f32,
}

impl Point {
    /// Of a place at a distance from the centre, the cosine of its angle from the sun axis, and
    /// the cosine of a direction's azimuth relative to the place's.
    pub fn new(grid: &FieldGrid, radius: f64, zenith: f64, azimuth: f64) -> Self {
        let size = grid.size;
        let (zeniths, turns) = (size.zenith, fine(size.azimuth));
        let i = split(grid.radius_index(radius), size.radius);
        let j = split(acos(zenith) / PI * (zeniths - 1) as f64, zeniths);
        let k = split(acos(azimuth) / PI * (turns - 1) as f64, turns);
        let base = (i.0 * zeniths + j.0) * turns + k.0;
        Self { base: base as u32, radius: i.1, zenith: j.1, azimuth: k.1 }
    }

    fn read(&self, slice: &[Node], [radius, zenith]: [usize; 2]) -> f32 {
        let base = self.base as usize;
        let pair = |at: usize| {
            let (low, high) = (slice[at].value, slice[at + 1].value);
            low + self.azimuth * (high - low)
        };
        let line = |at: usize| {
            let (a, b) = (pair(at), pair(at + zenith));
            a + self.zenith * (b - a)
        };
        let (a, b) = (line(base), line(base + radius));
        let linear = a + self.radius * (b - a);
        let step = |share: f32, stride: usize| if share > 0.5 { stride } else { 0 };
        let near = slice
            [base + step(self.radius, radius) + step(self.zenith, zenith) + step(self.azimuth, 1)];
        linear
            - 0.5 * self.radius * (1.0 - self.radius) * near.bend_radius
            - 0.5 * self.zenith * (1.0 - self.zenith) * near.bend_zenith
    }
}

/// Flights from every place of a grid in every direction.
pub struct Flights {
    /// By angle from the sun, place, azimuth, point.
    points: Vec<Point>,
    /// Opacity of each flight up to the surface, by angle from the sun, place, azimuth.
    opacities: Vec<f32>,
    weights: [f32; POINTS],
}

impl Flights {
    /// Works out where all flights go. `solid_angles` are those of the grid's directions.
    pub fn new(grid: &FieldGrid, optical_radius: f64, solid_angles: &[f64]) -> Self {
        let size = grid.size;
        let rule = flight_rule(POINTS);
        let (points, opacities): (Vec<Vec<Point>>, Vec<Vec<f32>>) = (0..size.view_sun)
            .into_par_iter()
            .map(|angle| {
                let rows = size.radius * size.zenith * size.azimuth;
                let mut points = Vec::with_capacity(rows * POINTS);
                let mut opacities = Vec::with_capacity(rows);
                let (st, ct) = grid.view_sun_at(angle).sin_cos();
                for place in 0..size.radius * size.zenith {
                    let radius = grid.radius_at((place / size.zenith) as f64);
                    let (s, c) = grid.zenith_at((place % size.zenith) as f64).sin_cos();
                    let x = [radius * s, radius * c];
                    let inside = ((1.0 - radius) * (1.0 + radius)).max(0.0);
                    for turn in 0..size.azimuth {
                        let (sp, cp) = (PI * turn as f64 / (size.azimuth - 1) as f64).sin_cos();
                        let exit = exit_distance(inside, x[0] * st * cp + x[1] * ct);
                        let opaque = opacity(optical_radius * exit);
                        opacities.push(opaque as f32);
                        for &(u, _) in &rule {
                            let t = (-(-u * opaque).ln_1p() / optical_radius).min(exit);
                            let y = [x[0] + t * st * cp, t * st * sp, x[1] + t * ct];
                            let across2 = y[0] * y[0] + y[1] * y[1];
                            let r = (across2 + y[2] * y[2]).sqrt();
                            // The direction keeps its angle from the sun; its azimuth is counted
                            // from the place's own.
                            let toward = (y[0] * cp + y[1] * sp) / across2.sqrt().max(1e-12);
                            points.push(Point::new(grid, r, y[2] / r.max(1e-12), toward));
                        }
                    }
                }
                (points, opacities)
            })
            .unzip();
        let mut weights = [0.0; POINTS];
        for (w, &(_, weight)) in weights.iter_mut().zip(&rule) {
            *w = weight as f32;
        }
        let mut flights = Self { points: points.concat(), opacities: opacities.concat(), weights };
        flights.conserve(grid, optical_radius, solid_angles);
        flights
    }

    /// Scales the flights of each place so that the share of light which does not escape from it
    /// is exact: directions at the horizon are cut by the grid's cells.
    fn conserve(&mut self, grid: &FieldGrid, optical_radius: f64, solid_angles: &[f64]) {
        let size = grid.size;
        let places = size.radius * size.zenith;
        let mut sums = vec![0.0; places];
        for (row, opacity) in self.opacities.iter().enumerate() {
            let (angle, turn) = (row / (places * size.azimuth), row % size.azimuth);
            sums[row / size.azimuth % places] +=
                f64::from(*opacity) * solid_angles[angle * size.azimuth + turn] / (4.0 * PI);
        }
        let factors: Vec<f32> = sums
            .iter()
            .enumerate()
            .map(|(place, sum)| {
                let radius = grid.radius_at((place / size.zenith) as f64);
                (mean_opacity(radius, optical_radius) / sum) as f32
            })
            .collect();
        for (row, opacity) in self.opacities.iter_mut().enumerate() {
            *opacity *= factors[row / size.azimuth % places];
        }
    }

    /// Light that arrives at each place from each direction: by place, angle from the sun,
    /// azimuth.
    pub fn arriving(&self, grid: &FieldGrid, emission: &Emission) -> Vec<f32> {
        let size = grid.size;
        let places = size.radius * size.zenith;
        let strides = emission.strides();
        let slices: Vec<Vec<f32>> = (0..size.view_sun)
            .into_par_iter()
            .map(|angle| {
                let slice = emission.slice(angle);
                let rows = places * size.azimuth;
                let opacities = &self.opacities[angle * rows..][..rows];
                self.points[angle * rows * POINTS..][..rows * POINTS]
                    .chunks_exact(POINTS)
                    .zip(opacities)
                    .map(|(points, opacity)| {
                        let sum: f32 = points
                            .iter()
                            .zip(&self.weights)
                            .map(|(point, weight)| weight * point.read(slice, strides))
                            .sum();
                        opacity * sum
                    })
                    .collect()
            })
            .collect();
        let mut out = Vec::with_capacity(places * size.directions());
        for place in 0..places {
            for slice in &slices {
                out.extend_from_slice(&slice[place * size.azimuth..][..size.azimuth]);
            }
        }
        out
    }

    /// Opacity of the flight from a place in a direction, with the correction of the place.
    pub fn opacity(&self, grid: &FieldGrid, place: usize, direction: usize) -> f64 {
        let size = grid.size;
        let (angle, turn) = (direction / size.azimuth, direction % size.azimuth);
        let row = (angle * size.radius * size.zenith + place) * size.azimuth + turn;
        self.opacities[row].into()
    }
}

/// Shares of the light that arrives along a flight from before each point, and their weights:
/// Gauss's rule in the root of what is left. In the share itself the place has a logarithmic
/// singularity at its end, which costs 8 points 0.5 % of the light at optical radii above 4.
pub fn flight_rule(points: usize) -> Vec<(f64, f64)> {
    let rule = GaussRule::new(points);
    rule.points.iter().map(|&(v, w)| (v * (2.0 - v), 2.0 * w * (1.0 - v))).collect()
}

/// Inverse cosine, error below 7e-5 rad (Abramowitz and Stegun 4.4.45): a thousandth of a cell.
fn acos(c: f64) -> f64 {
    let a = c.abs().min(1.0);
    let p =
        (1.0 - a).sqrt() * (1.570_728_8 + a * (-0.212_114_4 + a * (0.074_261 - 0.018_729_3 * a)));
    if c < 0.0 { PI - p } else { p }
}

fn split(at: f64, count: usize) -> (usize, f32) {
    let index = (at as usize).min(count - 2);
    (index, (at - index as f64).clamp(0.0, 1.0) as f32)
}

/// Distance to the surface from a place with 1 - r^2 = `inside` in a direction with place times
/// direction = `along`.
fn exit_distance(inside: f64, along: f64) -> f64 {
    let root = (along * along + inside).sqrt();
    // Rationalised where the difference would cancel.
    if along > 0.0 { inside / (root + along) } else { root - along }
}

/// Mean over all directions of the opacity between a place and the surface.
pub fn mean_opacity(radius: f64, optical_radius: f64) -> f64 {
    let rule = GaussRule::new(ESCAPE_POINTS);
    let inside = ((1.0 - radius) * (1.0 + radius)).max(0.0);
    let at = |cosine: f64| opacity(optical_radius * exit_distance(inside, radius * cosine));
    // Graded towards the horizon, where flights just below the surface lengthen quickly.
    [-1.0, 1.0]
        .into_iter()
        .map(|side| rule.integrate(0.0, 1.0, |u| 0.5 * at(side * u * u * u) * 3.0 * u * u))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::scattering::bake::FieldSize;
    use crate::tables::scattering::mapping::ViewSunMap;

    #[test]
    fn mean_opacity_has_its_limits() {
        // At the centre all flights are one radius long; at the surface half of them are 0 and
        // the others chords: 1/2 (1 - (1 - exp(-2R)) / (2R)).
        for r in [0.1f64, 2.0, 30.0] {
            assert!((mean_opacity(0.0, r) - opacity(r)).abs() < 1e-9);
            let surface = 0.5 * (1.0 - opacity(2.0 * r) / (2.0 * r));
            assert!((mean_opacity(1.0, r) - surface).abs() < 1e-6, "{r}");
        }
    }

    #[test]
    fn flights_through_a_smooth_emission_are_its_integral() {
        let size = FieldSize { radius: 14, zenith: 19, view_sun: 12, azimuth: 9 };
        let optical_radius = 3.0;
        let grid = FieldGrid::new(size, ViewSunMap { lobe_scale: 0.5 }, optical_radius);
        // Emission that depends on the place only, smooth through the centre.
        let emitted = |x: glam::DVec3| 1.0 + 0.4 * x.z + 0.3 * (x.x * x.x + x.y * x.y);
        let turns = fine(size.azimuth);
        let mut values = Vec::new();
        for place in 0..size.radius * size.zenith {
            let r = grid.radius_at((place / size.zenith) as f64);
            let (s, c) = grid.zenith_at((place % size.zenith) as f64).sin_cos();
            let value = emitted(glam::DVec3::new(r * s, 0.0, r * c)) as f32;
            values.extend(std::iter::repeat_n(value, size.view_sun * turns));
        }
        let solid_angles = grid.solid_angles();
        let flights = Flights::new(&grid, optical_radius, &solid_angles);
        let emission = Emission::new(&grid, &values, size.view_sun);
        let got = flights.arriving(&grid, &emission);
        let rule = GaussRule::new(64);
        for place in 0..size.radius * size.zenith {
            let r = grid.radius_at((place / size.zenith) as f64);
            let (s, c) = grid.zenith_at((place % size.zenith) as f64).sin_cos();
            let x = glam::DVec3::new(r * s, 0.0, r * c);
            let inside = (1.0 - r * r).max(0.0);
            let light = |w: glam::DVec3| {
                rule.integrate(0.0, exit_distance(inside, x.dot(w)), |t| {
                    optical_radius * (-optical_radius * t).exp() * emitted(x + t * w)
                })
            };
            let mut total = 0.0;
            for direction in 0..size.directions() {
                let (st, ct) = grid.view_sun_at(direction / size.azimuth).sin_cos();
                let turn = PI * (direction % size.azimuth) as f64 / (size.azimuth - 1) as f64;
                let w = glam::DVec3::new(st * turn.cos(), st * turn.sin(), ct);
                let got = f64::from(got[place * size.directions() + direction]);
                total += got * solid_angles[direction] / (4.0 * PI);
                // The correction of a place's escape is five per cent at the surface of this coarse
                // grid: it belongs to the sum over directions, which is checked below.
                let opaque = opacity(optical_radius * exit_distance(inside, x.dot(w)));
                if opaque > 0.0 {
                    let got = got * opaque / flights.opacity(&grid, place, direction);
                    let want = light(w);
                    // Parabolas over cells of 10 degrees, and 8 points.
                    assert!((got - want).abs() < 0.01 * want.max(0.1), "{r} {c} {w} {got} {want}");
                }
            }
            // All directions, about the vertical, graded towards the horizon as the escape is.
            let up = x.try_normalize().unwrap_or(glam::DVec3::Z);
            let (u, v) = up.any_orthonormal_pair();
            let few = GaussRule::new(24);
            let want: f64 = [-1.0, 1.0]
                .into_iter()
                .map(|side| {
                    few.integrate(0.0, 1.0, |q| {
                        let cosine: f64 = side * q * q * q;
                        let sine = (1.0 - cosine * cosine).sqrt();
                        let ring: f64 = (0..16)
                            .map(|k| {
                                let (a, b) = (PI * f64::from(k) / 8.0).sin_cos();
                                light(cosine * up + sine * (a * u + b * v)) / 16.0
                            })
                            .sum();
                        0.5 * 3.0 * q * q * ring
                    })
                })
                .sum();
            assert!((total / want - 1.0).abs() < 0.005, "{r} {c} {total} {want}");
        }
    }
}
