//! The guards of `numerics.wgsl` and the rotations of `quaternion.wgsl` against f64.

use glam::{DQuat, DVec3, Vec4};

use crate::common::{Random, Snippet, map};

/// Step of f32 at 1.
const EPSILON: f64 = f32::EPSILON as f64;

/// From 1e-12 to 1e3 in steps of 0.3 %, and 0, and both sides of the places where a series ends.
fn optical_depths() -> Vec<f32> {
    let mut values: Vec<f32> =
        (0..=12_000).map(|i| 10f64.powf(-12.0 + 15.0 * f64::from(i) / 12_000.0) as f32).collect();
    values.push(0.0);
    for edge in [0.02f32, 0.1, 80.0] {
        values.extend([edge.next_down(), edge, edge.next_up()]);
    }
    values
}

/// 1/tau - 1/(exp(tau) - 1) cancels for small tau even in f64: there the Bernoulli series, whose
/// first dropped term is tau^7 / 1209600.
fn mean_scatter_fraction(tau: f64) -> f64 {
    if tau < 0.1 {
        0.5 - tau / 12.0 + tau.powi(3) / 720.0 - tau.powi(5) / 30240.0
    } else {
        1.0 / tau - 1.0 / tau.exp_m1()
    }
}

#[test]
fn guards_keep_their_digits() {
    let taus = optical_depths();
    let results: Vec<[f32; 4]> = map(
        Snippet {
            declarations: "#import cumuli::numerics::{mean_scatter_fraction, mean_transmittance, opacity}",
            input: "f32",
            output: "vec4<f32>",
            result: "vec4(opacity(x), mean_transmittance(x), mean_scatter_fraction(x), exp(-x))",
        },
        &[],
        &taus,
    );
    let mut worst = [0.0f64; 3];
    for (&tau, result) in taus.iter().zip(results) {
        let exact_tau = f64::from(tau);
        let opacity = -(-exact_tau).exp_m1();
        let mean = if tau == 0.0 { 1.0 } else { opacity / exact_tau };
        let fraction = mean_scatter_fraction(exact_tau);
        if tau == 0.0 {
            assert_eq!(result, [0.0, 1.0, 0.5, 1.0], "at 0 the limits are exact");
            continue;
        }
        let exact = [opacity, mean, fraction];
        for i in 0..3 {
            let error = (f64::from(result[i]) / exact[i] - 1.0).abs();
            assert!(error.is_finite(), "function {i} at {tau}: {} for {}", result[i], exact[i]);
            worst[i] = worst[i].max(error);
        }
    }
    let steps = worst.map(|error| error / EPSILON);
    println!("opacity, mean_transmittance, mean_scatter_fraction: {steps:.1?} steps");
    // Above 0.02 the subtraction from 1 magnifies the rounding of exp (2 steps of f32, by WGSL's
    // accuracy table 3 + 2 |tau|) by up to 1 / 0.02: 100 to 150 steps. Below, the series: a few.
    assert!(worst[0] < 160.0 * EPSILON, "opacity: {:e}", worst[0]);
    assert!(worst[1] < 160.0 * EPSILON, "mean transmittance: {:e}", worst[1]);
    // At 0.1 two numbers near 10 are subtracted and leave 1/2: 10 / (1/2) times the roundings of
    // 1/t, and of exp(t) - 1, which is 0.1: some 20 x 15 steps; the series' dropped term is 3e-6.
    assert!(worst[2] < 300.0 * EPSILON, "mean scatter fraction: {:e}", worst[2]);
}

#[test]
fn sortable_keeps_the_order_of_floats() {
    let mut random = Random(1);
    let mut values: Vec<f32> = (0..4096)
        .map(|_| f32::from_bits(random.bits() as u32))
        .filter(|v| !v.is_nan())
        // Drivers may flush what is below the smallest normal number to 0.
        .filter(|v| *v == 0.0 || v.is_normal() || v.is_infinite())
        .collect();
    values.extend([0.0, f32::MIN_POSITIVE, -f32::MIN_POSITIVE, f32::MAX, f32::MIN]);
    values.extend([f32::INFINITY, f32::NEG_INFINITY, 1.0, -1.0, 1.0f32.next_up()]);
    values.sort_by(f32::total_cmp);
    values.dedup();
    let snippet = Snippet {
        declarations: "#import cumuli::numerics::sortable",
        input: "f32",
        output: "u32",
        result: "sortable(x)",
    };
    let keys: Vec<u32> = map(snippet, &[], &values);
    for i in 1..keys.len() {
        assert!(keys[i - 1] < keys[i], "{} and {}", values[i - 1], values[i]);
    }
    // The key of what is not seen must come after all others.
    assert!(keys.iter().all(|k| *k < u32::MAX));
}

#[test]
fn rotations_are_those_of_plain_quaternions() {
    let mut random = Random(2);
    let inputs: Vec<[f32; 8]> = (0..2048)
        .map(|_| {
            let q = DQuat::from_axis_angle(random.direction(), random.between(-4.0, 4.0)).as_quat();
            let v = (random.direction() * random.between(0.1, 10.0)).as_vec3();
            [q.x, q.y, q.z, q.w, v.x, v.y, v.z, 0.0]
        })
        .collect();
    let snippet = Snippet {
        declarations: "#import cumuli::quaternion::rotate
            struct Turn { q: vec4<f32>, v: vec4<f32> }",
        input: "Turn",
        output: "vec4<f32>",
        result: "vec4(rotate(x.q, x.v.xyz), 0.0)",
    };
    let results: Vec<[f32; 4]> = map(snippet, &[], &inputs);
    let mut worst = 0.0f64;
    for (input, result) in inputs.iter().zip(results) {
        let d = input.map(f64::from);
        let v = DVec3::new(d[4], d[5], d[6]);
        let exact = DQuat::from_xyzw(d[0], d[1], d[2], d[3]) * v;
        let error = (Vec4::from(result).truncate().as_dvec3() - exact).length();
        // Two cross products and two sums: no more than 16 roundings of terms up to twice as long.
        assert!(error < 16.0 * EPSILON * v.length(), "{input:?}: off by {error:e}");
        worst = worst.max(error / (EPSILON * v.length()));
    }
    println!("rotate: {worst:.1} steps of the length");
}

#[test]
fn uniform_rotations_are_unit_and_as_stated() {
    let mut random = Random(3);
    let mut inputs: Vec<[f32; 4]> =
        (0..2048).map(|_| std::array::from_fn(|_| random.uniform() as f32)).collect();
    // The ends of the range, and the largest number that `unit_float` makes.
    inputs.extend([[0.0; 4], [1.0f32.next_down(); 4], [0.0, 0.5, 0.5, 0.0]]);
    let snippet = Snippet {
        declarations: "#import cumuli::quaternion::uniform_rotation",
        input: "vec4<f32>",
        output: "vec4<f32>",
        result: "uniform_rotation(x.xyz)",
    };
    let results: Vec<[f32; 4]> = map(snippet, &[], &inputs);
    let mut mean = [[0.0f64; 3]; 3];
    let mut worst = 0.0f64;
    for (input, result) in inputs.iter().zip(&results) {
        let u = input.map(f64::from);
        let (a, b) = ((1.0 - u[0]).sqrt(), u[0].sqrt());
        let tau = std::f64::consts::TAU;
        let ((s, c), (t, d)) = ((tau * u[1]).sin_cos(), (tau * u[2]).sin_cos());
        let exact = [a * s, a * c, b * t, b * d];
        for i in 0..4 {
            // WGSL asks of sin and cos an absolute error below 2^-11 within [-pi, pi] and leaves
            // it open beyond; every driver in use does far better up to 2 pi. A turn of 1e-5 rad
            // moves the surface of a particle of 1000 m by 1 cm.
            let off = (f64::from(result[i]) - exact[i]).abs();
            assert!(off < 1e-5, "{input:?}: {result:?}");
            worst = worst.max(off);
        }
        let q = DQuat::from_array(result.map(f64::from));
        assert!((q.length() - 1.0).abs() < 2e-5, "{q}");
        let axes = [q.normalize() * DVec3::X, q.normalize() * DVec3::Y, q.normalize() * DVec3::Z];
        for (sum, axis) in mean.iter_mut().zip(axes) {
            for (s, c) in sum.iter_mut().zip(axis.to_array()) {
                *s += c / results.len() as f64;
            }
        }
    }
    println!("uniform_rotation: {worst:.1e}");
    // Each coordinate of a turned axis is uniform in [-1, 1]: the standard error of the mean is
    // 1 / sqrt(3 x 2051) = 0.0127; nine of them within 4.
    assert!(mean.iter().flatten().all(|m| m.abs() < 4.0 * 0.0127), "{mean:?}");
}
