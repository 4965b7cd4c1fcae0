use std::f64::consts::PI;

use super::cells::{cells, centre, index, side};
use super::{CellLight, GridLight, positive};
use crate::frame::gpu_data::{GridLevel, LightGridUniforms};
use crate::frame::light_grid::{Directions, relaxations};
use glam::DVec3;

fn set_directions(uniforms: &mut LightGridUniforms, set: Directions) {
    uniforms.axes = set.axes().len() as u32;
    for (slot, axis) in uniforms.axis.iter_mut().zip(set.axes()) {
        *slot = axis.as_vec4().to_array();
    }
}

/// One level with a ragged cloud: two balls that overlap, of cells that hold no matter, little, or
/// up to this optical depth.
pub(super) fn ragged(thickest: f64) -> GridLight {
    let mut uniforms = <LightGridUniforms as bytemuck::Zeroable>::zeroed();
    let size = [11, 9, 10];
    uniforms.sun = [0.48, 0.6, 0.64, 0.0];
    uniforms.levels = 1;
    uniforms.cells = size.iter().product();
    set_directions(&mut uniforms, Directions::ThirtyTwo);
    uniforms.moment_first = 0.3;
    uniforms.moment_second = 0.1;
    uniforms.albedo = 1.0;
    uniforms.level[0] = GridLevel {
        low: [-55.0, -36.0, -45.0, 0.0],
        cell: [10.0, 8.0, 9.0, 0.0],
        size: [size[0], size[1], size[2], 0],
    };
    let mut grid = GridLight::empty(&uniforms);
    let level = grid.level(0);
    for cell in cells(&level) {
        let at = centre(&level, cell.map(|v| v as f64));
        let [x, y, z] = cell;
        let inside = at.distance(DVec3::new(-15.0, 0.0, 5.0)) < 32.0
            || at.distance(DVec3::new(22.0, 8.0, -8.0)) < 25.0;
        let ragged = ((x * 7 + y * 13 + z * 29) % 11) as f64 / 10.0;
        if inside {
            grid.extinction[index(&level, cell)] = ragged.powi(3) * thickest / 8.0;
        }
    }
    grid
}

/// Power of sunlight that the cells take, and of scattered sunlight that leaves, W per W/m^2.
fn taken_and_left(grid: &GridLight, leaves: &[CellLight]) -> (f64, f64) {
    let level = grid.level(0);
    let cell = side(&level);
    let volume = cell.x * cell.y * cell.z;
    let taken: f64 = grid.sun.iter().zip(&grid.extinction).map(|(sun, e)| sun * e * volume).sum();
    let left = (leaves.iter().enumerate())
        .map(|(d, light)| {
            let path = super::cells::Crossing::new(grid.direction(d), cell).path;
            light.x * 4.0 * PI * grid.weight(d) * volume / path
        })
        .sum();
    (taken, left)
}

#[test]
fn all_sunlight_that_is_taken_leaves() {
    for thickest in [0.3, 3.0, 12.0] {
        let mut grid = ragged(thickest);
        grid.start(0);
        let mut leaves = Vec::new();
        for step in relaxations(257, 0.0) {
            leaves = grid.turn(0, f64::from(step), false);
        }
        let (taken, left) = taken_and_left(&grid, &leaves);
        println!(
            "thickest cell {thickest}: {taken} taken, {left} left, ratio - 1 {:e}",
            left / taken - 1.0
        );
        assert!(taken > 100.0, "{taken}");
        // Converged to roundings, which a thousand cells add up. Light interpolated between planes of
        // cells (short characteristics): 3.7 % too much with the thinnest cells.
        assert!((left / taken - 1.0).abs() < 1e-12, "{thickest}: {left} of {taken}");
    }
}

#[test]
fn uniform_light_stays_uniform() {
    let mut grid = ragged(12.0);
    grid.start(0);
    for step in relaxations(17, 0.0) {
        grid.turn(0, f64::from(step), false);
    }
    for (light, extinction) in grid.lights.iter().zip(grid.extinction.iter().cycle()) {
        assert!((light.z - 1.0).abs() < 1e-12, "{} at {extinction}", light.z);
    }
}

/// Largest difference of the scattered sunlight from that of the converged solution, over its largest.
fn off(grid: &GridLight, converged: &GridLight) -> f64 {
    let pairs = grid.lights.iter().zip(&converged.lights);
    let off = pairs.map(|(a, b)| (a.x - b.x).abs()).fold(0.0, f64::max);
    off / converged.lights.iter().map(|l| l.x).fold(0.0, f64::max)
}

#[test]
fn relaxed_turns_converge_faster_than_plain_ones() {
    let solved = |steps: &[f32]| {
        let mut grid = ragged(6.0);
        grid.start(0);
        for step in steps {
            grid.turn(0, f64::from(*step), false);
        }
        grid
    };
    let converged = solved(&relaxations(257, 0.0));
    for turns in [5, 9, 17] {
        let plain = off(&solved(&vec![1.0; turns]), &converged);
        let relaxed = off(&solved(&relaxations(turns as u32, 0.0)), &converged);
        println!("{turns} turns: plain {plain:e}, relaxed {relaxed:e}");
        assert!(relaxed < plain, "{turns} turns: plain {plain}, relaxed {relaxed}");
    }
}

/// What is negative goes, and the sum stays; where nothing is, all stays to the bit.
#[test]
fn no_light_is_negative_and_none_is_lost() {
    let grid = ragged(0.0);
    let weights: Vec<f64> = (0..grid.directions()).map(|d| grid.weight(d)).collect();
    let mut scattered = vec![DVec3::new(1.0, 0.25, 0.0); grid.directions()];
    let mut result = scattered.clone();
    positive(&mut result, &weights);
    assert_eq!(result, scattered);
    (scattered[3].x, scattered[7].x) = (-0.5, -1.0);
    scattered[2].y = -1e9;
    result.clone_from(&scattered);
    positive(&mut result, &weights);
    assert!(result.iter().all(|s| s.min_element() >= 0.0), "{result:?}");
    let sum = |of: &[CellLight], axis: usize| -> f64 {
        of.iter().zip(&weights).map(|(s, w)| w * s[axis]).sum()
    };
    assert!((sum(&result, 0) - sum(&scattered, 0)).abs() < 1e-12);
    assert_eq!((sum(&result, 1), sum(&result, 2)), (0.0, 0.0), "less than nothing is nothing");
}

/// Sunlight falls off through even matter as it must, on into a coarser level, from wherever the sun shines.
#[test]
fn sunlight_falls_off_with_the_way_through_matter() {
    const EXTINCTION: f64 = 0.01;
    for sun in [DVec3::Y, DVec3::X, DVec3::new(0.48, 0.6, 0.64), DVec3::new(-0.6, 0.0, 0.8)] {
        let mut uniforms = <LightGridUniforms as bytemuck::Zeroable>::zeroed();
        uniforms.sun = [sun.x as f32, sun.y as f32, sun.z as f32, 0.0];
        uniforms.levels = 2;
        uniforms.widest = 1;
        uniforms.level[0] = GridLevel {
            low: [-40.0, -32.0, -36.0, 0.0],
            cell: [10.0, 8.0, 9.0, 0.0],
            size: [8, 8, 8, 0],
        };
        uniforms.level[1] = GridLevel {
            low: [-100.0, -32.0, -120.0, 0.0],
            cell: [20.0, 16.0, 24.0, 0.0],
            size: [10, 4, 10, 512],
        };
        uniforms.cells = 912;
        let mut grid = GridLight::empty(&uniforms);
        grid.extinction.fill(EXTINCTION);
        grid.start(1);
        grid.start(0);
        let half = DVec3::new(100.0, 32.0, 120.0);
        for l in 0..2 {
            let level = grid.level(l);
            for cell in cells(&level) {
                let at = centre(&level, cell.map(|v| v as f64));
                // Out of the whole box; within its cell the ray has half a chord.
                let out = |from: DVec3, size: DVec3| {
                    (0..3)
                        .map(|i| (size[i] - from[i] * sun[i].signum()) / sun[i].abs())
                        .fold(f64::INFINITY, f64::min)
                };
                let own = out(DVec3::ZERO, 0.5 * side(&level));
                let before = (-EXTINCTION * (out(at, half) - own)).exp();
                let chord = 2.0 * own * EXTINCTION;
                let expected = before * -(-chord).exp_m1() / chord;
                let found = grid.sun[index(&level, cell)];
                // The sun's direction is in f32.
                assert!(
                    (found / expected - 1.0).abs() < 1e-6,
                    "{sun} {cell:?}: {found} {expected}"
                );
            }
        }
    }
}

/// Above a level there is no matter: what coarser cells spread to there takes no sunlight from it. Beside it there is.
#[test]
fn matter_that_coarser_cells_spread_above_a_level_throws_no_shadow() {
    let slanted = DVec3::new(0.8, 0.6, 0.0);
    // With listed particles there may be.
    for (sun, has_above, is_lit) in
        [(DVec3::Y, 0, true), (slanted, 0, false), (DVec3::Y, 1, false), (slanted, 1, false)]
    {
        let mut uniforms = <LightGridUniforms as bytemuck::Zeroable>::zeroed();
        uniforms.sun = sun.extend(0.0).as_vec4().to_array();
        uniforms.levels = 2;
        uniforms.widest = 1;
        uniforms.has_above = has_above;
        let level = |low: [f32; 3], cell: f32, size: [u32; 3], first: u32| GridLevel {
            low: [low[0], low[1], low[2], 0.0],
            cell: [cell, cell, cell, 0.0],
            size: [size[0], size[1], size[2], first],
        };
        uniforms.level[0] = level([-20.0, 0.0, -20.0], 10.0, [4, 2, 4], 0);
        uniforms.level[1] = level([-200.0, 0.0, -20.0], 40.0, [10, 4, 1], 32);
        uniforms.cells = 72;
        let mut grid = GridLight::empty(&uniforms);
        // All of the coarse level's second layer, from 40 to 80 m.
        let coarse = grid.level(1);
        for cell in cells(&coarse).filter(|[_, y, _]| *y == 1) {
            grid.extinction[index(&coarse, cell)] = 1.0;
        }
        grid.start(0);
        let lit = |s: &f64| if is_lit { *s == 1.0 } else { *s < 1e-6 };
        let lowest: Vec<f64> = cells(&grid.level(0))
            .filter(|[x, y, _]| *x == 3 && *y == 0)
            .map(|cell| grid.sun[index(&grid.level(0), cell)])
            .collect();
        assert!(lowest.iter().all(lit), "{sun}: {lowest:?}");
    }
}

/// Rays do not spread: behind an opaque wall it is dark to the wall's edge, however far behind.
#[test]
fn a_shadow_keeps_its_edge() {
    let mut grid = ragged(0.0);
    grid.uniforms.sun = [0.0, 1.0, 0.0, 0.0];
    let level = grid.level(0);
    for cell in cells(&level) {
        let [x, y, _] = cell;
        let wall = y == 8 && x < 5;
        grid.extinction[index(&level, cell)] = if wall { 10.0 } else { 1e-9 };
    }
    grid.start(0);
    for cell in cells(&level).filter(|[_, y, _]| *y < 8) {
        let sun = grid.sun[index(&level, cell)];
        assert!(if cell[0] < 5 { sun < 1e-8 } else { sun > 0.999 }, "{cell:?}: {sun}");
    }
}
