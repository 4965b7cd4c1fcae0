//! Random particles with random light, as a screen tile lists them.

use crate::TABLES;
use bytemuck::Zeroable;
use cumuli::frame::Lighting;
use cumuli::frame::cpu::light_grid::FieldSeen;
use cumuli::frame::cpu::shadow::Maps;
use cumuli::frame::gpu_data::{
    GridLevel, LightGridUniforms, Particle, ParticleLight, ShadowUniforms,
};
use cumuli::frame::view::{Bounds, shadow_uniforms};
use cumuli::reference::Random;
use glam::{DQuat, DVec3, DVec4, Vec3};

/// Particles with their light, nearest first, as a screen tile lists them.
pub(super) struct Cloud {
    pub(super) particles: Vec<Particle>,
    pub(super) lights: Vec<ParticleLight>,
    pub(super) field: FieldSeen,
    /// Optical depth to the sun.
    pub(super) shadow: Shadow,
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
            // The clouds are those of older figures: four more were drawn then.
            let _ = [four(2.0), four(2.0), four(2.0), four(2.0)];
            // One colour for all: in a frame it changes with the altitude alone, by less within a
            // block than is measured here. How much of a particle is alone differs.
            let _ = [four(1.0), four(0.1)];
            let light = ParticleLight {
                sun_irradiance: [0.9, 0.7, 0.5, 0.0],
                ambient_above: [0.05, 0.08, 0.1, 0.0],
                ambient_below: [0.04, 0.03, 0.02, four(0.1)[3].abs()],
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
    Cloud {
        particles,
        lights,
        field: field(recipe),
        shadow: Shadow::new(recipe),
        altitude: recipe.altitude,
    }
}

/// Deep shadow maps over the whole of a recipe's cloud, of matter that waves.
pub(super) struct Shadow {
    pub(super) maps: ShadowUniforms,
    pub(super) texels: Vec<[u32; 4]>,
}

/// Texels of a map along each axis.
const SHADOW_TEXELS: u32 = 24;

impl Shadow {
    fn new(recipe: &Recipe) -> Self {
        let reach = recipe.spread + recipe.radii[1];
        let bounds = Bounds {
            low: recipe.centre - reach,
            high: recipe.centre + reach,
            detail: reach,
            finest: reach,
            closest: f64::INFINITY,
            around_camera: false,
        };
        let maps = shadow_uniforms(sun(), &bounds, DVec3::ZERO, None, SHADOW_TEXELS, true, false);
        let texel = |i: u32| {
            let [x, y] = [i % SHADOW_TEXELS, i / SHADOW_TEXELS % SHADOW_TEXELS].map(f64::from);
            let first = 0.2 + 0.1 * (0.4 * x).sin() + 0.1 * (0.3 * y).cos();
            let at = [0.0, 0.08, 0.15, 0.2, 0.3, 0.5, 0.7].map(|step| first + 0.5 * step);
            let half = |x: f64| (x * 65_535.0).round() as u32;
            let pair = |a: f64, b: f64| half(a) | (half(b) << 16);
            [
                pair(at[0], at[1]),
                pair(at[2], at[3]),
                pair(at[4], at[5]),
                pair(at[6], 0.5 * (first + 0.9)),
            ]
        };
        let count = maps.maps * SHADOW_TEXELS * SHADOW_TEXELS;
        Self { maps, texels: (0..count).map(texel).collect() }
    }

    /// Of a point, m from the eye.
    pub(super) fn depth(&self, point: DVec3, lighting: Lighting) -> f64 {
        let maps = Maps { uniforms: &self.maps, texels: &self.texels };
        match lighting {
            Lighting::Octaves => maps.depth_for_octaves(point),
            Lighting::Grid | Lighting::Alone => maps.depth(point),
        }
    }
}

/// Towards the sun.
pub(super) fn sun() -> DVec3 {
    DVec3::new(0.4, 0.7, -0.3).normalize()
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
        DVec4::new((1.0 + x) / 64.0, (y + z) / 32.0, 1.0, 1.0)
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
