//! Light at the particles against sums over all particles, without lists, in double precision.

use bytemuck::Zeroable;
use cumuli::frame::Lighting;
use cumuli::frame::cpu;
use cumuli::frame::cpu::lighting::aloneness;
use cumuli::frame::gpu_data::{GridLevel, LightGridUniforms, LightView, Particle, ParticleLight};
use cumuli::frame::light::LightPass;
use cumuli::frame::light_grid::{GridMedium, LightGridPass, Spreads};
use cumuli::frame::sky::{SkyInputs, SkyKind, SkyPass};
use cumuli::frame::view::{Bounds, light_view};
use cumuli::gpu::buffers;
use cumuli::medium::halo::{HALO_COLUMNS, HALO_ROWS};
use cumuli::medium::{Halo, Phase};
use cumuli::scene::Camera;
use cumuli::tables::TablesGpu;
use glam::{DQuat, DVec3, Vec3};

use crate::common::{Random, gpu, library, submit, tables};
use crate::pictures::{Population, ball, frame};

const SKY_RADIANCE: f32 = 0.25;
const SUN_IRRADIANCE: f32 = 1.5;

/// The built-in tables on the device; any medium they hold.
pub fn tables_on_device() -> TablesGpu {
    let phase = Phase::hg(0.85).expect("a phase function");
    TablesGpu::new(gpu(), tables(), &phase, 1.0).expect("tables on the device")
}

/// Overlapping particles around a point, of the first `shapes` shapes of the tables.
pub fn clump(centre: DVec3, spread: f64, shapes: u32, random: &mut Random) -> Vec<Particle> {
    (0..80)
        .map(|i| {
            let offset = random.direction() * spread * random.uniform().cbrt();
            let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 3.0));
            Particle {
                orientation: turn.as_quat().to_array(),
                shape: i % shapes,
                ..ball(centre + offset, random.between(40.0, 150.0), random.between(0.003, 0.02))
            }
        })
        .collect()
}

struct Sky {
    pass: SkyPass,
}

impl Sky {
    /// The same radiance from everywhere, and no air.
    fn uniform(sun: DVec3) -> Self {
        let mut pass = SkyPass::new(gpu(), library()).expect("the sky");
        let inputs = SkyInputs {
            kind: SkyKind::Uniform { radiance: SKY_RADIANCE },
            sun_direction: sun.as_vec3(),
            sun_irradiance: SUN_IRRADIANCE,
            angular_diameter: 0.0093,
            camera_altitude: 0.0,
            ground_albedo: Vec3::ZERO,
            has_ground: false,
            sea_wind: None,
        };
        let work = pass.update(gpu(), &inputs);
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        pass.encode(&mut encoder, work);
        gpu().queue.submit([encoder.finish()]);
        Self { pass }
    }
}

/// The light of all particles after the pass, and which of them are in view.
fn on_device(
    particles: &[Particle],
    view: &LightView,
    before: &[ParticleLight],
    lighting: Lighting,
) -> (Vec<ParticleLight>, Vec<u32>) {
    let sky = Sky::uniform(cpu::light_project::axis(view.towards)).pass;
    let tables = tables_on_device();
    let halo = Halo { factors: vec![1.0; HALO_ROWS * HALO_COLUMNS] };
    let spreads = Spreads(vec![1.0]);
    let medium =
        GridMedium { spreads: &spreads, tables: tables.layout(), halo: &halo, albedo: 1.0 };
    let grid = LightGridPass::new(gpu(), library(), &medium).expect("the light grid");
    let groups = [tables.layout(), sky.layout(), grid.layout()];
    let pass = LightPass::new(gpu(), library(), lighting, &groups).expect("the light pass");
    let field = empty_field(&grid);
    let frame = frame(
        &Camera { position: DVec3::ZERO, target: DVec3::NEG_Z, ..Camera::default() },
        [64, 48],
    );
    let population = Population::new(&frame, particles);
    let (screen, order) = population.screen(&frame);
    let (lists, uniforms, _) = population.light(view);
    let lights = buffers::storage_with(gpu(), "lights", before);
    let job = pass.job(
        gpu(),
        &population.frame,
        &uniforms,
        &population.particles,
        &lists,
        &population.visible,
        &screen,
        &lights,
    );
    let groups = [tables.bind_group(), sky.bind_group(), &field];
    let groups = if lighting.has_grid() { &groups[..] } else { &groups[..2] };
    submit(|compute| pass.encode(compute, &job, groups));
    (gpu().read_buffer(&lights, particles.len()).expect("the light"), order)
}

/// A light field of one cell without matter: nothing crowds there.
fn empty_field(grid: &LightGridPass) -> wgpu::BindGroup {
    let mut uniforms = LightGridUniforms { levels: 1, cells: 1, ..LightGridUniforms::zeroed() };
    uniforms.level[0] = GridLevel { low: [-1e4; 4], cell: [2e4; 4], size: [1, 1, 1, 0] };
    let texture = gpu().device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let uniforms = buffers::uniform(gpu(), "light grid", &uniforms);
    let cells = buffers::storage_with(gpu(), "cells", &[u32::MAX]);
    grid.bind(gpu(), &uniforms, &texture.create_view(&Default::default()), &cells)
}

/// Worst and root mean square difference.
struct Errors {
    worst: f64,
    rms: f64,
}

const BOUNDS: Bounds = Bounds {
    low: DVec3::splat(-2500.0),
    high: DVec3::splat(2500.0),
    detail: 90.0,
    finest: 30.0,
    closest: f64::INFINITY,
    around_camera: false,
};

/// Compares the optical depths of all particles in view and how much they are alone; the camera looks
/// along -Z from the origin.
fn compare(particles: &[Particle], towards: DVec3, lighting: Lighting) -> Errors {
    let view = light_view(towards, &BOUNDS, DVec3::ZERO);
    let none = <ParticleLight as bytemuck::Zeroable>::zeroed();
    let (lights, order) = on_device(particles, &view, &vec![none; particles.len()], lighting);
    assert!(order.len() > 50 && order.len() < particles.len(), "{} in view", order.len());
    // Particles that no matter on their ray could crowd are asked for all of their depth.
    let before = vec![none; particles.len()];
    let whole = on_device(&never_crowded(particles), &view, &before, lighting).0;
    // The direction as the device has it.
    let towards = cpu::light_project::axis(view.towards);
    let (mut worst, mut squares, mut largest) = (0.0f64, 0.0, 0.0f64);
    let (mut shared, mut ended) = (0, 0);
    for (i, (light, whole)) in lights.iter().zip(&whole).enumerate() {
        if !order.contains(&(i as u32)) {
            assert_eq!(*light, none, "particle {i} is not in view");
            continue;
        }
        let sky = [SKY_RADIANCE; 3];
        assert_eq!(light.sun_irradiance, [SUN_IRRADIANCE, SUN_IRRADIANCE, SUN_IRRADIANCE, 1.0]);
        assert_eq!(light.ambient_above[..3], sky);
        assert_eq!(light.ambient_below[..3], sky);
        let own = &particles[i];
        let centre = DVec3::from(own.centre.map(f64::from));
        let taken = cpu::light::occlusion(tables(), particles, Some(i), towards, centre);
        let alone = match lighting {
            Lighting::Grid => aloneness(own.optical_radius.into(), taken.front + taken.behind, 0.0),
            // Whatever there is around them.
            Lighting::Octaves | Lighting::Alone => 1.0,
        };
        // Smoothstep of slope 1.5 over 0.45 of a share, whose depths differ by what is told below.
        let found = light.ambient_below[3];
        let difference = (f64::from(found) - alone).abs();
        assert!(difference < 0.05, "{i}: {alone} differs by {difference}");
        shared += u32::from(alone > 0.0);
        // The sum ends early for none that is alone, and nothing is added to a part of it.
        if found > 0.0 {
            assert_eq!(light.ambient_above[3], whole.ambient_above[3], "{i} is alone");
        } else {
            assert!(light.ambient_above[3] <= whole.ambient_above[3], "{i} is not");
            ended += u32::from(light.ambient_above[3] < whole.ambient_above[3]);
        }
        let error = (f64::from(whole.ambient_above[3]) - taken.front).abs();
        worst = worst.max(error);
        squares += error * error / order.len() as f64;
        largest = largest.max(taken.front);
    }
    assert!(largest > 3.0, "nothing stands before anything: {largest}");
    assert!(shared > 2, "{shared} are alone");
    // Where every particle is alone all of its depth is asked for.
    assert_eq!(ended > 20, lighting.has_grid(), "{ended} sums ended early");
    assert!(lighting.has_grid() || ended == 0, "{ended} sums ended early");
    Errors { worst, rms: squares.sqrt() }
}

/// The same particles with an own depth that is told to be larger than what all others have together.
fn never_crowded(particles: &[Particle]) -> Vec<Particle> {
    let deeper = |p: &Particle| Particle { optical_radius: 1e6 * p.optical_radius, ..*p };
    particles.iter().map(deeper).collect()
}

/// A clump in view, and particles out of view that stand between it and the light.
fn scene(shapes: u32, seed: u64) -> Vec<Particle> {
    let mut random = Random(seed);
    let mut particles = clump(DVec3::new(0.0, 0.0, -1500.0), 450.0, shapes, &mut random);
    particles.extend(clump(DVec3::new(100.0, 1500.0, -1400.0), 300.0, shapes, &mut random));
    particles
}

const SUN: DVec3 = DVec3::new(0.05, 0.95, 0.3);

#[test]
fn uniform_particles_shade_each_other_exactly() {
    let particles = scene(1, 70);
    for (towards, lighting) in
        [(SUN.normalize(), Lighting::Grid), (DVec3::Y, Lighting::Grid), (DVec3::Y, Lighting::Alone)]
    {
        let errors = compare(&particles, towards, lighting);
        // Places of 2000 m are rounded to 1e-4 m. On a line that grazes a sphere of 150 m that makes
        // sqrt(2 x 150 x 1e-4) = 0.17 m of half a chord, 0.007 of optical depth at 0.02 / m. Such
        // lines are rare, which the root mean square shows.
        assert!(errors.worst < 0.007, "{:e}", errors.worst);
        assert!(errors.rms < 1e-4, "{:e}", errors.rms);
    }
}

#[test]
fn shaped_particles_shade_each_other_by_the_tables() {
    let particles = scene(tables().shape_names().count() as u32, 71);
    let errors = compare(&particles, SUN.normalize(), Lighting::Grid);
    // Filtering hardware places a fetch to 1/256 of a texel: the table's twin test allows for 0.004 of
    // mean density x chord in radii and 0.02 of a share. With optical radii up to 3 and ten particles
    // on a line up to 0.08.
    assert!(errors.worst < 0.08, "{:e}", errors.worst);
    assert!(errors.rms < 0.01, "{:e}", errors.rms);
}

#[test]
fn light_of_this_epoch_stays() {
    let particles = scene(1, 72);
    let view = light_view(SUN.normalize(), &BOUNDS, DVec3::ZERO);
    // Every other particle was lit in this epoch, which is 1 (see `frame`), the rest earlier.
    let mark = |epoch: f32| ParticleLight {
        ambient_above: [7.5; 4],
        sun_irradiance: [9.0, 9.0, 9.0, epoch],
        ..<ParticleLight as bytemuck::Zeroable>::zeroed()
    };
    let before: Vec<_> = (0..particles.len()).map(|i| mark((i % 2) as f32)).collect();
    let (lights, order) = on_device(&particles, &view, &before, Lighting::Grid);
    for &i in &order {
        let i = i as usize;
        let kept = lights[i] == before[i];
        assert_eq!(kept, i % 2 == 1, "particle {i}");
    }
}

#[test]
fn dense_clumps_stay_finite_and_dark() {
    // Beyond OPTICAL_DEPTH_LIMIT sums may end early: still so deep that nothing comes through.
    let mut particles = scene(1, 73);
    for particle in &mut particles {
        particle.extinction *= 1e4;
    }
    let particles = never_crowded(&particles);
    let view = light_view(SUN.normalize(), &BOUNDS, DVec3::ZERO);
    let none = <ParticleLight as bytemuck::Zeroable>::zeroed();
    let (lights, order) =
        on_device(&particles, &view, &vec![none; particles.len()], Lighting::Grid);
    let towards = cpu::light_project::axis(view.towards);
    let mut dark = 0;
    for &i in &order {
        let i = i as usize;
        let centre = DVec3::from(particles[i].centre.map(f64::from));
        let exact = cpu::light::occlusion(tables(), &particles, Some(i), towards, centre);
        let found = lights[i].ambient_above[3];
        assert!(found.is_finite());
        // A line that grazes one may make anything of 1e4 times the rounding: leave those out.
        if exact.front > 1000.0 {
            assert!(found > 80.0, "{found} for {}", exact.front);
            dark += 1;
        }
    }
    assert!(dark > 30, "only {dark} in the dark");
}
