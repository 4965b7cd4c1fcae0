//! Colours and amounts that anyone can check outdoors, and places where formulas break.

use super::*;

fn answer(bench: &mut Bench, asked: &SkyInputs, dir: DVec3) -> Answer {
    bench.make(asked);
    bench.ask(&[query(dir, 1e4, 0.0)])[0]
}

#[test]
fn a_clear_noon() {
    let mut bench = Bench::new();
    // At a right angle to the sun, where a clear sky is deepest: its correlated colour temperature
    // is beyond 15,000 K there, blue at least twice red.
    let noon = answer(&mut bench, &inputs(60.0, 2.0), direction(30.0, 180.0));
    let deepest = noon.sky;
    assert!(deepest[2] > 2.0 * deepest[0] && deepest[1] > deepest[0], "{deepest:?}");
    // The sun is a little yellow: red, green, blue fall, blue by a fifth at most.
    let sun = noon.sun;
    assert!(sun[0] > sun[1] && sun[1] > sun[2] && sun[2] > 0.8 * sun[0], "{sun:?}");
    // Towards the horizon the sky gets brighter and whiter.
    let low = answer(&mut bench, &inputs(60.0, 2.0), direction(3.0, 180.0)).sky;
    let blue = |c: [f32; 3]| c[2] / c[0];
    assert!(low[1] > 1.3 * deepest[1] && blue(low) < 0.7 * blue(deepest), "{low:?}");
    // Diffuse over global irradiance of a clear day with the sun high: 0.1 to 0.2 (Iqbal 1983,
    // An Introduction to Solar Radiation), here for a dark ground.
    let horizontal = f64::from(sun[1]) * 60f64.to_radians().sin();
    let dark = Query { visibility: 0.0, ..query(DVec3::NEG_Y, 2.0, 0.0) };
    let on_ground = f64::from(bench.ask(&[dark])[0].ground[1]) * std::f64::consts::PI / 0.11;
    let share = on_ground / (horizontal + on_ground);
    assert!((0.1..0.2).contains(&share), "{share}");
}

#[test]
fn a_low_sun_is_orange_and_dusk_is_blue() {
    let mut bench = Bench::new();
    let sun = answer(&mut bench, &inputs(4.0, 2.0), DVec3::Y).sun;
    assert!(sun[0] > 1.5 * sun[1] && sun[1] > 3.0 * sun[2] && sun[2] > 0.0, "{sun:?}");
    // Ozone keeps the zenith blue when the sun has set.
    let dusk = answer(&mut bench, &inputs(-4.0, 2.0), DVec3::Y).sky;
    assert!(dusk[2] > 1.3 * dusk[0], "{dusk:?}");
    // Over the place of the sunset it is red at the horizon.
    let glow = bench.ask(&[query(direction(0.5, 0.0), 1e4, 0.0)])[0].sky;
    assert!(glow[0] > 1.5 * glow[1] && glow[1] > glow[2], "{glow:?}");
    assert!(glow[0] > 5.0 * dusk[0], "{glow:?} {dusk:?}");
}

#[test]
fn everything_is_finite_everywhere() {
    let mut bench = Bench::new();
    let directions: Vec<_> = [-90.0, -60.0, -19.0, -1.0, -0.05, 0.0, 0.05, 1.0, 30.0, 90.0]
        .into_iter()
        .flat_map(|e| [0.0, 90.0, 180.0].map(|a| direction(e, a)))
        .chain([DVec3::Y, DVec3::NEG_Y])
        .collect();
    for altitude in [-1e11, -50.0, 0.0, 0.01, 3e4, 9.9999e4, 1e5, 1.0001e5, 4e5, 1e7, 1e11] {
        for sun in [90.0, 10.0, 0.0, -20.0, -90.0] {
            bench.make(&inputs(sun, altitude));
            let queries: Vec<_> = directions
                .iter()
                .flat_map(|&d| {
                    [(0.0, -1e6), (1e3, 0.0), (1e6, 1e4), (1e12, 1e9), (f64::INFINITY, 1e5)]
                        .map(|(distance, h)| query(d, distance, h))
                })
                .collect();
            for (q, a) in queries.iter().zip(bench.ask(&queries)) {
                let values: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&a));
                let bad = values.iter().any(|v| !v.is_finite() || (*v < 0.0 && *v != -1.0));
                assert!(!bad, "altitude {altitude}, sun {sun}, {:?}: {a:?}", (q.dir, q.distance));
                let t = rgb(a.transmittance);
                assert!(t.max_element() <= 1.0, "{t}");
            }
        }
    }
}

#[test]
fn a_night_is_dark() {
    let mut bench = Bench::new();
    let night = answer(&mut bench, &inputs(-20.0, 2.0), direction(20.0, 30.0));
    let day = answer(&mut bench, &inputs(30.0, 2.0), direction(20.0, 30.0));
    assert_eq!(night.sun, [0.0; 4]);
    // The sun at -18 degrees leaves less than 1e-6 of the day's sky.
    assert!(night.sky[1] < 1e-6 * day.sky[1], "{:?} {:?}", night.sky, day.sky);
}

#[test]
fn all_light_scales_with_the_suns() {
    let mut bench = Bench::new();
    let mut asked = inputs(10.0, 500.0);
    let dir = direction(12.0, 3.0);
    let one = answer(&mut bench, &asked, dir);
    asked.sun_irradiance = 8.0;
    let eight = answer(&mut bench, &asked, dir);
    // A power of two: to the bit.
    let times = |v: [f32; 4]| v.map(|x| x * 8.0);
    assert_eq!(eight.sky, one.sky.map(|x| x * 8.0));
    assert_eq!(eight.inscatter, times(one.inscatter));
    assert_eq!(eight.sun, times(one.sun));
    assert_eq!(eight.above, times(one.above));
    assert_eq!(eight.below, times(one.below));
    assert_eq!(eight.ground, times(one.ground));
    assert_eq!(eight.transmittance, one.transmittance);
}

#[test]
fn a_uniform_sky_is_uniform() {
    let mut bench = Bench::new();
    let mut asked = inputs(50.0, 100.0);
    asked.kind = SkyKind::Uniform { radiance: 0.0318 };
    asked.sun_irradiance = 2.0;
    asked.has_ground = false;
    for dir in [DVec3::Y, direction(1.0, 4.0), direction(-70.0, 100.0)] {
        let a = answer(&mut bench, &asked, dir);
        assert_eq!(a.sky, [0.0318; 3]);
        assert_eq!(a.inscatter, [0.0; 4]);
        assert_eq!(a.transmittance, [1.0, 1.0, 1.0, 0.0]);
        assert_eq!(a.sun, [2.0, 2.0, 2.0, 0.0]);
        assert_eq!(a.above, [0.0318, 0.0318, 0.0318, 0.0]);
        assert_eq!(a.below, [0.0318, 0.0318, 0.0318, 0.0]);
    }
    // The ground of such a scene, if it has one: E cos / pi + L, times its albedo.
    let a = bench.ask(&[query(DVec3::NEG_Y, 100.0, 0.0)])[0];
    let light = 2.0 * 50f64.to_radians().sin() / std::f64::consts::PI + 0.0318;
    assert!((f64::from(a.ground[0]) / (0.09 * light) - 1.0).abs() < 1e-5, "{:?}", a.ground);
    // It is what lights from below.
    asked.has_ground = true;
    let a = answer(&mut bench, &asked, DVec3::Y);
    assert_eq!(a.above, [0.0318, 0.0318, 0.0318, 0.0]);
    for (below, albedo) in a.below.iter().zip([0.09, 0.11, 0.06]) {
        assert!((f64::from(*below) / (albedo * light) - 1.0).abs() < 1e-5, "{:?}", a.below);
    }
    let twin = crate::frame::cpu::sky::Sky::new(&asked, 4).sky_ambient_below(100.0);
    assert!((twin / (DVec3::new(0.09, 0.11, 0.06) * light) - 1.0).abs().max_element() < 1e-6);
}
