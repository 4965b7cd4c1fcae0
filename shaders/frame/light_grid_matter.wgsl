// Matter of the light grid: what the particles hold is spread over the cells of every level.
// Twin: src/frame/cpu/light_grid/matter.rs.
//
// Workgroup contract: `splat` one invocation a particle (sums of integers: no order), `splat_large` one
// workgroup a particle and level, of those that hold too many cells for an invocation.
#import cumuli::gpu_data::{Particle, ParticleCount}
#import cumuli::light_grid_data::{GridLevel, LightGridUniforms, grid_index}
#import cumuli::numerics::unfolded
#import cumuli::optical_depth::density_at
#import cumuli::quaternion::rotate

@group(0) @binding(0) var<uniform> grid: LightGridUniforms;
@group(0) @binding(1) var<storage, read> particles: array<Particle>;
@group(0) @binding(2) var<storage, read> particle_count: ParticleCount;
@group(0) @binding(3) var<storage, read> spread: array<f32>;               // by shape: radius of the even ball of the same moments
@group(0) @binding(4) var<storage, read_write> matter: array<atomic<u32>>; // counts of grid.quantum
@group(0) @binding(5) var<storage, read_write> large: array<atomic<u32>>;  // [0] how many, [1] of `splat_large`'s invocations those that a driver ended before their time, then particles

const PI: f32 = 3.14159265;
// Distance, m, below which a ball and a cell have the same middle: its direction does not matter then,
// since the width is at least that of the cell's shortest side.
const SAME_PLACE: f32 = 1e-6;
// Sum of shares of a ball that meets no cell: none gets any of it.
const LEAST_TOTAL: f32 = 1e-20;
// Cells of the box around a ball up to which one invocation spreads it: few enough for a watchdog, and for
// drivers that end all loops of an invocation after 65535 turns (lavapipe), on all levels together.
const MOST_CELLS: f32 = 2048.0;
// Mean side of a cell, in radii, from which on the first and the second filtered copy of a noise shape are read: a
// cell's mean is about that of a copy whose nodes are half a cell apart, and those of the shape are 2 / 63.
const COPY_SIDES = vec2<f32>(0.0898, 0.1796); // 4 / 63 times the roots of 2 and 8
// Share of a small ball's cells in those of a noise shape: where no cell's middle meets matter, that is where it goes.
const LEAST_SHARE: f32 = 1e-4;
const LARGE_WORKGROUP: u32 = 256u;
// Words of `large` before the particles.
const LARGE_HEAD: u32 = 2u;

// Share of a cell that a ball fills, roughly: linear in the distance between the centres over one
// cell's width. The sum over all cells is made exact by `splat`.
fn ball_share(ball: f32, offset: vec3<f32>, cell: vec3<f32>) -> f32 {
    let distance = length(offset);
    let width = max(dot(abs(offset), cell) / max(distance, SAME_PLACE), min(cell.x, min(cell.y, cell.z)));
    return clamp((ball - distance) / width + 0.5, 0.0, 1.0);
}

// How a particle is spread over the cells of a level.
struct Spread {
    ball: f32,          // m
    mass: f32,          // extinction times volume, m^2
    place: vec3<f32>,   // cells from the level's corner
    reach: vec3<f32>,   // cells that may get a share, to each side
    is_small: bool,     // linear between the nearest cells
    is_noise: bool,     // by the density at the middles of the cells
    meets: bool,        // the level
    is_large: bool,     // left to `splat_large`
    copy: u32,          // filtered copy of the density
}

fn spread_over(level: GridLevel, particle: Particle) -> Spread {
    let cell = level.cell.xyz;
    var s: Spread;
    s.ball = particle.radius * spread[min(particle.shape, grid.spreads - 1u)];
    s.mass = particle.optical_radius * particle.radius * particle.radius * (4.0 / 3.0 * PI);
    s.place = (particle.centre - level.low.xyz) / cell;
    s.is_small = s.ball < 0.75 * max(cell.x, max(cell.y, cell.z));
    s.is_noise = (particle.shape > 0u) & !s.is_small;
    // Small ones at least over the nearest cells.
    s.reach = select(max(select(s.ball, particle.radius, s.is_noise) / cell + 0.5, vec3(1.0)), vec3(1.0), s.is_small);
    let side = dot(cell, vec3(1.0 / 3.0)) / particle.radius;
    s.copy = select(0u, 1u, side > COPY_SIDES.x) + select(0u, 1u, side > COPY_SIDES.y);
    let size = vec3<f32>(level.size.xyz);
    s.meets = all(s.place + s.reach >= vec3(0.0)) & all(s.place - s.reach <= size);
    let box = 2.0 * s.reach + 1.0;
    s.is_large = box.x * box.y * box.z > MOST_CELLS;
    return s;
}

fn share_of(s: Spread, particle: Particle, cell: vec3<f32>, at: vec3<f32>) -> f32 {
    let away = s.place - at - 0.5;
    let hats = max(1.0 - abs(away), vec3(0.0));
    let hat = hats.x * hats.y * hats.z;
    if s.is_noise {
        let place = rotate(particle.orientation, -away * cell / particle.radius);
        return density_at(particle.shape, place, s.copy) + LEAST_SHARE * hat;
    }
    return select(ball_share(s.ball, away * cell, cell), hat, s.is_small);
}

// Sum of the shares of all cells of a large ball, wherever the level ends: the integral of the shares. The
// square of the ramp's width is its mean over all directions.
fn large_total(ball: f32, cell: vec3<f32>) -> f32 {
    let square = dot(cell, cell) / 3.0 + 4.0 / (3.0 * PI) * (cell.x * cell.y + cell.y * cell.z + cell.z * cell.x);
    return 4.0 / 3.0 * PI * ball * (ball * ball + 0.25 * square) / (cell.x * cell.y * cell.z);
}

fn add_share(level: GridLevel, at: vec3<f32>, share: f32) {
    if share > 0.0 {
        atomicAdd(&matter[grid_index(level, vec3<u32>(at))], u32(share + 0.5));
    }
}

@compute @workgroup_size(64)
fn splat(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= particle_count.particles {
        return;
    }
    let particle = particles[id.x];
    var large_somewhere = false;
    let levels = unfolded(grid.levels, arrayLength(&particles) == 0u);
    for (var l = 0u; l < levels; l++) {
        let level = grid.level[l];
        let cell = level.cell.xyz;
        let s = spread_over(level, particle);
        if !s.meets {
            continue;
        }
        if s.is_large {
            large_somewhere = true;
            continue;
        }
        let first = floor(s.place - s.reach);
        let last = floor(s.place + s.reach);
        var total = 0.0;
        for (var pass_index = 0u; pass_index < 2u; pass_index++) {
            let scale = s.mass / (max(total, LEAST_TOTAL) * cell.x * cell.y * cell.z * grid.quantum);
            // The sum runs over the whole ball, also where it sticks out of the level.
            let writes = pass_index == 1u;
            let begin = select(first, max(first, vec3(0.0)), writes);
            let end = select(last, min(last, vec3<f32>(level.size.xyz) - 1.0), writes);
            for (var z = begin.z; z <= end.z; z += 1.0) {
                for (var y = begin.y; y <= end.y; y += 1.0) {
                    for (var x = begin.x; x <= end.x; x += 1.0) {
                        let share = share_of(s, particle, cell, vec3(x, y, z));
                        if writes {
                            add_share(level, vec3(x, y, z), share * scale);
                        } else {
                            total += share;
                        }
                    }
                }
            }
        }
    }
    if large_somewhere {
        let slot = atomicAdd(&large[0], 1u) + LARGE_HEAD;
        if slot < arrayLength(&large) {
            atomicStore(&large[slot], id.x);
        }
    }
}

@compute @workgroup_size(LARGE_WORKGROUP)
fn splat_large(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let level = grid.level[group.y];
    let cell = level.cell.xyz;
    let count = min(atomicLoad(&large[0]), arrayLength(&large) - LARGE_HEAD);
    var is_cut = false;
    var i = group.x;
    for (; i < count; i += groups.x) {
        let particle = particles[atomicLoad(&large[i + LARGE_HEAD])];
        let s = spread_over(level, particle);
        if !(s.meets & s.is_large) {
            continue;
        }
        // A noise shape's density is its share: over so many cells their sum is the integral.
        let even = s.mass / (large_total(s.ball, cell) * cell.x * cell.y * cell.z);
        let scale = select(even, particle.extinction, s.is_noise) / grid.quantum;
        let first = max(floor(s.place - s.reach), vec3(0.0));
        let last = min(floor(s.place + s.reach), vec3<f32>(level.size.xyz) - 1.0);
        let extent = vec3<u32>(max(last - first + 1.0, vec3(0.0)));
        let cells = extent.x * extent.y * extent.z;
        var at = local;
        for (; at < cells; at += LARGE_WORKGROUP) {
            let here = first + vec3<f32>(vec3(at % extent.x, at / extent.x % extent.y, at / (extent.x * extent.y)));
            add_share(level, here, share_of(s, particle, cell, here) * scale);
        }
        is_cut = is_cut || at < cells;
    }
    if is_cut || i < count {
        atomicAdd(&large[1], 1u);
    }
}
