//! In, through and out of clouds: nothing jumps where the eye crosses a surface, or as cells of the field
//! come and go.

use cumuli::frame::{Picture, Preset};
use cumuli::scene::Scene;
use glam::DVec3;

use crate::{alone, particle, renderer, scene, settings, space};

const SIZE: [u32; 2] = [64, 36];

/// RMS of the difference between two pictures' radiance over the first one's mean.
fn change(a: &Picture, b: &Picture) -> f64 {
    let pairs = a.radiance.iter().flatten().zip(b.radiance.iter().flatten());
    let (mut square, mut sum) = (0.0, 0.0);
    for (a, b) in pairs {
        square += f64::from(a - b).powi(2);
        sum += f64::from(*a);
    }
    let count = 4.0 * a.radiance.len() as f64;
    (square / count).sqrt() / (sum / count)
}

/// The eye a centimetre before and behind the surface of a particle, for particles with and without noise
/// that overlap. The way itself changes pictures by its 2 cm of matter: 2e-4 to 8e-4.
#[test]
fn crossing_a_surface_changes_nothing() {
    const STEP: f64 = 0.01;
    let _turn = alone();
    let particles = vec![
        particle(DVec3::ZERO, 100.0, 0.02, "uniform"),
        particle(DVec3::new(90.0, 10.0, 0.0), 70.0, 0.04, "pyroclastic-1"),
        particle(DVec3::new(-60.0, -40.0, 30.0), 50.0, 0.03, "soft-1"),
    ];
    let mut scene = space(0.05, 1.0, 300.0 * DVec3::Z, particles);
    scene.sun.direction = DVec3::new(0.4, 0.8, 0.3).normalize();
    let mut renderer = renderer(&scene, &settings(Preset::Medium));
    // From none of them the sun is seen, whose disc would be all of the picture's light.
    let sides = [DVec3::Z, DVec3::new(-0.6, 0.3, 0.7), DVec3::new(0.2, 0.9, -0.4)];
    let mut worst = 0.0_f64;
    for body in scene.particles.clone() {
        for side in sides.map(DVec3::normalize) {
            let mut from = |height: f64| {
                let mut seen = scene.clone();
                seen.camera.position = body.centre + side * (body.radius + height);
                // Past the middle, so that rays of all lengths are in the picture.
                seen.camera.target = body.centre + DVec3::new(20.0, -15.0, 10.0);
                renderer.render(&seen, 0.0, SIZE).expect("a frame")
            };
            let (outside, inside) = (from(STEP), from(-STEP));
            let found = change(&outside, &inside);
            println!("{} from {side:.2}: {found:.5}", body.shape);
            worst = worst.max(found);
        }
    }
    assert!(worst < MOST_AT_SURFACE, "{worst}");
}

/// Found: 0.0006 at most. A particle that appeared or went would change a tenth of the picture.
const MOST_AT_SURFACE: f64 = 0.002;

/// A flight through a field in steps of 2 m, over several of its cells and into a cloud.
#[test]
fn a_flight_through_a_field_has_no_jump() {
    const STEPS: u32 = 60;
    const STEP: f64 = 2.0;
    let _turn = alone();
    let field: Scene = scene(
        "[camera]\nposition = [0, 0, 0]\ntarget = [0, 0, -1]\n[sun]\ndirection = [0.5, 0.7, 0.3]\n\
         [clouds]\nbase = 600.0\ncoverage = 0.7\ncells = 24\nrings = 3\nlayers = 4\nwind = [0, 0, 0]\n",
    );
    let mut renderer = renderer(&field, &settings(Preset::Low));
    let mut last: Option<Picture> = None;
    let (mut changes, mut opacities) = (Vec::new(), Vec::new());
    for step in 0..STEPS {
        let mut seen = field.clone();
        let way = DVec3::new(0.3, 0.05, -1.0).normalize();
        seen.camera.position = DVec3::new(0.0, 690.0, 0.0) + way * STEP * f64::from(step);
        seen.camera.target = seen.camera.position + way;
        let shown = renderer.render(&seen, 0.0, SIZE).expect("a frame");
        let middle = shown.radiance[(SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2) as usize][3];
        opacities.push(middle);
        if let Some(last) = &last {
            changes.push(change(last, &shown));
        }
        last = Some(shown);
    }
    let shares = [opacities[0], opacities[opacities.len() - 1]];
    assert!(shares[0] > 0.99 && shares[1] < 0.8, "it leads out of a cloud: {opacities:.2?}");
    // Where the cloud gets thinner steps change more; no step does by much more than those before and after.
    for (number, around) in changes.windows(3).enumerate() {
        let most = MOST_OVER_NEIGHBOURS * around[0].max(around[2]);
        assert!(around[1] < most, "step {}: {changes:.4?}", number + 1);
    }
}

/// Found: 1.22 at most. What appeared or went at once would be tens of times as much as the steps around it.
const MOST_OVER_NEIGHBOURS: f64 = 2.0;
