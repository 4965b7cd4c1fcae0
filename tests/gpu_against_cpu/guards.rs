//! Functions of the shared modules against their f64 twins, at random and at the ends of their ranges,
//! with the largest error in steps of f32; and every guard at the limit that it guards.

use cumuli::frame::cpu::shadow::Nodes;
use cumuli::frame::cpu::{atmosphere, lighting};

use crate::common::{Random, Snippet, map};

/// Step of f32 at 1.
const STEP: f64 = f32::EPSILON as f64;

/// A function of four numbers on the device.
fn four(import: &str, result: &str, inputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let declarations = format!("#import {import}");
    let snippet =
        Snippet { declarations: &declarations, input: "vec4<f32>", output: "vec4<f32>", result };
    map(snippet, &[], inputs)
}

/// Largest error in steps of f32 at `scale` of the exact value, and what it was for.
fn worst(
    inputs: &[[f32; 4]],
    results: &[[f32; 4]],
    exact: impl Fn([f64; 4]) -> (f64, f64),
) -> (f64, String) {
    let mut worst = (0.0, String::new());
    for (input, result) in inputs.iter().zip(results) {
        let (value, scale) = exact(input.map(f64::from));
        let error = (f64::from(result[0]) - value).abs() / (scale * STEP);
        let error = if f64::from(result[0]) == value { 0.0 } else { error };
        assert!(!error.is_nan(), "{input:?}: {result:?} for {value}");
        if error > worst.0 {
            worst = (error, format!("{input:?}: {} for {value}", result[0]));
        }
    }
    worst
}

#[track_caller]
fn within(name: &str, most: f64, (error, place): (f64, String)) {
    println!("{name}: {error:.2} steps of f32, at {place}");
    assert!(error <= most, "{name}: {error} steps at {place}");
}

/// By magnitude from the smallest to the largest optical depth that a scene can have, and 0.
fn depths(random: &mut Random, count: usize) -> Vec<f32> {
    let mut values: Vec<f32> =
        (0..count).map(|_| 10f64.powf(random.between(-20.0, 13.0)) as f32).collect();
    values.extend([0.0, 1e-38, 1e-20, 0.02, 0.1, 80.0, 1e13]);
    values
}

#[test]
fn sunlight_over_a_piece() {
    let mut random = Random(31);
    let depths = depths(&mut random, 400);
    let mut inputs = Vec::new();
    for _ in 0..20_000 {
        let mut pick = || depths[(random.bits() % depths.len() as u64) as usize];
        inputs.push([pick(), pick(), pick(), 0.0]);
    }
    let results = four(
        "cumuli::lighting::mean_sunlight",
        "vec4(mean_sunlight(x.x, x.y, x.z), 0.0, 0.0, 0.0)",
        &inputs,
    );
    // It is a mean of exp(-depth): 0 to 1. Optical depths of 1e7 are rounded by more than 1, but
    // exp(-depth) of a depth is then the same 0; where depths of the piece and to the sun nearly cancel, the
    // error of their sum is that of the largest.
    let found = worst(&inputs, &results, |[front, back, tau, _]| {
        let both = tau + back - front;
        let lost = [front, back, tau].into_iter().fold(1.0, f64::max);
        let mean = lighting::mean_sunlight(front, back, tau);
        (mean, mean.max(1e-30) * (1.0 + lost / both.abs().max(0.02)).max(160.0))
    });
    within("mean_sunlight", 16.0, found);
    assert!(results.iter().all(|r| (0.0..=1.00002).contains(&r[0])));
    // No piece and no depth: all of the light, exactly.
    let limit = four(
        "cumuli::lighting::mean_sunlight",
        "vec4(mean_sunlight(x.x, x.y, x.z), 0.0, 0.0, 0.0)",
        &[[0.0; 4], [1e13, 1e13, 0.0, 0.0], [1e13, 0.0, 0.0, 0.0]],
    );
    assert_eq!([limit[0][0], limit[1][0]], [1.0, 0.0]);
    assert!((0.0..1e-6).contains(&limit[2][0]), "{}", limit[2][0]);
}

#[test]
fn the_share_of_a_particle_alone() {
    let mut random = Random(32);
    let depth = depths(&mut random, 4000);
    let inputs: Vec<[f32; 4]> = depth
        .iter()
        .map(|v| [*v, random.between(0.3, 1.0) as f32, random.between(0.0, 25.0) as f32, 0.0])
        .collect();
    let results = four(
        "cumuli::lighting::own_share",
        "vec4(own_share(x.z, x.x, x.y), 0.0, 0.0, 0.0)",
        &inputs,
    );
    // Two mean transmittances of 160 steps each (numerics.rs), divided; the exponent, down to -59, is
    // exact to as many half steps.
    let found = worst(&inputs, &results, |[tau, scale, before, _]| {
        let share = lighting::own_share(before, tau, scale);
        (share, share)
    });
    within("own_share", 390.0, found);
}

#[test]
fn how_much_a_particle_is_alone() {
    let mut random = Random(33);
    let depths = depths(&mut random, 200);
    let mut inputs = Vec::new();
    for _ in 0..20_000 {
        let mut pick = || depths[(random.bits() % depths.len() as u64) as usize];
        let (own, others) = (pick(), pick());
        inputs.push([own, others, random.between(0.0, 4.0) as f32, 0.0]);
    }
    inputs.extend([[0.0; 4], [0.0, 0.0, 1e30, 0.0], [1e13, 0.0, 0.0, 0.0]]);
    let call = "vec4(aloneness(x.x, x.y, x.z), crowding_depth(x.x), \
        aloneness(x.x, max(x.y, crowding_depth(x.x)), x.z), aloneness(x.x, x.y, max(x.z, CROWD_END)))";
    let functions = "cumuli::lighting::{CROWD_END, aloneness, crowding_depth}";
    let results = four(functions, call, &inputs);
    // The steepest part of a smoothstep between 0.5 and 0.95 magnifies by 1.5 / 0.45.
    let found = worst(&inputs, &results, |[own, others, crowd, _]| {
        (lighting::aloneness(own, others, crowd), 1.0)
    });
    within("aloneness", 24.0, found);
    // Two products.
    let depth: Vec<_> = results.iter().map(|r| [r[1], 0.0, 0.0, 0.0]).collect();
    let found = worst(&inputs, &depth, |[own, ..]| {
        let depth = lighting::crowding_depth(own);
        (depth, depth)
    });
    within("crowding_depth", 2.0, found);
    // The pass ends its sums there: exactly nothing is left.
    assert!(results.iter().all(|r| r[2] == 0.0 && r[3] == 0.0));
    // Nothing is not alone; matter among nothing is, wholly.
    let ends: Vec<f32> = results[results.len() - 3..].iter().map(|r| r[0]).collect();
    assert_eq!(ends, [0.0, 0.0, 1.0]);
}

#[test]
fn rays_through_the_air() {
    let mut random = Random(35);
    let mut inputs: Vec<[f32; 4]> = (0..20_000)
        .map(|_| {
            let altitude = 10f64.powf(random.between(-3.0, 9.0)) as f32;
            [
                altitude,
                random.between(-1.0, 1.0) as f32,
                10f64.powf(random.between(-3.0, 8.0)) as f32,
                0.0,
            ]
        })
        .collect();
    for altitude in [0.0, 1.0, 1e5, 1e5_f32.next_up(), 1e5_f32.next_down(), 1e9] {
        for mu in [-1.0, -1e-7, 0.0, 1e-7, 1.0] {
            inputs.extend([[altitude, mu, 0.0, 0.0], [altitude, mu, 1e30, 0.0]]);
        }
    }
    // Distances from where the ray is: the error is that of the planet's radius, 0.5 m for f32.
    let ground = four(
        "cumuli::atmosphere::distance_to_ground",
        "vec4(distance_to_ground(x.x, x.y), 0.0, 0.0, 0.0)",
        &inputs,
    );
    let span = four("cumuli::atmosphere::air_span", "vec4(air_span(x.x, x.y), 0.0, 0.0)", &inputs);
    let share = four(
        "cumuli::atmosphere::{air_place, air_distance, air_spread}",
        "vec4(air_place(x.z, vec2(1e30, 2e25)), air_place(x.z, vec2(0.0, 0.05)), \
         air_distance(1.0, vec2(1e30, 2e25)), air_distance(0.0, vec2(x.z, 0.05)))",
        &inputs,
    );
    let spread = four(
        "cumuli::atmosphere::{air_span, air_spread}",
        "vec4(air_spread(x.x, x.y, air_span(x.x, x.y).x, true), air_spread(x.x, x.y, air_span(x.x, x.y).x, false))",
        &inputs,
    );
    for (i, input) in inputs.iter().enumerate() {
        let [ground, span] = [&ground[i], &span[i]];
        assert!(ground[0] >= 0.0 || ground[0] == -1.0, "{input:?}: {ground:?}");
        assert!(0.0 <= span[0] && span[0] <= span[1] && span[1].is_finite(), "{input:?}: {span:?}");
        let [place, none, end, begin] = share[i];
        assert!((0.0..=1.0).contains(&place) && (0.0..=1.0).contains(&none), "{input:?}");
        assert!(end.is_finite() && end > 1e15 && begin == 0.0, "{input:?}: {end} {begin}");
        let exact = atmosphere::air_place(f64::from(input[2]), [1e30, 2e25]);
        assert!((f64::from(place) - exact).abs() < 4.0 * STEP, "{input:?}: {place} {exact}");
    }
    // Whatever the ray, places are in it.
    for (input, [reach, dense, far, up]) in inputs.iter().zip(&spread) {
        assert!(reach.is_finite() && *reach >= 0.0, "{input:?}: {reach}");
        assert!(dense.is_finite() && *dense >= 0.05, "{input:?}: {dense}");
        assert!(*far == 1e30 && up.is_finite() && *up > 1e23, "{input:?}: {up}");
    }
    // On the ground, looking down, the ground is at hand; level and up there is none or it is here.
    let down = inputs.iter().zip(&ground).filter(|(i, _)| i[0] == 0.0 && i[1] < 0.0);
    assert!(down.clone().count() >= 4 && down.clone().all(|(_, g)| g[0] == 0.0));
    let up = inputs.iter().zip(&ground).filter(|(i, _)| i[1] > 1e-6);
    assert!(up.clone().all(|(_, g)| g[0] == -1.0));
    // At the top of the air a ray that goes up has none before it.
    let top = inputs.iter().zip(&span).filter(|(i, _)| i[0] == 1e5 && i[1] > 0.0);
    assert!(top.clone().all(|(_, s)| s[1] == 0.0));
}

/// Depths between the nodes of a shadow map's texel: never negative, never falling away from the sun,
/// and those of the twin, whatever the nodes are.
#[test]
fn depths_between_nodes() {
    let mut random = Random(41);
    let mut inputs: Vec<[f32; 12]> = (0..20_000)
        .map(|i| {
            let mut nodes: Vec<f64> = (0..7).map(|_| random.uniform()).collect();
            nodes.sort_by(f64::total_cmp);
            // Nodes that fall on each other, and such as 16 bits hold.
            if i % 3 == 0 {
                nodes = nodes.iter().map(|n| (n * 8.0).floor() / 8.0).collect();
            }
            let all = if i % 2 == 0 { random.between(0.5, 1.0) } else { random.between(0.0, 0.5) };
            let mut input = [0.0; 12];
            for (slot, value) in input.iter_mut().zip(nodes.iter().chain([&all])) {
                *slot = *value as f32;
            }
            input[8] = random.between(-0.5, 1.5) as f32;
            input
        })
        .collect();
    for all in [0.0, 0.4999, 0.5, 0.99, 1.0] {
        for at in [-1e9, 0.0, 0.5, 1.0, 1e9] {
            for node in [0.0, 0.5, 1.0] {
                let mut input = [node; 12];
                (input[7], input[8]) = (all, at);
                inputs.push(input);
            }
        }
    }
    let snippet = Snippet {
        declarations: "#import cumuli::shadow_maps::{ShadowNodes, nodes_depth}
            struct Ask { low: vec4<f32>, high: vec4<f32>, at: vec4<f32> }",
        input: "Ask",
        output: "vec4<f32>",
        result: "vec4(nodes_depth(ShadowNodes(x.low, x.high), x.at.x), nodes_depth(ShadowNodes(x.low, x.high), x.at.x + 0.01), 0.0, 0.0)",
    };
    let results: Vec<[f32; 4]> = map(snippet, &[], &inputs);
    let mut most = 0.0_f64;
    for (input, result) in inputs.iter().zip(results) {
        let nodes = Nodes { at: std::array::from_fn(|i| input[i].into()), rest: input[7].into() };
        let exact = nodes.depth(input[8].into());
        assert!((0.0..=80.0).contains(&result[0]), "{input:?}: {result:?}");
        assert!(result[1] >= result[0], "{input:?}: {result:?}");
        // A place is known to a step of f32 at 1; the closest nodes magnify that.
        let gap = (0..6).fold(1.0, |g: f64, i| g.min((nodes.at[i + 1] - nodes.at[i]).max(7.6e-6)));
        let error = (f64::from(result[0]) - exact).abs();
        most = most.max(error * gap / STEP);
    }
    println!("nodes_depth: {most:.2} steps of f32 over the least gap of nodes");
    // Five roundings of places up to 1.5, by steps of depth up to 2.
    assert!(most < 20.0, "{most}");
}
