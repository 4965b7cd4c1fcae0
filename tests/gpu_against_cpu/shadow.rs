//! Shadow maps against sums over all particles, without lists, in double precision.

use cumuli::frame::cpu;
use cumuli::frame::gpu_data::{FrameUniforms, Particle, ShadowTexel};
use cumuli::frame::shadow::{ShadowJob, ShadowPass};
use cumuli::frame::view::{Bounds, light_view, shadow_uniforms};
use cumuli::scene::Camera;
use glam::DVec3;

use crate::common::{Random, gpu, library, submit, tables};
use crate::light::{clump, tables_on_device};
use crate::pictures::{Population, frame};

/// Texels a side: no multiple of a workgroup's.
const RESOLUTION: u32 = 60;
const MAPS: u32 = 2;

/// Both maps, row after row.
fn read_maps(job: &ShadowJob) -> Vec<f32> {
    let count = (MAPS * RESOLUTION * RESOLUTION) as usize;
    let texels = gpu().read_buffer::<ShadowTexel>(&job.maps, count).expect("texels");
    texels.iter().map(|texel| texel.transmittance).collect()
}

/// Worst and root mean square error of transmittance.
fn compare(particles: &[Particle], sun: DVec3) -> (f64, f64) {
    let camera = DVec3::new(4321.0, 200.0, -1234.0);
    // All of them, relative to the camera, within these.
    let (low, high) = (DVec3::new(-2000.0, 200.0, -2000.0), DVec3::new(2000.0, 2000.0, 2000.0));
    let bounds = Bounds { low: camera + low, high: camera + high, detail: 90.0 };
    let view = light_view(sun, &bounds, camera, 1);
    let maps = shadow_uniforms(camera, &bounds, RESOLUTION, false);
    let tables_gpu = tables_on_device();
    let pass = ShadowPass::new(gpu(), library(), tables_gpu.layout()).expect("the shadow pass");
    let job = pass.job(gpu(), RESOLUTION);
    gpu().queue.write_buffer(&job.uniforms, 0, bytemuck::bytes_of(&maps));
    let seen = FrameUniforms { shadow_epoch: 1, ..frame(&Camera::default(), [64, 48]) };
    let population = Population::new(&seen, particles);
    let (lists, uniforms, _) = population.light(&view);
    let bindings =
        pass.bind(gpu(), &job, &population.frame, &uniforms, &population.particles, &lists);
    submit(|compute| pass.encode(compute, &job, &bindings, tables_gpu.bind_group()));

    let sun = cpu::light_project::axis(view.towards);
    let (mut worst, mut squares, mut shaded, mut open) = (0.0f64, 0.0, 0, 0);
    let texels = read_maps(&job);
    for (i, found) in texels.iter().enumerate() {
        let (i, side) = (i as u32, RESOLUTION);
        let map = (i / (side * side)) as usize;
        let point = cpu::shadow::point(&maps, map, [i % side, i / side % side]);
        let exact = cpu::shadow::transmittance(tables(), particles, sun, point);
        let error = (f64::from(*found) - exact).abs();
        worst = worst.max(error);
        squares += error * error / texels.len() as f64;
        shaded += u32::from(exact < 0.5);
        if exact == 1.0 {
            open += 1;
        }
    }
    assert!(shaded > 100 && open > 100, "{shaded} texels in shadow, {open} in the sun");
    (worst, squares.sqrt())
}

const SUNS: [DVec3; 3] = [DVec3::Y, DVec3::new(0.5, 0.6, -0.3), DVec3::new(-0.2, 0.9, 0.9)];

#[test]
fn shadows_of_uniform_particles_are_exact() {
    let particles = clump(DVec3::new(100.0, 900.0, -50.0), 500.0, 1, &mut Random(80));
    for sun in SUNS {
        let (worst, rms) = compare(&particles, sun.normalize());
        // As in light.rs: 0.007 of optical depth on a line that just grazes a particle;
        // such lines are rare, which the root mean square shows.
        assert!(worst < 0.007, "{worst:e}");
        assert!(rms < 2e-5, "{rms:e}");
    }
}

#[test]
fn shadows_of_shaped_particles_follow_the_tables() {
    let shapes = tables().shape_names().count() as u32;
    let particles = clump(DVec3::new(100.0, 900.0, -50.0), 500.0, shapes, &mut Random(81));
    for sun in SUNS {
        let (worst, rms) = compare(&particles, sun.normalize());
        // The table's twin test allows 0.004 of mean density x chord in radii: 0.012 of optical
        // depth at an optical radius of 3, of which several may lie on one line.
        assert!(worst < 0.03, "{worst:e}");
        assert!(rms < 2e-3, "{rms:e}");
    }
}
