//! Random particles with random light, as a screen tile lists them.

use crate::TABLES;
use bytemuck::Zeroable;
use cumuli::frame::cpu::light_grid::FieldSeen;
use cumuli::frame::gpu_data::{GridLevel, LightGridUniforms, Particle, ParticleLight};
use cumuli::reference::Random;
use glam::{DQuat, DVec3, DVec4, Vec3};

/// Particles with their light, nearest first, as a screen tile lists them.
pub(super) struct Cloud {
    pub(super) particles: Vec<Particle>,
    pub(super) lights: Vec<ParticleLight>,
    pub(super) field: FieldSeen,
    /// m; with ground where it is above 0.
    pub(super) altitude: f64,
}

/// `radii` and `depths` (optical, across the whole particle) are drawn logarithmically.
pub(super) struct Recipe {
    pub(super) count: usize,
    pub(super) centre: DVec3,
    pub(super) spread: f64,
    pub(super) radii: [f64; 2],
    pub(super) depths: [f64; 2],
    pub(super) noise: bool,
    pub(super) altitude: f64,
}

pub(super) const OUTSIDE: Recipe = Recipe {
    count: 60,
    centre: DVec3::new(0.0, 0.0, -600.0),
    spread: 150.0,
    radii: [40.0, 120.0],
    depths: [0.3, 6.0],
    noise: false,
    altitude: 0.0,
};

pub(super) fn cloud(recipe: &Recipe, seed: u64) -> Cloud {
    let mut random = Random::new(seed, 0, 0);
    let mut made: Vec<(Particle, ParticleLight)> = (0..recipe.count)
        .map(|i| {
            let mut signed = || (2.0 * random.unit() - 1.0) as f32;
            let mut four = |scale: f32| [0; 4].map(|_| scale * signed());
            let (sun_front, sun_behind) = (four(2.0), four(2.0));
            // The clouds are those of the figures below: two more were drawn then.
            let _ = (four(2.0), four(2.0));
            let light = ParticleLight {
                sun_front,
                sun_behind,
                sun_irradiance: four(1.0).map(f32::abs),
                ambient_above: four(0.1).map(f32::abs),
                ambient_below: four(0.1).map(f32::abs),
            };
            // One colour for all: in a frame it changes with the altitude alone, by less within a
            // block than is measured here. How much of a particle is alone differs.
            let light = ParticleLight {
                sun_irradiance: [0.9, 0.7, 0.5, 0.0],
                ambient_above: [0.05, 0.08, 0.1, 0.0],
                ambient_below: [0.04, 0.03, 0.02, light.ambient_below[3]],
                ..light
            };
            // Depths to the sun that stay above 0 over the whole particle: linear along chords.
            let light = ParticleLight {
                sun_front: [3.5, light.sun_front[1], light.sun_front[2], light.sun_front[3]],
                ..light
            };
            let orientation = DQuat::from_array(four(1.0).map(f64::from)).normalize().as_quat();
            let offset = DVec3::from_slice(&four(1.0).map(f64::from)) * recipe.spread;
            let mut between = |[low, high]: [f64; 2]| low * (high / low).powf(random.unit());
            let radius = between(recipe.radii);
            let extinction = between(recipe.depths) / (2.0 * radius);
            let shape = if recipe.noise { i as u32 % 6 } else { 0 };
            let particle = Particle {
                centre: (recipe.centre + offset).as_vec3().to_array(),
                radius: radius as f32,
                orientation: orientation.to_array(),
                extinction: extinction as f32,
                shape,
                id: i as u32,
                optical_radius: (extinction * radius * TABLES.mean_density(shape)) as f32,
            };
            (particle, light)
        })
        .collect();
    let key = |p: &Particle| (Vec3::from(p.centre).length() - p.radius).max(0.0);
    made.sort_by(|a, b| key(&a.0).total_cmp(&key(&b.0)));
    let (particles, lights) = made.into_iter().unzip();
    Cloud { particles, lights, field: field(recipe), altitude: recipe.altitude }
}

/// A light field over the whole of a recipe's cloud that rises from corner to corner: linear, so that
/// what is left between the compositors is how they order matter.
pub(super) fn field(recipe: &Recipe) -> FieldSeen {
    let reach = 2.0 * (recipe.spread + recipe.radii[1]);
    let low = (recipe.centre - reach).as_vec3();
    let side = (2.0 * reach / f64::from(FIELD_CELLS)) as f32;
    let cells = FIELD_CELLS.pow(3);
    let mut uniforms = LightGridUniforms { levels: 1, cells, ..LightGridUniforms::zeroed() };
    uniforms.level[0] = GridLevel {
        low: low.extend(0.0).to_array(),
        cell: [side, side, side, 0.0],
        size: [FIELD_CELLS, FIELD_CELLS, FIELD_CELLS, 0],
    };
    let cell = |i: u32| {
        let at = [i % FIELD_CELLS, i / FIELD_CELLS % FIELD_CELLS, i / FIELD_CELLS.pow(2)];
        let [x, y, z] = at.map(f64::from);
        // Multiples of 2^-6: f16 holds them exactly.
        DVec4::new((1.0 + x) / 64.0, y / 16.0, 1.0, 2.0 + z / 4.0)
    };
    FieldSeen::new(uniforms, (0..cells).map(cell).collect(), DVec3::ZERO)
}

/// Cells of the field along each axis.
pub(super) const FIELD_CELLS: u32 = 8;

pub(super) fn cases() -> [(&'static str, Recipe); 7] {
    [
        ("outside", OUTSIDE),
        ("noise", Recipe { noise: true, depths: [1.0, 20.0], ..OUTSIDE }),
        ("inside", Recipe { centre: DVec3::ZERO, noise: true, ..OUTSIDE }),
        ("ground", Recipe { altitude: 60.0, ..OUTSIDE }),
        ("many", Recipe { count: 500, depths: [0.03, 1.0], ..OUTSIDE }),
        (
            "tiny",
            Recipe { radii: [1e-3, 10.0], spread: 1.0, centre: DVec3::NEG_Z * 5.0, ..OUTSIDE },
        ),
        ("huge", Recipe { radii: [100.0, 1e5], spread: 3e4, depths: [0.1, 3.0], ..OUTSIDE }),
    ]
}
