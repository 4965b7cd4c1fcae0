//! A guess at what all further orders would add: the diffusion approximation.
//!
//! Scattering orders that are summed one by one converge slowly because the slow part of the light
//! diffuses; diffusion is known in closed form along the zenith angle (Legendre polynomials) and
//! is a tridiagonal system along the radius. Known as diffusion synthetic acceleration (Alcouffe
//! 1977). It steers the iteration and leaves its fixed point alone.

use std::f64::consts::PI;

use super::grid::{FieldGrid, solve_tridiagonal};
use super::sweep::fine;

/// Legendre polynomials along the zenith angle: degrees below this.
const DEGREES: usize = 16;
/// Extrapolation length of the Milne problem, in transport mean free paths.
const EXTRAPOLATION: f64 = 0.7104;

/// The diffusion operator of a sphere on a grid.
pub struct Diffusion<'a> {
    grid: &'a FieldGrid,
    optical_radius: f64,
    albedo: f64,
    mean_cosine: f64,
    /// By zenith node and degree: polynomial, and its slope with the angle.
    polynomials: Vec<[(f64, f64); DEGREES]>,
    solid_angles: &'a [f64],
}

impl<'a> Diffusion<'a> {
    /// For a sphere of this optical radius; `solid_angles` are those of the grid's directions.
    pub fn new(
        grid: &'a FieldGrid,
        optical_radius: f64,
        albedo: f64,
        mean_cosine: f64,
        solid_angles: &'a [f64],
    ) -> Self {
        let polynomials =
            (0..grid.size.zenith).map(|j| legendre(grid.zenith_at(j as f64))).collect();
        Self { grid, optical_radius, albedo, mean_cosine, polynomials, solid_angles }
    }

    /// Adds to `emission` what all further orders make of `excess`, a small emission that it has
    /// just gained at each place, both by place, angle from the sun and fine azimuth.
    pub fn add(&self, excess: &[f32], emission: &mut [f32]) {
        let size = self.grid.size;
        let means = self.means(excess);
        let (values, slopes) = self.solve(&means);
        let turns = fine(size.azimuth);
        let outputs = size.view_sun * turns;
        let transport = self.optical_radius * (1.0 - self.albedo * self.mean_cosine);
        let directional = self.mean_cosine / transport;
        for place in 0..size.radius * size.zenith {
            let (i, j) = (place / size.zenith, place % size.zenith);
            let (mut light, mut outward, mut along) = (0.0, 0.0, 0.0);
            for (degree, (polynomial, slope)) in self.polynomials[j].iter().enumerate() {
                light += values[i * DEGREES + degree] * polynomial;
                outward += slopes[i * DEGREES + degree] * polynomial;
                along += values[i * DEGREES + degree] * slope;
            }
            along /= self.grid.radius_at(i as f64);
            let (s, c) = self.grid.zenith_at(j as f64).sin_cos();
            for view in 0..size.view_sun {
                let (st, ct) = self.grid.view_sun_at(view).sin_cos();
                for turn in 0..turns {
                    let across = st * (PI * turn as f64 / (turns - 1) as f64).cos();
                    let gradient = outward * (across * s + ct * c) + along * (across * c - ct * s);
                    // Light comes from where there is more of it.
                    let gained = self.albedo * (light + directional * gradient);
                    emission[place * outputs + view * turns + turn] += gained as f32;
                }
            }
        }
    }

    /// Means over all directions, by place.
    fn means(&self, excess: &[f32]) -> Vec<f64> {
        let size = self.grid.size;
        let turns = fine(size.azimuth);
        excess
            .chunks_exact(size.view_sun * turns)
            .map(|place| {
                let mut sum = 0.0;
                for (view, ring) in place.chunks_exact(turns).enumerate() {
                    // Every other of the fine azimuths is one of the grid's.
                    for (turn, value) in ring.iter().step_by(2).enumerate() {
                        sum += f64::from(*value) * self.solid_angles[view * size.azimuth + turn];
                    }
                }
                sum / (4.0 * PI)
            })
            .collect()
    }

    /// Mean intensity and its slope along the radius, by radius and degree, for an isotropic
    /// emission by place.
    fn solve(&self, emission: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let size = self.grid.size;
        let zeniths = self.grid.zenith_measures();
        let radii: Vec<f64> = (0..size.radius).map(|i| self.grid.radius_at(i as f64)).collect();
        let transport = self.optical_radius * (1.0 - self.albedo * self.mean_cosine);
        let diffusivity = 1.0 / (3.0 * transport);
        let absorption = self.optical_radius * (1.0 - self.albedo);
        let mut sources = vec![0.0; size.radius * DEGREES];
        for (place, value) in emission.iter().enumerate() {
            let (i, j) = (place / size.zenith, place % size.zenith);
            for degree in 0..DEGREES {
                let norm = (2 * degree + 1) as f64 / (4.0 * PI);
                sources[i * DEGREES + degree] +=
                    norm * zeniths[j] * value * self.polynomials[j][degree].0;
            }
        }
        // Shells around the nodes, cut half-way; the innermost is a ball. Their balance is exact
        // for a parabola, which elements with a consistent mass matrix miss by 3 % at the core.
        let faces: Vec<f64> = radii.windows(2).map(|r| 0.5 * (r[0] + r[1])).collect();
        let shell = |i: usize, antiderivative: fn(f64) -> f64| {
            let outer = if i > 0 { faces[i - 1] } else { radii[0] };
            antiderivative(outer) - faces.get(i).map_or(0.0, |inner| antiderivative(*inner))
        };
        let volumes: Vec<f64> = (0..size.radius).map(|i| shell(i, |r| r * r * r / 3.0)).collect();
        let mut values = vec![0.0; size.radius * DEGREES];
        for degree in 0..DEGREES {
            let turning = diffusivity * (degree * (degree + 1)) as f64;
            let mut diagonal: Vec<f64> = (0..size.radius)
                .map(|i| absorption * volumes[i] + turning * shell(i, |r| r))
                .collect();
            diagonal[0] += diffusivity * transport / EXTRAPOLATION;
            let mut beside = vec![0.0; size.radius - 1];
            for (cell, face) in faces.iter().enumerate() {
                let conductance = diffusivity * face * face / (radii[cell] - radii[cell + 1]);
                diagonal[cell] += conductance;
                diagonal[cell + 1] += conductance;
                beside[cell] -= conductance;
            }
            let mut load: Vec<f64> = (0..size.radius)
                .map(|i| self.optical_radius * volumes[i] * sources[i * DEGREES + degree])
                .collect();
            solve_tridiagonal(&diagonal, &beside, &mut load, 1);
            for (i, value) in load.into_iter().enumerate() {
                values[i * DEGREES + degree] = value;
            }
        }
        let slopes = (0..size.radius * DEGREES)
            .map(|at| {
                let (i, degree) = (at / DEGREES, at % DEGREES);
                let (a, b) = (i.saturating_sub(1), (i + 1).min(size.radius - 1));
                (values[a * DEGREES + degree] - values[b * DEGREES + degree])
                    / (radii[a] - radii[b])
            })
            .collect();
        (values, slopes)
    }
}

/// Legendre polynomials of the cosine of an angle, and their slopes with the angle.
fn legendre(angle: f64) -> [(f64, f64); DEGREES] {
    let (s, c) = angle.sin_cos();
    let mut out = [(1.0, 0.0); DEGREES];
    for degree in 1..DEGREES {
        let n = degree as f64;
        let before = out[degree - 1].0;
        let earlier = if degree > 1 { out[degree - 2].0 } else { 0.0 };
        let value = ((2.0 * n - 1.0) * c * before - (n - 1.0) * earlier) / n;
        // Even in the angle at both poles.
        let slope = if s.abs() > 1e-9 { n / s * (c * value - before) } else { 0.0 };
        out[degree] = (value, slope);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::scattering::bake::FieldSize;
    use crate::tables::scattering::mapping::ViewSunMap;

    #[test]
    fn uniform_emission_diffuses_to_the_closed_form() {
        // -D phi'' - 2 D phi' / r = R with phi + z phi' = 0 at 1: phi = R / (6 D) (1 - r^2 + 2 z).
        let size = FieldSize { radius: 24, zenith: 17, view_sun: 8, azimuth: 5 };
        for (optical_radius, mean_cosine) in [(5.0, 0.0), (80.0, 0.85)] {
            let grid = FieldGrid::new(size, ViewSunMap { lobe_scale: 0.5 }, optical_radius);
            let solid_angles = grid.solid_angles();
            let diffusion = Diffusion::new(&grid, optical_radius, 1.0, mean_cosine, &solid_angles);
            let (values, _) = diffusion.solve(&vec![1.0; size.radius * size.zenith]);
            let transport = optical_radius * (1.0 - mean_cosine);
            for i in 0..size.radius {
                let r = grid.radius_at(i as f64);
                let z = EXTRAPOLATION / transport;
                let want = optical_radius * transport * 0.5 * (1.0 - r * r + 2.0 * z);
                let got = values[i * DEGREES];
                // The balance of shells is exact for a parabola but for rounding.
                assert!((got / want - 1.0).abs() < 1e-6, "{r} {got} {want}");
                assert!(values[i * DEGREES + 1].abs() < 0.02 * want);
            }
        }
    }

    #[test]
    fn legendre_slopes_are_slopes() {
        for angle in [0.3, 1.2, 2.9] {
            let (low, high) = (legendre(angle - 1e-6), legendre(angle + 1e-6));
            for (degree, (_, slope)) in legendre(angle).iter().enumerate() {
                let want = (high[degree].0 - low[degree].0) / 2e-6;
                assert!((slope - want).abs() < 1e-6, "{angle} {degree} {slope} {want}");
            }
        }
    }
}
