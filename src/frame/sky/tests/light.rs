//! What the shader functions answer: against rays marched finely in f64, and against what must
//! hold exactly.

use super::*;
use crate::frame::cpu::atmosphere::{distance_to_ground, sky_spans};
use crate::frame::cpu::sky::Sky;

/// Steps of the reference's rays; ten times as many change it by less than 1e-3.
const FINE: u32 = 400;

/// Altitude from which on only what lies below the horizon is compared, and elevations count from there, m.
const HIGH: f64 = 1.5e4;

/// Of the radiance straight down, what is dark seen from there.
const NIGHT: f64 = 0.05;

const ELEVATIONS: [f64; 9] = [-60.0, -10.0, -2.5, -0.5, 0.05, 1.5, 4.1, 21.0, 80.0];
const AZIMUTHS: [f64; 5] = [0.5, 20.0, 50.0, 90.0, 170.0];

fn directions() -> impl Iterator<Item = DVec3> {
    directions_over(0.0)
}

/// Elevations over a horizon so far below the horizontal (degrees).
fn directions_over(dip: f64) -> impl Iterator<Item = DVec3> {
    // As the device gets them.
    ELEVATIONS.iter().flat_map(move |&e| {
        AZIMUTHS.iter().map(move |&a| direction(e - dip, a).as_vec3().as_dvec3())
    })
}

/// Largest errors of sky radiance, and of transmittance and inscattered light of the air, relative
/// to the brightest channel (transmittance: absolute).
fn errors(bench: &mut Bench, asked: &SkyInputs) -> (f64, f64, f64) {
    bench.make(asked);
    let sky = Sky::new(asked, FINE);
    let (mut of_sky, mut of_transmittance, mut of_inscatter) = (0.0f64, 0.0f64, 0.0f64);
    let is_high = asked.camera_altitude > HIGH;
    // The night side is as dark as it may be.
    let dark = if is_high { NIGHT * sky.sky_radiance(DVec3::NEG_Y).max_element() } else { 0.0 };
    let dip = if is_high { sky.horizon_dip().to_degrees() } else { 0.0 };
    for dir in directions_over(dip) {
        // The air over the horizon is a thin rim then: below.
        if is_high && sky.ground_distance(dir) < 0.0 {
            continue;
        }
        let truth = sky.sky_radiance(dir);
        let bright = truth.max_element().max(dark);
        let ground = sky.ground_distance(dir);
        // Far from an eye that looks down from on high, most of the air lies shortly before the ground.
        let lower = [0.6, 0.8, 0.9, 0.96, 0.99].map(|share| share * ground.max(0.0));
        let distances: Vec<f64> = [80.0, 1234.0, 9e3, 4e4, 1.2e5, f64::INFINITY]
            .into_iter()
            .chain(lower)
            .filter(|d| *d > 0.0 && (ground < 0.0 || *d <= ground))
            .collect();
        let queries: Vec<_> = distances.iter().chain([&1.0]).map(|&d| query(dir, d, 0.0)).collect();
        let answers = bench.ask(&queries);
        let got = Vec3::from_array(answers[0].sky).as_dvec3();
        of_sky = of_sky.max((got - truth).abs().max_element() / bright);
        for (answer, distance) in answers.iter().zip(distances) {
            let air = sky.air_between(dir, distance);
            let t = (rgb(answer.transmittance) - air.transmittance).abs().max_element();
            let l = (rgb(answer.inscatter) - air.inscatter).abs().max_element() / bright;
            of_transmittance = of_transmittance.max(t);
            of_inscatter = of_inscatter.max(l);
        }
    }
    (of_sky, of_transmittance, of_inscatter)
}

#[test]
fn sky_and_air_agree_with_fine_rays() {
    let mut bench = Bench::new();
    // By day 1 % is less than one 8-bit step of a picture; at dusk the light changes by its half
    // within a degree, and so does what the tables lose.
    for (sun, altitude, limits) in [
        (60.0, 2.0, [0.01, 0.01, 0.01]),
        (30.0, 10_000.0, [0.01, 0.015, 0.01]),
        (30.0, 20_000.0, [0.01, 0.02, 0.02]),
        (30.0, 62_000.0, [0.015, 0.015, 0.01]),
        (30.0, 120_000.0, [0.035, 0.015, 0.01]),
        (30.0, 4e5, [0.035, 0.01, 0.01]),
        (30.0, 3.6e7, [0.02, 0.01, 0.01]),
        (4.0, 2000.0, [0.01, 0.01, 0.015]),
        (0.0, 10_000.0, [0.015, 0.015, 0.03]),
        (-5.0, 2000.0, [0.015, 0.01, 0.05]),
    ] {
        let (sky, transmittance, inscatter) = errors(&mut bench, &inputs(sun, altitude));
        println!("sun {sun}, {altitude} m: {sky:.4} {transmittance:.4} {inscatter:.4}");
        assert!(sky < limits[0], "sun {sun}, {altitude} m: sky {sky}");
        assert!(
            transmittance < limits[1],
            "sun {sun}, {altitude} m: transmittance {transmittance}"
        );
        assert!(inscatter < limits[2], "sun {sun}, {altitude} m: inscatter {inscatter}");
    }
}

/// The air over the horizon, seen from outside: a rim of some degrees, and of an eighth of one from where satellites stand still.
#[test]
fn the_planet_has_its_rim() {
    let mut bench = Bench::new();
    for altitude in [1.2e5, 4e5, 3.6e7] {
        let asked = inputs(30.0, altitude);
        bench.make(&asked);
        let sky = Sky::new(&asked, FINE);
        let [_, rim] = sky_spans(altitude);
        let dip = sky.horizon_dip().to_degrees();
        let at = |share: f64, azimuth: f64| {
            let over = (share * rim).to_degrees();
            direction(over - dip, azimuth).as_vec3().as_dvec3()
        };
        let mut worst = 0.0f64;
        for azimuth in AZIMUTHS {
            let brightest = sky.sky_radiance(at(0.02, azimuth)).max_element();
            for share in [0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.1, 2.0] {
                let dir = at(share, azimuth);
                let got = Vec3::from_array(bench.ask(&[query(dir, 1.0, 0.0)])[0].sky).as_dvec3();
                let off = (got - sky.sky_radiance(dir)).abs().max_element() / brightest;
                worst = worst.max(off);
            }
        }
        println!("{altitude} m: {worst:.4}");
        assert!(worst < 0.02, "{altitude} m: {worst}");
    }
}

#[test]
fn air_has_no_steps() {
    let mut bench = Bench::new();
    bench.make(&inputs(20.0, 900.0));
    for dir in [direction(0.3, 40.0), direction(-0.2, 90.0), direction(8.0, 170.0)] {
        // 1 % farther each time, 10 m to 200 km or the ground.
        let end = distance_to_ground(900.0, dir.y);
        let queries: Vec<_> = (0..1000)
            .map(|i| 10.0 * 1.01f64.powi(i))
            .filter(|&d| d < 2e5 && (end < 0.0 || d < end))
            .map(|d| query(dir, d, 0.0))
            .collect();
        let answers = bench.ask(&queries);
        for pair in answers.windows(2) {
            let through = rgb(pair[0].transmittance) - rgb(pair[1].transmittance);
            let light = rgb(pair[1].inscatter) - rgb(pair[0].inscatter);
            // Air only takes and only adds; the last digits of half floats may differ.
            assert!(through.min_element() > -1e-5, "{through}");
            assert!(light.min_element() > -1e-6, "{light}");
            // 1 % of the way changes optical depth by 1 % at most: 0.01 x exp(-x) <= 0.0037;
            // twice that is a step.
            assert!(through.max_element() < 0.0075, "{through}");
        }
    }
}

#[test]
fn air_far_away_is_the_sky() {
    let mut bench = Bench::new();
    bench.make(&inputs(35.0, 300.0));
    for dir in directions().filter(|d| distance_to_ground(300.0, d.y) < 0.0) {
        let answer = bench.ask(&[query(dir, f64::INFINITY, 0.0)])[0];
        let sky = Vec3::from_array(answer.sky).as_dvec3();
        let difference = (rgb(answer.inscatter) - sky).abs().max_element() / sky.max_element();
        // Two tables of the same function, each within 1 %.
        assert!(difference < 0.01, "{dir} {difference}");
    }
    // And there is no air in no distance.
    let here = bench.ask(&[query(DVec3::X, 0.0, 0.0)])[0];
    assert_eq!(here.inscatter, [0.0; 4]);
    assert_eq!(here.transmittance, [1.0, 1.0, 1.0, 0.0]);
}

#[test]
fn ground_distance_keeps_its_digits() {
    let mut bench = Bench::new();
    for altitude in [0.5, 2.0, 1000.0, 35_000.0, 4e5] {
        bench.make(&inputs(35.0, altitude));
        // The uniform holds the altitude in f32.
        let altitude = f64::from(altitude as f32);
        for elevation in [-90.0, -45.0, -25.0, -3.0, -0.1, -0.05, 0.0, 5.0] {
            let dir = direction(elevation, 77.0);
            let mu = f64::from(dir.as_vec3().y);
            let exact = distance_to_ground(altitude, mu);
            let got = f64::from(bench.ask(&[query(dir, 1.0, 0.0)])[0].to_ground);
            // A few roundings of 6e-8; twice as many digits are lost where the ray is a tangent.
            assert!((got - exact).abs() <= 1e-5 * exact.abs(), "{altitude} m: {got} {exact}");
        }
    }
}

#[test]
fn the_disc_holds_the_suns_irradiance() {
    let mut bench = Bench::new();
    let mut asked = inputs(40.0, 5.0);
    asked.sun_irradiance = 3.0;
    bench.make(&asked);
    // Directions on a square grid of chords around the sun, a thousand over the disc.
    let sun = asked.sun_direction.as_dvec3();
    let u = sun.cross(DVec3::Y).normalize();
    let v = sun.cross(u);
    let half = 0.7 * f64::from(asked.angular_diameter);
    let n = 48;
    let cell = 2.0 * half / f64::from(n);
    let queries: Vec<_> = (0..n * n)
        .map(|i| {
            let place = |k: i32| (f64::from(k) + 0.5) * cell - half;
            query((sun + u * place(i % n) + v * place(i / n)).normalize(), 1.0, 5.0)
        })
        .collect();
    let answers = bench.ask(&queries);
    let sum: DVec3 = answers.iter().map(|a| rgb(a.disc)).sum();
    let expected = rgb(answers[0].sun);
    // Directions carry 6e-8, a disc 5e-3: 1e-5 each, and the grid 1e-3.
    let error = (sum * cell * cell / expected - 1.0).abs().max_element();
    assert!(error < 3e-3, "{error}");
    // The twin's disc is the same.
    let sky = Sky::new(&asked, FINE);
    let centre = bench.ask(&[query(sun, 1.0, 5.0)])[0];
    let twin = sky.sun_disc_radiance(asked.sun_direction.as_dvec3());
    assert!((rgb(centre.disc) / twin - 1.0).abs().max_element() < 3e-3);
    assert_eq!(bench.ask(&[query(-sun, 1.0, 5.0)])[0].disc, [0.0; 4]);
}

#[test]
fn the_ground_is_lit_as_the_twin_says() {
    let mut bench = Bench::new();
    let asked = inputs(25.0, 800.0);
    bench.make(&asked);
    let sky = Sky::new(&asked, FINE);
    for elevation in [-80.0, -20.0, -2.0] {
        let dir = direction(elevation, 60.0).as_vec3().as_dvec3();
        let distance = sky.ground_distance(dir);
        for light in [[0.0, 0.0, 0.5], [0.25, 0.04, 0.9], [1.0, 0.0, 1.0]] {
            let [visibility, by_clouds, sky_share] = light.map(|l: f64| l as f32);
            let bare = query(dir, distance, 0.0);
            let asked = Query { visibility, by_clouds, sky_share, ..bare };
            let got = rgb(bench.ask(&[asked])[0].ground);
            let expected = sky.ground_radiance(dir, distance, light);
            // Half floats, and one table between the two.
            assert!((got / expected - 1.0).abs().max_element() < 4e-3, "{got} {expected}");
        }
        // The bare ground through the air is what is seen there.
        let answer = bench.ask(&[query(dir, distance, 0.0)])[0];
        let through = rgb(answer.ground) * rgb(answer.transmittance) + rgb(answer.inscatter);
        let seen = Vec3::from_array(answer.sky).as_dvec3();
        assert!(
            (through - seen).abs().max_element() < 0.02 * seen.max_element(),
            "{through} {seen}"
        );
    }
}
