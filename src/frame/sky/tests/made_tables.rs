//! Each table against the twin's.

use glam::DVec2;

use super::*;
use crate::frame::cpu::atmosphere::{
    altitude_at_place, depth_place, depth_ray, direction_of, sky_spans, sun_at_place,
};
use crate::frame::cpu::sky::Sky;
use crate::frame::cpu::sky_march::{Table, depth_to_space};
use crate::frame::sky::spectrum::{Coefficients, rayleigh_depth, to_rgb};

/// Half floats round by 2.4e-4, each table is gathered through one or two others, and a device's
/// filter has weights of 8 bits (1/512 of the difference of two texels).
const THROUGH_TABLES: f64 = 4e-3;
/// As in the shader.
const TABLE_SCALE: f64 = 1024.0;
/// Smallest value whose digits matter: half floats keep 11 bits down to 6e-5 in the table.
const LEAST: f64 = 1e-4 / TABLE_SCALE;

/// Largest difference relative to the brightest of the four wavelengths.
fn difference(got: DVec4, expected: DVec4) -> f64 {
    (got - expected).abs().max_element() / expected.max_element().max(LEAST)
}

/// Prints a table's largest error and asserts that it is small.
#[track_caller]
fn below(table: &str, error: f64) {
    println!("{table}: {error:.1e}");
    assert!(error < THROUGH_TABLES, "{table} {error}");
}

fn worst(got: &[DVec4], expected: impl Fn(usize) -> DVec4, every: usize) -> f64 {
    (0..got.len())
        .step_by(every)
        .map(|i| difference(got[i] / TABLE_SCALE, expected(i)))
        .fold(0.0, f64::max)
}

#[test]
fn constants_agree_with_wgsl() {
    let text = include_str!("../../../../shaders/shared/atmosphere.wgsl");
    let plain: String = text.lines().filter(|l| !l.starts_with('#')).collect::<Vec<_>>().join("\n");
    let module = naga::front::wgsl::parse_str(&plain).expect("the module stands alone");
    let sizes = [
        ("PLANET_RADIUS", vec![crate::frame::sky::gpu_data::PLANET_RADIUS]),
        ("TOP_ALTITUDE", vec![crate::frame::cpu::atmosphere::TOP_ALTITUDE]),
        ("RAYLEIGH_HEIGHT", vec![crate::frame::sky::spectrum::RAYLEIGH_HEIGHT]),
        ("AEROSOL_HEIGHT", vec![crate::frame::cpu::atmosphere::AEROSOL_HEIGHT]),
        ("AEROSOL_MEAN_COSINE", vec![crate::frame::cpu::atmosphere::AEROSOL_MEAN_COSINE]),
        ("OZONE_ALTITUDE", vec![crate::frame::cpu::atmosphere::OZONE_ALTITUDE]),
        ("OZONE_HALF_WIDTH", vec![crate::frame::cpu::atmosphere::OZONE_HALF_WIDTH]),
        ("SUN_RADIUS", vec![crate::frame::cpu::atmosphere::SUN_RADIUS]),
        ("AIR_MIDDLE", vec![crate::frame::cpu::atmosphere::AIR_MIDDLE]),
        ("TABLE_SCALE", vec![TABLE_SCALE]),
        ("DEPTH_SIZE", tables::DEPTH_SIZE.map(f64::from).to_vec()),
        ("MULTIPLE_SIZE", tables::MULTIPLE_SIZE.map(f64::from).to_vec()),
        ("GROUND_SIZE", tables::GROUND_SIZE.map(f64::from).to_vec()),
        ("ALTITUDE_SIZE", tables::ALTITUDE_SIZE.map(f64::from).to_vec()),
        ("VIEW_SIZE", tables::VIEW_SIZE.map(f64::from).to_vec()),
        ("AIR_SIZE", tables::AIR_SIZE.map(f64::from).to_vec()),
    ];
    for (name, expected) in sizes {
        let constant = module.constants.iter().find(|(_, c)| c.name.as_deref() == Some(name));
        let init = constant.unwrap_or_else(|| panic!("no WGSL constant {name}")).1.init;
        let number = |handle| match module.global_expressions[handle] {
            naga::Expression::Literal(naga::Literal::F32(value)) => f64::from(value),
            ref other => panic!("{name}: {other:?}"),
        };
        let found: Vec<f64> = match &module.global_expressions[init] {
            naga::Expression::Compose { components, .. } => {
                components.iter().map(|&h| number(h)).collect()
            }
            _ => vec![number(init)],
        };
        let rounded: Vec<f64> = expected.iter().map(|&x| f64::from(x as f32)).collect();
        assert_eq!(found, rounded, "{name}");
    }
}

#[test]
fn uniforms_have_the_layout_of_wgsl() {
    let text = include_str!("../../../../shaders/shared/atmosphere.wgsl");
    let plain: String = text.lines().filter(|l| !l.starts_with('#')).collect::<Vec<_>>().join("\n");
    let module = naga::front::wgsl::parse_str(&plain).expect("the module stands alone");
    let found = module.types.iter().find_map(|(_, ty)| match (&ty.name, &ty.inner) {
        (Some(n), naga::TypeInner::Struct { members, span }) if n == "SkyUniforms" => Some((
            *span as usize,
            members
                .iter()
                .map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize))
                .collect::<Vec<_>>(),
        )),
        _ => None,
    });
    let host: Vec<_> = SkyUniforms::FIELDS.iter().map(|(n, o)| ((*n).to_owned(), *o)).collect();
    assert_eq!(found, Some((size_of::<SkyUniforms>(), host)));
}

#[test]
fn zenith_depths_are_those_of_the_air() {
    let c = Coefficients::earth();
    let zenith = depth_to_space(&c, 0.0, 1.0, 20_000);
    for (i, wavelength) in spectrum::WAVELENGTHS.into_iter().enumerate() {
        // Hansen and Travis (1974), another source than the coefficients' own.
        let um = wavelength / 1000.0;
        let published = 0.008569 / um.powi(4) * (1.0 + 0.0113 / um.powi(2) + 0.00013 / um.powi(4));
        assert!((rayleigh_depth(wavelength) / published - 1.0).abs() < 0.01, "{wavelength} nm");
        let ozone = c.ozone[i] * 15e3;
        let aerosol = c.aerosol_extinction[i] * 2000.0;
        // The exponential goes on above the top of the air; 7e-6 of it is left there.
        let expected = rayleigh_depth(wavelength) + ozone + aerosol;
        assert!((zenith[i] / expected - 1.0).abs() < 1e-5, "{wavelength} nm");
    }
}

#[test]
fn optical_depth_agrees_with_fine_integration() {
    let mut bench = Bench::new();
    bench.make(&inputs(30.0, 100.0));
    let [width, height] = tables::DEPTH_SIZE.map(|s| s as usize);
    let got = bench.table(&bench.sky.tables().depth);
    assert_eq!(got.len(), width * height);
    let c = Coefficients::earth();
    let table = Table::new(tables::DEPTH_SIZE, |place| {
        let x = (place.x * (width - 1) as f64).round() as usize;
        let y = (place.y * (height - 1) as f64).round() as usize;
        got[y * width + x]
    });
    // A half float's rounding of the optical depth does 2.4e-4 * max(x exp(-x)) = 9e-5 to a
    // transmittance; interpolation does the rest, most at the upper edge of the ozone layer, where
    // density has a bend and one row of the table is 2 km.
    for (altitude, limit) in [
        (0.0, 1e-3),
        (1.0, 1e-3),
        (30.0, 1e-3),
        (500.0, 1e-3),
        (3000.0, 1e-3),
        (11_000.0, 1e-3),
        (40_000.0, 5e-3),
    ] {
        let mut largest = 0.0f64;
        let horizon = depth_ray(DVec2::new(1.0, depth_place(altitude, 0.0).y)).1;
        for step in 0..=20 {
            // From the horizon to the zenith, dense near the horizon.
            let t = (f64::from(step) / 20.0).powi(2);
            let mu = horizon + 1e-9 + (1.0 - horizon - 1e-9) * t;
            let exact = depth_to_space(&c, altitude, mu, 4000);
            let found = table.at(depth_place(altitude, mu));
            let error = ((-found).exp() - (-exact).exp()).abs().max_element();
            largest = largest.max(error);
            assert!(error < limit, "{altitude} m, {mu}: {error}");
        }
        println!("transmittance from {altitude} m: {largest:.1e}");
    }
}

#[test]
fn tables_of_the_air_agree_with_the_twin() {
    let plain = inputs(12.0, 700.0);
    tables_agree(&plain);
    // Over a sea, which reflects by the sun's height.
    tables_agree(&SkyInputs { sea_wind: Some(5.0), ..plain });
}

fn tables_agree(asked: &SkyInputs) {
    let mut bench = Bench::new();
    let asked = *asked;
    bench.make(&asked);
    let sky = Sky::new(&asked, 32);
    let made = bench.sky.tables();
    let multiple = bench.table(&made.multiple);
    let e = worst(&multiple, |i| sky.air().multiple.values()[i], 1);
    below("multiple scattering", e);
    let ground = bench.table(&made.ground);
    let columns = tables::GROUND_SIZE[0] as usize;
    let rgb = |light: DVec4| to_rgb(light).max(DVec3::ZERO).extend(0.0);
    let e = worst(
        &ground,
        |i| {
            let sun_mu = sun_at_place((i % columns) as f64 / (columns - 1) as f64);
            match i / columns {
                0 => sky.air().ground.values()[i],
                1 => rgb(sky.air().sunlight(0.0, sun_mu) * sun_mu.max(0.0)),
                _ => rgb(sky.air().ground.values()[i % columns]),
            }
        },
        1,
    );
    below("light on the ground", e);

    let altitude = bench.table(&made.altitude);
    let columns = tables::ALTITUDE_SIZE[0] as usize;
    let e = worst(
        &altitude,
        |i| {
            let h = altitude_at_place((i % columns) as f64 / (columns - 1) as f64);
            let sun_mu = f64::from(asked.sun_direction.y);
            rgb(match i / columns {
                0 => sky.air().sunlight(h, sun_mu),
                row => sky.air().hemispheres(h, sun_mu)[row - 1],
            })
        },
        5,
    );
    below("light by altitude", e);

    let view = bench.table(&made.view);
    let [width, height] = tables::VIEW_SIZE.map(|s| s as usize);
    let size = DVec2::new(width as f64, height as f64);
    let sun = asked.sun_direction.as_dvec3();
    let e = worst(
        &view,
        |i| {
            let texel = DVec2::new((i % width) as f64, (i / width) as f64);
            let direction = direction_of(texel, sky_spans(asked.camera_altitude), size);
            let (sine, cosine) = (direction.y - sky.horizon_dip()).sin_cos();
            let cos_sun = sine * sun.y + cosine * sun.x.hypot(sun.z) * direction.x;
            let ray = crate::frame::cpu::sky_march::AirRay {
                altitude: asked.camera_altitude,
                mu: sine,
                sun_mu: sun.y,
                cos_sun,
            };
            rgb(sky.air().gather_all(ray, i / width < height / 2, 32).radiance)
        },
        97,
    );
    below("view", e);
}
