//! Only what changed is made again, and the result is the same as if all were.

use super::*;

#[test]
fn work_is_what_the_change_asks_for() {
    let mut bench = Bench::new();
    let first = inputs(20.0, 100.0);
    assert_eq!(bench.make(&first), SkyWork::All);
    assert_eq!(bench.make(&first), SkyWork::None);
    let mut next = first;
    next.sun_irradiance = 2.0;
    assert_eq!(bench.make(&next), SkyWork::Uniforms);
    // The sun at the same height elsewhere.
    next.sun_direction =
        Vec3::new(next.sun_direction.z, next.sun_direction.y, next.sun_direction.x);
    assert_eq!(bench.make(&next), SkyWork::Uniforms);
    next.camera_altitude = 101.0;
    assert_eq!(bench.make(&next), SkyWork::Camera);
    next.sun_direction = inputs(21.0, 0.0).sun_direction;
    next.camera_altitude = 102.0;
    assert_eq!(bench.make(&next), SkyWork::Sun);
    next.ground_albedo = Vec3::splat(0.3);
    assert_eq!(bench.make(&next), SkyWork::Ground);
    // A uniform sky between two equal atmospheres costs nothing.
    let uniform = SkyInputs { kind: SkyKind::Uniform { radiance: 1.0 }, ..next };
    assert_eq!(bench.make(&uniform), SkyWork::Uniforms);
    assert_eq!(bench.make(&next), SkyWork::Uniforms);
    // Below the ground it looks as on the ground.
    next.camera_altitude = 0.0;
    assert_eq!(bench.make(&next), SkyWork::Camera);
    next.camera_altitude = -30.0;
    assert_eq!(bench.make(&next), SkyWork::Uniforms);
}

#[test]
fn the_way_to_a_sky_leaves_no_trace() {
    let queries: Vec<_> = [-30.0, -0.1, 2.0, 50.0]
        .into_iter()
        .map(|e| query(direction(e, 33.0), 5e3, 1200.0))
        .collect();
    let wanted = inputs(7.0, 1500.0);
    let mut fresh = Bench::new();
    fresh.make(&wanted);
    let expected = fresh.ask(&queries);

    let mut bench = Bench::new();
    let mut way = inputs(-3.0, 9000.0);
    way.ground_albedo = Vec3::splat(0.8);
    bench.make(&way);
    // Each table's last change is one that asks for it alone.
    way.ground_albedo = wanted.ground_albedo;
    bench.make(&way);
    way.sun_direction = wanted.sun_direction;
    bench.make(&way);
    bench.make(&wanted);
    assert_eq!(bench.ask(&queries), expected);
}
