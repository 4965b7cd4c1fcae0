// Matter of the light grid: what the particles hold is spread over the cells of every level.
// Twin: src/frame/cpu/light_grid/matter.rs.
//
// Workgroup contract: `splat` one invocation a particle (sums of integers: no order), `density` one a
// cell.
#import cumuli::gpu_data::{Particle, ParticleCount}
#import cumuli::light_grid_data::{LightGridUniforms, grid_index}
#import cumuli::numerics::unfolded

@group(0) @binding(0) var<uniform> grid: LightGridUniforms;
@group(0) @binding(1) var<storage, read> particles: array<Particle>;
@group(0) @binding(2) var<storage, read> particle_count: ParticleCount;
@group(0) @binding(3) var<storage, read> spread: array<f32>;               // by shape: radius of the even ball of the same moments
@group(0) @binding(4) var<storage, read_write> matter: array<atomic<u32>>; // counts of grid.quantum
@group(0) @binding(5) var<storage, read_write> extinction: array<f32>;     // 1/m

const PI: f32 = 3.14159265;
// Distance, m, below which a ball and a cell have the same middle: its direction does not matter then,
// since the width is at least that of the cell's shortest side.
const SAME_PLACE: f32 = 1e-6;
// Sum of shares of a ball that meets no cell: none gets any of it.
const LEAST_TOTAL: f32 = 1e-20;

// Share of a cell that a ball fills, roughly: linear in the distance between the centres over one
// cell's width. The sum over all cells is made exact by `splat`.
fn ball_share(ball: f32, offset: vec3<f32>, cell: vec3<f32>) -> f32 {
    let distance = length(offset);
    let width = max(dot(abs(offset), cell) / max(distance, SAME_PLACE), min(cell.x, min(cell.y, cell.z)));
    return clamp((ball - distance) / width + 0.5, 0.0, 1.0);
}

@compute @workgroup_size(64)
fn splat(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= particle_count.particles {
        return;
    }
    let particle = particles[id.x];
    let ball = particle.radius * spread[min(particle.shape, grid.spreads - 1u)];
    // Extinction times volume, m^2.
    let mass = particle.optical_radius * particle.radius * particle.radius * (4.0 / 3.0 * PI);
    let levels = unfolded(grid.levels, arrayLength(&particles) == 0u);
    for (var l = 0u; l < levels; l++) {
        let level = grid.level[l];
        let cell = level.cell.xyz;
        let place = (particle.centre - level.low.xyz) / cell;
        // At least the nearest cells, so that particles smaller than a cell are spread too.
        let reach = max(vec3(ball) / cell, vec3(0.5)) + 0.5;
        let last = vec3<f32>(level.size.xyz) - 1.0;
        if any(place + reach < vec3(0.0)) || any(place - reach > last + 1.0) {
            continue;
        }
        let first_cell = vec3<i32>(floor(place - reach));
        let last_cell = vec3<i32>(floor(place + reach));
        var total = 0.0;
        // Small balls: linear between the nearest cells.
        let small = ball < 0.75 * max(cell.x, max(cell.y, cell.z));
        for (var pass_index = 0u; pass_index < 2u; pass_index++) {
            let scale = mass / (max(total, LEAST_TOTAL) * cell.x * cell.y * cell.z * grid.quantum);
            // The sum runs over the whole ball, also where it sticks out of the level.
            var begin_cell = first_cell;
            var end_cell = last_cell;
            if pass_index == 1u {
                begin_cell = max(first_cell, vec3(0));
                end_cell = min(last_cell, vec3<i32>(last));
            }
            for (var z = begin_cell.z; z <= end_cell.z; z++) {
                for (var y = begin_cell.y; y <= end_cell.y; y++) {
                    for (var x = begin_cell.x; x <= end_cell.x; x++) {
                        let away = place - vec3(f32(x), f32(y), f32(z)) - 0.5;
                        let hat = max(1.0 - abs(away), vec3(0.0));
                        let share = select(ball_share(ball, away * cell, cell), hat.x * hat.y * hat.z, small);
                        if pass_index == 0u {
                            total += share;
                        } else if share > 0.0 {
                            let index = grid_index(level, vec3<u32>(vec3(x, y, z)));
                            atomicAdd(&matter[index], u32(share * scale + 0.5));
                        }
                    }
                }
            }
        }
    }
}

@compute @workgroup_size(64)
fn density(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < grid.cells {
        extinction[id.x] = f32(atomicLoad(&matter[id.x])) * grid.quantum;
    }
}
