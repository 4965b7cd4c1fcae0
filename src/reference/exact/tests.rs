use bytemuck::Zeroable;
use glam::{DQuat, DVec4};

use super::*;
use crate::frame::cpu::light_grid::FieldSeen;
use crate::frame::cpu::segments::{compose, compose_exactly};
use crate::frame::gpu_data::{FrameUniforms, GridLevel, LightGridUniforms};
use crate::medium::{Halo, Phase, Truncation};
use crate::reference::Random;
use crate::tables::TableSet;

const PHASE: Phase = Phase::Mie { diameter_um: 20.0 };

/// Overlapping particles ahead, with light drawn at random, so that order shows.
fn cloud(tables: &TableSet, noise: bool) -> (Vec<Particle>, Vec<ParticleLight>) {
    let mut random = Random::new(11, 0, 0);
    (0..40u32)
        .map(|id| {
            let mut signed = || (2.0 * random.unit() - 1.0) as f32;
            let centre = [150.0 * signed(), 150.0 * signed(), -600.0 + 150.0 * signed()];
            let turn = DQuat::from_xyzw(signed().into(), signed().into(), signed().into(), 1.0);
            let mut four = |scale: f32| [0; 4].map(|_| scale * signed());
            // The clouds are those of older figures: two more were drawn then.
            let _ = [four(1.0), four(1.0)];
            let light = ParticleLight {
                sun_irradiance: four(1.0).map(f32::abs),
                ambient_above: four(0.1).map(f32::abs),
                ambient_below: four(0.1).map(f32::abs),
            };
            // None is alone.
            let light =
                ParticleLight { ambient_below: [light.ambient_below[0], 0.05, 0.05, 0.0], ..light };
            let (radius, extinction) = (40.0 + 80.0 * signed().abs(), 0.02 * signed().abs());
            let shape = if noise { 1 + id % 5 } else { 0 };
            let optical_radius = extinction * radius * tables.mean_density(shape) as f32;
            let orientation = turn.normalize().as_quat().to_array();
            (Particle { centre, radius, orientation, extinction, shape, id, optical_radius }, light)
        })
        .unzip()
}

fn uniforms() -> FrameUniforms {
    let truncation = Truncation::new(&PHASE);
    FrameUniforms {
        sun: [0.6, 0.64, 0.48, 0.0],
        albedo: 1.0,
        delta_scale: truncation.scale(1.0) as f32,
        halo_share: truncation.peak_depth(1.0) as f32,
        ..FrameUniforms::zeroed()
    }
}

/// A light field over the clouds that rises from corner to corner.
fn field() -> FieldSeen {
    let mut uniforms = LightGridUniforms { levels: 1, cells: 512, ..LightGridUniforms::zeroed() };
    uniforms.level[0] = GridLevel {
        low: [-400.0, -400.0, -1000.0, 0.0],
        cell: [100.0, 100.0, 100.0, 0.0],
        size: [8, 8, 8, 0],
    };
    let cell = |i: u32| {
        let [x, y, z] = [i % 8, i / 8 % 8, i / 64].map(f64::from);
        DVec4::new(0.01 * (1.0 + x), 0.05 * (y + z), 1.0, 1.0)
    };
    FieldSeen::new(uniforms, (0..512).map(cell).collect(), DVec3::ZERO)
}

/// An optical depth to the sun that is linear, so that pieces of any length have it right.
fn sun_depth(point: DVec3) -> f64 {
    2.0 + 0.002 * point.x - 0.001 * point.y + 0.001 * point.z
}

fn scene() -> Scene {
    Scene { sky: SkyOf::Uniform { radiance: 0.1 }, ..Scene::default() }
}

fn directions() -> impl Iterator<Item = DVec3> {
    (0..400).map(|i| {
        let (x, y) = (f64::from(i % 20) - 9.5, f64::from(i / 20) - 9.5);
        DVec3::new(0.04 * x, 0.04 * y, -1.0).normalize()
    })
}

/// With uniform particles the tables are exact and so are pieces between events.
#[test]
fn uniform_particles_as_the_other_compositor_has_them() {
    let tables = TableSet::embedded().expect("tables");
    let scattering = tables.scattering_for(&PHASE, 1.0).expect("built in");
    let (particles, lights) = cloud(&tables, false);
    let frame = uniforms();
    let (halo, field) = (Halo::new(&PHASE, &Truncation::new(&PHASE)), field());
    let inputs = || ChordInputs {
        frame: &frame,
        tables: &tables,
        scattering,
        phase: PHASE.prepare(),
        halo: &halo,
        field: &field,
        sun_depth: &sun_depth,
    };
    let exact =
        Exact::new(&scene(), inputs(), particles.clone(), lights.clone()).expect("particles");
    let mut seen = 0;
    for dir in directions() {
        let chords: Vec<_> = particles
            .iter()
            .zip(&lights)
            .filter_map(|(p, l)| inputs().chord(p, l, dir, f64::INFINITY))
            .collect();
        let (got, expected) =
            (exact.clouds(dir, f64::INFINITY), compose_exactly(&chords, &inputs().ray(dir)));
        seen += usize::from(expected.transmittance < 0.9);
        // The other one holds chords' shares in f32.
        assert!((got.transmittance - expected.transmittance).abs() < 1e-6, "{dir}");
        assert!((got.radiance - expected.radiance).length() < 1e-5, "{dir}");
        assert!((got.distance - expected.distance).abs() < 0.1, "{dir}");
    }
    assert!(seen > 100, "{seen} rays met clouds");
}

/// With noise shapes: against all particles marched in very small steps.
#[test]
fn noise_shapes_as_a_fine_march_has_them() {
    let tables = TableSet::embedded().expect("tables");
    let scattering = tables.scattering_for(&PHASE, 1.0).expect("built in");
    let (particles, lights) = cloud(&tables, true);
    let frame = uniforms();
    let (halo, field) = (Halo::new(&PHASE, &Truncation::new(&PHASE)), field());
    let phase = PHASE.prepare();
    let inputs = ChordInputs {
        frame: &frame,
        tables: &tables,
        scattering,
        phase,
        halo: &halo,
        field: &field,
        sun_depth: &sun_depth,
    };
    let exact = Exact::new(&scene(), inputs, particles, lights).expect("particles");
    for dir in directions().step_by(7) {
        let ray = Ray { origin: DVec3::ZERO, dir };
        let chords = exact.chords(&ray, f64::INFINITY);
        let lit = exact.inputs.ray(dir);
        const STEP: f64 = 0.05;
        let (mut depth, mut since_gap, mut radiance) = (0.0f64, 0.0, DVec3::ZERO);
        for i in 0..(1100.0 / STEP) as usize {
            let t = (i as f64 + 0.5) * STEP;
            let here = || chords.iter().filter(|c| (c.begin..c.end).contains(&t));
            let own = |chord: &Chord<'_>| STEP * chord.particle.extinction_at(ray.at(t));
            let tau: f64 = here().map(own).sum();
            if here().next().is_none() {
                since_gap = 0.0;
            }
            let before = Before { view: depth, since_gap };
            let piece = lit.piece(t - 0.5 * STEP, t + 0.5 * STEP, tau, 0.5, before);
            let light: DVec3 = here().map(|chord| own(chord) * piece.source(&chord.light)).sum();
            radiance += (-depth - 0.5 * tau).exp() * light;
            depth += tau;
            since_gap += tau;
        }
        let got = exact.clouds(dir, f64::INFINITY);
        // The march cuts ends of chords to its steps: a few times 0.05 m of 0.02 a metre.
        assert!((got.transmittance - (-depth).exp()).abs() < 1e-3, "{dir}: {got:?} {depth}");
        assert!((got.radiance - radiance).length() < 2e-3 * radiance.length().max(0.1), "{dir}");
    }
}

/// A frame's compositor with few open chords differs: the test above would see it.
#[test]
fn order_matters_in_these_clouds() {
    let tables = TableSet::embedded().expect("tables");
    let scattering = tables.scattering_for(&PHASE, 1.0).expect("built in");
    let (particles, lights) = cloud(&tables, false);
    let frame = uniforms();
    let (halo, field) = (Halo::new(&PHASE, &Truncation::new(&PHASE)), field());
    let phase = PHASE.prepare();
    let inputs = ChordInputs {
        frame: &frame,
        tables: &tables,
        scattering,
        phase,
        halo: &halo,
        field: &field,
        sun_depth: &sun_depth,
    };
    let most = directions()
        .map(|dir| {
            let mut chords: Vec<_> = particles
                .iter()
                .zip(&lights)
                .filter_map(|(p, l)| inputs.chord(p, l, dir, f64::INFINITY))
                .collect();
            chords.sort_by(|a, b| a.order.total_cmp(&b.order));
            let ray = inputs.ray(dir);
            let exact = compose_exactly(&chords, &ray).radiance;
            let off = compose(&chords, &ray, 1, 0.0).radiance - exact;
            off.length()
        })
        .fold(0.0, f64::max);
    assert!(most > 1e-3, "{most}");
}

/// Sunlight on a ball of a million optical depths, up to where the sun is low over its surface: it comes from a skin of a
/// millimetre, over which both ways are straight.
#[test]
fn light_of_an_opaque_ball_comes_from_its_skin() {
    const ALIKE: Phase = Phase::Hg { g: 0.0 };
    let tables = TableSet::embedded().expect("tables");
    // Nothing is alone here: any table does.
    let scattering = tables.scattering_for(&PHASE, 1.0).expect("built in");
    let truncation = Truncation::new(&ALIKE);
    let frame = FrameUniforms { delta_scale: 1.0, halo_share: 0.0, ..uniforms() };
    let (halo, field) = (Halo::new(&ALIKE, &truncation), FieldSeen::dark());
    let (centre, radius, extinction) = (DVec3::new(0.0, 0.0, -3000.0), 1000.0, 1000.0);
    let sun = DVec3::new(0.6, 0.64, 0.48);
    let ball = Particle {
        centre: centre.as_vec3().to_array(),
        radius: radius as f32,
        orientation: [0.0, 0.0, 0.0, 1.0],
        extinction: extinction as f32,
        shape: 0,
        id: 0,
        optical_radius: (extinction * radius) as f32,
    };
    let light = ParticleLight { sun_irradiance: [1.0; 4], ..ParticleLight::zeroed() };
    let depth = |point: DVec3| {
        let out = point - centre;
        let along = out.dot(sun);
        let rest = along * along - out.length_squared() + radius * radius;
        if rest > 0.0 { extinction * (rest.sqrt() - along).max(0.0) } else { 0.0 }
    };
    let inputs = || ChordInputs {
        frame: &frame,
        tables: &tables,
        scattering,
        phase: ALIKE.prepare(),
        halo: &halo,
        field: &field,
        sun_depth: &depth,
    };
    let exact = Exact::new(&scene(), inputs(), vec![ball], vec![light]).expect("a particle");
    let mut seen = 0;
    for dir in directions() {
        let middle = centre.dot(dir);
        let half = radius * radius - (centre - middle * dir).length_squared();
        if half <= 0.0 {
            continue;
        }
        let normal = ((middle - half.sqrt()) * dir - centre) / radius;
        let [to_sun, to_eye] = [normal.dot(sun), -normal.dot(dir)];
        if to_sun < 0.02 || to_eye < 0.02 {
            continue;
        }
        seen += 1;
        let expected = inputs().ray(dir).first / (1.0 + to_eye / to_sun);
        let got = exact.clouds(dir, f64::INFINITY).radiance.x;
        // Beside the ways' curvature, that depths change linearly over what is left of a step.
        assert!((got / expected - 1.0).abs() < 1e-3, "{to_sun} {to_eye}: {got} {expected}");
    }
    assert!(seen > 50, "{seen} rays");
}
