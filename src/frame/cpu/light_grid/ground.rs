//! Light that reaches the ground, and what of it rises again: twin of
//! `shaders/frame/light_ground.wgsl`, where the method is told.

use std::f64::consts::PI;

use glam::DVec2;

use super::cells::{index, low, side};
use super::sweep::mean_transmittance;
use super::{GridLight, outside};
use crate::frame::gpu_data::GridLevel;

const ZENITHS: u32 = 3;
const AZIMUTHS: u32 = 4;
/// Least sine of the sun's height.
const LEAST_SUN: f64 = 0.01;
const MOST_SHARE: f64 = 100.0;

/// Light at the ground below a column.
#[derive(Clone, Copy)]
struct Fallen {
    beam: f64,
    scattered: f64,
    sky: f64,
}

/// Columns of a level, row by row.
fn columns(level: &GridLevel) -> impl Iterator<Item = [usize; 2]> + use<> {
    let [nx, _, nz, _] = level.size.map(|n| n as usize);
    (0..nz).flat_map(move |z| (0..nx).map(move |x| [x, z]))
}

fn flat(v: glam::DVec3) -> DVec2 {
    DVec2::new(v.x, v.z)
}

impl GridLight {
    fn fall(&self, level: &GridLevel, [x, z]: [usize; 2]) -> Fallen {
        let at = index(level, [x, 0, z]);
        let Some(slot) = self.light_at(0, at) else {
            return Fallen { beam: 1.0, scattered: 0.0, sky: 1.0 };
        };
        let (mut scattered, mut sky, mut sum, mut bare) = (0.0, 0.0, 0.0, 0.0);
        for d in 0..self.directions() {
            let down = self.weight(d) * (-self.direction(d).y).max(0.0);
            let light = self.lights[d * self.kept + slot];
            scattered += down * light.x;
            sky += down * light.y;
            sum += down;
            bare += down * outside(d, &self.uniforms).y;
        }
        let tau = self.extinction[at] * self.sun_path(level);
        let beam = self.sun[at] * (-tau).exp() / mean_transmittance(tau);
        Fallen { beam, scattered: PI * scattered / sum, sky: sky / bare }
    }

    fn fallen_at(&self, fallen: &[Vec<Fallen>], place: DVec2) -> Fallen {
        for (l, fallen) in fallen.iter().enumerate() {
            let level = self.level(l);
            let at = ((place - flat(low(&level))) / flat(side(&level))).floor();
            let size = DVec2::new(level.size[0].into(), level.size[2].into());
            if at.min_element() >= 0.0 && at.x < size.x && at.y < size.y {
                return fallen[at.y as usize * level.size[0] as usize + at.x as usize];
            }
        }
        Fallen { beam: 1.0, scattered: 0.0, sky: 1.0 }
    }

    /// Light of the ground as each column of each level sees it over that of bare ground: lit by the
    /// sun, by the sky.
    pub fn ground_shares(&self) -> Vec<Vec<[f64; 2]>> {
        let of_level = |l| {
            let level = self.level(l);
            columns(&level).map(|column| self.fall(&level, column)).collect()
        };
        let fallen: Vec<Vec<_>> = (0..self.levels()).map(of_level).collect();
        let sun = self.sun_direction();
        let sine = sun.y.max(LEAST_SUN);
        let shares = |level: &GridLevel, [x, z]: [usize; 2]| {
            let place =
                flat(low(level)) + (DVec2::new(x as f64, z as f64) + 0.5) * flat(side(level));
            let lowest = (low(level).y - f64::from(self.uniforms.sun[3])).max(0.0);
            let middle = lowest + 0.5 * f64::from(level.size[1]) * side(level).y;
            let from_sun = flat(sun) * (lowest / sine);
            let mut sum = [0.0; 2];
            for i in 0..ZENITHS {
                let cosine = (f64::from(i) + 0.5) / f64::from(ZENITHS);
                let away = middle * (1.0 - cosine * cosine).sqrt() / cosine;
                for j in 0..AZIMUTHS {
                    let turned = f64::from(j) + f64::from(i) / f64::from(ZENITHS);
                    let azimuth = 2.0 * PI * turned / f64::from(AZIMUTHS);
                    let seen = place + away * DVec2::from_angle(azimuth);
                    let diffuse = self.fallen_at(&fallen, seen);
                    let beam = self.fallen_at(&fallen, seen + from_sun).beam;
                    sum[0] += beam + diffuse.scattered / sine;
                    sum[1] += diffuse.sky;
                }
            }
            sum.map(|s| (s / f64::from(ZENITHS * AZIMUTHS)).min(MOST_SHARE))
        };
        let of_level = |l| {
            let level = self.level(l);
            columns(&level).map(|column| shares(&level, column)).collect()
        };
        (0..self.levels()).map(of_level).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::cells::cells;
    use super::super::tests::ragged;
    use super::*;

    /// Below a lowest layer that is dense, sunlight is what the whole way through it leaves.
    #[test]
    fn sunlight_falls_through_a_dense_lowest_layer() {
        for depth in [1e-6, 0.5, 5.0] {
            let mut grid = ragged(0.0);
            let level = grid.level(0);
            let path = grid.sun_path(&level);
            for cell in cells(&level).filter(|[_, y, _]| *y == 0) {
                grid.extinction[index(&level, cell)] = depth / path;
            }
            grid.uniforms.sun = [0.0, 1.0, 0.0, 0.0];
            let path = grid.sun_path(&level);
            grid.start(0);
            let expected = (-grid.extinction[index(&level, [3, 0, 4])] * path).exp();
            let found = grid.fall(&level, [3, 4]).beam;
            assert!((found / expected - 1.0).abs() < 1e-12, "{depth}: {found} {expected}");
        }
    }
}
