//! Twin of `shaders/frame/light_grid_matter.wgsl`.

use std::f64::consts::PI;

use glam::DVec3;

use super::GridLight;
use super::cells::{index, low, side};
use crate::frame::gpu_data::Particle;

impl GridLight {
    pub(super) fn splat(&mut self, particle: &Particle, spread: f64) {
        let radius = f64::from(particle.radius);
        let ball = radius * spread;
        let mass = f64::from(particle.optical_radius) * radius * radius * 4.0 / 3.0 * PI;
        let middle = DVec3::from_array(particle.centre.map(f64::from));
        for l in 0..self.levels() {
            let level = self.level(l);
            let cell = side(&level);
            let place = (middle - low(&level)) / cell;
            let reach = (ball / cell).max(DVec3::splat(0.5)) + 0.5;
            let size = DVec3::new(level.size[0].into(), level.size[1].into(), level.size[2].into());
            if (place + reach).min_element() < 0.0 || (place - reach).cmpgt(size).any() {
                continue;
            }
            let first = (place - reach).floor().as_i64vec3();
            let last = (place + reach).floor().as_i64vec3();
            let small = ball < 0.75 * cell.max_element();
            let share = |x: i64, y: i64, z: i64| {
                let away = place - DVec3::new(x as f64, y as f64, z as f64) - 0.5;
                if small {
                    let hat = (1.0 - away.abs()).max(DVec3::ZERO);
                    return hat.x * hat.y * hat.z;
                }
                let offset = away * cell;
                let distance = offset.length();
                let width = (offset.abs().dot(cell) / distance.max(1e-6)).max(cell.min_element());
                ((ball - distance) / width + 0.5).clamp(0.0, 1.0)
            };
            let mut all = Vec::new();
            for z in first.z..=last.z {
                for y in first.y..=last.y {
                    for x in first.x..=last.x {
                        all.push(([x, y, z], share(x, y, z)));
                    }
                }
            }
            let total: f64 = all.iter().map(|(_, s)| s).sum();
            let scale = mass / (total.max(1e-20) * cell.x * cell.y * cell.z);
            for (at, share) in all {
                if (0..3).all(|i| at[i] >= 0 && at[i] < i64::from(level.size[i])) {
                    let at = index(&level, at.map(|v| v as usize));
                    self.extinction[at] += share * scale;
                }
            }
        }
    }
}
